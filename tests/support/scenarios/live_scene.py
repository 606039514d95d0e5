"""A small seeded recording for the live pipeline: aircraft on straight lines, radars and ADS-B."""

import numpy as np
import polars as pl

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.wire import sensor_table
from multiradar_schemas.measurements.directions import PLAIN_SCHEMA
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile

START_S = 1_700_000_000.0
_SITES = {"41-10": (50.0, 14.0, 400.0), "41-20": (49.2, 16.5, 300.0)}


def sensors() -> SensorTable:
    """Two radars and ADS-B."""
    return sensor_table(sensors_file())


def sensors_file() -> SensorsFile:
    """Two radars and ADS-B."""
    radars = [
        {"id": name, "kind": "radar", "latitude_deg": lat, "longitude_deg": lon, "height_m": height}
        for name, (lat, lon, height) in _SITES.items()
    ]
    every = [Sensor.model_validate(one) for one in [*radars, {"id": "adsb", "kind": "adsb"}]]
    return SensorsFile(sensor=tuple(every))


def recording(
    rows: int, *, seed: int = 1, aircraft: int = 12, step_s: float = 0.05
) -> pl.DataFrame:
    """Return measurements in the order of their arrival, somewhat out of order in time."""
    random = np.random.default_rng(seed)
    time_s = np.round(np.arange(rows) * step_s, 3)
    number = random.integers(0, aircraft, rows)
    latitude = 49.5 + 0.05 * number + 0.001 * (number % 3 - 1) * time_s / 10.0
    longitude = 15.0 + 0.07 * number + 0.0002 * time_s
    height = 9000.0 + 100.0 * number
    sensor = random.integers(0, 3, rows)
    range_m, azimuth_deg = np.full(rows, np.nan), np.full(rows, np.nan)
    for place, site in enumerate(_SITES.values()):
        seen = sensor == place
        found, azimuth_rad, _ = slant_range_azimuth(
            (np.radians(site[0]), np.radians(site[1]), site[2]),
            np.radians(latitude[seen]),
            np.radians(longitude[seen]),
            height[seen],
        )
        range_m[seen] = found + random.normal(0.0, 50.0, seen.sum())
        azimuth_deg[seen] = np.degrees(azimuth_rad + random.normal(0.0, 0.001, seen.sum())) % 360.0
    reported = sensor == 2
    frame = pl.DataFrame(
        {
            "time_s": START_S + time_s,
            "sensor_id": np.array([*_SITES, "adsb"])[sensor],
            "kind": np.where(reported, "adsb", "radar"),
            "range_m": range_m,
            "azimuth_deg": azimuth_deg,
            "latitude_deg": np.where(reported, latitude, np.nan),
            "longitude_deg": np.where(reported, longitude, np.nan),
            "height_m": height,
            "mode_3a": pl.Series([f"{value + 0o1000:04o}" for value in number]),
            "mode_s_address": pl.Series([f"{value + 0x4B0000:06x}" for value in number]),
            "track_number": number,
            "callsign": pl.Series([f"TST{value}" for value in number]),
        }
    )
    late = np.argsort(time_s + random.uniform(0.0, 2.0, rows), kind="stable")
    return frame.fill_nan(None).cast(PLAIN_SCHEMA).select(PLAIN_SCHEMA.names())[late]


def cut(frame: pl.DataFrame, sizes: list[int]) -> list[pl.DataFrame]:
    """Cut a frame into pieces of these sizes, and a last piece of the rest."""
    pieces, start = [], 0
    for size in sizes:
        pieces.append(frame[start : start + size])
        start += size
    return [piece for piece in [*pieces, frame[start:]] if len(piece)]
