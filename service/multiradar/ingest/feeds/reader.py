"""Reads one feed: connects, decodes, submits, and connects again; the body of one thread."""

import threading
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass

import structlog

from multiradar.clock import Clock
from multiradar.errors import MultiradarError
from multiradar.ingest.feeds.connections import FeedConnection
from multiradar.ingest.feeds.counts import CONNECTED, STOPPED, WAITING, FeedCounts
from multiradar.ingest.submission import submit_when_possible
from multiradar.runtime.live.receipt import Receipt, RejectedRow
from multiradar.runtime.ports import MeasurementSink
from multiradar_converters.adsb.reading.batches import RejectedRecord
from multiradar_converters.feeds.live import FeedBatch, LiveFeed

_log = structlog.get_logger("multiradar.feeds")

#: Sources of the journal: this, a slash and the name of the feed.
SOURCE = "feeds"
#: Maximum positions of a batch; bounds the memory.
BATCH_ROWS_MAX = 8192
#: Maximum internal errors that are logged.
FAILURES_LOGGED_MAX = 100


@dataclass(frozen=True, slots=True)
class ReaderBounds:
    """Limits of reading.

    Attributes
    ----------
    reconnect_min_s, reconnect_max_s : float
        Pause before the first new attempt, and maximum pause, s.
    batch_interval_s : float
        Interval over which positions are collected, s.
    quarantine_rows_max : int
        Rejects of a batch that are retained individually.
    """

    reconnect_min_s: float = 1.0
    reconnect_max_s: float = 30.0
    batch_interval_s: float = 0.25
    quarantine_rows_max: int = 100


