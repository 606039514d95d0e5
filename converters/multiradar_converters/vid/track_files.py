"""Track files of each aircraft: points partitioned into buckets, each bucket sorted and written.

A bucket that fits is sorted in memory. A larger one is partitioned again; one with a single huge
track is sorted on disk. So memory does not depend on the number or length of tracks.
"""

import math
import os
from collections import Counter, deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.track_text import new4, plt
from multiradar_converters.vid import _kernels
from multiradar_converters.vid.numbering import Numbering
from multiradar_converters.vid.records import (
    POINT_WORDS,
    Records,
    aircraft_of,
    split_track,
    times,
)
from multiradar_converters.vid.spool import Buckets, TimeSorter, partition

#: Maximum points sorted in memory, per thread.
BUCKET_POINTS_MAX = 400_000

#: Target number of points of a bucket.
BUCKET_POINTS = 300_000

_BITS_MAX = 7
_BITS_AGAIN = 4
_REPARTITIONS_MAX = 6
_LINES_AT_ONCE = 1 << 15


@dataclass(frozen=True)
class TrackFileNames:
    """Numbers and names of the files of an aircraft: 0 is `ads`, then two per source."""

    sources: tuple[int, ...]

    def stem(self, file: int) -> str:
        """Return the name without extension, such as `41_mr`."""
        if file == 0:
            return "ads"
        place, plots = divmod(file - 1, 2)
        return f"{self.sources[place]}_{'r' if plots else 'mr'}"


