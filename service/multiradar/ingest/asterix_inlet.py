"""Decodes what waits, and hands it to the service: measurements, and what was refused.

Datagrams are gathered for a moment and decoded together, because a batch costs much and its
records cost little; what becomes of each is the same as if it had come alone.
"""

import threading
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass

import numpy as np
import structlog
from numpy.typing import NDArray

from multiradar.errors import MultiradarError, QueueFullError
from multiradar.ingest.asterix_counts import AsterixCounts
from multiradar.ingest.asterix_queue import DatagramQueue, Received
from multiradar.runtime.live.receipt import Receipt, RejectedRow
from multiradar.runtime.ports import MeasurementSink
from multiradar_converters.asterix.framing.datagrams import Datagrams
from multiradar_converters.asterix.live.batch import LiveBatch, RefusedOctets, unreadable
from multiradar_converters.asterix.live.reception import LiveDecoder

_log = structlog.get_logger("multiradar.asterix")

SOURCE = "asterix"
#: Datagrams decoded together at most: bounds the memory and the wait of others.
BATCH_DATAGRAMS_MAX = 8192
#: Attempts for a batch after the first while the journal has no room; then its rows are lost.
SUBMIT_RETRIES_MAX = 60
#: Faults of ours that are logged.
FAILURES_LOGGED_MAX = 100
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
        Refusals of a batch that are kept one by one.
    """

    batch_interval_s: float = 0.25
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
        self._failures = 0
        self._losing = False

    def run(self) -> None:
        """Decode until told to stop, then what still waits."""
        while not self._stopping.wait(self._bounds.batch_interval_s):
            self._drain_whatever_comes()
        self._drain_whatever_comes()

    def stop(self) -> None:
        """Have `run` end."""
        self._stopping.set()

    def drain(self) -> None:
        """Decode everything that waits."""
        while received := self._queue.take(BATCH_DATAGRAMS_MAX):
            for part, batch in self._decoded(received):
                self._account(part, batch)
                self._hand_in(part, batch)

    # ---------------------------------------------------------------- inside

    def _decoded(self, received: list[Received]) -> Iterator[tuple[list[Received], LiveBatch]]:
        try:
            batch = self._decoder.decode(_joined(received))
        except Exception as error:
            # A fault of ours: by halves down to the one that fails, so that the others do not
            # suffer, nor wait until each was decoded for itself.
            self._failed(error, len(received))
            if len(received) == 1:
                reason = f"could not be decoded: {type(error).__name__}"
                yield received, unreadable(_joined(received), reason)
                return
            middle = len(received) // 2
            for half in (received[:middle], received[middle:]):
                yield from self._decoded(half)
        else:
            yield received, batch

    def _drain_whatever_comes(self) -> None:
        try:
            self.drain()
        except Exception as error:
            # The next batch is decoded all the same.
            self._failed(error, 0)

    def _failed(self, error: Exception, datagrams: int) -> None:
        self._counts.batch_failed()
        if self._failures < FAILURES_LOGGED_MAX:
            self._failures += 1
            _log.error("asterix_batch_failed", datagrams=datagrams, exc_info=error)

    def _account(self, part: list[Received], batch: LiveBatch) -> None:
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
            codes = Counter(str(one.code) for one in batch.refused if own[one.datagram])
            self._counts.refused(number, codes)
        self._counts.decoded(batch.categories)

    def _hand_in(self, part: list[Received], batch: LiveBatch) -> None:
        """Hand in what listeners brought, in the order in which it came."""
        rejected = self._rows(part, batch.refused, len(batch.frame))
        if not len(batch.frame) and not rejected:
            return
        listener = np.array([one.listener for one in part])[batch.datagram]
        full: QueueFullError | None = None
        for _ in range(SUBMIT_RETRIES_MAX + 1):
            try:
                future = self._sink.submit(batch.frame, source=SOURCE, rejected=rejected)
            except QueueFullError as error:
                # Meanwhile datagrams wait in the queue; what does not fit there is counted.
                full = error
                if self._stopping.wait(error.retry_after_s):
                    break
            except MultiradarError as error:
                self._lost(listener, error)
                return
            except Exception as error:
                # A fault of the service: counted here, told by who drains.
                self._lost(listener, error)
                raise
            else:
                future.add_done_callback(lambda done: self._settled(done, listener))
                return
        self._lost(listener, full)

    def _rows(
        self, part: list[Received], refused: list[RefusedOctets], first: int
    ) -> list[RejectedRow]:
        rows_max, labels = self._bounds.quarantine_rows_max, self._counts.labels
        kept, rest = refused[:rows_max], refused[rows_max:]
        rows = [
            RejectedRow(first + k, str(one.code), _told(part[one.datagram], one, labels), _raw(one))
            for k, one in enumerate(kept)
        ]
        if rest:
            codes = Counter(str(one.code) for one in rest)
            told = ", ".join(f"{code} {count}" for code, count in sorted(codes.items()))
            octets = sum(len(one.octets) for one in rest)
            reason = (
                f"{_place(part[rest[0].datagram], labels)} to "
                f"{_place(part[rest[-1].datagram], labels)}: {len(rest)} more refusals of {octets} "
                f"octets that are not kept ({told})"
            )
            rows.append(RejectedRow(first + len(kept), codes.most_common(1)[0][0], reason))
        return rows

    def _settled(self, done: Future[Receipt], listener: NDArray[np.int64]) -> None:
        error = done.exception()
        if error is not None:
            self._lost(listener, error)
            return
        self._losing = False
        accepted = np.ones(len(listener), dtype=np.bool_)
        # What was refused before stands behind the measurements.
        refused = [row.index for row in done.result().rejected if row.index < len(listener)]
        accepted[refused] = False
        for name, own in (("rows_accepted", accepted), ("rows_rejected", ~accepted)):
            self._add(name, listener[own])

    def _lost(self, listener: NDArray[np.int64], error: BaseException | None) -> None:
        self._add("rows_lost", listener)
        # Told when it begins: a service that has failed takes none of the batches that follow.
        if not self._losing:
            self._losing = True
            _log.error("asterix_rows_lost", rows=len(listener), reason=str(error))

    def _add(self, name: str, listener: NDArray[np.int64]) -> None:
        for number, count in enumerate(np.bincount(listener).tolist()):
            self._counts.add(number, **{name: count})


def _joined(received: list[Received]) -> Datagrams:
    octets = np.array([len(one.octets) for one in received], dtype=np.int64)
    ends = np.cumsum(octets)
    return Datagrams(
        data=np.frombuffer(b"".join(one.octets for one in received), dtype=np.uint8),
        begins=ends - octets,
        ends=ends,
        received_s=np.array([one.received_s for one in received]),
    )


def _place(received: Received, labels: Sequence[str]) -> str:
    return f"{labels[received.listener]}, datagram {received.number}"


def _told(received: Received, one: RefusedOctets, labels: Sequence[str]) -> str:
    cut = len(one.octets) > RAW_OCTETS_MAX
    return f"{_place(received, labels)}, octet {one.offset}: {one.reason}" + (
        f"; the first {RAW_OCTETS_MAX} of {len(one.octets)} octets are kept" if cut else ""
    )


def _raw(one: RefusedOctets) -> str:
    return one.octets[:RAW_OCTETS_MAX].hex()
