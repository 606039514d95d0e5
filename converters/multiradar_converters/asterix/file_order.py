"""Days of the files of a recording: their records have times of day only.

=============================  ====================================================================
a file                         starts
=============================  ====================================================================
with dates (a capture of the   on its date, relative to the first file with a date
original messages)
with records of another file,  on the day of that file: two recorders of the same hours
for more than five minutes
with a sensor of another file  on the day nearest to the hours of the last one, not before the day
                               on which that one starts, and on which it does not contradict another
                               file: a sensor does not send different records in the same minutes,
                               so files in which it does for more than five minutes are of different
                               days
other                          on the day on which it is nearest to the hours of any file, the first
                               one of several
=============================  ====================================================================

Equal records prove the same hours only if they contain their time of day; those of a sensor status
do not, because its phase and content may be those of the previous day.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.decoding.clocks import RECORD, TRUNCATED
from multiradar_converters.asterix.decoding.gathering import SENSOR_STATUS, SYSTEM_TRACKS, Gathered
from multiradar_converters.asterix.decoding.timing import FileDays, Timed
from multiradar_converters.asterix.layout import _block_kernels
from multiradar_converters.asterix.layout.columns import Flags, Integers, Numbers
from multiradar_converters.distinct import distinct

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
#: Fraction of equal records of a sensor in a bin from which on the files are of the same hours, if
#: it is reached in most bins; those of different days have none, and recorders lose some.
EQUAL_MIN = 0.1
#: Fraction of the longest common hours on a day from which on a file may be of another one.
LIKE_MIN = 0.5
#: Records of a file that are compared, at most: those whose hash is a multiple of a power of two.
SAMPLE_MAX = 1 << 16

_MOVED = (
    "{}: placed on a later day than {}, because at the same times of day both contain records of "
    "the same sensors, but different ones; if the files are of the same day, convert them "
    "separately"
)
_DOUBTFUL = (
    "{}: placed on the first of several days with files of the same hours, because no file before "
    "it contains records of the same sensors; if it is of a later day, convert each day separately"
)
_DAY_S = 86_400.0
# Odd constant of xxHash64.
_MIX = np.int64(2870177450012600261)
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
        Source and category, and hash of the octets; negative without a time of day in them.
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
        of_day = np.isin(timed.origin, (RECORD, TRUNCATED))
        record = np.where(of_day, timed.same, ~timed.same)
        whole = FileTimes(days.time_s, timed.rows.received_s, stream, record)
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
        Files that end before the last file before them with a sensor of theirs starts, and that
        file.
    moved : list of str
        Files placed on a later day because they contradict another file, or on the first one of
        several days, with the reason.
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

    def add(self, file: str, windows: Iterable[FileTimes]) -> float:
        """Return what to add to the times of a file, s: whole days.

        Parameters
        ----------
        file : str
            Its name.
        windows : iterable of FileTimes
            All its records, part by part, or its first ones if `needs_all` is false and `extend`
            follows.
        """
        new, date = _Placed(file), math.nan
        for times in windows:
            new.extend(times)
            date = _date(times) if math.isnan(date) else date
        if not new.streams:
            return self._placed[-1].moved_s if self._placed else 0.0
        previous = self._previous(new)
        if not math.isnan(date + self._first_day):
            new.moved_s = (date - self._first_day) * _DAY_S
        elif self._placed:
            self._place(new, previous)
        if math.isnan(self._first_day):
            self._first_day = date - new.moved_s / _DAY_S
        if previous is not None and new.end_s < previous.start_s:
            self.exchanged.append((file, previous.file))
        self._placed.append(new)
        return new.moved_s

    def extend(self, times: FileTimes) -> None:
        """Add further records of the last file."""
        if self._placed:
            self._placed[-1].extend(times)

    def _days_s(self) -> list[float]:
        """Return the days on which a file without a date may start, s."""
        first = min(0.0, *(one.moved_s for one in self._placed))
        last = max(one.end_s for one in self._placed)
        return [first + _DAY_S * k for k in range(int((last - first) // _DAY_S) + 2)]

    def _previous(self, new: "_Placed") -> "_Placed | None":
        """Return the last file with a sensor of a new one."""
        return next((one for one in reversed(self._placed) if one.streams & new.streams), None)

    def _place(self, new: "_Placed", previous: "_Placed | None") -> None:
        days_s = self._days_s()
        for day_s in days_s:
            new.moved_s = day_s
            if any(new.compared(one) > 0 for one in self._placed):
                return
        if previous is None:
            self._place_other(new, days_s)
            return

        def away_s(day_s: float) -> float:
            start_s = new.first_s + day_s
            return max(previous.start_s - start_s, start_s - previous.end_s, 0.0)

        days_s = [day_s for day_s in days_s if day_s >= previous.moved_s]
        new.moved_s = min(days_s, key=away_s)
        against = [one for one in self._placed if new.compared(one) < 0]
        if against:
            self.moved.append(_MOVED.format(new.file, against[-1].file))
        while any(new.compared(one) < 0 for one in self._placed):
            new.moved_s += _DAY_S

    def _place_other(self, new: "_Placed", days_s: list[float]) -> None:
        """Place a file without a sensor of other files on the first day with its hours."""
        apart_s = {day_s: min(new.apart_s(one, day_s) for one in self._placed) for day_s in days_s}
        least_s = min(apart_s.values())
        near_s = [day_s for day_s, one_s in apart_s.items() if one_s <= LIKE_MIN * least_s]
        new.moved_s = min(apart_s, key=lambda day_s: apart_s[day_s])
        if least_s < 0.0:
            new.moved_s = near_s[0]
            if len(near_s) > 1:
                self.moved.append(_DOUBTFUL.format(new.file))


class _Placed:
    """A file with its day."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.moved_s = 0.0
        self.first_s, self.last_s = math.inf, -math.inf
        self.streams: set[int] = set()
        self._sample, self._step = joined_times([]), 1

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
        if not len(times.time_s):
            return
        self.first_s = min(self.first_s, float(times.time_s.min()))
        self.last_s = max(self.last_s, float(times.time_s.max()))
        self.streams.update(distinct(times.stream).tolist())
        own = (times.stream % 256 != SENSOR_STATUS) & (times.record % self._step == 0)
        self._sample = joined_times([self._sample, times.select(own)])
        while len(self._sample.time_s) > SAMPLE_MAX:
            self._step *= 2
            self._sample = self._sample.select(self._sample.record % self._step == 0)

    def apart_s(self, other: "_Placed", moved_s: float) -> float:
        """Return the time between the hours on a day and those of another file, s.

        Negative is the duration of their common hours.
        """
        start_s, end_s = self.first_s + moved_s, self.last_s + moved_s
        return max(other.start_s, start_s) - min(other.end_s, end_s)

    def compared(self, other: "_Placed") -> int:
        """Return 1 if another file has the same records in the same bins, -1 if others, else 0."""
        common_s = min(self.end_s, other.end_s) - max(self.start_s, other.start_s)
        if common_s < BIN_S:
            return 0
        step, bin_s = max(self._step, other._step), max(BIN_S, common_s / BINS)
        own, others = self._in_cells(step, bin_s), other._in_cells(step, bin_s)
        share = _equal_share(own, others)
        if math.isnan(share):
            return 0
        if share < 0.5:
            return -1
        # Other records may recur on other days.
        return int(_equal_share(own[:, own[1] >= 0], others[:, others[1] >= 0]) >= 0.5)

    def _in_cells(self, step: int, bin_s: float) -> Integers:
        """Return the sensor and bin of the records of the sample, and their hashes, int64[2, n]."""
        sample = self._sample.select(self._sample.record % step == 0)
        bins: NDArray[np.int64] = np.floor((sample.time_s + self.moved_s) / bin_s).astype(np.int64)
        return np.stack([sample.stream * _BINS_MAX + bins % _BINS_MAX, sample.record])


