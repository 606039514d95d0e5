"""The output of a run of `track`, as a source of pictures."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import InputError
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, SensorTable
from multiradar.runtime.engine.plot_rows import NO_TRACK, PLOT_DTYPE
from multiradar.runtime.memory.set_backs import TrackStep, superseded_from_s
from multiradar.runtime.offline.offline_job import (
    BIASES_FILE,
    HEALTH_FILE,
    TRACKS_FILE,
    TRANSITIONS_FILE,
)
from multiradar.runtime.picture.past import ENDING_S, Positions, last_of_each
from multiradar.runtime.recorded.plots import RecordedPlots
from multiradar.runtime.recorded.update_rows import sensor_numbers, update_rows
from multiradar.storage.recording import MEASUREMENTS_FILE
from multiradar.storage.time_table import TimeTable, scan_parts
from multiradar.tracking.lifecycle.transitions import ENDED, TRANSITION_NAMES
from multiradar.tracking.outputs import SPREAD_COUNT
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire.sensors import parameter_unit
from multiradar_schemas.products.bias import BIAS_SCHEMA
from multiradar_schemas.products.health import HEALTH_SCHEMA
from multiradar_schemas.products.track import TRACK_SCHEMA
from multiradar_schemas.products.transition import TRANSITION_SCHEMA

#: Spans in which the latest estimate of each bias is searched, s.
_BIAS_SPANS_S = (60.0, 3600.0, np.inf)
#: Span read at once for the history of a track, s.
_HISTORY_SPAN_S = 600.0
_BIAS_COLUMNS = ("time_s", "sensor_id", "parameter", "estimate", "sigma")

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RunFiles:
    """Where a run is.

    Attributes
    ----------
    name : str
        Its name for the user.
    tables : mapping of str to sequence of Path
        The files of each table, by its name such as `tracks.parquet`: one, or its parts; none
        where it is absent.
    sensors : SensorTable
        The sensors; none where their file is absent.
    report : Path
        Its report, which may be absent.
    block_rows : int or None
        Rows of the files that are read at once; None: see `TimeTable`.
    steps : sequence of TrackStep
        When the data time was set back: tracks until then have terminated at that time.
    """

    name: str
    tables: Mapping[str, Sequence[Path]]
    sensors: SensorTable
    report: Path
    block_rows: int | None = None
    steps: Sequence[TrackStep] = ()

    def scan(self, table: str, columns: Sequence[str]) -> pl.LazyFrame | None:
        """Return columns of a table, null where it lacks them; None where it is absent.

        Raises
        ------
        InputError
            If it cannot be read.
        """
        paths = self.tables.get(table)
        if not paths:
            return None
        try:
            scan = scan_parts(paths)
            missing = [name for name in columns if name not in scan.collect_schema()]
        except (pl.exceptions.PolarsError, OSError) as error:
            msg = f"{paths[0]}: cannot be read as Parquet: {str(error).splitlines()[0]}"
            raise InputError(msg) from error
        return scan.with_columns(pl.lit(None).alias(name) for name in missing).select(columns)


class RecordedRun:
    """A run of `track`, read from its files; a `PictureSource`.

    Parameters
    ----------
    files : RunFiles
        Where it is.
    folder : Path, optional
        Existing folder for temporary files; see `TimeTable`.

    Raises
    ------
    InputError
        A file cannot be read, or has no rows.
    MissingColumnError
        A table lacks a column.
    """

    def __init__(self, files: RunFiles, folder: Path | None = None) -> None:
        self.files = files
        self._sensors = files.sensors
        required = {"time_s", "track_id", "latitude_deg", "longitude_deg", "state"}
        optional = {name: dtype for name, dtype in TRACK_SCHEMA.items() if name not in required}
        tracks = files.tables[TRACKS_FILE]
        blocks = files.block_rows
        self._tracks = TimeTable(
            tracks, list(TRACK_SCHEMA), optional, folder=folder, block_rows=blocks
        )
        self.report = _report(files.report)
        given = _settings(self.report)
        #: Age from which a confirmed track is coasting, s.
        self.coast_after_s = given["coast_after_s"]
        #: Spectral density of the acceleration between updates, m²/s³.
        self.acceleration_density = given["acceleration_density"]
        self._drop_after_s = given["drop_after_s"]
        self._ended_id, self._ended_s = self._read_ended()
        rows = files.scan(BIASES_FILE, _BIAS_COLUMNS)
        self._biases = (
            None
            if rows is None or rows.head(1).collect().is_empty()
            else TimeTable(
                files.tables[BIASES_FILE],
                BIAS_SCHEMA.names(),
                {name: BIAS_SCHEMA[name] for name in BIAS_SCHEMA if name not in _BIAS_COLUMNS},
                folder=folder,
                block_rows=blocks,
            )
        )
        measurements = files.tables.get(MEASUREMENTS_FILE)
        self._plots = (
            RecordedPlots(measurements, self._sensors, self._tracks, folder, blocks)
            if measurements
            else None
        )

    @property
    def name(self) -> str:
        """Its name for the user."""
        return self.files.name

    @property
    def sensors(self) -> SensorTable:
        """The sensors."""
        return self._sensors

    def span_s(self) -> tuple[float, float]:
        """Return the time of the first and of the last update, s."""
        return self._tracks.span_s

    def extent_deg(self) -> tuple[float, float, float, float] | None:
        """Return the west, south, east and north end of confirmed tracks, degrees; None without.

        East of the antimeridian, longitudes continue above 180.
        """
        rows = scan_parts(self.files.tables[TRACKS_FILE]).filter(pl.col("state") == "confirmed")
        return extent_of(rows)

    def measured_span_s(self) -> tuple[float, float] | None:
        """Return the time of the first and of the last measurement, s; None without them."""
        return None if self._plots is None else self._plots.span_s

    @property
    def has_plots(self) -> bool:
        """Whether the measurements of the run are known."""
        return self._plots is not None

    def latest(self, at_s: float) -> NDArray[np.void]:
        """Return the last update of each track at a time."""
        return update_rows(self.tracks(at_s), self._sensors)

    def tracks(self, at_s: float) -> pl.DataFrame:
        """Return the last update of each track at a time, rows of `tracks.parquet` by track."""
        # Without transitions; with them a track ends at its end.
        rows = self._tracks.between(at_s - self._drop_after_s - ENDING_S, at_s)
        last = rows[last_of_each(rows["track_id"].to_numpy())]
        live = ~np.isin(last["track_id"].to_numpy(), self._ended_id[self._ended_s <= at_s])
        if not len(self._ended_id):
            live &= last["time_s"].to_numpy() >= at_s - self._drop_after_s
        live &= superseded_from_s(last["track_id"].to_numpy(), self.files.steps) > at_s
        return last.filter(pl.Series(live))

    def spread(self, rows: NDArray[np.void]) -> tuple[None, Floats]:
        """Return NaN: a run has the sigmas of positions, but no covariances."""
        return None, np.full((len(rows), SPREAD_COUNT), np.nan)

    def positions(self, after_s: float, at_s: float) -> Positions:
        """Return the positions of the updates of a span."""
        rows = self._tracks.between(after_s, at_s)
        rows = rows.filter(pl.Series(self._valid(rows["track_id"], rows["time_s"])))
        columns = (rows[name].to_numpy() for name in ("latitude_deg", "longitude_deg"))
        numbers = sensor_numbers(rows["sensor_id"], self._sensors)
        return Positions(rows["track_id"].to_numpy(), rows["time_s"].to_numpy(), numbers, *columns)

    def plots(self, after_s: float, at_s: float, limit: int) -> tuple[NDArray[np.void], int]:
        """Return the last plots of a span, and the number of the others; none without them."""
        if self._plots is None:
            return np.empty(0, PLOT_DTYPE), 0
        rows, others = self._plots.last(after_s, at_s, limit)
        valid = self._valid(rows["track_id"], rows["time_s"]) | (rows["track_id"] == NO_TRACK)
        return rows[valid], others

    def biases(self, at_s: float) -> Floats:
        """Return the biases estimated at a time."""
        estimates = np.zeros((len(self._sensors), len(PARAMETER_NAMES)))
        number = {name: row for row, name in enumerate(self._sensors.ids)}
        for record in self.bias_records(at_s):
            if record["sensor_id"] in number and record["parameter"] in PARAMETER_NAMES:
                place = number[record["sensor_id"]], PARAMETER_NAMES.index(record["parameter"])
                estimates[place] = record["estimate"] * parameter_unit(record["parameter"])
        return estimates

    def bias_records(self, at_s: float) -> list[dict[str, Any]]:
        """Return the latest row of each bias at a time, as of `biases.parquet`."""
        if self._biases is None:
            return []
        at_s = min(at_s, self._biases.span_s[1])
        latest = pl.DataFrame()
        for span_s in _BIAS_SPANS_S:
            rows = self._biases.between(at_s - span_s, at_s)
            found = rows.unique(["sensor_id", "parameter"], keep="last", maintain_order=True)
            # A longer span has further biases only where some were not estimated lately.
            if len(found) and len(found) == len(latest):
                break
            latest = found
        return latest.sort("sensor_id", maintain_order=True).to_dicts()

    def health_records(self, at_s: float) -> list[dict[str, Any]]:
        """Return the last row of `health.parquet` of each radar at a time; none without it."""
        scan = self.files.scan(HEALTH_FILE, list(HEALTH_SCHEMA))
        if scan is None:
            return []
        rows = scan.filter(pl.col("time_s") <= at_s).collect()
        last = rows.sort("time_s", maintain_order=True).unique("sensor_id", keep="last")
        return last.to_dicts()

    def updates_by_sensor(self) -> dict[str, tuple[int, float]]:
        """Return the number of updates by each sensor, and the time of the last one, s."""
        scan = self.files.scan(TRACKS_FILE, ["time_s", "sensor_id"])
        assert scan is not None, "a run has tracks"
        counted = scan.group_by("sensor_id").agg(pl.len().alias("updates"), pl.col("time_s").max())
        rows = counted.collect()
        return {name: (count, last_s) for name, count, last_s in rows.iter_rows()}

    def updates(
        self, track_id: int, since_s: float | None, limit: int, until_s: float | None = None
    ) -> pl.DataFrame:
        """Return updates of a track, as rows of `tracks.parquet`: the first since a time, or last.

        With `until_s` the last ones up to that time. Columns that the file lacks are null.
        """
        if until_s is not None:
            return self._last_updates(track_id, since_s, limit, until_s)
        first_s, last_s = self._tracks.span_s
        whole = self._tracks.between(-np.inf, -np.inf).clear()
        parts: list[pl.DataFrame] = []
        count = 0
        backwards = since_s is None
        start_s = last_s if since_s is None else np.nextafter(max(since_s, first_s), -np.inf)
        while count < limit and first_s <= start_s + _HISTORY_SPAN_S and start_s <= last_s:
            if backwards:
                rows = self._tracks.between(start_s - _HISTORY_SPAN_S, start_s)
                start_s -= _HISTORY_SPAN_S
            else:
                rows = self._tracks.between(start_s, start_s + _HISTORY_SPAN_S)
                start_s += _HISTORY_SPAN_S
            own = rows.filter(pl.col("track_id") == track_id)
            count += len(own)
            parts.append(own)
        found = pl.concat([whole, *(parts[::-1] if backwards else parts)])
        return found.tail(limit) if backwards else found.head(limit)

    def _last_updates(
        self, track_id: int, since_s: float | None, limit: int, until_s: float
    ) -> pl.DataFrame:
        first_s, last_s = self._tracks.span_s
        parts = [self._tracks.between(-np.inf, -np.inf).clear()]
        begin_s = np.nextafter(first_s if since_s is None else max(since_s, first_s), -np.inf)
        end_s, count = min(until_s, last_s), 0
        while count < limit and end_s > begin_s:
            start_s = max(end_s - _HISTORY_SPAN_S, begin_s)
            rows = self._tracks.between(start_s, end_s)
            parts.append(rows.filter(pl.col("track_id") == track_id))
            count, end_s = count + len(parts[-1]), start_s
        return pl.concat(parts[::-1]).tail(limit)

    def bias_history(
        self, sensor_id: str, since_s: float | None, limit: int, until_s: float | None = None
    ) -> pl.DataFrame:
        """Return rows of `biases.parquet` of a sensor: the first since a time, or the last."""
        rows = self.files.scan(BIASES_FILE, list(BIAS_SCHEMA))
        if rows is None:
            return pl.DataFrame(schema=BIAS_SCHEMA)
        return _page(rows.filter(pl.col("sensor_id") == sensor_id), since_s, limit, until_s)

    def transitions(
        self, track_id: int, since_s: float | None, limit: int, until_s: float | None = None
    ) -> pl.DataFrame:
        """Return rows of `transitions.parquet` of a track: the first since a time, or the last."""
        rows = self.files.scan(TRANSITIONS_FILE, list(TRANSITION_SCHEMA))
        if rows is None:
            return pl.DataFrame(schema=TRANSITION_SCHEMA)
        return _page(rows.filter(pl.col("track_id") == track_id), since_s, limit, until_s)

    # Which rows of tracks are not superseded by others after a step back.
    def _valid(self, track_ids: ArrayLike, times_s: ArrayLike) -> NDArray[np.bool_]:
        limits_s = superseded_from_s(np.asarray(track_ids), self.files.steps)
        return np.asarray(np.asarray(times_s) <= limits_s)

    def _read_ended(self) -> tuple[NDArray[np.int64], Floats]:
        scan = self.files.scan(TRANSITIONS_FILE, ["time_s", "track_id", "transition"])
        if scan is None:
            return np.empty(0, np.int64), np.empty(0)
        rows = scan.filter(pl.col("transition") == TRANSITION_NAMES[ENDED]).collect()
        return rows["track_id"].to_numpy(), rows["time_s"].to_numpy()


def _page(
    rows: pl.LazyFrame, since_s: float | None, limit: int, until_s: float | None
) -> pl.DataFrame:
    if since_s is not None:
        rows = rows.filter(pl.col("time_s") >= since_s)
    if until_s is not None:
        rows = rows.filter(pl.col("time_s") <= until_s)
    last = since_s is None or until_s is not None
    return (rows.tail(limit) if last else rows.head(limit)).collect()


def extent_of(tracks: pl.LazyFrame) -> tuple[float, float, float, float] | None:
    """Return the ends of rows with positions; see `RecordedRun.extent_deg`."""
    latitude, longitude = pl.col("latitude_deg"), pl.col("longitude_deg")
    # Westwards and eastwards of the antimeridian together, if that is narrower.
    turned = longitude % 360.0
    ends = tracks.select(
        longitude.min(), longitude.max().alias("east"), turned.min().alias("turned_west"),
        turned.max().alias("turned_east"), latitude.min().alias("south"),
        latitude.max().alias("north"),
    )  # fmt: skip
    west, east, turned_west, turned_east, south, north = ends.collect().row(0)
    if west is None:
        return None
    if east - west > 180.0 and turned_east - turned_west < east - west:
        west, east = turned_west, turned_east
    return west, south, east, north


def _report(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {}
    try:
        document = json.loads(path.read_bytes())
    except ValueError as error:
        msg = f"{path}: not valid JSON: {error}"
        raise InputError(msg) from error
    return document if isinstance(document, dict) else {}


def _settings(report: dict[str, Any]) -> dict[str, float]:
    settings = report.get("settings")
    given = settings if isinstance(settings, dict) else {}
    default = TrackingSettings()
    found = {}
    for name in ("coast_after_s", "drop_after_s", "acceleration_density"):
        value = given.get(name)
        usable = isinstance(value, int | float) and 0 < value < np.inf
        found[name] = float(value) if usable and value is not None else getattr(default, name)
    return found


def final_diagnoses(report: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the findings of a run about its sensors, from its report."""
    figures = report.get("figures")
    found = figures.get("diagnoses") if isinstance(figures, dict) else None
    return [one for one in found if isinstance(one, dict)] if isinstance(found, list) else []
