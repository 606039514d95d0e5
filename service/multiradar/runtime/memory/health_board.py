"""Health of the radars at the ends of past epochs."""

from collections import deque
from typing import ClassVar

import numpy as np

from multiradar.runtime.memory.set_backs import SetBacks
from multiradar.state import Fields
from multiradar.tracking.health.health_records import HealthRecords

#: Epochs of which the health of the radars is retained: three hours with epochs of 4 s.
HEALTH_EPOCHS_MAX = 2700


class HealthBoard:
    """The records of the last epochs, numbered from 0 as they are added; one owner.

    Parameters
    ----------
    epochs_max : int
        Number of retained epochs; the oldest are discarded first.
    """

    STATE: ClassVar[Fields] = {
        "_joined": tuple[HealthRecords, list[int], int],
        "_set_backs": SetBacks,
    }

    def __init__(self, epochs_max: int = HEALTH_EPOCHS_MAX) -> None:
        # With the number of the first record of each: an epoch that a flush has closed, or that
        # comes again after a step back, has the name of another one.
        self._epochs: deque[tuple[int, HealthRecords]] = deque(maxlen=epochs_max)
        self._set_backs = SetBacks()

    @property
    def _joined(self) -> tuple[HealthRecords, list[int], int]:
        # All records, the length of each epoch, and the number of the first: a snapshot has few
        # arrays.
        epochs = [records for _, records in self._epochs]
        first = self._epochs[0][0] if self._epochs else 0
        return HealthRecords.concatenate(epochs), [len(one) for one in epochs], first

    @_joined.setter
    def _joined(self, state: tuple[HealthRecords, list[int], int]) -> None:
        records, lengths, first = state
        ends = np.cumsum([0, *lengths]).tolist()
        place = np.repeat(np.arange(len(lengths)), lengths)
        self._epochs.clear()
        self._epochs.extend(
            (first + ends[one], records.select(place == one)) for one in range(len(lengths))
        )

    @property
    def appended(self) -> int:
        """Number of records so far."""
        epochs = tuple(self._epochs)
        return epochs[-1][0] + len(epochs[-1][1]) if epochs else 0

    def append(self, records: HealthRecords) -> None:
        """Add the records of closed epochs, in order."""
        for epoch in np.unique(records.epoch):
            self._epochs.append((self.appended, records.select(records.epoch == epoch)))

    def set_back(self, time_s: float) -> None:
        """Expect records from an earlier time on."""
        oldest = self._epochs[0][0] if self._epochs else 0
        self._set_backs.add(self.appended, time_s, oldest)

    @property
    def complete_from_s(self) -> float:
        """Time from which all records are retained, s; -inf if none was discarded."""
        epochs = tuple(self._epochs)
        if not epochs or not epochs[0][0]:
            return -np.inf
        first, oldest = epochs[0]
        return min(float(oldest.time_s[0]), self._set_backs.limit_s(first))

    def after(self, number: int) -> tuple[HealthRecords, int]:
        """Return the retained records from a number on.

        Parameters
        ----------
        number : int
            How many records were returned earlier, or discarded since.

        Returns
        -------
        records : HealthRecords
            In order; none as long as the engine processes the journal again.
        lost : int
            Records from that number on that are no longer retained.
        """
        # A copy: the owner may append meanwhile.
        epochs = tuple(self._epochs)
        # Whole epochs: each call has returned what there was.
        parts = [records for first, records in epochs if first >= number]
        oldest = epochs[0][0] if epochs else 0
        return HealthRecords.concatenate(parts), max(oldest - number, 0)

    def at(self, time_s: float) -> HealthRecords:
        """Return the records of the last epoch that had ended at a data time; none before it."""
        # A copy: the owner may append meanwhile.
        for _, records in reversed(tuple(self._epochs)):
            if records.time_s[0] <= time_s:
                return records
        return HealthRecords.concatenate([])
