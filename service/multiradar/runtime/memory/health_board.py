"""Health of the radars at the ends of past epochs."""

from collections import deque
from typing import ClassVar

import numpy as np

from multiradar.state import Fields
from multiradar.tracking.health.health_records import HealthRecords

#: Epochs of which the health of the radars is retained: three hours with epochs of 4 s.
HEALTH_EPOCHS_MAX = 2700


class HealthBoard:
    """The records of the last epochs; one owner.

    Parameters
    ----------
    epochs_max : int
        Number of retained epochs; the oldest are discarded first.
    """

    STATE: ClassVar[Fields] = {"_joined": tuple[HealthRecords, list[int]]}

    def __init__(self, epochs_max: int = HEALTH_EPOCHS_MAX) -> None:
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
        if not len(records):
            return
        for epoch in np.unique(records.epoch):
            self._epochs.append(records.select(records.epoch == epoch))

    @property
    def complete_from_s(self) -> float:
        """Time from which all records are retained, s; -inf if none was discarded."""
        epochs = tuple(self._epochs)
        if len(epochs) < (self._epochs.maxlen or 0):
            return -np.inf
        # The oldest may be after the newest, if the data time was set back since.
        return min(float(one.time_s[0]) for one in (epochs[0], epochs[-1]))

    def after(
        self, last: tuple[int, float] | None, *, repeating: bool = False
    ) -> tuple[HealthRecords, tuple[int, float] | None]:
        """Return the retained records after an epoch, and the last epoch.

        Parameters
        ----------
        last : tuple of int and float, or None
            Number and end of an epoch; None, or one that is no longer retained: all records. No
            record before the epoch is there again, as while the engine processes the journal again.
        repeating : bool
            Whether it does, as far as is known.

        Returns
        -------
        records : HealthRecords
            In order.
        last : tuple of int and float, or None
            Number and end of the last retained epoch; None without any.
        """
        new: list[HealthRecords] = []
        named = None
        epochs = tuple(self._epochs)
        for records in reversed(epochs):
            name = int(records.epoch[0]), float(records.time_s[0])
            named = named or name
            if name == last:
                break
            new.append(records)
        else:
            if last is not None and named is not None:
                has_all = len(epochs) < (self._epochs.maxlen or 0)
                if repeating or (has_all and named < last):
                    return HealthRecords.concatenate([]), last
        return HealthRecords.concatenate(new[::-1]), named

    def at(self, time_s: float) -> HealthRecords:
        """Return the records of the last epoch that had ended at a data time; none before it."""
        # A copy: the owner may append meanwhile.
        for records in reversed(tuple(self._epochs)):
            if records.time_s[0] <= time_s:
                return records
        return HealthRecords.concatenate([])
