"""Decodes queued datagrams and submits measurements and rejects to the service.

Datagrams are collected for a short interval and decoded together, because a batch has a high fixed
cost and a low cost per record. Each listener is a source of its own in the journal, so that invalid
data of one do not put the others into quarantine.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass

import numpy as np
import polars as pl
import structlog
from numpy.typing import NDArray

from multiradar.errors import MultiradarError, QuarantineError
from multiradar.ingest.asterix_counts import AsterixCounts
from multiradar.ingest.asterix_queue import DatagramQueue, Received
from multiradar.ingest.submission import submit_when_possible
from multiradar.runtime.live.receipt import Receipt, RejectedRow
from multiradar.runtime.live.threads import SystemThreads, Threads
from multiradar.runtime.ports import MeasurementSink
from multiradar_converters.asterix.framing.datagrams import Datagrams
from multiradar_converters.asterix.live.batch import LiveBatch, RejectedOctets, unreadable
from multiradar_converters.asterix.live.reception import LiveDecoder

_log = structlog.get_logger("multiradar.asterix")

#: Sources of the journal: this, a slash and the name of the listener.
SOURCE = "asterix"
#: Reception time, s, over which data of one listener come before those of another. What waited
#: longer is divided: together, data of one listener would make those of the others late.
TOGETHER_S = 0.25
#: Maximum datagrams per batch; bounds memory and latency.
BATCH_DATAGRAMS_MAX = 8192
#: Maximum internal errors that are logged.
FAILURES_LOGGED_MAX = 100
#: Octets of a reject that are retained.
RAW_OCTETS_MAX = 4096


@dataclass(frozen=True, slots=True)
class InletBounds:
    """Limits of decoding.

    Attributes
    ----------
    batch_interval_s : float
        Interval over which datagrams are collected, s.
    quarantine_rows_max : int
        Rejects of a batch that are retained individually.
    """

    batch_interval_s: float = 0.25
    quarantine_rows_max: int = 100


class AsterixInlet:
    """Moves datagrams from the queue to the service; `run` is the body of one thread.

    Parameters
    ----------
    queue : DatagramQueue
        Queue of received datagrams.
    decoder : LiveDecoder
        Owned by that thread.
    sink : MeasurementSink
        The running service.
    counts : AsterixCounts
        Counts the disposition of everything.
    bounds : InletBounds
        Limits.
    can_wait : callable, optional
        Returns whether further data of a listener, by index, can wait at their sender.
    threads : Threads, optional
        Makes what its thread waits for; threads of the system by default.
    """

    def __init__(
        self,
        queue: DatagramQueue,
        decoder: LiveDecoder,
        sink: MeasurementSink,
        counts: AsterixCounts,
        bounds: InletBounds,
        *,
        can_wait: Callable[[int], bool] = lambda _listener: False,
        threads: Threads | None = None,
    ) -> None:
        self._queue = queue
        self._decoder = decoder
        self._sink = sink
        self._counts = counts
        self._bounds = bounds
        self._can_wait = can_wait
        self._stopping = (threads or SystemThreads()).event()
        self._failures = 0
        #: Listeners whose last measurements were lost.
        self._losing: set[int] = set()

    def run(self) -> None:
        """Decode until `stop`, then decode what is still queued."""
        while not self._stopping.wait(self._bounds.batch_interval_s):
            self._drain_safely()
        self._drain_safely()

    def stop(self) -> None:
        """Make `run` return."""
        self._stopping.set()

    def drain(self) -> None:
        """Decode everything in the queue."""
        while received := self._popped():
            for part, batch in self._decoded(received):
                self._account(part, batch)
                self._submit(part, batch)

    # ---------------------------------------------------------------- inside

    def _popped(self) -> list[Received]:
        with self._counts.at_once():
            received = self._queue.pop(BATCH_DATAGRAMS_MAX)
            self._counts.decoding(_octets_of(received))
            return received

    def _decoded(self, received: list[Received]) -> Iterator[tuple[list[Received], LiveBatch]]:
        try:
            batch = self._decoder.decode(_concatenated(received))
        except Exception as error:
            # An internal error: bisect down to the failing datagram, so that the others are
            # decoded, and without decoding each one alone.
            self._failed(error, len(received))
            if len(received) == 1:
                reason = f"could not be decoded: {type(error).__name__}"
                yield received, unreadable(_concatenated(received), reason)
                return
            middle = len(received) // 2
            for half in (received[:middle], received[middle:]):
                yield from self._decoded(half)
        else:
            yield received, batch

    def _drain_safely(self) -> None:
        try:
            self.drain()
        except Exception as error:
            # The next batch is decoded regardless.
            self._failed(error, 0)

    def _failed(self, error: Exception, datagrams: int) -> None:
        self._counts.batch_failed()
        if self._failures < FAILURES_LOGGED_MAX:
            self._failures += 1
            _log.error("asterix_batch_failed", datagrams=datagrams, exc_info=error)

    def _account(self, part: list[Received], batch: LiveBatch) -> None:
        with self._counts.at_once():
            self._counts.decoding(-_octets_of(part))
            self._add(part, batch)
        self._counts.decoded(batch.categories)
        for sensor, alarm, reason in self._counts.clocks(batch.clocks):
            _log.warning("asterix_sensor_alarm", sensor=sensor, alarm=alarm, reason=reason)

    def _add(self, part: list[Received], batch: LiveBatch) -> None:
        listener = np.array([one.listener for one in part])
        for number in np.unique(listener).tolist():
            own = listener == number
            sums = {
                f"octets_{name}": int(sum_of[own].sum()) for name, sum_of in batch.octets.items()
            }
            sums |= {
                f"records_{name}": int(sum_of[own].sum()) for name, sum_of in batch.records.items()
            }
            self._counts.add(number, **sums)
            codes = Counter(str(one.code) for one in batch.rejected if own[one.datagram])
            self._counts.rejected(number, codes)

    def _submit(self, part: list[Received], batch: LiveBatch) -> None:
        """Submit a batch, the data of each listener in the order of reception."""
        rejected = defaultdict[int, list[RejectedOctets]](list)
        for one in batch.rejected:
            rejected[part[one.datagram].listener].append(one)
        for listener, rows in _pieces(part, batch.datagram):
            frame = batch.frame if len(rows) == len(batch.frame) else batch.frame[rows]
            own = self._rows(part, rejected.pop(listener, []), len(rows))
            self._submit_piece(listener, frame, own)
        for listener, rest in rejected.items():
            self._submit_piece(listener, batch.frame[:0], self._rows(part, rest, 0))

    def _submit_piece(
        self, listener: int, frame: pl.DataFrame, rejected: list[RejectedRow]
    ) -> None:
        count = len(frame)
        try:
            future = submit_when_possible(
                self._sink,
                frame,
                rejected,
                f"{SOURCE}/{self._counts.labels[listener]}",
                self._stopping.wait,
                patient=self._can_wait(listener),
                shared=True,
            )
        except MultiradarError as error:
            self._lost(listener, count, error)
        except Exception as error:
            # An internal error of the service: the data of other listeners follow.
            self._lost(listener, count, error)
            self._failed(error, 0)
        else:
            future.add_done_callback(lambda done: self._settled(done, listener, count))

    def _rows(
        self, part: list[Received], rejected: list[RejectedOctets], first: int
    ) -> list[RejectedRow]:
        rows_max, labels = self._bounds.quarantine_rows_max, self._counts.labels
        kept, rest = rejected[:rows_max], rejected[rows_max:]
        rows = [
            RejectedRow(
                first + k, str(one.code), _described(part[one.datagram], one, labels), _raw(one)
            )
            for k, one in enumerate(kept)
        ]
        if rest:
            codes = Counter(str(one.code) for one in rest)
            summary = ", ".join(f"{code} {count}" for code, count in sorted(codes.items()))
            octets = sum(len(one.octets) for one in rest)
            reason = (
                f"{_datagram_name(part[rest[0].datagram], labels)} to "
                f"{_datagram_name(part[rest[-1].datagram], labels)}: {len(rest)} more rejects, "
                f"{octets} octets in total, not retained ({summary})"
            )
            rows.append(RejectedRow(first + len(kept), codes.most_common(1)[0][0], reason))
        return rows

    def _settled(self, done: Future[Receipt], listener: int, count: int) -> None:
        error = done.exception()
        if error is not None:
            self._lost(listener, count, error)
            return
        self._losing.discard(listener)
        # Rejects of the decoder have indices behind the measurements.
        rejected = sum(row.index < count for row in done.result().rejected)
        self._counts.add(listener, rows_accepted=count - rejected, rows_rejected=rejected)

    def _lost(self, listener: int, count: int, error: BaseException) -> None:
        self._counts.add(listener, rows_lost=count)
        # Logged once when it starts: a failed service accepts none of the following batches. The
        # status warns of a quarantine, in which some are accepted again and again.
        if listener not in self._losing and not isinstance(error, QuarantineError):
            self._losing.add(listener)
            label = self._counts.labels[listener]
            _log.error("asterix_rows_lost", listener=label, rows=count, reason=str(error))


def _pieces(
    part: list[Received], datagram: NDArray[np.int64]
) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """Yield the rows of each listener, given the datagram of each row."""
    if not len(datagram):
        return
    listener = np.array([one.listener for one in part])[datagram]
    received_s = np.array([one.received_s for one in part])[datagram]
    # The clock may be set back.
    period = np.floor((np.maximum.accumulate(received_s) - received_s[0]) / TOGETHER_S)
    several = bool((listener != listener[0]).any())
    ends = np.flatnonzero(np.diff(period)) + 1 if several else ()
    for rows in np.split(np.arange(len(datagram)), ends):
        heard, first = np.unique(listener[rows], return_index=True)
        for number in heard[np.argsort(first)].tolist():
            yield number, rows[listener[rows] == number]


def _octets_of(received: list[Received]) -> int:
    return sum(len(one.octets) for one in received)


def _concatenated(received: list[Received]) -> Datagrams:
    octets = np.array([len(one.octets) for one in received], dtype=np.int64)
    ends = np.cumsum(octets)
    # Writable, as the octets of a file are: another type would be compiled as well.
    data = bytearray().join(one.octets for one in received)
    return Datagrams(
        data=np.frombuffer(data, dtype=np.uint8),
        begins=ends - octets,
        ends=ends,
        received_s=np.array([one.received_s for one in received]),
    )


def _datagram_name(received: Received, labels: Sequence[str]) -> str:
    return f"{labels[received.listener]}, datagram {received.number}"


def _described(received: Received, one: RejectedOctets, labels: Sequence[str]) -> str:
    cut = len(one.octets) > RAW_OCTETS_MAX
    return f"{_datagram_name(received, labels)}, octet {one.offset}: {one.reason}" + (
        f"; the first {RAW_OCTETS_MAX} of {len(one.octets)} octets are retained" if cut else ""
    )


def _raw(one: RejectedOctets) -> str:
    return one.octets[:RAW_OCTETS_MAX].hex()