def _equal_share(own: Integers, others: Integers) -> float:
    """Return the fraction of common cells with equal records; NaN in less than `BINS_MIN` bins."""
    found, counts = np.unique(own[0], return_counts=True)
    other_found, other_counts = np.unique(others[0], return_counts=True)
    common, at, other_at = np.intersect1d(found, other_found, True, True)
    more = np.maximum(counts[at], other_counts[other_at])
    less = np.minimum(counts[at], other_counts[other_at])
    alike = more <= RATIO_MAX * less
    common, less = common[alike], less[alike]
    if len(np.unique(common % _BINS_MAX)) < BINS_MIN:
        return math.nan
    # Equal records of another bin are of another time.
    _, places, _ = np.intersect1d(own[0] * _MIX ^ own[1], others[0] * _MIX ^ others[1], False, True)
    equal = np.sort(own[0][places])
    counts = np.searchsorted(equal, common, "right") - np.searchsorted(equal, common)
    return float(np.mean(counts >= EQUAL_MIN * less))


def _date(times: FileTimes) -> float:
    """Return the Unix day on which the times of a file start; NaN if unknown."""
    apart_s = times.received_s - times.time_s
    apart_s = apart_s[np.isfinite(apart_s)]
    if not len(apart_s) or np.median(apart_s) < DATED_FROM_S:
        return math.nan
    day = round(float(np.median(apart_s)) / _DAY_S)
    return day if abs(np.median(apart_s) - day * _DAY_S) <= LATENCY_MAX_S else math.nan
