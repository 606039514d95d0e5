"""Aircraft on straight lines, a radar, and direction finders that move or measure elevations."""

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
PLANE = SystemPlane(np.radians(49.9), np.radians(15.2))
SIGMA_DEG = 0.2
PERIOD_S = 2.0
RADAR, FIXED, FLYING = "41-10", "df-1", "df-air"
_SITES = {RADAR: (49.9, 14.4, 400.0), FIXED: (49.6, 15.2, 300.0), FLYING: (50.0, 15.4, 3000.0)}


def sensors(*, bias_sigma_deg: float = 0.5) -> SensorTable:
    """A radar, a direction finder that stands still and one that flies, both with elevations."""
    every = []
    for name, (latitude, longitude, height) in _SITES.items():
        kind = "radar" if name == RADAR else "direction-finder"
        known = {"azimuth_offset_deg": {"prior_sigma": bias_sigma_deg}}
        every.append(
            Sensor.model_validate(
                {
                    "id": name, "kind": kind, "latitude_deg": latitude,
                    "longitude_deg": longitude, "height_m": height,
                    "azimuth_sigma_deg": 0.06 if kind == "radar" else SIGMA_DEG,
                    "elevation_sigma_deg": SIGMA_DEG, "moving": name == FLYING, "bias": known,
                }
            )
        )  # fmt: skip
    return sensor_table(SensorsFile(sensor=tuple(every)))


@dataclass(frozen=True)
class Path:
    """Where something flies: place + t velocity, m on `PLANE`, and a circle about that."""

    place_m: tuple[float, float]
    velocity_mps: tuple[float, float] = (0.0, 0.0)
    height_m: float = 9000.0
    radius_m: float = 0.0
    turn_rad_per_s: float = 0.0

    def at(self, time_s: Floats) -> Floats:
        """East and north, (n, 2)."""
        angle = self.turn_rad_per_s * time_s
        circle = self.radius_m * np.column_stack([np.sin(angle), np.cos(angle)])
        return np.asarray(
            np.array(self.place_m) + time_s[:, None] * np.array(self.velocity_mps) + circle
        )

    def geodetic(self, time_s: Floats) -> tuple[Floats, Floats, Floats]:
        """Latitude and longitude, rad, and height, m."""
        latitude, longitude = PLANE.to_geodetic(*self.at(time_s).T)
        return latitude, longitude, np.full(len(time_s), self.height_m)


def seen(
    sensor: str,
    target: Path,
    number: int | None,
    time_s: Floats,
    rng: np.random.Generator,
    *,
    source: Path | None = None,
    elevations: bool = False,
    heights: bool = False,
    bias_deg: float = 0.0,
) -> pl.DataFrame:
    """What a sensor measures of an aircraft at times after `START_S`."""
    count = len(time_s)
    latitude, longitude, height = _SITES[sensor]
    sites = np.tile([np.radians(latitude), np.radians(longitude), height], (count, 1))
    if source is not None:
        sites = np.column_stack(source.geodetic(time_s))
    there = np.column_stack(target.geodetic(time_s))
    lines = [
        slant_range_azimuth((site[0], site[1], site[2]), *place)
        for site, place in zip(sites, there, strict=True)
    ]
    slant, azimuth, elevation = np.array(lines, np.float64).reshape(count, 3).T
    ranged = sensor == RADAR
    noise = rng.standard_normal((3, count)) * [[50.0], [0.06 if ranged else SIGMA_DEG], [SIGMA_DEG]]
    columns: dict[str, object] = {
        "time_s": START_S + time_s,
        "sensor_id": [sensor] * count,
        "kind": ["radar" if ranged else "bearing"] * count,
        "range_m": slant + noise[0] if ranged else [None] * count,
        "azimuth_deg": (np.degrees(azimuth) + noise[1] + bias_deg) % 360.0,
        "track_number": [number] * count,
        "height_m": there[:, 2] if heights else [None] * count,
        "elevation_deg": np.degrees(elevation) + noise[2] if elevations else [None] * count,
    }
    if source is not None:
        columns |= {
            "source_latitude_deg": np.degrees(sites[:, 0]),
            "source_longitude_deg": np.degrees(sites[:, 1]),
            "source_height_m": sites[:, 2],
        }
    missing = {name: [None] * count for name in MEASUREMENT_SCHEMA if name not in columns}
    return pl.DataFrame(columns | missing, schema_overrides=dict(MEASUREMENT_SCHEMA)).select(
        list(MEASUREMENT_SCHEMA)
    )


def together(*parts: pl.DataFrame) -> pl.DataFrame:
    """All of them in the order of time."""
    return pl.concat(parts).sort("time_s")


def errors(tracks: pl.DataFrame, target: Path) -> tuple[Floats, Floats]:
    """Distance of each row of a track from the truth, and its sigma, m."""
    true = target.at(tracks["time_s"].to_numpy() - START_S)
    east, north = PLANE.to_plane(
        np.radians(tracks["latitude_deg"].to_numpy()),
        np.radians(tracks["longitude_deg"].to_numpy()),
    )
    return np.hypot(east - true[:, 0], north - true[:, 1]), tracks["position_sigma_m"].to_numpy()
