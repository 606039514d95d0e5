"""The bounded queue between the journal and the engine: entries on disk that wait their turn."""

import threading
from collections import deque
from dataclasses import dataclass

from multiradar.errors import PipelineError
from multiradar.storage.entries import EntryKind, RejectedRow
from multiradar.tracking.input.measurements import MeasurementBatch


@dataclass(frozen=True, slots=True)
class Journalled:
    """An entry of the journal, ready for the engine.

    Attributes
    ----------
    sequence : int
        Place in the journal.
    kind : EntryKind
        Measurements, or the end of a stream.
    batch : MeasurementBatch
        The accepted measurements, in the order of their arrival.
    source : str
        Who sent them.
    rejects : tuple of RejectedRow
        The rows of the same message that were refused.
    """

    sequence: int
    kind: EntryKind
    batch: MeasurementBatch
    source: str = ""
    rejects: tuple[RejectedRow, ...] = ()


def grouped(waiting: deque[Journalled], rows_max: int) -> list[Journalled]:
    """Take from the left what goes to the engine in one call: batches, or one end of a stream."""
    taken = [waiting.popleft()]
    rows = len(taken[0].batch)
    while (
        waiting
        and taken[-1].kind is EntryKind.BATCH
        and waiting[0].kind is EntryKind.BATCH
        and rows + len(waiting[0].batch) <= rows_max
    ):
        rows += len(waiting[0].batch)
        taken.append(waiting.popleft())
    return taken


class Backlog:
    """Journalled entries that wait for the engine; the writer waits when they are too many.

    Parameters
    ----------
    rows_max : int
        Measurements that may wait; a larger entry enters an empty backlog.
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
        """Measurements that wait."""
        return self._rows

    def put(self, entries: list[Journalled]) -> None:
        """Add entries, waiting for room.

        Raises
        ------
        PipelineError
            If the engine has stopped. The entries are in the journal and will be processed after
            the next start.
        """
        for entry in entries:
            with self._changed:
                while self._waiting and self._rows + len(entry.batch) > self._rows_max:
                    if self._broken:
                        break
                    self._changed.wait()
                if self._broken:
                    raise PipelineError("the engine has stopped")
                self._waiting.append(entry)
                self._rows += len(entry.batch)
                self._changed.notify_all()

    def take(self, rows_max: int) -> list[Journalled]:
        """Wait for entries and return those that go together; empty when closed and drained."""
        with self._changed:
            while not self._waiting and not self._closed:
                self._changed.wait()
            if not self._waiting:
                return []
            taken = grouped(self._waiting, rows_max)
            self._rows -= sum(len(entry.batch) for entry in taken)
            self._changed.notify_all()
            return taken

    def close(self) -> None:
        """Add nothing more; what waits can still be taken out."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def abandon(self) -> None:
        """Drop what waits and refuse more: the engine has stopped."""
        with self._changed:
            self._broken = self._closed = True
            self._waiting.clear()
            self._rows = 0
            self._changed.notify_all()
