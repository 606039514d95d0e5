"""Days of the files of a recording: their records have times of day only.

=============================  ====================================================================
a file                         starts
=============================  ====================================================================
with dates (a capture of the   on its date, relative to the first file with a date
original messages)
with records of another file,  on the day of that file: two recorders of the same hours
for more than five minutes
other                          on the day nearest to the hours of the previous file, not before the
                               day on which that one starts, and on which it does not contradict
                               another file: a sensor does not send different records in the same
                               minutes, so files in which it does for more than five minutes are of
                               different days
=============================  ====================================================================
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.decoding.gathering import SENSOR_STATUS, SYSTEM_TRACKS, Gathered
from multiradar_converters.asterix.decoding.timing import FileDays, Timed
from multiradar_converters.asterix.layout import _block_kernels
from multiradar_converters.asterix.layout.columns import Flags, Integers, Numbers

#: Times of reception from which a recorder knows the date, s.
DATED_FROM_S = 366 * 86_400.0
#: Maximum median difference between reception and time of day of a file with dates, s: one that was
#: replayed and captured has others.
LATENCY_MAX_S = 600.0
#: Duration of a bin in which files are compared, s: at least this, and at most a fraction of their
#: common hours.
BIN_S, BINS = 60.0, 100
#: Bins with records of the same sensor in both files from which on they are of the same or of
#: different hours; files that follow one another share fewer.
BINS_MIN = 5
#: Ratio of the numbers of records of a sensor in a bin, at most, in files of the same hours.
RATIO_MAX = 10.0
#: Fraction of equal records from which on files are of the same hours; those of different days have
#: none, and recorders lose some.
EQUAL_MIN = 0.1
#: Records of a file that are compared, at most: those whose hash is a multiple of a power of two.
SAMPLE_MAX = 1 << 16

_MOVED = (
    "{}: placed on a later day than {}, because at the same times of day both contain records of "
    "the same sensors, but different ones; if the files are of the same day, convert them "
    "separately"
)
_DAY_S = 86_400.0
# Numbers of bins; more than a recording has.
_BINS_MAX = 1 << 32


@dataclass(frozen=True)
class FileTimes:
    """Times of the records of a file or of a part of it.

    Attributes
    ----------
    time_s, received_s : float64[n]
        Time, and time of reception (NaN: none), s.
    stream, record : int64[n]
        Source and category, and hash of the octets.
    """

    time_s: Numbers
    received_s: Numbers
    stream: Integers
    record: Integers

    def select(self, own: Flags) -> "FileTimes":
        """Return some of the records."""
        return FileTimes(self.time_s[own], self.received_s[own], self.stream[own], self.record[own])


def file_times(gathered: Gathered, timed: Timed | None, days: FileDays) -> FileTimes:
    """Return the times of all records of a file.

    Parameters
    ----------
    gathered : Gathered
        The file.
    timed : Timed or None
        Its target reports.
    days : FileDays
        The times of its records.

    Returns
    -------
    FileTimes
        Of the records with a time.
    """
    parts = []
    if timed is not None:
        stream = timed.rows.source * 256 + timed.targets.category
        whole = FileTimes(days.time_s, timed.rows.received_s, stream, timed.same)
        parts.append(whole.select(days.kept))
    others = [
        *((SYSTEM_TRACKS, rows) for rows, _ in gathered.tracks),
        *((SENSOR_STATUS, rows) for rows, _ in gathered.status),
    ]
    for (category, rows), time_s in zip(others, days.tracks_s + days.status_s, strict=True):
        record = np.empty(len(time_s), dtype=np.int64)
        _block_kernels.hash_records(gathered.blocks.data, rows.begin, rows.end, record)
        whole = FileTimes(time_s, rows.received_s, rows.source * 256 + category, record)
        parts.append(whole.select(~np.isnan(time_s)))
    return joined_times(parts)


def joined_times(parts: Sequence[FileTimes]) -> FileTimes:
    """Return the records of the parts of a file."""
    number, whole = np.empty(0), np.empty(0, dtype=np.int64)
    return FileTimes(
        np.concatenate([number, *(one.time_s for one in parts)]),
        np.concatenate([number, *(one.received_s for one in parts)]),
        np.concatenate([whole, *(one.stream for one in parts)]),
        np.concatenate([whole, *(one.record for one in parts)]),
    )


class FileOrder:
    """Adds files in the order in which they were given.

    Attributes
    ----------
    exchanged : list of (str, str)
        Files that end before the file given before them starts, and that file.
    moved : list of str
        Files placed on a later day because they contradict another file, with the reason.
    """

    def __init__(self) -> None:
        self.exchanged: list[tuple[str, str]] = []
        self.moved: list[str] = []
        self._placed: list[_Placed] = []
        # Unix day of the first day, NaN if unknown.
        self._first_day = math.nan

    def needs_all(self, part: FileTimes) -> bool:
        """Return whether only all records of a file, not its first ones, determine its day."""
        if not len(part.time_s) or not self._placed:
            return False
        if not math.isnan(_date(part) + self._first_day):
            return False
        start_s = float(part.time_s.min())
        return any(
            one.start_s - 0.5 * _DAY_S < start_s + day_s < one.end_s - BIN_S
            for one in self._placed
            for day_s in self._days_s()
        )

    def add(self, file: str, times: FileTimes) -> float:
        """Return what to add to the times of a file, s: whole days.

        Parameters
        ----------
        file : str
            Its name.
        times : FileTimes
            All its records, or its first ones if `needs_all` is false and `extend` follows.
        """
        if not len(times.time_s):
            return self._placed[-1].moved_s if self._placed else 0.0
        new, date = _Placed(file, times), _date(times)
        if not math.isnan(date + self._first_day):
            new.moved_s = (date - self._first_day) * _DAY_S
        elif self._placed:
            self._place(new)
        if math.isnan(self._first_day):
            self._first_day = date - new.moved_s / _DAY_S
        if self._placed and new.end_s < self._placed[-1].start_s:
            self.exchanged.append((file, self._placed[-1].file))
        self._placed.append(new)
        return new.moved_s

    def extend(self, times: FileTimes) -> None:
        """Add further records of the last file."""
        if len(times.time_s) and self._placed:
            self._placed[-1].extend(times)

    def _days_s(self) -> list[float]:
        """Return the days on which a file without a date may start, s."""
        first = min(0.0, *(one.moved_s for one in self._placed))
        last = max(one.end_s for one in self._placed)
        return [first + _DAY_S * k for k in range(int((last - first) // _DAY_S) + 2)]

    def _place(self, new: "_Placed") -> None:
        for day_s in self._days_s():
            new.moved_s = day_s
            if any(new.compared(one) > 0 for one in self._placed):
                return
        previous = self._placed[-1]

        def away_s(day_s: float) -> float:
            start_s = new.first_s + day_s
            return max(previous.start_s - start_s, start_s - previous.end_s, 0.0)

        days_s = [day_s for day_s in self._days_s() if day_s >= previous.moved_s]
        new.moved_s = min(days_s, key=away_s)
        against = [one for one in self._placed if new.compared(one) < 0]
        if against:
            self.moved.append(_MOVED.format(new.file, against[-1].file))
        while any(new.compared(one) < 0 for one in self._placed):
            new.moved_s += _DAY_S


class _Placed:
    """A file with its day."""

    def __init__(self, file: str, times: FileTimes) -> None:
        self.file = file
        self.moved_s = 0.0
        self.first_s, self.last_s = math.inf, -math.inf
        self._sample, self._step = joined_times([]), 1
        self.extend(times)

    @property
    def start_s(self) -> float:
        """First time in the recording, s."""
        return self.first_s + self.moved_s

    @property
    def end_s(self) -> float:
        """Last time in the recording, s."""
        return self.last_s + self.moved_s

    def extend(self, times: FileTimes) -> None:
        """Add records."""
        self.first_s = min(self.first_s, float(times.time_s.min()))
        self.last_s = max(self.last_s, float(times.time_s.max()))
        self._sample = joined_times([self._sample, times.select(times.record % self._step == 0)])
        while len(self._sample.time_s) > SAMPLE_MAX:
            self._step *= 2
            self._sample = self._sample.select(self._sample.record % self._step == 0)

    def compared(self, other: "_Placed") -> int:
        """Return 1 if another file has the same records in the same bins, -1 if others, else 0."""
        common_s = min(self.end_s, other.end_s) - max(self.start_s, other.start_s)
        if common_s < BIN_S:
            return 0
        step, bin_s = max(self._step, other._step), max(BIN_S, common_s / BINS)
        own, cells = self._in_cells(step, bin_s)
        others, other_cells = other._in_cells(step, bin_s)
        found, counts = np.unique(cells, return_counts=True)
        other_found, other_counts = np.unique(other_cells, return_counts=True)
        common, at, other_at = np.intersect1d(found, other_found, True, True)
        more = np.maximum(counts[at], other_counts[other_at])
        less = np.minimum(counts[at], other_counts[other_at])
        common = common[more <= RATIO_MAX * less]
        if len(np.unique(common % _BINS_MAX)) < BINS_MIN:
            return 0
        records = np.unique(own[np.isin(cells, common)])
        other_records = np.unique(others[np.isin(other_cells, common)])
        equal = len(np.intersect1d(records, other_records, assume_unique=True))
        return 1 if equal >= EQUAL_MIN * min(len(records), len(other_records)) else -1

    def _in_cells(self, step: int, bin_s: float) -> tuple[Integers, Integers]:
        """Return the records of the sample, and the sensor and bin of each."""
        sample = self._sample.select(self._sample.record % step == 0)
        bins: NDArray[np.int64] = np.floor((sample.time_s + self.moved_s) / bin_s).astype(np.int64)
        return sample.record, sample.stream * _BINS_MAX + bins % _BINS_MAX


def _date(times: FileTimes) -> float:
    """Return the Unix day on which the times of a file start; NaN if unknown."""
    apart_s = times.received_s - times.time_s
    apart_s = apart_s[np.isfinite(apart_s)]
    if not len(apart_s) or np.median(apart_s) < DATED_FROM_S:
        return math.nan
    day = round(float(np.median(apart_s)) / _DAY_S)
    return day if abs(np.median(apart_s) - day * _DAY_S) <= LATENCY_MAX_S else math.nan
