"""The table of ensemble forecasts of an offline run."""

from typing import Any

import numpy as np
import polars as pl

from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.offline.trajectory_table import TrajectoryTable
from multiradar.runtime.queries.forecast_methods import bundle_path
from multiradar.runtime.queries.forecasts import forecast_points
from multiradar.runtime.queries.parameters import PROBABILITY_DEFAULT
from multiradar.runtime.trajectories.pool import Reading
from multiradar.tracking.forecast.region_sizes import HORIZONS_S
from multiradar.tracking.outputs import EngineOutput
from multiradar_schemas.products.forecast import FORECAST_SCHEMA

_MEMBERS = "members"


class BundleForecasts:
    """Computes forecasts of bundles at ends of epochs.

    Parameters
    ----------
    every_s : float
        Minimum data time between two forecasts of a track, s.
    """

    def __init__(self, every_s: float) -> None:
        self._every_s = every_s
        self._last_s: dict[int, float] = {}

    def __call__(self, track_id: int, reading: Reading, plane: SystemPlane) -> list[dict[str, Any]]:
        """Return the rows of a bundle; none if it has no tracks or the interval is not over."""
        if not len(reading.bundle):
            return []
        made_s = reading.bundle.window_s[1]
        if made_s < self._last_s.get(track_id, -np.inf) + self._every_s:
            return []
        self._last_s[track_id] = made_s
        return rows_of_bundle(track_id, reading, plane)


class BundleForecastTable:
    """Returns the rows of `bundle_forecasts.parquet`.

    Parameters
    ----------
    table : TrajectoryTable
        Computes the rows; it is updated with each output before this table.
    """

    def __init__(self, table: TrajectoryTable) -> None:
        self._table = table

    def update(self, output: EngineOutput) -> pl.DataFrame:
        """Return the rows of the completed epochs."""
        return self.finish()

    def finish(self) -> pl.DataFrame:
        """Return the rows of the last epoch."""
        return pl.DataFrame(self._table.pop_extra_rows(), schema=FORECAST_SCHEMA)


def rows_of_bundle(track_id: int, reading: Reading, plane: SystemPlane) -> list[dict[str, Any]]:
    """Return the forecasts from a bundle at its last plot.

    Parameters
    ----------
    track_id : int
        The track.
    reading : Reading
        Its bundle, with tracks.
    plane : SystemPlane
        The plane of the bundle.

    Returns
    -------
    list of dict
        Columns of `FORECAST_SCHEMA`, one row for each horizon.
    """
    made_s = reading.bundle.window_s[1]
    time_s = made_s + HORIZONS_S
    height_m = None if np.isnan(reading.height_m) else reading.height_m
    # A track with a bundle is confirmed.
    track = {"height_m": height_m, "state": "confirmed", "time_s": made_s}
    course = bundle_path(reading, time_s, PROBABILITY_DEFAULT)
    same = {
        "track_id": track_id, "made_s": made_s, "probability": PROBABILITY_DEFAULT,
        "by": course.motion,
    }  # fmt: skip
    points = forecast_points(course, time_s, track, plane)
    return [
        {**{name: point[name] for name in point if name != _MEMBERS}, **same, "horizon_s": ahead_s}
        for point, ahead_s in zip(points, HORIZONS_S.tolist(), strict=False)
    ]
