"""Table of the forecasts of a run: each track, at a fixed interval, at all horizons."""

from typing import Any

import numpy as np
import polars as pl

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.memory.live_tracks import LiveTracks
from multiradar.runtime.queries.forecast_methods import (
    Known,
    method_of,
    no_bundle,
    no_plots,
)
from multiradar.runtime.queries.forecasts import forecast_points
from multiradar.runtime.queries.parameters import FILTER, PROBABILITY_DEFAULT
from multiradar.tracking.columns import rows_of, table_of
from multiradar.tracking.forecast.forecast_calibration import calibration_for
from multiradar.tracking.forecast.region_sizes import HORIZONS_S
from multiradar.tracking.outputs import EngineOutput, StateSample, TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.products.forecast import FORECAST_SCHEMA


class ForecastTable:
    """Computes the rows of `forecasts.parquet` from the state samples in the engine's output.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    settings : TrackingSettings
        Settings of the tracker.
    plane : SystemPlane
        The plane of the states.
    every_s : float
        Minimum data time between two forecasts of a track, s.
    """

    def __init__(
        self, sensors: SensorTable, settings: TrackingSettings, plane: SystemPlane, every_s: float
    ) -> None:
        self._sensors, self._plane, self._every_s = sensors, plane, every_s
        self._calibration = calibration_for(settings)
        self._live = LiveTracks()
        self._last_s = -np.inf

    def update(self, output: EngineOutput) -> pl.DataFrame:
        """Return the rows of the samples in an output."""
        found: list[dict[str, Any]] = []
        rows = rows_of(output.updates)
        first = 0
        # A forecast uses the calibration up to its sample, as in the service.
        for part in self._calibration.parts(output):
            last = first + part.updates
            self._live.update(rows[first:last])
            first = last
            if part.sample is not None and part.sample.time_s >= self._last_s + self._every_s:
                self._last_s = part.sample.time_s
                found += self._rows(part.sample)
        self._live.remove(output.ended.track_id)
        return pl.DataFrame(found, schema=FORECAST_SCHEMA)

    def finish(self) -> pl.DataFrame:
        """Return no rows: all were returned with their samples."""
        return pl.DataFrame(schema=FORECAST_SCHEMA)

    def _rows(self, sample: StateSample) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = []
        states, method = sample.states, method_of(FILTER, PROBABILITY_DEFAULT)
        latest = {
            row: live
            for row, track_id in enumerate(states.track_id.tolist())
            if (live := self._live.get(track_id)) is not None
        }
        if not latest:
            return []
        updates = table_of(TrackUpdates, np.concatenate(list(latest.values())))
        tracks = wire.tracks_frame(updates, self._sensors).iter_rows(named=True)
        for row, track in zip(latest, tracks, strict=True):
            known = Known(states, row, self._calibration, no_bundle, no_plots)
            ahead_s = track["time_s"] + HORIZONS_S - states.time_s[row]
            if ahead_s[0] < 0.0:
                continue
            course = method(known, ahead_s)
            time_s = states.time_s[row] + ahead_s
            points = forecast_points(course, time_s, track, self._plane)
            same = {
                "track_id": track["track_id"],
                "made_s": track["time_s"],
                "probability": PROBABILITY_DEFAULT,
                "by": FILTER,
            }
            found += [
                {**point, **same, "horizon_s": horizon_s}
                for point, horizon_s in zip(points, HORIZONS_S.tolist(), strict=False)
            ]
        return found
