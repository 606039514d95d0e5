"""Times of the dump made times of the recording: past midnight, and since 1970 with a date."""

import datetime as dt
import math

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.vid import _tables
from multiradar_converters.vid.layout import TimeForm

#: How far the rows of one file may reach back over the midnight at which another began.
LATE_S = 3600.0

_DAY_S = 86_400.0


class Clockwork:
    """Turns the times of one file, taken in its order, into times of the recording.

    Parameters
    ----------
    form : str
        What the times of the file are.
    start_s : float or None
        Time of the first row of the file read before, so that files of which one begins before
        and one after midnight agree on the day.
    """

    def __init__(self, form: TimeForm, start_s: float | None) -> None:
        self._of_day = form == "seconds-of-day"
        self._current = math.nan
        self._reference = start_s
        self.start_s: float | None = None

    def run(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return times of the recording, s; changes the given ones."""
        if self._of_day and len(times):
            if math.isnan(self._current) and self._reference is not None:
                self._current = _beside(float(times[0]), self._reference)
            self._current = float(_tables.unwrap(times, self._current, LATE_S))
        if self.start_s is None and len(times):
            self.start_s = float(times[0])
        return times


def _beside(time: float, reference: float) -> float:
    """Return a time moved by a day if that brings it close to a reference, else as it is."""
    for days in (-1, 1):
        if abs(time + days * _DAY_S - reference) <= LATE_S:
            return time + days * _DAY_S
    return time


def unix_start(date: dt.date | None) -> float:
    """Return the Unix time at which a day begins, s; 0 without a date."""
    if date is None:
        return 0.0
    return (date - dt.date(1970, 1, 1)).days * _DAY_S
