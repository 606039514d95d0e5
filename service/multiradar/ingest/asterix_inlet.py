"""Decodes what waits, and hands it to the service: measurements, and what was refused.

Datagrams are gathered for a moment and decoded together, because a batch costs much and its
records cost little; what becomes of each is the same as if it had come alone.
"""

import threading
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import dataclass

import numpy as np
import polars as pl
import structlog

from multiradar.errors import MultiradarError, QueueFullError
from multiradar.ingest.asterix_counts import AsterixCounts
from multiradar.ingest.asterix_queue import DatagramQueue, Received
from multiradar.runtime.ports import MeasurementSink
from multiradar.runtime.receipt import Receipt, RejectedRow
from multiradar_converters.asterix.datagrams import Datagrams
from multiradar_converters.asterix.live import LiveDecoder
from multiradar_converters.asterix.live_batch import LiveBatch, RefusedOctets, unreadable

_log = structlog.get_logger("multiradar.asterix")

#: Datagrams decoded together at most: bounds the memory and the wait of others.
BATCH_DATAGRAMS_MAX = 8192
#: Attempts for a batch after the first while the journal has no room; then its rows are lost.
SUBMIT_RETRIES_MAX = 60
#: Octets of one refusal that are kept.
RAW_OCTETS_MAX = 4096


@dataclass(frozen=True, slots=True)
class InletBounds:
    """Bounds of decoding.

    Attributes
    ----------
    batch_interval_s : float
        How long datagrams are gathered, s.
    quarantine_rows_max : int
        Refusals of a listener and batch that are kept one by one.
    """

    batch_interval_s: float = 0.1
    quarantine_rows_max: int = 100


class AsterixInlet:
    """Empties the queue into the service; `run` is the body of one thread.

    Parameters
    ----------
    queue : DatagramQueue
        Where datagrams wait.
    decoder : LiveDecoder
        Owned by that thread.
    sink : MeasurementSink
        The running service.
    counts : AsterixCounts
        Told what became of everything.
    bounds : InletBounds
        Bounds.
    """

    def __init__(
        self,
        queue: DatagramQueue,
        decoder: LiveDecoder,
        sink: MeasurementSink,
        counts: AsterixCounts,
        bounds: InletBounds,
    ) -> None:
        self._queue = queue
        self._decoder = decoder
        self._sink = sink
        self._counts = counts
        self._bounds = bounds
        self._stopping = threading.Event()

    def run(self) -> None:
        """Decode until told to stop, then what still waits."""
        while not self._stopping.wait(self._bounds.batch_interval_s):
            self.drain()
        self.drain()

    def stop(self) -> None:
        """Have `run` end."""
        self._stopping.set()

    def drain(self) -> None:
        """Decode everything that waits."""
        while received := self._queue.take(BATCH_DATAGRAMS_MAX):
            for part, batch in self._decoded(received):
                self._account(part, batch)
                for listener in sorted({one.listener for one in part}):
                    self._hand_in(part, batch, listener)

    # ---------------------------------------------------------------- inside

    def _decoded(self, received: list[Received]) -> Iterator[tuple[list[Received], LiveBatch]]:
        try:
            yield received, self._decoder.decode(_joined(received))
        except Exception as error:
            # A fault of ours: each for itself, so that the others do not suffer.
            _log.error("asterix_batch_failed", datagrams=len(received), exc_info=error)
            self._counts.batch_failed()
            if len(received) == 1:
                reason = f"could not be decoded: {type(error).__name__}"
                yield received, unreadable(_joined(received), reason)
                return
            for one in received:
                yield from self._decoded([one])

    def _account(self, part: list[Received], batch: LiveBatch) -> None:
        listener = np.array([one.listener for one in part])
        for number in np.unique(listener).tolist():
            own = listener == number
            sums = {f"octets_{name}": int(each[own].sum()) for name, each in batch.octets.items()}
            sums |= {
                f"records_{name}": int(each[own].sum()) for name, each in batch.records.items()
            }
            self._counts.add(number, **sums)
        self._counts.decoded(batch.categories)

    def _hand_in(self, part: list[Received], batch: LiveBatch, listener: int) -> None:
        """Hand in what one listener brought."""
        own = np.array([one.listener == listener for one in part])
        frame = batch.frame.filter(pl.Series(own[batch.datagram], dtype=pl.Boolean))
        refused = [one for one in batch.refused if own[one.datagram]]
        codes = Counter(str(one.code) for one in refused)
        self._counts.refused(listener, codes)
        label = self._counts.labels[listener]
        rejected = self._rows(part, refused, label, len(frame))
        if len(frame) or rejected:
            self._submit(frame, rejected, listener)

    def _rows(
        self, part: list[Received], refused: list[RefusedOctets], label: str, first: int
    ) -> list[RejectedRow]:
        kept, rest = (
            refused[: self._bounds.quarantine_rows_max],
            refused[self._bounds.quarantine_rows_max :],
        )
        rows = [
            RejectedRow(first + k, str(one.code), _told(part, one, label), _raw(one))
            for k, one in enumerate(kept)
        ]
        if rest:
            codes = Counter(str(one.code) for one in rest)
            numbers = sorted(part[one.datagram].number for one in rest)
            octets = sum(len(one.octets) for one in rest)
            reason = (
                f"{label}, datagrams {numbers[0]} to {numbers[-1]}: {len(rest)} more refusals of "
                f"{octets} octets that are not kept ("
                + ", ".join(f"{code} {count}" for code, count in sorted(codes.items()))
                + ")"
            )
            rows.append(RejectedRow(first + len(kept), codes.most_common(1)[0][0], reason))
        return rows

    def _submit(self, frame: pl.DataFrame, rejected: list[RejectedRow], listener: int) -> None:
        source = f"asterix:{self._counts.labels[listener]}"
        for _ in range(SUBMIT_RETRIES_MAX + 1):
            try:
                future = self._sink.submit(frame, source=source, rejected=rejected)
            except QueueFullError as error:
                # Meanwhile datagrams wait in the queue; what does not fit there is counted.
                if self._stopping.wait(error.retry_after_s):
                    break
            except MultiradarError as error:
                _log.error("asterix_rows_lost", rows=len(frame), reason=str(error))
                break
            else:
                future.add_done_callback(lambda done: self._settled(done, len(frame), listener))
                return
        self._counts.add(listener, rows_lost=len(frame))

    def _settled(self, done: Future[Receipt], rows: int, listener: int) -> None:
        error = done.exception()
        if error is not None:
            _log.error("asterix_rows_lost", rows=rows, reason=str(error))
            self._counts.add(listener, rows_lost=rows)
            return
        accepted = done.result().accepted
        self._counts.add(listener, rows_accepted=accepted, rows_rejected=rows - accepted)


def _joined(received: list[Received]) -> Datagrams:
    octets = np.array([len(one.octets) for one in received], dtype=np.int64)
    ends = np.cumsum(octets)
    return Datagrams(
        data=np.frombuffer(b"".join(one.octets for one in received), dtype=np.uint8),
        begins=ends - octets,
        ends=ends,
        received_s=np.array([one.received_s for one in received]),
    )


def _told(part: list[Received], one: RefusedOctets, label: str) -> str:
    cut = len(one.octets) > RAW_OCTETS_MAX
    return f"{label}, datagram {part[one.datagram].number}, octet {one.offset}: {one.reason}" + (
        f"; the first {RAW_OCTETS_MAX} of {len(one.octets)} octets are kept" if cut else ""
    )


def _raw(one: RefusedOctets) -> str:
    return one.octets[:RAW_OCTETS_MAX].hex()
