"""Days of times without a date, from all files of a recording.

A file in order of time, in which no time is more than an hour before the previous one, is one part
of the recording, and continues past midnight; wrong times of a few reports, which return at once,
do not matter. In a file by aircraft or flight, the reports of an aircraft are a part as long as
they are at most an hour apart. Parts are placed as follows.

========================================= =========================================================
the parts                                 start
========================================= =========================================================
continue past 86 400 s in any file        as they are
are files in order of time, each within   as they follow one another
an hour of the end of the previous one
do not pass midnight                      on the first day
other                                     on the first day if they pass midnight or start after the
                                          hours of the day at which the fewest of them are under
                                          way, else on the second one
========================================= =========================================================

Files whose aircraft are at the same places in the same minutes are of the same hours. A file whose
aircraft are elsewhere in the same minutes than in a previous file is of a later day.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from multiradar_converters.adsb.day_comparison import Sample, compared
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
# Times of which the median is that of the file.
_WINDOW = 5
_MOVED = (
    "{}: placed on a later day than {}, because in the same minutes the aircraft of both are at "
    "different places; if the files are of the same day, convert them separately"
)


class DayClock:
    """Converts the times of a file, in file order, to times of the recording.

    Parameters
    ----------
    parts : Parts
        Divides the file into parts; new.
    moved_s : float64[p]
        What to add to the times of each part, s.
    first_day : int
        Day of the recording on which the file starts.
    note : str
        Why it is on a later day than another file; empty if it is not.
    """

    def __init__(
        self, parts: "Parts", moved_s: Numbers, first_day: int = 0, note: str = ""
    ) -> None:
        self._parts, self._moved_s = parts, moved_s
        self.first_day, self.note = first_day, note

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
    known = [one for one in surveys if one is not None and len(one.first_s)]
    if any(one.parts is _Continued for one in known) or not _placed_in_order(known):
        _place_by_hours(known)
    for number, one in enumerate(known):
        one.keep_apart(known[:number])
    # No file starts before the first day.
    first_day = min([0, *(one.first_day for one in known)])
    return [
        None
        if one is None
        else DayClock(
            one.parts(), one.moved_s - first_day * _DAY_S, one.first_day - first_day, one.note
        )
        for one in surveys
    ]


def _surveyed(path: Path, utc_offset_s: float) -> "_File | None":
    """Return a file, not yet placed; None if it has dates."""
    source = open_source(path, lambda _: None, utc_offset_s)
    if not of_day(source.layout.time):
        return None
    forms: list[Parts] = [_Continued(), _Whole(), Flights()]
    sample = Sample()
    orders = [_Order(), _Order()]
    flights = _Extents()
    for batch in source.batches:
        address = batch.words[roles.ADDRESS - roles.FIRST_WORD]
        place_deg = batch.numbers[[roles.LATITUDE, roles.LONGITUDE]]
        parts = [form.push(batch) for form in forms]
        times_s = np.stack([time_s for _, time_s in parts])
        sample.push(address, times_s, place_deg, parts[-1][0])
        for order, (_, time_s) in zip(orders, parts[:2], strict=True):
            order.push(time_s)
        flights.push(*parts[2])
    for order in orders:
        order.finish()
    chosen = 0 if orders[0].last_s >= _DAY_S else 1 if orders[1].ordered else 2
    sample.choose(chosen, in_parts=chosen == 2)
    if chosen < 2 and len(flights.first_s):
        order = orders[chosen]
        first_s, last_s = np.array([order.first_s]), np.array([order.last_s])
    else:
        first_s, last_s = flights.first_s, flights.last_s
    return _File(path.name, type(forms[chosen]), first_s, last_s, sample)


class _File:
    """A file and the days of its parts.

    Attributes
    ----------
    name : str
        Its name.
    parts : type
        How its times are divided into parts.
    first_s, last_s : float64[p]
        First and last time of each part, s.
    moved_s : float64[p]
        What to add to them, s.
    note : str
        Why it is on a later day than another file.
    """

    def __init__(
        self,
        name: str,
        parts: type["Parts"],
        first_s: Numbers,
        last_s: Numbers,
        sample: Sample,
    ) -> None:
        self.name, self.parts = name, parts
        self.first_s, self.last_s = first_s, last_s
        # The part of a file that starts before midnight in disorder starts on the day before.
        self.moved_s = -_DAY_S * np.floor(np.minimum(first_s, 0.0) / _DAY_S)
        self.note = ""
        self._sample = sample

    @property
    def start_s(self) -> float:
        """First time in the recording, s."""
        return float((self.first_s + self.moved_s).min())

    @property
    def end_s(self) -> float:
        """Last time in the recording, s."""
        return float((self.last_s + self.moved_s).max())

    @property
    def first_day(self) -> int:
        """Day of the recording on which the file starts."""
        return int(self.start_s // _DAY_S) if len(self.first_s) else 0

    def agrees(self, others: Sequence["_File"]) -> bool:
        """Move the file by the days after which it has the aircraft of another one, if any."""
        for other in reversed(others):
            reports = other._sample.moving(other.moved_s)
            least = math.ceil((other.start_s - self.end_s) / _DAY_S)
            for day in range(least, int((other.end_s - self.start_s) // _DAY_S) + 1):
                moved_s = self.moved_s + day * _DAY_S
                if compared(self._sample.moving(moved_s), reports) > 0:
                    self.moved_s = moved_s
                    return True
        return False

    def keep_apart(self, others: Sequence["_File"]) -> None:
        """Move the file to the day of the same aircraft, or from that of other ones."""
        if self.agrees(others):
            return
        while against := [one for one in others if self._contradicts(one)]:
            self.note = self.note or _MOVED.format(self.name, against[-1].name)
            self.moved_s = self.moved_s + _DAY_S

    def _contradicts(self, other: "_File") -> bool:
        if min(self.end_s, other.end_s) < max(self.start_s, other.start_s):
            return False
        own, others = (one._sample.moving(one.moved_s) for one in (self, other))
        return compared(own, others) < 0


def _placed_in_order(files: Sequence[_File]) -> bool:
    """Place files that follow one another; return whether they do."""
    placed = [one.moved_s for one in files]
    for number, one in enumerate(files):
        follows = one.parts is _Whole
        if number and follows and not one.agrees(files[:number]):
            end_s = files[number - 1].end_s
            one.moved_s = one.moved_s + _DAY_S * np.round((end_s - one.start_s) / _DAY_S)
            follows = abs(one.start_s - end_s) <= LATE_S
        if not follows:
            for other, moved_s in zip(files, placed, strict=True):
                other.moved_s = moved_s
            return False
    return True


def _place_by_hours(files: Sequence[_File]) -> None:
    """Place the parts of files by the hours of the day, unless they continue past 86 400 s."""
    if any(one.parts is _Continued for one in files):
        return
    first_s, last_s = (
        np.concatenate([np.empty(0), *parts])
        for parts in (
            [one.first_s + one.moved_s for one in files],
            [one.last_s + one.moved_s for one in files],
        )
    )
    ends = np.cumsum([len(one.first_s) for one in files])
    for one, moved_s in zip(files, np.split(_by_hours(first_s, last_s), ends[:-1]), strict=True):
        one.moved_s = one.moved_s + moved_s


def _by_hours(first_s: Numbers, last_s: Numbers) -> Numbers:
    """Return what to add by the hours of the day at which the fewest parts are under way, s."""
    over = last_s >= _DAY_S
    if not over.any():
        return np.zeros(len(first_s))
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
    return np.where(~over & (first_s < end * _BIN_S), _DAY_S, 0.0)


def _days_passed(time_s: Numbers, before_s: Numbers) -> Numbers:
    """Return the days passed from times of day before to the nearest ones after."""
    days: Numbers = -np.round((time_s - before_s) / _DAY_S)
    return days


class _Order:
    """Medians of five consecutive times, which are those of a file in order without wrong ones.

    Attributes
    ----------
    ordered : bool
        Whether none is more than an hour before the previous one.
    first_s, last_s : float
        First and last time at most an hour from its median, s.
    """

    def __init__(self) -> None:
        self.ordered = True
        self.first_s, self.last_s = math.inf, -math.inf
        self._held, self._last_s = np.empty(0), np.nan

    def push(self, time_s: Numbers) -> None:
        """Add times, s."""
        if not len(self._held) and len(time_s):
            self._held = np.full(2, np.median(time_s[:3]))
        held = np.append(self._held, time_s)
        self._held = held[-4:]
        if len(held) < _WINDOW:
            return
        medians = np.sort(sliding_window_view(held, _WINDOW), axis=1)[:, 2]
        self.ordered &= not (np.diff(np.append(self._last_s, medians)) < -LATE_S).any()
        self._last_s = float(medians[-1])
        own = held[2:-2]
        near_s = np.where(np.abs(own - medians) <= LATE_S, own, medians)
        self.first_s = min(self.first_s, float(near_s.min()))
        self.last_s = max(self.last_s, float(near_s.max()))

    def finish(self) -> None:
        """Add the last times."""
        if len(self._held):
            self.push(np.full(2, np.median(self._held[-3:])))


class _Extents:
    """First and last time of each part, s."""

    def __init__(self) -> None:
        self.first_s, self.last_s = np.empty(0), np.empty(0)

    def push(self, part: Words, time_s: Numbers) -> None:
        """Add reports."""
        more = max(0, int(part.max(initial=-1)) + 1 - len(self.first_s))
        self.first_s = np.append(self.first_s, np.full(more, np.inf))
        self.last_s = np.append(self.last_s, np.full(more, -np.inf))
        np.minimum.at(self.first_s, part, time_s)
        np.maximum.at(self.last_s, part, time_s)


class _Continued:
    """A file whose times continue past 86 400 s as one part."""

    def push(self, batch: Batch) -> tuple[Words, Numbers]:
        """Return the part and the time of each report."""
        time_s = batch.numbers[roles.TIME].copy()
        return np.zeros(len(time_s), dtype=np.int64), time_s


class _Whole:
    """A file as one part."""

    def __init__(self) -> None:
        self._time_s, self._day = np.nan, 0.0

    def push(self, batch: Batch) -> tuple[Words, Numbers]:
        """Return the part and the continued time of each report."""
        time_s = batch.numbers[roles.TIME].copy()
        part = np.zeros(len(time_s), dtype=np.int64)
        if not len(time_s):
            return part, time_s
        days = _days_passed(time_s, np.append(self._time_s, time_s[:-1]))
        passed = self._day + np.cumsum(np.nan_to_num(days))
        self._time_s, self._day = float(time_s[-1]), float(passed[-1])
        return part, time_s + passed * _DAY_S


class Flights:
    """The reports of each aircraft in a file, as long as they are at most an hour apart."""

    def __init__(self) -> None:
        self._count = 0
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
        days = _days_passed(time_s, before_s)
        new = ~(np.abs(time_s - before_s + days * _DAY_S) <= LATE_S)
        days[new] = 0.0
        part = self._count - 1 + np.cumsum(new)
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
        self._count += int(new.sum())
        back = np.empty(len(order), dtype=np.int64)
        back[order] = np.arange(len(order))
        return part[back], time_s[back]


Parts = _Continued | _Whole | Flights
