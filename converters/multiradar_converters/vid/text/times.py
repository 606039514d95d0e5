"""Conversion of dump times to recording times: continued past midnight, Unix time with a date."""

import datetime as dt
import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.vid import _kernels
from multiradar_converters.vid.text.layout import TimeForm

#: Interval that counts as shortly before or after midnight, s.
LATE_S = 3600.0

_DAY_S = 86_400.0


class TimeUnwrapper:
    """Converts the times of a file, in file order, to times of the recording.

    Parameters
    ----------
    form : str or None
        Time format of the file.
    start : float
        Consensus of its first rows, in file time, s; NaN for none.
    from_before_midnight : bool
        Whether the recording begins shortly before midnight: a file whose first rows are shortly
        after midnight then begins on the second day.
    """

    def __init__(self, form: TimeForm | None, *, start: float, from_before_midnight: bool) -> None:
        self._of_day = form == "seconds-of-day"
        self._state = np.array([start, start, start, start, math.nan, 0.0])
        if self._of_day and from_before_midnight and start <= LATE_S:
            self._state[:3] += _DAY_S

    @property
    def last_s(self) -> float:
        """File time of the last accepted row, s."""
        return float(self._state[3])

    def run(self, times: NDArray[np.float64], kept: NDArray[np.bool_]) -> tuple[int, int]:
        """Convert times to those of the recording, s, in place; see `_kernels.mark_outliers`."""
        decided, rejected = _kernels.mark_outliers(times, self._state, self._of_day, kept)
        return int(decided), int(rejected)


def agreed_start(times: Sequence[float], form: TimeForm | None) -> float:
    """Return the start time of a file, robust to outliers.

    Parameters
    ----------
    times : sequence of float
        File times of its first rows, s.
    form : str or None
        Their format.

    Returns
    -------
    float
        First time of the first consecutive rows that agree, or of the largest such group; NaN
        without rows.
    """
    best, best_count, begin = math.nan, 0, 0
    for k in range(1, len(times) + 1):
        if k < len(times) and _distance(times[k], times[k - 1], form) <= LATE_S:
            continue
        if k - begin > best_count:
            best, best_count = times[begin], k - begin
        if best_count >= _kernels.AGREEING_ROWS:
            break
        begin = k
    return best


def agreeing(times: Sequence[float], form: TimeForm | None) -> list[float]:
    """Return the first times of a file that are near their consensus."""
    start = agreed_start(times, form)
    return [time for time in times if _distance(time, start, form) <= LATE_S]


def _distance(time: float, other: float, form: TimeForm | None) -> float:
    """Return the difference of two times, s; times of day are compared across midnight."""
    away = abs(time - other)
    over_midnight = form == "seconds-of-day" and max(time, other) < _DAY_S
    return min(away, _DAY_S - away) if over_midnight else away


def begins_before_midnight(first_times: Iterable[float]) -> bool:
    """Return whether a recording begins shortly before midnight.

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


def dates_of(times: Iterable[float]) -> tuple[dt.date, dt.date] | None:
    """Return the possible first days of a file with dates.

    Parameters
    ----------
    times : iterable of float
        Unix times of its first rows, s.

    Returns
    -------
    tuple of two dates or None
        The same day twice, except near midnight; None without times.
    """
    start = agreed_start(list(times), None)
    if math.isnan(start):
        return None
    days = [math.floor((start + step) / _DAY_S) for step in (-LATE_S, LATE_S)]
    first, last = (dt.date(1970, 1, 1) + dt.timedelta(days=day) for day in days)
    return first, last


def unix_start(date: dt.date | None) -> float:
    """Return the Unix time of the start of a day, s; 0 without a date."""
    if date is None:
        return 0.0
    return (date - dt.date(1970, 1, 1)).days * _DAY_S
