"""The planes in which tracks manoeuvre: from the last plots of a track, live and offline alike."""

from dataclasses import fields
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.errors import PlaneError
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, SensorTable
from multiradar.restoration.manoeuvre_plane import ManoeuvrePlane, fit_plane
from multiradar.restoration.plot_positions import PlotPositions, Plots, plot_positions
from multiradar.runtime.bias_board import BiasBoard
from multiradar.runtime.history import TrackHistory
from multiradar.runtime.limits import RuntimeLimits
from multiradar.tracking.measurements import MeasurementBatch
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.plots import TrackPlots
from multiradar_schemas.arrow import MANOEUVRE_PLANE_SCHEMA

#: The window of plots, and its bounds, the same for everybody who asks, s.
WINDOW_DEFAULT_S = 60.0
WINDOW_MIN_S = 5.0
WINDOW_MAX_S = 600.0
#: Most plots of a window; the last ones are used.
POINTS_MAX = 1000

# Identity is not kept: these are all that a plane is made of.
_MEASURED = (
    "time_s", "sensor", "kind", "range_m", "azimuth_rad", "latitude_rad", "longitude_rad",
    "height_m",
)  # fmt: skip
#: A row of `TrackPlots`; field names are those of `MeasurementBatch`.
PLOT_DTYPE = np.dtype(
    [("track_id", np.int64)]
    + [
        (field.name, getattr(MeasurementBatch.empty(), field.name).dtype)
        for field in fields(MeasurementBatch)
        if field.name in _MEASURED
    ]
)


def plot_rows(plots: TrackPlots) -> NDArray[np.void]:
    """Return plots as rows of `PLOT_DTYPE`."""
    rows = np.empty(len(plots), PLOT_DTYPE)
    rows["track_id"] = plots.track_id
    for name in _MEASURED:
        rows[name] = getattr(plots.measured, name)
    return rows


def plane_of_track(
    rows: NDArray[np.void], window_s: float, biases: NDArray[np.void], sensors: SensorTable
) -> dict[str, Any]:
    """Return the plane through the plots of a window.

    Parameters
    ----------
    rows : (n,) ndarray of `PLOT_DTYPE`
        The last plots of a track, by ascending time.
    window_s : float
        Plots so long before the last one are used, s.
    biases : (k,) ndarray of `BIAS_DTYPE`
        What was published of the biases when the last plot came; it is taken off the plots.
    sensors : SensorTable
        Who measured them.

    Returns
    -------
    dict
        The fields of `multiradar_schemas.manoeuvre_plane.ManoeuvrePlane`.

    Raises
    ------
    PlaneError
        If the plots determine no plane.
    """
    if not len(rows):
        raise PlaneError("TOO_FEW_POINTS", "expected plots that are kept still, was none")
    last_s = float(rows["time_s"][-1])
    chosen = rows[rows["time_s"] >= last_s - window_s]
    plots = Plots(*(chosen[name] for name in Plots._fields))
    placed = plot_positions(plots, sensors, _estimates(biases, len(sensors)))
    plane = fit_plane(placed.positions_m, placed.covariances_m2)
    known = {
        "track_id": int(rows["track_id"][-1]),
        "time_s": last_s,
        "window_s": float(window_s),
        **_figures(plane, placed),
    }
    return {**known, "positions": _positions(plane, placed)}


class PlaneTable:
    """Rows of `manoeuvre_planes.parquet`: each track at its last update of each epoch.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    window_s : float
        Plots so long before the update are used, s.
    epoch_s : float
        Length of an epoch of the biases, s.
    limits : RuntimeLimits, optional
        Bounds of the rings of plots and biases.
    """

    def __init__(
        self,
        sensors: SensorTable,
        window_s: float,
        epoch_s: float,
        limits: RuntimeLimits | None = None,
    ) -> None:
        limits = limits or RuntimeLimits()
        self._sensors, self._window_s, self._epoch_s = sensors, window_s, epoch_s
        self._plots = TrackHistory(limits.plot_rows_max, PLOT_DTYPE)
        self._biases = BiasBoard(sensors, limits.bias_history_rows_max)
        self._epoch: int | None = None
        self._updated: set[int] = set()

    def take(self, output: EngineOutput) -> pl.DataFrame:
        """Return the rows of the epochs that an output of the engine ends."""
        found: list[dict[str, Any]] = []
        rows = plot_rows(output.plots)
        epochs = np.floor(rows["time_s"] / self._epoch_s).astype(np.int64)
        # What an epoch ends with is published before anything of the next one comes.
        self._biases.append(output.biases)
        for epoch in np.unique(epochs).tolist():
            if epoch != self._epoch:
                found += self._close()
                self._epoch = epoch
            mine = rows[epochs == epoch]
            self._plots.append(mine)
            self._updated.update(mine["track_id"].tolist())
        return _frame(found)

    def finish(self) -> pl.DataFrame:
        """Return the rows of the last epoch."""
        return _frame(self._close())

    def _close(self) -> list[dict[str, Any]]:
        found = []
        for track_id in sorted(self._updated):
            rows = self._plots.read(track_id, None, POINTS_MAX)
            last_s = float(rows["time_s"][-1])
            try:
                plane = plane_of_track(rows, self._window_s, self._biases.at(last_s), self._sensors)
            except PlaneError as error:
                plane = {"track_id": track_id, "time_s": last_s, "window_s": self._window_s}
                plane["reason"] = error.code
            found.append({name: plane.get(name) for name in MANOEUVRE_PLANE_SCHEMA})
        self._updated.clear()
        return found


def _frame(rows: list[dict[str, Any]]) -> pl.DataFrame:
    return pl.DataFrame(rows, schema=MANOEUVRE_PLANE_SCHEMA)


def _estimates(records: NDArray[np.void], sensors: int) -> NDArray[np.float64]:
    estimates = np.zeros((sensors, len(PARAMETER_NAMES)))
    estimates[records["sensor"], records["parameter"]] = records["estimate"]
    return estimates


def _figures(plane: ManoeuvrePlane, placed: PlotPositions) -> dict[str, Any]:
    east, north, up = plane.normal.tolist()
    return {
        "points": plane.points,
        "normal_east": east,
        "normal_north": north,
        "normal_up": up,
        "distance_m": plane.distance_m,
        "origin_latitude_deg": float(np.degrees(placed.frame.latitude_rad)),
        "origin_longitude_deg": float(np.degrees(placed.frame.longitude_rad)),
        "tilt_deg": float(np.degrees(np.arctan2(np.hypot(east, north), up))),
        "normal_sigma_deg": float(np.degrees(plane.normal_sigma_rad)),
        "statistic": plane.statistic,
        "degrees_of_freedom": plane.degrees_of_freedom,
        "p_value": plane.p_value,
        "is_planar": plane.is_planar,
        "printed_statistic": plane.printed_statistic,
        "printed_threshold": plane.printed_threshold,
        "refused_by_printed_criterion": plane.refused_by_printed_criterion,
    }


def _positions(plane: ManoeuvrePlane, placed: PlotPositions) -> list[dict[str, float]]:
    east_m, north_m, height_m = plane.positions_m.T
    latitude_rad, longitude_rad = placed.frame.to_geodetic(east_m, north_m)
    columns = (placed.time_s, np.degrees(latitude_rad), np.degrees(longitude_rad), height_m)
    names = ("time_s", "latitude_deg", "longitude_deg", "height_m")
    return [dict(zip(names, row, strict=True)) for row in np.column_stack(columns).tolist()]
