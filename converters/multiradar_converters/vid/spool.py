"""Records on disk between passes: sorted by time, or partitioned into buckets."""

import io
import itertools
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.vid import _kernels
from multiradar_converters.vid.records import Records, times

#: Records sorted in memory, per sorter.
RUN_RECORDS = 1 << 18

#: Memory of a merge, bytes: pieces of all runs that overlap in time.
_MERGE_BYTES = 24 << 20
_PIECE_RECORDS_MAX = 1 << 16
_PIECE_RECORDS_MIN = 256

_WORD_BYTES = 8


class TimeSorter:
    """Sorts records by time on disk; stable.

    Records are collected into runs, each run is sorted and appended to one file. Runs of a nearly
    ordered input overlap little, so few of them are read at a time.

    Parameters
    ----------
    path : Path
        The working file; deleted at the end.
    words : int
        Words of a record.
    run_records : int
        Records of a run.
    """

    def __init__(self, path: Path, words: int, run_records: int = RUN_RECORDS) -> None:
        self._path = path
        self._words = words
        self._file = path.open("w+b", buffering=0)
        self._waiting = np.empty((run_records, words), dtype=np.int64)
        self._count = 0
        self._runs: list[_Run] = []

    def add(self, records: Records) -> None:
        """Add records."""
        while len(records):
            room = len(self._waiting) - self._count
            taken = records[:room]
            self._waiting[self._count : self._count + len(taken)] = taken
            self._count += len(taken)
            records = records[room:]
            if self._count == len(self._waiting):
                self._close_run()

    def __len__(self) -> int:
        return sum(run.count for run in self._runs) + self._count

    def sorted(self) -> Iterator[Records]:
        """Yield all records by time, in non-empty blocks; then discard them."""
        self._close_run()
        self._waiting = np.empty((0, self._words), dtype=np.int64)
        try:
            yield from self._merged()
        finally:
            self.close()

    def close(self) -> None:
        """Close and delete the file."""
        self._file.close()
        self._path.unlink(missing_ok=True)

    def _close_run(self) -> None:
        if not self._count:
            return
        run = self._waiting[: self._count]
        run_times = times(run)
        if not _kernels.is_sorted(run_times):
            run = run[np.argsort(run_times, kind="stable")]
        offset = self._file.seek(0, os.SEEK_END)
        write_all(self._file.fileno(), run)
        first, last = times(run)[[0, -1]].tolist()
        self._runs.append(_Run(len(self._runs), offset, self._count, first, last))
        self._count = 0

    def _merged(self) -> Iterator[Records]:
        piece = self._piece_records()
        waiting = sorted(self._runs, key=lambda run: (run.first, run.index), reverse=True)
        active: list[_Front] = []
        while waiting or active:
            horizon = min(
                ((front.horizon, front.run.index) for front in active if front.horizon is not None),
                default=(np.inf, -1),
            )
            if waiting and (waiting[-1].first, waiting[-1].index) <= horizon:
                front = _Front(waiting.pop(), self._words)
                front.load(self._file, piece)
                active.append(front)
                active.sort(key=lambda each: each.run.index)
                continue
            block = _join([front.split(horizon) for front in active])
            for front in active:
                if not len(front.records):
                    front.load(self._file, piece)
            active = [front for front in active if len(front.records)]
            if len(block):
                yield block

    def _piece_records(self) -> int:
        """Return the piece of a run to load at a time, so that all overlapping runs fit."""
        ends = [(run.first, 0, 1) for run in self._runs] + [(run.last, 1, -1) for run in self._runs]
        overlap = max(itertools.accumulate(step for _, _, step in sorted(ends)), default=1)
        fitting = _MERGE_BYTES // (overlap * self._words * _WORD_BYTES)
        return max(_PIECE_RECORDS_MIN, min(_PIECE_RECORDS_MAX, fitting))


@dataclass(frozen=True)
class _Run:
    index: int
    offset: int
    count: int
    first: float
    last: float


