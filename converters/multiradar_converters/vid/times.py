"""Times of the dump made times of the recording: past midnight, and since 1970 with a date."""

import datetime as dt
import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.vid import _kernels
from multiradar_converters.vid.text.layout import TimeForm

#: What counts as shortly before or after midnight.
LATE_S = 3600.0

_DAY_S = 86_400.0


class Clockwork:
    """Turns the times of one file, taken in its order, into times of the recording.

    Parameters
    ----------
    form : str
        What the times of the file are.
    from_before_midnight : bool
        Whether the recording begins shortly before a midnight: a file whose first row comes
        shortly after one then begins on the second day.
    """

    def __init__(self, form: TimeForm, *, from_before_midnight: bool) -> None:
        self._of_day = form == "seconds-of-day"
        self._current = math.nan
        self._from_before_midnight = from_before_midnight

    def run(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return times of the recording, s; changes the given ones."""
        if self._of_day and len(times):
            if math.isnan(self._current) and self._from_before_midnight:
                first = float(times[0])
                self._current = first + _DAY_S if first <= LATE_S else first
            self._current = float(_kernels.unwrap(times, self._current, LATE_S))
        return times


def begins_before_midnight(first_times: Iterable[float]) -> bool:
    """Tell whether a recording begins shortly before a midnight.

    Parameters
    ----------
    first_times : iterable of float
        Times of day of the first rows of all its files, s.

    Returns
    -------
    bool
        True if some are shortly before and some shortly after midnight.
    """
    times = list(first_times)
    return any(_DAY_S - LATE_S <= time < _DAY_S for time in times) and any(
        time <= LATE_S for time in times
    )


def unix_start(date: dt.date | None) -> float:
    """Return the Unix time at which a day begins, s; 0 without a date."""
    if date is None:
        return 0.0
    return (date - dt.date(1970, 1, 1)).days * _DAY_S
