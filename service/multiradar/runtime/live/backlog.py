"""The bounded queue of journal entries between the journal and the engine."""

import threading
from collections import deque
from dataclasses import dataclass
from math import inf

from multiradar.errors import PipelineError
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
        Measurements, or the end of a stream.
    batch : MeasurementBatch
        The accepted measurements, in the order of their arrival.
    source : str
        Their sender.
    rejects : tuple of RejectedRow
        The rejected rows of the same message.
    clock_s : float
        The data clock after the entry, s.
    """

    sequence: int
    kind: EntryKind
    batch: MeasurementBatch
    source: str = ""
    rejects: tuple[RejectedRow, ...] = ()
    clock_s: float = -inf


def grouped(waiting: deque[Journalled], rows_max: int) -> list[Journalled]:
    """Pop the entries for one call of the engine: batches, or one end of a stream."""
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


class Backlog:
    """Journalled entries queued for the engine; the writer blocks when the queue is full.

    Parameters
    ----------
    rows_max : int
        Maximum queued measurements; a larger entry is accepted when the queue is empty.
    """

    def __init__(self, rows_max: int) -> None:
        self._rows_max = rows_max
        self._waiting: deque[Journalled] = deque()
        self._rows = 0
        self._closed = False
        self._broken = False
        self._changed = threading.Condition()

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
            self._changed.notify_all()
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
            self._changed.notify_all()
