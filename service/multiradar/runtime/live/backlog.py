"""The bounded queue of journal entries between the journal and the engine."""

import threading
from collections import deque
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from math import inf

from multiradar.errors import MultiradarError, PipelineError
from multiradar.observability.traces import MessageTraces
from multiradar.runtime.live.threads import SystemThreads, Threads
from multiradar.storage.entries import EntryKind, RejectedRow
from multiradar.tracking.input.measurements import MeasurementBatch


@dataclass(frozen=True, slots=True)
class Journalled:
    """An entry of the journal, ready for the engine.

    Attributes
    ----------
    sequence : int
        Number in the journal.
    kind : EntryKind
        What it is.
    batch : MeasurementBatch
        The accepted measurements, in the order of their arrival.
    source : str
        Their sender.
    rejects : tuple of RejectedRow
        The rejected rows of the same message.
    clock_s : float
        The data clock after the entry, s.
    received_s : float or None
        Time of reception, UTC, s; None of entries that are replayed.
    change : bytes
        Change of a sensor; see `multiradar.runtime.admission.sensors_in_force`. Of a handover,
        the message.
    """

    sequence: int
    kind: EntryKind
    batch: MeasurementBatch
    source: str = ""
    rejects: tuple[RejectedRow, ...] = ()
    clock_s: float = -inf
    received_s: float | None = None
    change: bytes = b""


def grouped(waiting: deque[Journalled], rows_max: int) -> list[Journalled]:
    """Pop the entries for one call of the engine: batches, or one entry of another kind."""
    popped = [waiting.popleft()]
    rows = len(popped[0].batch)
    while (
        waiting
        and popped[-1].kind is EntryKind.BATCH
        and waiting[0].kind is EntryKind.BATCH
        and rows + len(waiting[0].batch) <= rows_max
    ):
        rows += len(waiting[0].batch)
        popped.append(waiting.popleft())
    return popped


def releasing_clock_s(group: Sequence[Journalled]) -> float:
    """Return the data clock up to which a group releases measurements, s.

    An entry without measurements releases none, alone or in a group.
    """
    return next((one.clock_s for one in reversed(group) if len(one.batch)), group[-1].clock_s)


class Backlog:
    """Journalled entries queued for the engine; the writer blocks when the queue is full.

    Parameters
    ----------
    rows_max : int
        Maximum queued measurements; a larger entry is accepted when the queue is empty.
    threads : Threads, optional
        Makes what the threads wait for; threads of the system by default.
    """

    def __init__(self, rows_max: int, threads: Threads | None = None) -> None:
        self._rows_max = rows_max
        self._waiting: deque[Journalled] = deque()
        self._rows = 0
        #: Time of reception of the oldest queued entry, UTC, s; None if it has none.
        self.oldest_s: float | None = None
        self._closed = False
        self._broken = False
        self._changed = (threads or SystemThreads()).condition()
        #: Notes the times of messages; None where they are not traced.
        self.traces: MessageTraces | None = None

    @property
    def rows(self) -> int:
        """Queued measurements."""
        return self._rows

    def put(self, entries: list[Journalled]) -> None:
        """Add entries; block while the queue is full.

        Raises
        ------
        PipelineError
            If the engine has stopped. The entries are in the journal and are processed after the
            next start.
        """
        for entry in entries:
            with self._changed:
                while self._waiting and self._rows + len(entry.batch) > self._rows_max:
                    if self._broken:
                        break
                    self._changed.wait()
                if self._broken:
                    raise PipelineError("the engine has stopped; see the log")
                self._waiting.append(entry)
                self._rows += len(entry.batch)
                if self.traces is not None:
                    self.traces.journalled(entry)
                self.oldest_s = self._waiting[0].received_s
                self._changed.notify_all()

    def pop(self, rows_max: int) -> list[Journalled]:
        """Wait for entries and return those of one call; empty when closed and drained."""
        with self._changed:
            while not self._waiting and not self._closed:
                self._changed.wait()
            if not self._waiting:
                return []
            popped = grouped(self._waiting, rows_max)
            self._rows -= sum(len(entry.batch) for entry in popped)
            self.oldest_s = self._waiting[0].received_s if self._waiting else None
            self._changed.notify_all()
        if self.traces is not None:
            self.traces.started(popped)
        return popped

    def close(self) -> None:
        """Accept no more entries; queued ones can still be popped."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def abandon(self) -> None:
        """Discard queued entries and reject further ones: the engine has stopped."""
        with self._changed:
            self._broken = self._closed = True
            self._waiting.clear()
            self._rows = 0
            self.oldest_s = None
            self._changed.notify_all()


class EntryFutures:
    """Futures of the last update, resolved when an entry has been processed; of any thread.

    They have a lock of their own: registering one must not wait for a call of the engine.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._waiting: list[tuple[int, Future[int]]] = []
        self._ended: MultiradarError | None = None

    def add(self, sequence: int) -> Future[int]:
        """Return a future of an entry; it fails when processing has stopped before the entry."""
        future: Future[int] = Future()
        with self._lock:
            self._waiting.append((sequence, future))
        return future

    def settle(self, processed: int, updates: int) -> None:
        """Resolve the futures of the entries that were processed, with the last update."""
        with self._lock:
            done = [future for sequence, future in self._waiting if sequence <= processed]
            self._waiting = [one for one in self._waiting if one[0] > processed]
        for future in done:
            # The caller may have cancelled it.
            if future.set_running_or_notify_cancel():
                future.set_result(updates)
        if self._ended is not None:
            self.fail(self._ended)

    def fail(self, error: MultiradarError) -> None:
        """Fail all others, and those that are settled later."""
        self._ended = error
        with self._lock:
            waiting, self._waiting = self._waiting, []
        for _, future in waiting:
            if future.set_running_or_notify_cancel():
                future.set_exception(error)
