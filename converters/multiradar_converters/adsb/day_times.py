"""Days of times without a date, from all files of a recording.

A file in order of time, in which no time is more than an hour before the previous one, is one part
of the recording, and continues past midnight. In a file by aircraft or flight, the reports of an
aircraft are a part as long as they are at most an hour apart. Parts are placed as follows.

======================================= ===========================================================
the parts                               start
======================================= ===========================================================
are files in order of time, each within as they follow one another
an hour of the end of the previous one
do not pass midnight                    on the first day
other                                   on the first day if they pass midnight or start after the
                                        hours of the day at which the fewest of them are under way,
                                        else on the second one
======================================= ===========================================================
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.batches import Batch
from multiradar_converters.adsb.reading.files import open_source
from multiradar_converters.adsb.reading.time_forms import of_day
from multiradar_converters.vid.text.times import LATE_S

Numbers = NDArray[np.float64]
Words = NDArray[np.int64]

_DAY_S = 86_400.0
_BIN_S = 60.0
_BINS = 1440


class DayClock:
    """Converts the times of a file, in file order, to times of the recording.

    Parameters
    ----------
    by_flight : bool
        Whether the parts are those of aircraft, not the file.
    moved_s : float64[p]
        What to add to the times of each part, s.
    """

    def __init__(self, by_flight: bool, moved_s: Numbers) -> None:
        self._parts: _Parts = _Flights() if by_flight else _Whole()
        self._moved_s = moved_s

    def push(self, batch: Batch) -> None:
        """Change the times of reports in place."""
        part, time_s = self._parts.push(batch)
        batch.numbers[roles.TIME] = time_s + self._moved_s[part]


def day_clocks(files: Sequence[Path], utc_offset_s: float = 0.0) -> list[DayClock | None]:
    """Read files and determine the days of their times.

    Parameters
    ----------
    files : sequence of Path
        All files of the recording.
    utc_offset_s : float
        As of `open_source`.

    Returns
    -------
    list of DayClock or None
        None for a file with dates.

    Raises
    ------
    LayoutError
        A file cannot be read, or its form is unknown.
    """
    surveys = [_surveyed(path, utc_offset_s) for path in files]
    known = [one for one in surveys if one is not None]
    first_s = np.concatenate([np.empty(0), *(one.first_s for one in known)])
    last_s = np.concatenate([np.empty(0), *(one.last_s for one in known)])
    ordered = all(isinstance(one, _Whole) for one in known)
    moved_s = _in_order(first_s, last_s) if ordered else None
    moved_s = _by_hours(first_s, last_s) if moved_s is None else moved_s
    ends = np.cumsum([len(one.first_s) for one in known])
    parts = iter(np.split(moved_s, ends[:-1]))
    return [
        None if one is None else DayClock(isinstance(one, _Flights), next(parts)) for one in surveys
    ]


def _surveyed(path: Path, utc_offset_s: float) -> "_Parts | None":
    """Return the parts of a file; None if it has dates."""
    source = open_source(path, lambda _: None, utc_offset_s)
    if not of_day(source.layout.time):
        return None
    whole, flights = _Whole(), _Flights()
    for batch in source.batches:
        whole.push(batch)
        flights.push(batch)
    return whole if whole.ordered else flights


def _in_order(first_s: Numbers, last_s: Numbers) -> Numbers | None:
    """Place parts that follow one another; None if they do not."""
    moved_s = np.zeros(len(first_s))
    for k in range(len(first_s)):
        moved_s[k] = -_DAY_S * np.floor(min(first_s[k], 0.0) / _DAY_S)
        if k:
            before_s = last_s[k - 1] + moved_s[k - 1]
            moved_s[k] = _DAY_S * np.round((before_s - first_s[k]) / _DAY_S)
            if abs(first_s[k] + moved_s[k] - before_s) > LATE_S:
                return None
    return moved_s


def _by_hours(first_s: Numbers, last_s: Numbers) -> Numbers:
    """Place parts by the hours of the day at which the fewest are under way."""
    moved_s = -_DAY_S * np.floor(np.minimum(first_s, 0.0) / _DAY_S)
    first_s, last_s = first_s + moved_s, last_s + moved_s
    over = last_s >= _DAY_S
    if not over.any():
        return moved_s
    begin = np.floor(first_s / _BIN_S).astype(np.int64)
    count = np.minimum(np.floor(last_s / _BIN_S).astype(np.int64) - begin + 1, _BINS)
    changes = np.zeros(2 * _BINS + 1, dtype=np.int64)
    np.add.at(changes, begin % _BINS, 1)
    np.add.at(changes, begin % _BINS + count, -1)
    under_way = np.cumsum(changes[:-1]).reshape(2, _BINS).sum(axis=0)
    fewest = np.flatnonzero(under_way == under_way.min())
    # The end of the longest run of such bins, which may go on past midnight.
    edges = np.flatnonzero(np.diff(np.append(fewest, fewest[0] + _BINS)) > 1)
    lengths = np.diff(np.append(edges[-1] - len(fewest), edges)) if len(edges) else np.array([0])
    end = fewest[edges[int(np.argmax(lengths))]] + 1 if len(edges) else 0
    return moved_s + _DAY_S * (~over & (first_s < end * _BIN_S))


def _steps(time_s: Numbers, before_s: Numbers) -> tuple[Numbers, Numbers]:
    """Return the steps from times of day to the nearest ones after, s, and the days passed."""
    step_s = time_s - before_s
    days = -np.round(step_s / _DAY_S)
    return step_s + days * _DAY_S, days


class _Whole:
    """A file as one part."""

    def __init__(self) -> None:
        self.ordered = True
        self.first_s, self.last_s = np.empty(0), np.empty(0)
        self._time_s, self._day = np.nan, 0.0

    def push(self, batch: Batch) -> tuple[Words, Numbers]:
        """Return the part and the continued time of each report."""
        time_s = batch.numbers[roles.TIME].copy()
        part = np.zeros(len(time_s), dtype=np.int64)
        if not len(time_s):
            return part, time_s
        step_s, days = _steps(time_s, np.append(self._time_s, time_s[:-1]))
        self.ordered &= not (step_s < -LATE_S).any()
        passed = self._day + np.cumsum(np.nan_to_num(days))
        self._time_s, self._day = float(time_s[-1]), float(passed[-1])
        time_s += passed * _DAY_S
        self.first_s = np.append(self.first_s, time_s).min(keepdims=True)
        self.last_s = np.append(self.last_s, time_s).max(keepdims=True)
        return part, time_s


class _Flights:
    """The reports of each aircraft in a file, as long as they are at most an hour apart."""

    def __init__(self) -> None:
        self.first_s, self.last_s = np.empty(0), np.empty(0)
        # Last time of day, day and part of each aircraft.
        self._last: dict[int, tuple[float, float, int]] = {}

    def push(self, batch: Batch) -> tuple[Words, Numbers]:
        """Return the part and the continued time of each report."""
        address = batch.words[roles.ADDRESS - roles.FIRST_WORD]
        order = np.argsort(address, kind="stable")
        address, time_s = address[order], batch.numbers[roles.TIME][order]
        begins = np.flatnonzero(np.append(True, address[1:] != address[:-1])[: len(address)])
        ends = np.append(begins[1:], len(address))[: len(begins)]
        known = [self._last.get(one, (np.nan, 0.0, -1)) for one in address[begins].tolist()]
        before_s = np.append(np.nan, time_s[:-1])[: len(time_s)]
        before_s[begins] = [one for one, _, _ in known]
        step_s, days = _steps(time_s, before_s)
        new = ~(np.abs(step_s) <= LATE_S)
        days[new] = 0.0
        part = len(self.first_s) - 1 + np.cumsum(new)
        # Days passed since the first report of the aircraft here, or of the part.
        passed = np.cumsum(days)
        base = np.where(new, passed, np.nan)
        goes_on = ~new[begins]
        base[begins[goes_on]] = (passed - days)[begins[goes_on]] - np.array(
            [day for _, day, _ in known]
        )[goes_on]
        start = np.maximum.accumulate(np.where(np.isnan(base), -1, np.arange(len(base))))
        passed -= base[start]
        first_new = np.append(np.flatnonzero(new), len(new))
        for begin, end, (_, _, before) in zip(
            begins[goes_on].tolist(),
            ends[goes_on].tolist(),
            [one for one, own in zip(known, goes_on.tolist(), strict=True) if own],
            strict=True,
        ):
            part[begin : min(end, first_new[np.searchsorted(first_new, begin)])] = before
        for at, place in zip(address[begins].tolist(), (ends - 1).tolist(), strict=True):
            self._last[at] = (float(time_s[place]), float(passed[place]), int(part[place]))
        time_s = time_s + passed * _DAY_S
        more = int(new.sum())
        self.first_s = np.append(self.first_s, np.full(more, np.inf))
        self.last_s = np.append(self.last_s, np.full(more, -np.inf))
        np.minimum.at(self.first_s, part, time_s)
        np.maximum.at(self.last_s, part, time_s)
        back = np.empty(len(order), dtype=np.int64)
        back[order] = np.arange(len(order))
        return part[back], time_s[back]


_Parts = _Whole | _Flights