def monoradar_file(source: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the file of track rows of sources, by number (not by the name in the dump)."""
    return 1 + 2 * source


def plots_file(source: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the file of plots of sources, by number."""
    return 2 + 2 * source


@dataclass
class Written:
    """Counts of tracks written and skipped."""

    tracks: Counter[str] = field(default_factory=Counter)
    points: Counter[str] = field(default_factory=Counter)
    short_tracks: Counter[str] = field(default_factory=Counter)
    short_points: Counter[str] = field(default_factory=Counter)

    def add(self, other: "Written") -> None:
        """Add the counts of another part."""
        for mine, others in (
            (self.tracks, other.tracks),
            (self.points, other.points),
            (self.short_tracks, other.short_tracks),
            (self.short_points, other.short_points),
        ):
            mine.update(others)


@dataclass(frozen=True)
class TrackWriter:
    """Writes the files of aircraft.

    Attributes
    ----------
    folder : Path
        Parent of the folders of aircraft.
    names : TrackFileNames
        Names of the files.
    measurements_min : int
        Minimum number of points of a track.
    unix_start_s : float
        Added to times to give Unix time (for `.plt`).
    chosen : int64[a] or None
        Aircraft to write, in order; None for all.
    points_max : int
        Maximum points sorted in memory.
    """

    folder: Path
    names: TrackFileNames
    measurements_min: int
    unix_start_s: float
    chosen: NDArray[np.int64] | None = None
    points_max: int = BUCKET_POINTS_MAX

    def write(
        self, buckets: Buckets, pool: Executor, done: Callable[[], None] = lambda: None
    ) -> Written:
        """Write all tracks of closed buckets, which are emptied; call `done` after each."""
        total = Written()
        for part in pool.map(self._spooled, buckets.paths):
            total.add(part)
            done()
        return total

    def _spooled(self, path: Path, depth: int = 0) -> Written:
        written = Written()
        count = path.stat().st_size // (POINT_WORDS * 8)
        if count == 0:
            path.unlink()
        elif count <= self.points_max:
            points = self._selected(np.fromfile(path, dtype=np.int64).reshape(-1, POINT_WORDS))
            path.unlink()
            self._in_memory(points, written)
        elif depth < _REPARTITIONS_MAX:
            self._repartitioned(path, depth, written)
        else:
            self._single(path, written)
        return written

    def _selected(self, points: Records) -> Records:
        if self.chosen is None:
            return points
        return points[np.isin(aircraft_of(points[:, 4]), self.chosen)]

    def _in_memory(self, points: Records, written: Written) -> None:
        numbering = Numbering("tracks", len(points) + 1)
        places = numbering.number(np.ascontiguousarray(points[:, 4]))
        tracks = numbering.keys()
        points, ends = partition(points, places, len(tracks))
        begin = 0
        for track, end in zip(tracks.tolist(), ends.tolist(), strict=True):
            part = points[begin:end]
            begin = end
            if not _kernels.is_sorted(times(part)):
                part = part[np.argsort(times(part), kind="stable")]
            self._track(track, len(part), iter((part,)), written)

    def _repartitioned(self, path: Path, depth: int, written: Written) -> None:
        """Partition a bucket into smaller ones; the salt separates keys that shared a bin."""
        again = Buckets(path.with_name(f"{path.name}-{depth}"), _BITS_AGAIN, salt=1 + depth)
        for points in _read(path):
            again.add(points)
        again.close()
        path.unlink()
        for part in again.paths:
            written.add(self._spooled(part, _REPARTITIONS_MAX if _alone(part) else depth + 1))
        path.with_name(f"{path.name}-{depth}").rmdir()

    def _single(self, path: Path, written: Written) -> None:
        """Write tracks one of which is too long for memory."""
        tracks: Counter[int] = Counter()
        for points in map(self._selected, _read(path)):
            values, counts = np.unique(points[:, 4], return_counts=True)
            tracks.update(dict(zip(values.tolist(), counts.tolist(), strict=True)))
        for number, (track, length) in enumerate(sorted(tracks.items())):
            sorter = TimeSorter(path.with_name(f"{path.name}-s{number}"), POINT_WORDS)
            for points in _read(path):
                sorter.add(points[points[:, 4] == track])
            self._track(track, length, sorter.sorted(), written)
        path.unlink()

    def _track(self, track: int, length: int, parts: Iterator[Records], written: Written) -> None:
        aircraft, file = split_track(track)
        stem = self.names.stem(file)
        if length < self.measurements_min:
            written.short_tracks[stem] += 1
            written.short_points[stem] += length
            deque(parts, maxlen=0)
            return
        written.tracks[stem] += 1
        written.points[stem] += length
        # System calls: there may be hundreds of thousands of files.
        path = f"{self.folder}/{aircraft}"
        with suppress(FileExistsError):
            os.mkdir(path)
        colour = plt.COLOURS[stem.rpartition("_")[2]]
        header = plt.format_header(f"{aircraft} {stem}", length, colour)
        with (
            open(f"{path}/{stem}.new4", "xb", buffering=0) as new4_file,
            open(f"{path}/{stem}.plt", "xb", buffering=0) as plt_file,
        ):
            before = math.nan
            for part in parts:
                for begin in range(0, len(part), _LINES_AT_ONCE):
                    points = part[begin : begin + _LINES_AT_ONCE].view(np.float64)
                    new4_file.write(new4.format_lines(points))
                    plt_file.write(header + plt.format_points(points, self.unix_start_s, before))
                    header = b""
                    before = float(points[-1, 0]) + self.unix_start_s


def bucket_bits(input_bytes: int) -> int:
    """Return the number of bits of buckets for a dump of given size."""
    # A line of a dump is some 60 bytes, and nearly every line becomes a point.
    buckets = input_bytes // (60 * BUCKET_POINTS) + 1
    return min(_BITS_MAX, buckets.bit_length())


def _alone(path: Path) -> bool:
    """Return whether all points of a bucket belong to one track."""
    tracks = {int(value) for points in _read(path) for value in np.unique(points[:, 4])[:2]}
    return len(tracks) <= 1


def _read(path: Path) -> Iterator[Records]:
    with path.open("rb", buffering=0) as file:
        while data := file.read(POINT_WORDS * 8 * (1 << 16)):
            yield np.frombuffer(bytearray(data), dtype=np.int64).reshape(-1, POINT_WORDS)
