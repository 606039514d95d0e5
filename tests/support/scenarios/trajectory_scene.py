"""Aircraft for bundles of trajectories: a turn, one without height reports, ADS-B, and bearings."""

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.geodesy.system_plane import SystemPlane
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from support.scenarios import live_scene

Floats = NDArray[np.float64]

TABLE = live_scene.sensors()
PLANE = SystemPlane(np.radians(49.8), np.radians(15.1))
#: Numbers of the aircraft, which are those of their tracks. The last is heard by bearings alone
#: after some time.
TURNING, MUTE, REPORTING, JAMMED = 1, 2, 3, 4
TURN_MPS2 = 2.5
NOISE_M = 50.0


def flown(number: int, time_s: Floats) -> tuple[Floats, Floats]:
    """Return east and north of an aircraft on `PLANE`, m; the turning one turns after 60 s."""
    if number != TURNING:
        return -30e3 + 20e3 * number + 0.0 * time_s, 180.0 * time_s - 20e3 - 5e3 * number
    turned = TURN_MPS2 / 200.0 * np.maximum(time_s - 60.0, 0.0)
    radius = 200.0**2 / TURN_MPS2
    ahead = 200.0 * np.minimum(time_s, 60.0) + radius * np.sin(turned)
    return -20e3 + ahead, 15e3 - radius * (1.0 - np.cos(turned))


def recording(seconds: float = 100.0, *, seed: int = 1) -> pl.DataFrame:
    """Return measurements in the order of their time: a plot of each radar every 4 s."""
    random = np.random.default_rng(seed)
    parts = []
    for number in (TURNING, MUTE, REPORTING, JAMMED):
        for place, sensor in enumerate(("41-10", "41-20")):
            time_s = np.arange(0.5 + 0.3 * number + 1.7 * place, seconds, 4.0)
            parts.append(_plots(number, sensor, time_s, random))
    reported = np.arange(20.1, seconds, 2.0)
    latitude, longitude = PLANE.to_geodetic(*flown(REPORTING, reported))
    parts.append(
        _rows(REPORTING, "adsb", "adsb", reported).with_columns(
            latitude_deg=pl.Series(np.degrees(latitude)),
            longitude_deg=pl.Series(np.degrees(longitude)),
            height_m=pl.lit(9100.0),
        )
    )
    rows = pl.concat(parts, how="diagonal_relaxed").sort("time_s")
    missing = [name for name in MEASUREMENT_SCHEMA if name not in rows.columns]
    return rows.with_columns(pl.lit(None).alias(name) for name in missing).select(
        pl.col(name).cast(kind) for name, kind in MEASUREMENT_SCHEMA.items()
    )


def _plots(number: int, sensor: str, time_s: Floats, random: np.random.Generator) -> pl.DataFrame:
    own = TABLE.ids.index(sensor)
    site = (
        float(TABLE.latitude_rad[own]), float(TABLE.longitude_rad[own]), float(TABLE.height_m[own]),
    )  # fmt: skip
    height = np.full(len(time_s), 9000.0)
    latitude, longitude = PLANE.to_geodetic(*flown(number, time_s))
    slant, azimuth, _ = slant_range_azimuth(site, latitude, longitude, height)
    azimuth = azimuth + random.normal(0.0, 0.001, len(time_s))
    bearing = (time_s > 60.0) & (number == JAMMED)
    slant = slant + random.normal(0.0, NOISE_M, len(slant))
    frame = _rows(number, sensor, "radar", time_s).with_columns(
        kind=pl.Series(np.where(bearing, "bearing", "radar")),
        range_m=pl.Series(np.where(bearing, np.nan, slant)),
        azimuth_deg=pl.Series(np.degrees(azimuth) % 360.0),
        height_m=pl.Series(height if number != MUTE else height * np.nan),
    )
    return frame.fill_nan(None)


def _rows(number: int, sensor: str, kind: str, time_s: Floats) -> pl.DataFrame:
    count = len(time_s)
    return pl.DataFrame(
        {
            "time_s": live_scene.START_S + time_s,
            "sensor_id": [sensor] * count,
            "kind": [kind] * count,
            "track_number": [number] * count,
        }
    )
