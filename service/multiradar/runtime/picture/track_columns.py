"""Columns of the live tracks in frames of the air picture."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.memory.knowledge import AirTracks
from multiradar.tracking.forecast.coasting import coasted_variances
from multiradar.tracking.forecast.regions import ellipses

#: A source counts as long as it updated the track in the last seconds, s of data time.
SOURCE_KEPT_S = 30.0

_NUMBERS = (
    "height_m", "height_sigma_m", "speed_mps", "velocity_sigma_mps", "vertical_rate_mps",
    "position_sigma_m", "turn_right_probability", "turn_left_probability",
)  # fmt: skip
#: Identities as numbers; the page writes them as text. -1 for none.
_IDENTITIES = {"callsign": np.float64, "mode_s_address": np.int32, "mode_3a": np.int32}

Floats = NDArray[np.float64]
Columns = dict[str, NDArray[Any]]


def system_plane(sensors: SensorTable) -> SystemPlane | None:
    """Return the plane of the covariances; None where no sensor has a position."""
    if np.isnan(sensors.latitude_rad).all():
        return None
    return SystemPlane.for_sensors(sensors.latitude_rad, sensors.longitude_rad)


def track_columns(air: AirTracks, plane: SystemPlane | None, density: float) -> Columns:
    """Return the columns of the live tracks.

    Parameters
    ----------
    air : AirTracks
        The tracks.
    plane : SystemPlane or None
        The plane of their covariances; None where no sensor has a position.
    density : float
        Spectral density of the acceleration between updates, m²/s³.

    Returns
    -------
    dict of (n,) ndarray
        `track_id`, `time_s`, `latitude_deg`, `longitude_deg`, `height_m`, `height_sigma_m`,
        `speed_mps`, `heading_deg`, `velocity_sigma_mps`, `vertical_rate_mps`, `position_sigma_m`,
        `turn_right_probability`, `turn_left_probability`, `age_s`; at `time_s` + `age_s`, as from
        `coasted_variances`: `sigma_now_m` as `position_sigma_m`, semi-axes of one sigma of the
        position and the azimuth of the greater one, `sigma_major_m`, `sigma_minor_m`,
        `sigma_azimuth_deg`; `state` (index into `STATE_NAMES`), `on_ground` (-1 unknown),
        `sources` (sum of 1 for ADS-B, 2 for multilateration and 4 for radars and direction
        finders that updated it in the last
        `SOURCE_KEPT_S`); `callsign` (eight characters of six bits, the first in the highest),
        `mode_s_address`, `mode_3a`, -1 for none.
    """
    rows = air.rows
    at_update_m, azimuth_deg = _axes(air, plane)
    known = np.isfinite(at_update_m)
    # Without a covariance the same on both axes.
    each_m = np.where(known, at_update_m, rows["position_sigma_m"][:, None] / np.sqrt(2.0))
    variances = coasted_variances(each_m, rows["velocity_sigma_mps"], density, air.age_s)
    major_m, minor_m = np.where(known, np.sqrt(variances), np.nan).T
    heard = rows["time_s"][:, None] - air.heard_s <= SOURCE_KEPT_S
    columns: Columns = {
        "track_id": rows["track_id"].astype(np.float64),
        "time_s": rows["time_s"].astype(np.float64),
        "latitude_deg": np.degrees(rows["latitude_rad"]),
        "longitude_deg": np.degrees(rows["longitude_rad"]),
        "heading_deg": (np.degrees(rows["heading_rad"]) % 360.0).astype(np.float32),
        "age_s": air.age_s.astype(np.float32),
        "sigma_now_m": np.sqrt(variances.sum(axis=1)).astype(np.float32),
        "sigma_major_m": major_m.astype(np.float32),
        "sigma_minor_m": minor_m.astype(np.float32),
        "sigma_azimuth_deg": azimuth_deg.astype(np.float32),
        "state": rows["state"].astype(np.int8),
        "on_ground": rows["on_ground"].astype(np.int8),
        "sources": (heard @ (1 << np.arange(heard.shape[1]))).astype(np.int8),
    }
    columns |= {name: rows[name].astype(np.float32) for name in _NUMBERS}
    columns |= {name: rows[name].astype(kind) for name, kind in _IDENTITIES.items()}
    return columns


# Semi-axes of one sigma at the last update, m, (n, 2), and the azimuth of the greater one, degrees;
# NaN without a covariance.
def _axes(air: AirTracks, plane: SystemPlane | None) -> tuple[Floats, Floats]:
    axes = np.full((3, len(air.rows)), np.nan)
    known = np.isfinite(air.spread).all(axis=1)
    if plane is not None and known.any():
        east_m, north_m, east_east, east_north, north_north = air.spread[known].T
        height_m = np.nan_to_num(air.rows["height_m"][known])
        matrix = plane.local_matrix(east_m, north_m, height_m)
        flat = np.stack([east_east, east_north, east_north, north_north], axis=1).reshape(-1, 2, 2)
        true = matrix @ flat @ matrix.transpose(0, 2, 1)
        found = ellipses(true, np.ones(len(true)))
        axes[:, known] = found.major_m, found.minor_m, np.degrees(found.azimuth_rad)
    return axes[:2].T, axes[2]
