"""Answers about times that the service's memory no longer has, from its history on disk."""

import logging
import os
import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import polars as pl

from multiradar.errors import InputError, RequestError
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.memory.set_backs import TrackStep
from multiradar.runtime.offline.offline_job import (
    BIASES_FILE,
    HEALTH_FILE,
    TRACKS_FILE,
    TRANSITIONS_FILE,
)
from multiradar.runtime.offline.offline_report import REPORT_FILE
from multiradar.runtime.picture.past import ENDING_S, PATH_S
from multiradar.runtime.picture.past_sensors import SILENT_S
from multiradar.runtime.queries.deadline import check_deadline
from multiradar.runtime.recorded.history_files import (
    BLOCK_ROWS,
    HOUR_S,
    hour_name,
    parts_between,
)
from multiradar.runtime.recorded.run import RecordedRun, RunFiles
from multiradar.storage.recording import MEASUREMENTS_FILE
from multiradar_schemas.measurements.measurement import TIME_MAX_S
from multiradar_schemas.products.bias import BIAS_SCHEMA
from multiradar_schemas.products.track import TRACK_SCHEMA
from multiradar_schemas.products.transition import TRANSITION_SCHEMA

#: Runs in memory: pages that play back ask for many times of the same files.
_RUNS_MAX = 4
#: Biases and health of so long before a time, s.
_SLOW_S = 3600.0
#: Errors that are logged once: each page that is open repeats its queries.
_LOGGED_MAX = 1000

_log = logging.getLogger(__name__)


class HistoryReader:
    """Reads a history; for any thread.

    Parameters
    ----------
    folder : Path
        The history.
    known : Knowledge
        Its sensors and settings.
    oldest : callable
        Returns the earliest time in it, s; None without any.
    written : callable
        Returns the time up to which it is written, s; None without any.
    steps : callable, optional
        Returns when the data time was set back; see `joined_steps`.
    """

    def __init__(
        self, folder: Path, known: Knowledge, oldest: Callable[[], float | None],
        written: Callable[[], float | None], steps: Callable[[], Sequence[TrackStep]] = tuple,
    ) -> None:  # fmt: skip
        self._oldest, self._written, self._steps = oldest, written, steps
        self._folder = folder
        self._known = known
        self._lock = threading.Lock()
        self._logged: set[str] = set()
        self._runs: OrderedDict[tuple[object, ...], RecordedRun] = OrderedDict()

    @property
    def oldest_s(self) -> float | None:
        """Begin of the oldest data, s; None without any."""
        return self._oldest()

    @property
    def written_s(self) -> float | None:
        """Time up to which it is written, s; None without any."""
        return self._written()

    def at(self, at_s: float) -> RecordedRun | None:
        """Return the data before a time; None if there are no tracks.

        Raises
        ------
        RequestError
            A part is damaged; the log names it.
        """
        window_s = max(self._known.tracking.drop_after_s + ENDING_S, PATH_S, SILENT_S)
        spans = {
            TRACKS_FILE: window_s, TRANSITIONS_FILE: window_s, MEASUREMENTS_FILE: window_s,
            BIASES_FILE: _SLOW_S, HEALTH_FILE: _SLOW_S,
        }  # fmt: skip
        tables = {
            table: tuple(parts_between(self._folder, table, at_s - span_s, at_s))
            for table, span_s in spans.items()
        }
        if not tables[TRACKS_FILE]:
            return None
        name = hour_name(int(at_s // HOUR_S))
        sensors = self._known.sensors
        steps = tuple(self._steps())
        key = (steps, *(path for paths in tables.values() for path in paths))
        with self._lock:
            run = self._runs.get(key)
            if run is not None and run.sensors is sensors:
                self._runs.move_to_end(key)
                return run
        try:
            report = self._folder / name / REPORT_FILE
            run = RecordedRun(RunFiles(name, tables, sensors, report, BLOCK_ROWS, steps))
        except InputError as error:
            self._require_removed([path for paths in tables.values() for path in paths], error)
            return None
        with self._lock:
            self._runs[key] = run
            if len(self._runs) > _RUNS_MAX:
                self._runs.popitem(last=False)
        return run

    def rows(
        self,
        name: str,
        subject: int | str,
        since_s: float,
        before_s: float,
        limit: int,
        *,
        last: bool = False,
    ) -> pl.DataFrame:
        """Return the first or last rows of a track or a sensor in a span; see `PastFiles.rows`.

        Raises
        ------
        DeadlineError
            The query takes too long.
        RequestError
            A part is damaged; the log names it.
        """
        table = _TABLES[name]
        found = pl.DataFrame(schema=table.schema)
        # Hour by hour, so that a page of a long time does not read all of them. The parts of an
        # hour overlap, by much if the data time was set back.
        span_s = max(since_s, -TIME_MAX_S), min(before_s, TIME_MAX_S)
        paths = parts_between(self._folder, table.file, *span_s)
        for _, hour in groupby(reversed(paths) if last else paths, lambda one: one.parent):
            parts = [table.schema.to_frame()]
            for path in sorted(hour):
                check_deadline()
                try:
                    own = self._scanned(name, path).filter(
                        pl.col(table.key) == subject,
                        pl.col("time_s") >= since_s,
                        pl.col("time_s") < before_s,
                    )
                    parts.append(own.collect().cast(table.schema))
                except (InputError, pl.exceptions.PolarsError, OSError) as error:
                    self._require_removed([path], error)
            ordered = pl.concat(parts).sort("time_s", maintain_order=True)
            found = pl.concat([ordered, found] if last else [found, ordered])
            if len(found) >= limit:
                break
        return found.tail(limit) if last else found.head(limit)

    def _scanned(self, name: str, path: Path) -> pl.LazyFrame:
        table = _TABLES[name]
        files = RunFiles(name, {table.file: (path,)}, self._known.sensors, path)
        rows = files.scan(table.file, table.schema.names())
        assert rows is not None, "it has a file"
        return rows

    # An hour may be removed while it is read; other errors are not those of the request.
    def _require_removed(self, paths: Sequence[Path], error: Exception) -> None:
        if not all(map(os.path.lexists, paths)):
            return
        text, _, _ = str(error).partition("\n")
        if not isinstance(error, InputError):
            text = f"{paths[0]}: {text}"
        with self._lock:
            new = text not in self._logged
            if new and len(self._logged) < _LOGGED_MAX:
                self._logged.add(text)
        if new:
            _log.error("history cannot be read: %s", text)
        raise RequestError(
            503, "HISTORY_FAILED", "the history cannot be read; see the log of the service"
        ) from error


class _Table(NamedTuple):
    file: str
    key: str
    schema: pl.Schema


_TABLES = {
    "updates": _Table(TRACKS_FILE, "track_id", TRACK_SCHEMA),
    "transitions": _Table(TRANSITIONS_FILE, "track_id", TRANSITION_SCHEMA),
    "biases": _Table(BIASES_FILE, "sensor_id", BIAS_SCHEMA),
}
