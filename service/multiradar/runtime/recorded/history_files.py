"""The history of a service on disk: a folder for each hour of data time.

An hour reads like the output of `track`, except that each table is a folder of parts::

    2026-11-28T13/tracks.parquet/00000042-0000-0600.parquet

with the number of the write and the first and last second in the hour. `state.json` has the number
of the last complete write, and up to where it got: what a write that did not finish has left is
removed before the next one, so that each row is there once.
"""

import fcntl
import json
import os
import re
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from multiradar.errors import InputError
from multiradar.runtime.memory.set_backs import TrackStep, joined_steps, superseded_from_s
from multiradar.runtime.offline.offline_job import (
    BIASES_FILE,
    HEALTH_FILE,
    TRACKS_FILE,
    TRANSITIONS_FILE,
)
from multiradar.storage.recording import MEASUREMENTS_FILE
from multiradar.storage.sqlite.sqlite_file import sync
from multiradar.storage.table_writer import COMPRESSION_LEVEL

#: The tables of a history.
TABLES = (TRACKS_FILE, TRANSITIONS_FILE, BIASES_FILE, HEALTH_FILE, MEASUREMENTS_FILE)
#: Rows of a row group: what a query of a time reads at least.
BLOCK_ROWS = 16_384
HOUR_S = 3600
DAY_S = 86_400.0
STATE_FILE = "state.json"
_PARTIAL_STATE = f".{STATE_FILE}"
STATE_VERSION = 1
# The history is written as far as these tables are.
_WRITTEN = (TRACKS_FILE, MEASUREMENTS_FILE)
# Longer spans are met by the hours that exist: a span without a begin has 28 million hours.
_NAMED_HOURS_MAX = 24

_HOUR = re.compile(r"-?\d{4,}-\d\d-\d\dT\d\d")
_PART = re.compile(r"(\d{8,})-(\d{4})-(\d{4})\.parquet")
# Parts that are being written: never in the folder of a table, whose files all programs may read.
_STAGE = ".partial"


class Hour(NamedTuple):
    """An hour of the history: its number since 1970, and its folder."""

    number: int
    path: Path


class Part(NamedTuple):
    """A file of a table: the number of its write, and the times it covers, s."""

    write: int
    first_s: float
    last_s: float
    path: Path


@dataclass(frozen=True, slots=True)
class HistoryState:
    """How far a history was written.

    Attributes
    ----------
    write : int
        Number of the last complete write.
    sequence : int
        An entry of the journal that all its rows include.
    digest : str
        Digest of that entry, hexadecimal.
    positions : mapping
        By table, what was written last.
    steps : sequence of TrackStep
        When the data time was set back; see `joined_steps`.
    written_s : mapping
        By table, the time up to which it is written since the last step, s.
    """

    write: int = 0
    sequence: int = 0
    digest: str = ""
    positions: Mapping[str, Any] = field(default_factory=dict)
    steps: Sequence[TrackStep] = ()
    written_s: Mapping[str, float] = field(default_factory=dict)


def hour_name(number: int) -> str:
    """Return the name of the folder of an hour, such as ``2026-11-28T13`` (UTC)."""
    return str(np.datetime64(number, "h"))


def hours_of(folder: Path) -> list[Hour]:
    """Return the hours in a history, oldest first; none where it does not exist."""
    found = []
    with suppress(OSError):
        found = [
            Hour(int(np.datetime64(one.name, "h").astype(np.int64)), one)
            for one in folder.iterdir()
            if _HOUR.fullmatch(one.name)
        ]
    return sorted(found)


def parts_of(hour: Hour, table: str) -> list[Part]:
    """Return the parts of a table in an hour, in the order of writing."""
    begin_s = float(hour.number * HOUR_S)
    found = []
    with suppress(OSError):
        for path in (hour.path / table).iterdir():
            name = _PART.fullmatch(path.name)
            if name is not None:
                number, first, last = (int(one) for one in name.groups())
                found.append(Part(number, begin_s + first, begin_s + last, path))
    return sorted(found)


