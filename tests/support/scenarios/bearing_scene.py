"""Aircraft on straight lines, two radars of which ranges get lost, and two direction finders."""

from dataclasses import dataclass

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.wire import sensor_table
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile

Floats = NDArray[np.float64]

START_S = 1000.0
SITES = {
    "41-10": (50.0, 14.0, 400.0, "radar"),
    "41-20": (49.2, 16.5, 300.0, "radar"),
    "df-1": (50.6, 16.0, 200.0, "direction-finder"),
    "df-2": (49.3, 15.0, 200.0, "direction-finder"),
}
AZIMUTH_SIGMA_DEG = {"radar": 0.06, "direction-finder": 0.2}
PERIOD_S = {"radar": 5.0, "direction-finder": 2.0}
PLANE = SystemPlane(np.radians(49.9), np.radians(15.2))
#: Azimuth bias of `df-1`, degrees.
BIAS_DEG = 0.5


def sensors() -> SensorTable:
    """The four of them."""
    every = [
        Sensor.model_validate(
            {
                "id": name, "kind": kind, "latitude_deg": latitude, "longitude_deg": longitude,
                "height_m": height, "azimuth_sigma_deg": AZIMUTH_SIGMA_DEG[kind],
            }
        )
        for name, (latitude, longitude, height, kind) in SITES.items()
    ]  # fmt: skip
    return sensor_table(SensorsFile(sensor=tuple(every)))


@dataclass(frozen=True)
class Scene:
    """Measurements, and where aircraft i is: place + t velocity, m on `PLANE`."""

    frame: pl.DataFrame
    place_m: Floats
    velocity_mps: Floats

    def errors(self, tracks: pl.DataFrame) -> tuple[Floats, Floats]:
        """Distance of each row, by track number, from the truth, and its sigma, m."""
        number = tracks["track_number"].to_numpy()
        time_s = tracks["time_s"].to_numpy() - START_S
        true = self.place_m[number] + time_s[:, None] * self.velocity_mps[number]
        east, north = PLANE.to_plane(
            np.radians(tracks["latitude_deg"].to_numpy()),
            np.radians(tracks["longitude_deg"].to_numpy()),
        )
        distance = np.hypot(east - true[:, 0], north - true[:, 1])
        return distance, tracks["position_sigma_m"].to_numpy()


def make(
    *, aircraft: int = 5, seconds: float = 300.0, jammed_s: float = 120.0, named: bool = True,
    from_s: float = 0.0,
) -> Scene:  # fmt: skip
    """Return a scene whose first radar loses its ranges after a while, and the second all plots.

    Bearings carry the track number where `named`; before `from_s` only the direction finders
    measure.
    """
    rng = np.random.default_rng(1)
    course = rng.uniform(0.0, 2.0 * np.pi, aircraft)
    place = rng.uniform(-40e3, 40e3, (aircraft, 2))
    velocity = 220.0 * np.column_stack([np.sin(course), np.cos(course)])
    parts = []
    for number in range(aircraft):
        for name, (latitude, longitude, height, kind) in SITES.items():
            time_s = np.arange(rng.uniform(0.0, PERIOD_S[kind]), seconds, PERIOD_S[kind])
            if kind == "radar":
                time_s = time_s[time_s >= from_s]
            if name == "41-20":
                time_s = time_s[time_s < jammed_s]
            path = place[number] + time_s[:, None] * velocity[number]
            feet = PLANE.to_geodetic(path[:, 0], path[:, 1])
            tall = np.full(len(time_s), 8000.0 + 300.0 * number)
            site = np.radians(latitude), np.radians(longitude), height
            slant, azimuth, _ = slant_range_azimuth(site, feet[0], feet[1], tall)
            ranged = (time_s < jammed_s) & (kind == "radar")
            noise = AZIMUTH_SIGMA_DEG[kind] * rng.standard_normal(len(time_s))
            shift = BIAS_DEG if name == "df-1" else 0.0
            measured = slant + 50.0 * rng.standard_normal(len(time_s))
            parts.append(
                pl.DataFrame(
                    {
                        "time_s": START_S + time_s,
                        "sensor_id": pl.Series([name] * len(time_s), dtype=pl.String),
                        "kind": np.where(ranged, "radar", "bearing"),
                        "range_m": pl.Series(np.where(ranged, measured, np.nan)).fill_nan(None),
                        "azimuth_deg": (np.degrees(azimuth) + noise + shift) % 360.0,
                        "height_m": pl.Series(tall if kind == "radar" else tall * np.nan).fill_nan(
                            None
                        ),
                        "track_number": pl.Series(
                            [number if named or one else None for one in ranged], dtype=pl.Int64
                        ),
                    }
                )
            )
    rows = pl.concat(parts).sort("time_s")
    missing = [name for name in MEASUREMENT_SCHEMA if name not in rows.columns]
    frame = rows.with_columns(pl.lit(None).alias(name) for name in missing).select(
        pl.col(name).cast(kind) for name, kind in MEASUREMENT_SCHEMA.items()
    )
    return Scene(frame, place, velocity)
