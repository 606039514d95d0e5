"""Data times as text: UTC where the date is known, else the time of day."""

from collections.abc import Iterable
from datetime import UTC, datetime

_DAY_S = 86_400.0
#: Times of day continue past midnight, but no recording without a date lasts a year; times with a
#: date are seconds since 1970.
_DATED_FROM_S = 366 * _DAY_S
#: The years 1 to 9999, which have a calendar date; others are a number of days since 1970.
_FIRST_S, _END_S = -62_135_596_800.0, 253_402_300_800.0
#: GPS minus UTC since 2017, s (IERS Bulletin C 52).
GPS_MINUS_UTC_S, _GPS_WITHIN_S = 18.0, 0.7


def is_dated(time_s: float) -> bool:
    """Return whether a data time includes the date."""
    return abs(time_s) >= _DATED_FROM_S


def clock_text(time_s: float) -> str:
    """Return the time of day of a data time, in whole seconds, such as ``08:12:31``."""
    seconds = int(time_s // 1.0 % _DAY_S)
    return f"{seconds // 3600:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}"


def time_text(time_s: float) -> str:
    """Return a data time as text.

    Parameters
    ----------
    time_s : float
        Seconds since 1970, or of the day, continuing past midnight.

    Returns
    -------
    str
        ``2018-08-01 08:12:31 UTC``, or ``08:12:31`` where the date is unknown; after midnight
        ``00:12:31 (day 2)``.
    """
    if is_dated(time_s):
        return f"{_date_text(time_s)} {clock_text(time_s)} UTC"
    day = int(time_s // _DAY_S)
    return clock_text(time_s) + (f" (day {day + 1})" if day else "")


def day_text(time_s: float) -> str:
    """Return the day of a data time, such as ``08-01``, or ``day 2`` where the date is unknown."""
    if not is_dated(time_s):
        return f"day {time_s // _DAY_S + 1:.0f}"
    text = _date_text(time_s)
    return text if text.startswith("day") else text[len("2018-") :]


def axis_label(times_s: Iterable[float]) -> str:
    """Return the label of an axis of data times: the date where it is known.

    Parameters
    ----------
    times_s : iterable of float
        Data times, including the first and the last.
    """
    times = list(times_s)
    if not times or not is_dated(times[0]):
        return "time of day"
    first, last = _date_text(min(times)), _date_text(max(times))
    return f"UTC, {first}" if first == last else f"UTC, {first} to {last}"


def gps_time(late_s: float) -> str:
    """Return a hint if a clock is ahead by as much as GPS time is of UTC, else nothing."""
    is_gps = abs(late_s - GPS_MINUS_UTC_S) <= _GPS_WITHIN_S
    return " (GPS time instead of UTC?)" if is_gps else ""


def _date_text(time_s: float) -> str:
    if not _FIRST_S <= time_s < _END_S:
        return f"day {time_s // _DAY_S:.0f}"
    return datetime.fromtimestamp(time_s // 1.0, UTC).strftime("%Y-%m-%d")
