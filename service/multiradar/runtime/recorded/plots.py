"""The measurements of a recorded run as plots of its pictures, each with the track it updated."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar import wire
from multiradar.estimation.measurement.kinds import KIND_BEARING
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, SensorTable
from multiradar.runtime.engine.plot_rows import rows_without_track
from multiradar.runtime.picture.bearing_lines import directions_to
from multiradar.runtime.picture.plot_columns import plot_columns
from multiradar.storage.time_table import TimeTable
from multiradar_schemas.measurements.columns import MEASUREMENT_DIRECTIONS, MEASUREMENT_SCHEMA

_REQUIRED = ("time_s", "sensor_id", "kind")
_PLACE = ("range_m", "azimuth_deg", "latitude_deg", "longitude_deg", "height_m")
_COLUMNS = (*_REQUIRED, *_PLACE, *MEASUREMENT_DIRECTIONS)
#: Times of an update and of its measurement agree to so much, s.
_TIME_STEP_S = 1e-6


class RecordedPlots:
    """Plots of a recording by time.

    Parameters
    ----------
    paths : sequence of Path
        `measurements.parquet`, or its parts.
    sensors : SensorTable
        The sensors; measurements of others are left out.
    tracks : TimeTable
        `tracks.parquet`.
    folder : Path, optional
        Existing folder for temporary files; see `TimeTable`.
    block_rows : int, optional
        Rows read at once; see `TimeTable`.

    Raises
    ------
    InputError
        The measurements cannot be read.
    MissingColumnError
        They lack a column.
    """

    def __init__(
        self, paths: Sequence[Path], sensors: SensorTable, tracks: TimeTable,
        folder: Path | None = None,
        block_rows: int | None = None,
    ) -> None:  # fmt: skip
        optional = {name: MEASUREMENT_SCHEMA[name] for name in _COLUMNS if name not in _REQUIRED}
        self._measured = TimeTable(paths, _COLUMNS, optional, folder=folder, block_rows=block_rows)
        self._sensors = sensors
        self._tracks = tracks

    @property
    def span_s(self) -> tuple[float, float]:
        """The first and the last time, s."""
        return self._measured.span_s

    def last(self, after_s: float, until_s: float, limit: int) -> tuple[NDArray[np.void], int]:
        """Return plots of a span, by time.

        Parameters
        ----------
        after_s, until_s : float
            Plots later than the first and not later than the second.
        limit : int
            Maximum number.

        Returns
        -------
        rows : (n,) ndarray of `PLOT_DTYPE`
            The last ones; track `NO_TRACK` for those that updated none.
        others : int
            The number of the others.
        """
        found = self._measured.between(after_s, until_s)
        frame = found.tail(limit).cast({name: MEASUREMENT_SCHEMA[name] for name in _COLUMNS})
        batch, _ = wire.measurement_batch(frame, self._sensors)
        rows = rows_without_track(batch)
        if len(rows):
            self._assign(rows)
        return rows, len(found) - len(frame)

    # Sets the track of each plot and its position. Several plots of a sensor may have one time, in
    # whole seconds: an update belongs to the nearest of them then, for bearings by direction.
    def _assign(self, rows: NDArray[np.void]) -> None:
        first_s, last_s = float(rows["time_s"].min()), float(rows["time_s"].max())
        updates = self._tracks.between(first_s - 2.0 * _TIME_STEP_S, last_s + _TIME_STEP_S)
        plots = pl.DataFrame(
            {
                "plot": np.arange(len(rows)),
                "step": _steps(rows["time_s"]),
                "sensor_id": pl.Series(self._sensors.ids, dtype=pl.String).gather(rows["sensor"]),
            }
        )
        candidates = updates.select(
            "track_id", "sensor_id", "latitude_deg", "longitude_deg", "height_m",
            step=pl.Series(_steps(updates["time_s"].to_numpy())),
        ).with_row_index("update")  # fmt: skip
        pairs = plots.join(candidates, on=["step", "sensor_id"], maintain_order="left")
        if pairs["update"].is_duplicated().any() or pairs["plot"].is_duplicated().any():
            pairs = self._nearest(pairs, rows)
        numbers = pairs["plot"].to_numpy()
        rows["track_id"][numbers] = pairs["track_id"].to_numpy()
        rows["track_height_m"][numbers] = pairs["height_m"].fill_null(np.nan).to_numpy()
        for name in ("latitude", "longitude"):
            rows[f"track_{name}_rad"][numbers] = np.radians(pairs[f"{name}_deg"].to_numpy())

    def _nearest(self, pairs: pl.DataFrame, rows: NDArray[np.void]) -> pl.DataFrame:
        numbers, place = np.unique(pairs["plot"].to_numpy(), return_inverse=True)
        none = np.zeros((len(self._sensors), len(PARAMETER_NAMES)))
        found = plot_columns(rows[numbers], none, self._sensors)
        latitude_deg = pairs["latitude_deg"].to_numpy()
        north = found["latitude_deg"][place] - latitude_deg
        east = found["longitude_deg"][place] - pairs["longitude_deg"].to_numpy()
        east = (east + 180.0) % 360.0 - 180.0
        far = np.hypot(north, east * np.cos(np.radians(latitude_deg)))
        of_plot = rows[numbers][place]
        bearings = of_plot["kind"] == KIND_BEARING
        if bearings.any():
            where = np.radians(latitude_deg), np.radians(pairs["longitude_deg"].to_numpy())
            azimuth_rad = directions_to(of_plot, self._sensors, *where)
            off_rad = np.abs(np.exp(1j * (of_plot["azimuth_rad"] - azimuth_rad)) - 1.0)
            far = np.where(bearings, off_rad, far)
        return (
            pairs.with_columns(far=np.nan_to_num(far, nan=np.inf))
            .sort("far", maintain_order=True)
            .unique("update", keep="first", maintain_order=True)
            .unique("plot", keep="first", maintain_order=True)
        )


def _steps(time_s: NDArray[np.float64]) -> NDArray[np.int64]:
    steps: NDArray[np.int64] = np.rint(time_s / _TIME_STEP_S).astype(np.int64)
    return steps