class FeedReader:
    """Reads a feed until it is stopped.

    Parameters
    ----------
    label : str
        Its name.
    connection : FeedConnection
        Its text.
    feed : LiveFeed
        Its decoder.
    sink : MeasurementSink
        The running service.
    counts : FeedCounts
        Counts the disposition of everything.
    bounds : ReaderBounds
        Limits.
    clock : Clock
        Time of reception.
    stopping : Event
        Set to stop.
    """

    def __init__(
        self,
        *,
        label: str,
        connection: FeedConnection,
        feed: LiveFeed,
        sink: MeasurementSink,
        counts: FeedCounts,
        bounds: ReaderBounds,
        clock: Clock,
        stopping: threading.Event,
    ) -> None:
        self._label = label
        self._source = f"{SOURCE}/{label}"
        self._connection = connection
        self._feed = feed
        self._sink = sink
        self._counts = counts
        self._bounds = bounds
        self._clock = clock
        self._stopping = stopping
        self._pause_s = bounds.reconnect_min_s
        self._failures = 0
        self._losing = False
        counts.set_state(label, endpoint=connection.endpoint)

    def run(self) -> None:
        """Read until the stop; then submit what was decoded."""
        while not self._stopping.is_set():
            try:
                if not self._connection.open():
                    self._counts.set_state(self._label, state=WAITING)
                    continue
                self._connected()
                reason = self._receive()
            except OSError as error:
                reason = str(error) or type(error).__name__
            except Exception as error:
                # An internal error, or an address that cannot be used: tried again, too.
                reason = f"{type(error).__name__}: {error}"
                self._log_failure("feed_failed", error)
            self._disconnected(reason)
        self._counts.set_state(self._label, state=STOPPED)

    # ---------------------------------------------------------------- inside

    def _connected(self) -> None:
        self._counts.add(self._label, connections=1)
        self._counts.set_state(self._label, state=CONNECTED)
        _log.info("feed_connected", feed=self._label, endpoint=self._connection.endpoint)

    def _receive(self) -> str:
        """Read until the connection ends; return why."""
        due_s = self._clock.monotonic_s() + self._bounds.batch_interval_s
        try:
            while not self._stopping.is_set():
                text = self._connection.receive()
                if text == b"":
                    return "the connection was closed by the peer"
                if text:
                    self._pause_s = self._bounds.reconnect_min_s
                    self._push(text)
                if self._clock.monotonic_s() >= due_s or len(self._feed) >= BATCH_ROWS_MAX:
                    self._submit()
                    due_s = self._clock.monotonic_s() + self._bounds.batch_interval_s
            return ""
        finally:
            self._feed.end()
            self._submit()

    def _disconnected(self, reason: str) -> None:
        self._connection.close()
        if self._stopping.is_set():
            return
        self._counts.add(self._label, connection_faults=1)
        self._counts.set_state(self._label, state=WAITING, last_error=reason)
        _log.warning("feed_disconnected", feed=self._label, reason=reason, pause_s=self._pause_s)
        self._stopping.wait(self._pause_s)
        self._pause_s = min(2.0 * self._pause_s, self._bounds.reconnect_max_s)

    def _push(self, text: bytes) -> None:
        now_s = self._clock.now_s()
        self._counts.add(self._label, octets=len(text))
        self._counts.set_state(self._label, last_received_s=now_s)
        decode = self._feed.document if self._connection.whole else self._feed.push
        self._safely(lambda: decode(text, now_s))

    def _submit(self) -> None:
        self._safely(self._submit_batch)

    def _safely(self, act: Callable[[], None]) -> None:
        try:
            act()
        except Exception as error:
            # An internal error: the text that follows is read regardless.
            self._counts.add(self._label, batches_failed=1)
            self._log_failure("feed_batch_failed", error)

    def _log_failure(self, event: str, error: Exception) -> None:
        if self._failures < FAILURES_LOGGED_MAX:
            self._failures += 1
            _log.error(event, feed=self._label, exc_info=error)

    def _submit_batch(self) -> None:
        batch = self._feed.drain()
        if not batch.read and not batch.without_position:
            return
        self._account(batch)
        rows = self._rows(batch)
        count = len(batch.frame)
        if not count and not rows:
            return
        try:
            future = submit_when_possible(
                self._sink, batch.frame, rows, self._source, self._stopping.wait, patient=True
            )
        except MultiradarError as error:
            self._lost(count, error)
        except Exception as error:
            # An internal error of the service: counted here, logged by the caller.
            self._lost(count, error)
            raise
        else:
            future.add_done_callback(lambda done: self._settled(done, count))

    def _account(self, batch: FeedBatch) -> None:
        self._counts.add(
            self._label,
            reports_read=batch.read,
            reports_accepted=len(batch.frame),
            reports_rejected=len(batch.rejected),
            reports_duplicate=batch.duplicate,
            messages_without_position=batch.without_position,
        )
        self._counts.rejected(self._label, Counter(str(one.code) for one in batch.rejected))
        for sensor, alarm, reason in self._counts.clocks(self._label, self._feed.clocks()):
            _log.warning(
                "feed_sensor_alarm", feed=self._label, sensor=sensor, alarm=alarm, reason=reason
            )

    def _rows(self, batch: FeedBatch) -> list[RejectedRow]:
        first, most = len(batch.frame), self._bounds.quarantine_rows_max
        kept, rest = batch.rejected[:most], batch.rejected[most:]
        rows = [
            RejectedRow(first + k, str(one.code), f"{self._place(one)}: {one.reason}", _raw(one))
            for k, one in enumerate(kept)
        ]
        if rest:
            codes = Counter(str(one.code) for one in rest)
            summary = ", ".join(f"{code} {count}" for code, count in sorted(codes.items()))
            reason = (
                f"{self._place(rest[0])} to {rest[-1].place}: {len(rest)} more rejects, not "
                f"retained ({summary})"
            )
            rows.append(RejectedRow(first + len(kept), codes.most_common(1)[0][0], reason))
        return rows

    def _place(self, one: RejectedRecord) -> str:
        unit = "octet" if self._connection.whole else "line"
        return f"{self._label}, {unit} {one.place}"

    def _settled(self, done: Future[Receipt], count: int) -> None:
        error = done.exception()
        if error is not None:
            self._lost(count, error)
            return
        self._losing = False
        # Rejects of the decoder have indices behind the measurements.
        rejected = sum(row.index < count for row in done.result().rejected)
        self._counts.add(self._label, rows_accepted=count - rejected, rows_rejected=rejected)

    def _lost(self, count: int, error: BaseException) -> None:
        self._counts.add(self._label, rows_lost=count)
        # Logged once when it starts: a failed service accepts none of the following batches.
        if not self._losing:
            self._losing = True
            _log.error("feed_rows_lost", feed=self._label, rows=count, reason=str(error))


def _raw(one: RejectedRecord) -> str:
    return one.raw.decode("utf-8", "backslashreplace")
