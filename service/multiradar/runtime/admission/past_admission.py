"""Admission of measurements that were admitted before, when their journal was written."""

import numpy as np
from numpy.typing import NDArray

from multiradar.runtime.admission.admission_by_time import ACCEPTED, EXCESS, LATE, Admission
from multiradar.tracking.input.measurements import MeasurementBatch


class PastAdmission(Admission):
    """Accepts by time what was accepted before, unless it is late by a shorter reorder horizon.

    Whether a row is in the future may depend on times of reception, which a journal does not
    contain; so does the data clock, which is to be set after each message with `use_clock_of`.
    """

    __slots__ = ()

    def admit(self, batch: MeasurementBatch, received_s: float | None = None) -> NDArray[np.int8]:
        """Classify the next rows as `ACCEPTED`, `LATE` or `EXCESS`; see `Admission.admit`."""
        clock_s, earliest_s = self.data_clock_s, self.floor_s
        if clock_s is not None:
            earliest_s = max(earliest_s, clock_s - self.horizon_s)
        code = super().admit(batch, received_s)
        code[code != EXCESS] = ACCEPTED
        # All rows of a message are reordered together.
        code[batch.time_s < earliest_s] = LATE
        self.clock_s[:] = np.nan if clock_s is None else clock_s
        return code
