"""Times of the records of a file: truncated ones restored, missing ones found, past midnight.

A radar of category 001 gives the time of day modulo 512 s (item 141), or none. The reference is
the last time of day that the same source gave (service messages, mostly), moved on by the
recorder's clock where the file has one; else the recorder's clock; else any other source's time.
Without item 141 the time is when the antenna passed the plot's azimuth: the last north mark or
sector, and the turn. At midnight the time of day, and with it the truncated time, begins anew.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.layout.columns import Integers, Numbers

_DAY_S = 86_400.0
_TRUNCATED_S = 512.0
_TURN_DEG = 360.0

#: Where a time comes from, by number.
ORIGINS = ("none", "record", "truncated", "antenna", "recorder")
NONE, RECORD, TRUNCATED, ANTENNA, RECORDER = range(5)


@dataclass(frozen=True)
class Marks:
    """Times of day that sources gave, in the order of the file.

    Attributes
    ----------
    order : int64[n]
        Place in the file.
    source : int64[n]
        Who gave it.
    time_s : float64[n]
        Time of day.
    received_s : float64[n]
        Recorder's time of day, NaN where the file has none.
    sector_deg : float64[n]
        Azimuth that the antenna crossed; NaN where it is none of these messages.
    turn_s : float64[n]
        Time of a turn of the antenna; NaN where it is not known.
    """

    order: Integers
    source: Integers
    time_s: Numbers
    received_s: Numbers
    sector_deg: Numbers
    turn_s: Numbers


def nearest_day(time_s: Numbers, reference_s: Numbers | float, period_s: float = _DAY_S) -> Numbers:
    """Move times by whole periods to where they are nearest to a reference."""
    return time_s + period_s * np.round((reference_s - time_s) / period_s)


def restored(truncated_s: Numbers, reference_s: Numbers) -> Numbers:
    """Restore times of day that were written modulo 512 s.

    Parameters
    ----------
    truncated_s : float64[n]
        What was written, s; NaN for none.
    reference_s : float64[n]
        About when it was, time of day or any whole number of days from it, s; NaN for none.

    Returns
    -------
    float64[n]
        Of the times of day that are written so, the nearest to the reference, also over midnight
        (a day is no multiple of 512 s); NaN where either is not known.
    """
    last = np.ceil((_DAY_S - truncated_s) / _TRUNCATED_S) - 1.0
    nearest = np.full(len(truncated_s), np.nan)
    away = np.full(len(truncated_s), np.inf)
    for day in (0.0, -_DAY_S, _DAY_S):
        reference = reference_s % _DAY_S + day
        periods = np.clip(np.round((reference - truncated_s) / _TRUNCATED_S), 0.0, last)
        times = truncated_s + periods * _TRUNCATED_S
        nearer = np.abs(times - reference) < away
        nearest = np.where(nearer, times, nearest)
        away = np.where(nearer, np.abs(times - reference), away)
    return nearest


def times_of(
    *,
    order: Integers,
    source: Integers,
    time_s: Numbers,
    truncated_s: Numbers,
    azimuth_deg: Numbers,
    received_s: Numbers,
    marks: Marks,
) -> tuple[Numbers, Integers]:
    """Give every record a time of day.

    Parameters
    ----------
    order, source : int64[n]
        Place in the file, and who reports.
    time_s, truncated_s : float64[n]
        Time of day, and modulo 512 s, as the record says, s; NaN where it does not.
    azimuth_deg : float64[n]
        Azimuth of the plot; NaN for none.
    received_s : float64[n]
        Recorder's time of day, s; NaN for none.
    marks : Marks
        Times of day that sources gave.

    Returns
    -------
    time_s : float64[n]
        Times of day, s; NaN where nothing tells it.
    origin : int64[n]
        Where each comes from, see `ORIGINS`.
    """
    result = np.where(time_s < _DAY_S, time_s, np.nan)
    origin = np.where(np.isnan(result), NONE, RECORD)
    open_rows = np.flatnonzero(np.isnan(time_s))
    if not len(open_rows):
        return result, origin
    reference = _references(order[open_rows], source[open_rows], received_s[open_rows], marks)
    whole = restored(truncated_s[open_rows], reference)
    swept = _by_antenna(order[open_rows], source[open_rows], azimuth_deg[open_rows], marks)
    result[open_rows], origin[open_rows] = _first_known(
        ((whole, TRUNCATED), (swept, ANTENNA), (received_s[open_rows], RECORDER))
    )
    return result % _DAY_S, origin


def _first_known(choices: tuple[tuple[Numbers, int], ...]) -> tuple[Numbers, Integers]:
    times = np.full(len(choices[0][0]), np.nan)
    origin = np.zeros(len(times), dtype=np.int64)
    for values, number in choices:
        taken = np.isnan(times) & ~np.isnan(values)
        times[taken] = values[taken]
        origin[taken] = number
    return times, origin


def _before(order: Integers, known: Integers) -> NDArray[np.int64]:
    """Return the last of `known` that is not after each place, else the first."""
    return np.maximum(np.searchsorted(known, order, side="right") - 1, 0)


def _references(order: Integers, source: Integers, received_s: Numbers, marks: Marks) -> Numbers:
    reference = np.full(len(order), np.nan)
    for one in np.unique(source).tolist():
        rows = np.flatnonzero(source == one)
        own = np.flatnonzero(marks.source == one)
        if len(own):
            last = own[_before(order[rows], marks.order[own])]
            passed = received_s[rows] - marks.received_s[last]
            reference[rows] = marks.time_s[last] + np.where(np.isnan(passed), 0.0, passed)
    reference = np.where(np.isnan(reference), received_s, reference)
    if len(marks.order):
        last = _before(order, marks.order)
        reference = np.where(np.isnan(reference), marks.time_s[last], reference)
    return reference


def _by_antenna(order: Integers, source: Integers, azimuth_deg: Numbers, marks: Marks) -> Numbers:
    times = np.full(len(order), np.nan)
    for one in np.unique(source).tolist():
        own = np.flatnonzero((marks.source == one) & ~np.isnan(marks.sector_deg))
        if not len(own):
            continue
        rows = np.flatnonzero(source == one)
        last = own[_before(order[rows], marks.order[own])]
        angle = nearest_day(azimuth_deg[rows] - marks.sector_deg[last], 0.0, _TURN_DEG)
        times[rows] = marks.time_s[last] + angle / _TURN_DEG * marks.turn_s[last]
    return times
