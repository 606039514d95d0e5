"""Forecasts of live tracks, as points on the Earth."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.geodesy.system_plane import SystemPlane
from multiradar.tracking.forecast import forecast
from multiradar.tracking.outputs import TrackStates


def forecast_points(
    states: TrackStates,
    track: dict[str, Any],
    steps_s: NDArray[np.float64],
    plane: SystemPlane,
    acceleration_density: float,
) -> list[dict[str, Any]] | None:
    """Return the forecast of one track.

    Parameters
    ----------
    states : TrackStates
        States of the filter.
    track : dict
        The track as published, with its honest state and age.
    steps_s : (k,) ndarray
        Times after the data time of now, s.
    plane : SystemPlane
        The plane of the states.
    acceleration_density : float
        Spectral density of the acceleration, m²/s³.

    Returns
    -------
    list of dict or None
        One point for each step, with the state of the track and the age of its last update then;
        None when the filter has no such track.
    """
    place = int(np.searchsorted(states.track_id, track["track_id"]))
    if place == len(states) or states.track_id[place] != track["track_id"]:
        return None
    state_time_s = float(states.time_s[place])
    time_s = max(state_time_s, track["time_s"] + track["age_s"]) + steps_s
    means, covariances = forecast(
        states.mean[place], states.covariance[place], acceleration_density, time_s - state_time_s
    )
    latitude_rad, longitude_rad = plane.to_geodetic(means[:, 0], means[:, 1])
    matrix = plane.local_matrix(means[:, 0], means[:, 1])
    true = matrix @ covariances[:, :2, :2] @ matrix.transpose(0, 2, 1)
    return [
        {
            "time_s": time,
            "latitude_deg": latitude,
            "longitude_deg": longitude,
            "height_m": track["height_m"],
            "covariance_east_m2": east,
            "covariance_east_north_m2": cross,
            "covariance_north_m2": north,
            "position_sigma_m": (east + north) ** 0.5,
            "state": track["state"],
            "age_s": time - track["time_s"],
        }
        for time, latitude, longitude, east, cross, north in zip(
            time_s.tolist(),
            np.degrees(latitude_rad).tolist(),
            np.degrees(longitude_rad).tolist(),
            true[:, 0, 0].tolist(),
            true[:, 0, 1].tolist(),
            true[:, 1, 1].tolist(),
            strict=True,
        )
    ]
