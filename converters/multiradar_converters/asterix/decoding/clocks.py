"""Times of the records of a file: resolves truncated times, derives missing ones.

A radar of category 001 reports the time of day modulo 512 s (item 141), or no time. The reference
is the last time of day of the same source (mostly from service messages), advanced by the
recorder's clock if the file has one; else the recorder's clock; else the time of any other source.
Without item 141 the time is that of the antenna passage at the azimuth of the plot, from the last
north mark or sector and the scan period. At midnight the time of day, and with it the truncated
time, restarts.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.layout.columns import Integers, Numbers
from multiradar_converters.distinct import distinct

_DAY_S = 86_400.0
_TRUNCATED_S = 512.0
_REVOLUTION_DEG = 360.0

#: Origin of a time, by number.
ORIGINS = ("none", "record", "truncated", "antenna", "recorder")
NONE, RECORD, TRUNCATED, ANTENNA, RECORDER = range(5)


@dataclass(frozen=True)
class Marks:
    """Times of day reported by sources, in file order.

    Attributes
    ----------
    order : int64[n]
        Position in the file.
    source : int64[n]
        Source.
    time_s : float64[n]
        Time of day.
    received_s : float64[n]
        Recorder's time of day, NaN if absent.
    sector_deg : float64[n]
        Azimuth crossed by the antenna; NaN for other messages.
    period_s : float64[n]
        Scan period of the antenna; NaN if unknown.
    """

    order: Integers
    source: Integers
    time_s: Numbers
    received_s: Numbers
    sector_deg: Numbers
    period_s: Numbers


def nearest_day(time_s: Numbers, reference_s: Numbers | float, period_s: float = _DAY_S) -> Numbers:
    """Shift times by whole periods to the nearest ones to a reference."""
    return time_s + period_s * np.round((reference_s - time_s) / period_s)


def restored(truncated_s: Numbers, reference_s: Numbers) -> Numbers:
    """Resolve times of day that are truncated modulo 512 s.

    Parameters
    ----------
    truncated_s : float64[n]
        Truncated times, s; NaN for none.
    reference_s : float64[n]
        Approximate time of day, plus any whole number of days, s; NaN for none.

    Returns
    -------
    float64[n]
        The matching time of day nearest to the reference, also across midnight (a day is not a
        multiple of 512 s); NaN if either is unknown.
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
    """Assign a time of day to every record.

    Parameters
    ----------
    order, source : int64[n]
        Position in the file, and source.
    time_s, truncated_s : float64[n]
        Time of day, and time modulo 512 s, of the record, s; NaN if absent.
    azimuth_deg : float64[n]
        Azimuth of the plot; NaN for none.
    received_s : float64[n]
        Recorder's time of day, s; NaN for none.
    marks : Marks
        Times of day reported by sources.

    Returns
    -------
    time_s : float64[n]
        Times of day, s; NaN if unknown.
    origin : int64[n]
        Origin of each, see `ORIGINS`.
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
    """Return the last of `known` at or before each position, else the first."""
    return np.maximum(np.searchsorted(known, order, side="right") - 1, 0)


def _references(order: Integers, source: Integers, received_s: Numbers, marks: Marks) -> Numbers:
    reference = np.full(len(order), np.nan)
    for one in distinct(source).tolist():
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
    for one in distinct(source).tolist():
        own = np.flatnonzero((marks.source == one) & ~np.isnan(marks.sector_deg))
        if not len(own):
            continue
        rows = np.flatnonzero(source == one)
        last = own[_before(order[rows], marks.order[own])]
        angle = nearest_day(azimuth_deg[rows] - marks.sector_deg[last], 0.0, _REVOLUTION_DEG)
        times[rows] = marks.time_s[last] + angle / _REVOLUTION_DEG * marks.period_s[last]
    return times
