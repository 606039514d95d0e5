"""Health of the radars at the ends of past epochs."""

from collections import deque
from typing import ClassVar

import numpy as np

from multiradar.state import Fields
from multiradar.tracking.health.health_records import HealthRecords


class HealthBoard:
    """The records of the last epochs; one owner.

    Parameters
    ----------
    epochs_max : int
        Number of retained epochs; the oldest are discarded first.
    """

    STATE: ClassVar[Fields] = {"_joined": tuple[HealthRecords, list[int]]}

    def __init__(self, epochs_max: int) -> None:
        self._epochs: deque[HealthRecords] = deque(maxlen=epochs_max)

    @property
    def _joined(self) -> tuple[HealthRecords, list[int]]:
        # All records, and the number of each epoch: a snapshot has few arrays.
        return HealthRecords.concatenate(self._epochs), [len(one) for one in self._epochs]

    @_joined.setter
    def _joined(self, state: tuple[HealthRecords, list[int]]) -> None:
        records, lengths = state
        number = np.repeat(np.arange(len(lengths)), lengths)
        self._epochs.clear()
        self._epochs.extend(records.select(number == one) for one in range(len(lengths)))

    def append(self, records: HealthRecords) -> None:
        """Add the records of closed epochs, in order."""
        for epoch in np.unique(records.epoch):
            self._epochs.append(records.select(records.epoch == epoch))

    def at(self, time_s: float) -> HealthRecords:
        """Return the records of the last epoch that had ended at a data time; none before it."""
        # A copy: the owner may append meanwhile.
        for records in reversed(tuple(self._epochs)):
            if records.time_s[0] <= time_s:
                return records
        return HealthRecords.concatenate([])