class _Front:
    """The part of a run in memory."""

    def __init__(self, run: _Run, words: int) -> None:
        self.run = run
        self.records: Records = np.empty((0, words), dtype=np.int64)
        self._words = words
        self._done = 0

    @property
    def horizon(self) -> float | None:
        """Time up to which the run is in memory; None when all of it is."""
        if self._done == self.run.count:
            return None
        return float(times(self.records)[-1])

    def load(self, file: io.FileIO, piece: int) -> None:
        count = min(piece, self.run.count - self._done)
        if count <= 0:
            return
        self.records = np.empty((count, self._words), dtype=np.int64)
        offset = self.run.offset + self._done * self._words * _WORD_BYTES
        read_exactly(file.fileno(), self.records, offset)
        self._done += count

    def split(self, horizon: tuple[float, int]) -> Records:
        """Remove and return the records before (time, index of a run), ordered by time and run."""
        time, index = horizon
        if self.horizon is not None and self.run.index == index:
            cut = len(self.records)
        else:
            side = "right" if self.run.index < index else "left"
            cut = int(np.searchsorted(times(self.records), time, side=side))  # type: ignore[call-overload]  # an exact integer
        taken, self.records = self.records[:cut], self.records[cut:]
        return taken


def _join(parts: list[Records]) -> Records:
    parts = [part for part in parts if len(part)]
    if len(parts) <= 1:
        return parts[0] if parts else np.empty((0, 1), dtype=np.int64)
    block = np.concatenate(parts)
    return block[np.argsort(times(block), kind="stable")]


class Buckets:
    """Partitions records into 2**bits files by their last word; stable.

    Parameters
    ----------
    folder : Path
        Created; the reader of the files deletes them.
    bits : int
        The number of files is 2**bits; all are open at the same time.
    salt : int
        Changes which keys share a file.
    """

    def __init__(self, folder: Path, bits: int, salt: int = 0) -> None:
        folder.mkdir()
        self._folder = folder
        self._bits = bits
        self._salt = salt
        self.paths = [folder / f"{number:03d}" for number in range(1 << bits)]
        self._files = [path.open("wb", buffering=0) for path in self.paths]
        self.counts = np.zeros(1 << bits, dtype=np.int64)

    def add(self, records: Records) -> None:
        """Add records, partitioned by their last word."""
        places = np.empty(len(records), dtype=np.int64)
        _kernels.spread(np.ascontiguousarray(records[:, -1]), self._salt, self._bits, places)
        partitioned, ends = partition(records, places, 1 << self._bits)
        begin = 0
        for number, end in enumerate(ends.tolist()):
            if end > begin:
                write_all(self._files[number].fileno(), partitioned[begin:end])
                self.counts[number] += end - begin
            begin = end

    def close(self) -> None:
        """Close the files."""
        for file in self._files:
            file.close()

    def remove(self) -> None:
        """Remove the folder, whose files have been consumed."""
        self._folder.rmdir()


def partition(
    records: Records, places: NDArray[np.int64], count: int
) -> tuple[Records, NDArray[np.int64]]:
    """Group records by bin; stable.

    Parameters
    ----------
    records : int64[n, w]
        The records.
    places : int64[n]
        Bin of each, 0 <= bin < count.
    count : int
        Number of bins.

    Returns
    -------
    tuple of int64[n, w] and int64[count]
        The records, and the end of each bin among them.
    """
    counts = np.zeros(count, dtype=np.int64)
    _kernels.count_bins(places, counts)
    ends = np.cumsum(counts)
    out = np.empty_like(records)
    _kernels.distribute(records, places, ends - counts, out)
    return out, ends


def write_all(descriptor: int, records: Records) -> None:
    """Write records to an open file."""
    left = np.ascontiguousarray(records).data.cast("B")
    while left:
        left = left[os.write(descriptor, left) :]


def read_exactly(descriptor: int, records: Records, offset: int) -> None:
    """Fill records from an open file.

    Raises
    ------
    OSError
        The file is shorter: another process changed it.
    """
    left = records.data.cast("B")
    while left:
        count = os.preadv(descriptor, [left], offset)
        if count == 0:
            msg = "a temporary file of the conversion is shorter than the data written to it"
            raise OSError(msg)
        left = left[count:]
        offset += count