def parts_between(folder: Path, table: str, after_s: float, until_s: float) -> list[Path]:
    """Return the parts of a table that may have rows of a span of time, by hour and write."""
    first, last = (int(one // HOUR_S) for one in (after_s, until_s))
    if last - first < _NAMED_HOURS_MAX:
        hours = [Hour(one, folder / hour_name(one)) for one in range(first, last + 1)]
    else:
        hours = [one for one in hours_of(folder) if first <= one.number <= last]
    return [
        part.path
        for hour in hours
        for part in parts_of(hour, table)
        if part.last_s >= after_s and part.first_s <= until_s
    ]


def run_tables(tracks: Path) -> dict[str, tuple[Path, ...]]:
    """Return the tables of a run or an hour by their names, each with its file or parts.

    Parameters
    ----------
    tracks : Path
        Its `tracks.parquet`, a file or a folder; of any name, with the other tables beside.
    """
    found = {TRACKS_FILE: _files(tracks)}
    for table in TABLES:
        if table != TRACKS_FILE:
            found[table] = _files(tracks.parent / table)
    return found


def history_tables(folder: Path) -> dict[str, tuple[Path, ...]]:
    """Return the tables of a whole history; none where the folder is none."""
    if not (folder / STATE_FILE).is_file():
        return {}
    hours = [run_tables(hour.path / TRACKS_FILE) for hour in hours_of(folder)]
    return {table: tuple(path for hour in hours for path in hour[table]) for table in TABLES}


def last_hour(folder: Path) -> Path | None:
    """Return the last hour of a history, whose sensors are the present ones; None without."""
    hours = hours_of(folder) if (folder / STATE_FILE).is_file() else []
    return hours[-1].path if hours else None


def _files(table: Path) -> tuple[Path, ...]:
    if table.is_dir():
        return tuple(sorted(table.glob("[0-9]*.parquet")))
    return (table,) if table.is_file() else ()


class HistoryFolder:
    """The folder of a history, for its one writer.

    Parameters
    ----------
    path : Path
        The folder; created when absent, with its parent in place.
    beside : callable
        Returns the further files of a new hour: their contents by name.

    Raises
    ------
    InputError
        It cannot be written, another service writes to it, or it is not a history.
    """

    def __init__(self, path: Path, beside: Callable[[], Mapping[str, bytes]]) -> None:
        self.path = path
        self._beside = beside
        self._dirty = True
        # Whether the state on disk may count a write that failed at the end.
        self._is_ahead = False
        self._octets: dict[int, int] = {}
        #: Earliest time of a track, s; None without any.
        self.oldest_s: float | None = None
        try:
            path.mkdir(exist_ok=True)
            self._lock = os.open(path, os.O_RDONLY)
        except OSError as error:
            raise InputError(f"{path}: cannot write: {error.strerror}") from error
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self.state = read_state(path)
            self._tidy()
            self._octets = {hour.number: _octets(hour.path) for hour in hours_of(path)}
            self._find_oldest()
        except BaseException as error:
            self.close()
            if isinstance(error, BlockingIOError):
                raise InputError(f"{path}: another service is writing this history") from error
            if isinstance(error, OSError):
                raise InputError(f"{path}: cannot write: {error.strerror}") from error
            raise

    @property
    def octets(self) -> int:
        """Size of all parts."""
        return sum(self._octets.values())

    @property
    def written_s(self) -> float | None:
        """Time up to which tracks and measurements are written, s; None without any."""
        found = [self.state.written_s.get(table) for table in _WRITTEN]
        known = [one for one in found if one is not None]
        return min(known) if len(known) == len(found) else None

    def _find_oldest(self) -> None:
        for number in sorted(self._octets):
            hour = Hour(number, self.path / hour_name(number))
            times = [part.first_s for part in parts_of(hour, TRACKS_FILE)]
            if times:
                self.oldest_s = min(times)
                return
        self.oldest_s = None

    def free_octets(self) -> int:
        """Return the free space on its disk."""
        return shutil.disk_usage(self.path).free

    def write(self, tables: Mapping[str, pl.DataFrame], state: HistoryState) -> None:
        """Write rows, all or none of them, and how far they get.

        Parameters
        ----------
        tables : mapping of str to DataFrame
            The rows by the name of their table, with `time_s`.
        state : HistoryState
            The state with them, without its number and times, and with further steps.

        Raises
        ------
        OSError, PolarsError
            They cannot be written, as on a full disk.
        """
        number = self.state.write + 1
        if self._dirty:
            self._tidy()
        self._dirty = True
        try:
            staged = [
                self._stage(table, hour, number, rows)
                for table, frame in tables.items()
                for hour, rows in _by_hour(frame)
            ]
            for hour_path in {path.parent.parent for _, path in staged}:
                self._complete(hour_path)
        except BaseException:
            # On a full disk the journal needs the space.
            shutil.rmtree(self.path / _STAGE, ignore_errors=True)
            raise
        _give_names(staged)
        steps = joined_steps(self.state.steps, state.steps)
        final = HistoryState(
            number, state.sequence, state.digest, state.positions, steps,
            self._reached_s(tables, steps),
        )  # fmt: skip
        try:
            _write_state(self.path, final)
        except BaseException:
            self._is_ahead = _may_count(self.path, number)
            raise
        self.state, self._dirty = final, False
        for _, path in staged:
            hour = _number_of(path.parent.parent)
            self._octets[hour] = self._octets.get(hour, 0) + path.stat().st_size
        self._find_oldest()

    # The time up to which each table is written with these rows.
    def _reached_s(
        self, tables: Mapping[str, pl.DataFrame], steps: Sequence[TrackStep]
    ) -> dict[str, float]:
        new_s = [time_s for last, time_s in steps if (last, time_s) not in self.state.steps]
        found = {table: min([one, *new_s]) for table, one in self.state.written_s.items()}
        for table in _WRITTEN:
            rows = tables.get(table, pl.DataFrame()).tail(1)
            if len(rows):
                found[table] = float(rows["time_s"][0])
            if len(rows) and table == TRACKS_FILE:
                # The step may be known before the first row after it.
                limit_s = superseded_from_s(rows["track_id"].to_numpy(), steps)
                found[table] = min(found[table], float(limit_s[0]))
        return found

    def remove_oldest(self, days: float, octets: int, now_s: float) -> list[str]:
        """Remove the oldest hours that the rules do not keep; the last one stays.

        Parameters
        ----------
        days : float
            Hours are removed that ended so long before the newest data; 0: no rule.
        octets : int
            The oldest are removed while there are more; 0: no rule.
        now_s : float
            The time of the machine, s: data ahead of it do not make others older.

        Returns
        -------
        list of str
            The removed hours.
        """
        removed = []
        while len(self._octets) > 1:
            oldest, newest = min(self._octets), max(self._octets)
            newest_s = min((newest + 1.0) * HOUR_S, now_s)
            old = 0.0 < days * DAY_S < newest_s - (oldest + 1.0) * HOUR_S
            if not old and not 0 < octets < self.octets:
                break
            path = self.path / hour_name(oldest)
            shutil.rmtree(path)
            del self._octets[oldest]
            removed.append(path.name)
            self._find_oldest()
        return removed

    def close(self) -> None:
        """Let another writer have it."""
        os.close(self._lock)

    # What an interrupted write has left.
    def _tidy(self) -> None:
        shutil.rmtree(self.path / _STAGE, ignore_errors=True)
        if self._is_ahead:
            # First: after a kill, no state may count parts that were removed.
            _write_state(self.path, self.state)
            self._is_ahead = False
        for hour in hours_of(self.path):
            for table in hour.path.iterdir():
                for part in parts_of(hour, table.name) if table.is_dir() else ():
                    if part.write > self.state.write:
                        part.path.unlink()
        _write_state(self.path, self.state)

    def _stage(self, table: str, hour: int, number: int, rows: pl.DataFrame) -> tuple[Path, Path]:
        first, last = (float(rows["time_s"][one]) - hour * HOUR_S for one in (0, -1))
        span = f"{int(first):04d}-{int(np.ceil(last)):04d}"
        path = self.path / hour_name(hour) / table / f"{number:08d}-{span}.parquet"
        partial = self.path / _STAGE / f"{table}-{hour}"
        partial.parent.mkdir(exist_ok=True)
        rows.write_parquet(
            partial,
            compression="zstd",
            compression_level=COMPRESSION_LEVEL,
            row_group_size=BLOCK_ROWS,
        )
        sync(partial)
        return partial, path

    # What stands beside the tables of an hour is there whole or not at all.
    def _complete(self, hour: Path) -> None:
        if not hour.exists():
            hour.mkdir()
            sync(self.path)
        for name, content in self._beside().items():
            path, partial = hour / name, self.path / _STAGE / name
            if path.is_file() and path.stat().st_size:
                continue
            partial.write_bytes(content)
            sync(partial)
            os.replace(partial, path)
            sync(hour)


# The parts in their tables, on disk.
def _give_names(staged: Sequence[tuple[Path, Path]]) -> None:
    for partial, path in staged:
        if not path.parent.exists():
            path.parent.mkdir()
            sync(path.parent.parent)
        os.rename(partial, path)
    for folder in {path.parent for _, path in staged}:
        sync(folder)


# Whether the state on disk counts a write, as far as can be read.
def _may_count(folder: Path, number: int) -> bool:
    try:
        return read_state(folder).write == number
    except (OSError, InputError):
        return True


# Rows by hour, each by ascending time.
def _by_hour(frame: pl.DataFrame) -> Iterator[tuple[int, pl.DataFrame]]:
    if frame.is_empty():
        return
    rows = frame.sort("time_s", maintain_order=True)
    number = np.floor_divide(rows["time_s"].to_numpy(), HOUR_S).astype(np.int64)
    starts = np.flatnonzero(np.r_[True, number[1:] != number[:-1]]).tolist()
    for start, end in zip(starts, [*starts[1:], len(rows)], strict=True):
        yield int(number[start]), rows[start:end]


def read_state(folder: Path) -> HistoryState:
    """Return how far a history was written; raises InputError where a folder is no history."""
    path = folder / STATE_FILE
    if not path.exists():
        # A kill during the first write leaves a partial file alone.
        if any(one.name != _PARTIAL_STATE for one in folder.iterdir()):
            raise InputError(
                f"{folder}: not empty, and not the history of a service: {STATE_FILE} is missing; "
                "choose another folder"
            )
        return HistoryState()
    try:
        found = json.loads(path.read_bytes())
        if found.pop("format") != STATE_VERSION:
            raise InputError(f"{path}: written by a newer version of multiradar")
        found["steps"] = [(int(last), float(time_s)) for last, time_s in found.get("steps", [])]
        return HistoryState(**found)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: damaged; choose another folder for the history") from error


def _write_state(folder: Path, state: HistoryState) -> None:
    partial = folder / _PARTIAL_STATE
    document = {
        "format": STATE_VERSION, "write": state.write, "sequence": state.sequence,
        "digest": state.digest, "positions": dict(state.positions), "steps": list(state.steps),
        "written_s": dict(state.written_s),
    }  # fmt: skip
    partial.write_text(json.dumps(document), encoding="utf-8")
    sync(partial)
    os.replace(partial, folder / STATE_FILE)
    sync(folder)


def _number_of(hour: Path) -> int:
    return int(np.datetime64(hour.name, "h").astype(np.int64))


def _octets(folder: Path) -> int:
    return sum(one.stat().st_size for one in folder.rglob("*.parquet") if one.is_file())
