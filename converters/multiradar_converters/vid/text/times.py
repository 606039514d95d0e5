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
    day : int
        Day of the recording on which a file with times of day starts, see `first_day`.
    """

    def __init__(self, form: TimeForm | None, *, start: float, day: int = 0) -> None:
        self._of_day = form == "seconds-of-day"
        self._state = np.array([start, start, start, start, math.nan, 0.0])
        if self._of_day:
            self._state[:3] += day * _DAY_S

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


def span(times: Sequence[float], form: TimeForm | None, start_s: float) -> tuple[float, float]:
    """Return the first and last time of a file, relative to the day of its start.

    Parameters
    ----------
    times : sequence of float
        File times of some of its rows, in file order, s.
    form : str or None
        Their format.
    start_s : float
        As of `agreed_start`.

    Returns
    -------
    tuple of two floats
        Times that continue past midnight, s, negative for rows from before the midnight after which
        the file starts; NaN without times of day.
    """
    if form != "seconds-of-day" or math.isnan(start_s):
        return math.nan, math.nan
    found, kept = np.array(times), np.zeros(len(times), dtype=np.bool_)
    decided, _ = TimeUnwrapper(form, start=start_s).run(found, kept)
    own = found[:decided][kept[:decided]]
    return float(own.min(initial=start_s)), float(own.max(initial=start_s))


def _distance(time: float, other: float, form: TimeForm | None) -> float:
    """Return the difference of two times, s; times of day are compared across midnight."""
    away = abs(time - other)
    over_midnight = form == "seconds-of-day" and max(time, other) < _DAY_S
    return min(away, _DAY_S - away) if over_midnight else away


def first_day(start_s: float, reference_s: float) -> int:
    """Return the day on which a source starts: the one nearest to a time of other sources.

    Parameters
    ----------
    start_s : float
        First time of day of the source, s.
    reference_s : float
        Time of the other sources when it starts, s, counted from the day on which they start.

    Returns
    -------
    int
        The day; 0 without a time. -1 only if the source starts in the last hour before the
        midnight after which the others start.
    """
    away_s = reference_s - start_s
    if math.isnan(away_s):
        return 0
    day = round(away_s / _DAY_S)
    if day >= 0:
        return day
    return -1 if start_s >= _DAY_S - LATE_S and reference_s <= LATE_S else 0


def first_days(spans_s: Sequence[tuple[float, float]]) -> list[int]:
    """Return the days on which the files of a recording start, so that they overlap.

    Parameters
    ----------
    spans_s : sequence of (float, float)
        First and last time of each file, s, as of `span`; NaN if unknown.

    Returns
    -------
    list of int
        A day for each, the earliest one 0. A file that overlaps those before it by more than an
        hour if it starts on the same day does so; other files start on the day on which they
        overlap them longest, or else follow within an hour.
    """
    days: list[int] = []
    start_s, end_s, first_day = math.inf, -math.inf, 0
    for first_s, last_s in spans_s:
        if math.isnan(last_s - first_s):
            days.append(0)
            continue
        common_s = {
            day: min(last_s + day * _DAY_S, end_s) - max(first_s + day * _DAY_S, start_s)
            for day in (0, -1, 1)
        }
        day = max(common_s, key=lambda one: common_s[one])
        if common_s[0] > LATE_S or common_s[day] < -LATE_S:
            day = 0
        days.append(day)
        start_s = min(start_s, first_s + day * _DAY_S)
        end_s = max(end_s, last_s + day * _DAY_S)
        first_day = min(first_day, day + min(0, math.floor(first_s / _DAY_S)))
    return [day - first_day for day in days]


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
