"""Forecasts of live tracks, as points on the Earth."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ForecastError, OutsidePlaneError
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.tracking.forecast import (
    density_of,
    forecast,
    forecast_modes_of,
    forecast_of_modes,
)
from multiradar.tracking.outputs import TrackStates
from multiradar.tracking.settings import TrackingSettings

#: Bounds of a forecast and what is taken where nothing is said, the same for everybody who asks, s.
HORIZON_DEFAULT_S = 60.0
HORIZON_MAX_S = 3600.0
STEP_DEFAULT_S = 5.0
STEP_MIN_S = 0.1


def forecast_steps(horizon_s: float, step_s: float, points_max: int) -> NDArray[np.float64]:
    """Return the times of the points of a forecast.

    Parameters
    ----------
    horizon_s, step_s : float
        How far, and in what steps, s.
    points_max : int
        Most points, that of now included.

    Returns
    -------
    (k,) ndarray
        Times after now, s, the first 0.

    Raises
    ------
    ForecastError
        If the horizon or the step is out of its bounds or no number, or the points are too many.
    """
    # Written so that NaN fails.
    if not 0.0 < horizon_s <= HORIZON_MAX_S:
        reason = f"expected more than 0 s and at most {HORIZON_MAX_S:g} s, was {horizon_s} s"
        raise ForecastError("horizon_s", reason)
    if not STEP_MIN_S <= step_s <= HORIZON_MAX_S:
        reason = f"expected {STEP_MIN_S:g} s to {HORIZON_MAX_S:g} s, was {step_s} s"
        raise ForecastError("step_s", reason)
    # The tolerance keeps the last point when the step divides the horizon but for rounding.
    count = int(horizon_s / step_s + 1e-9) + 1
    if count > points_max:
        reason = (
            f"expected at most {points_max} points, was {count}: "
            f"a horizon of {horizon_s} s in steps of {step_s} s"
        )
        raise ForecastError("step_s", reason)
    return np.arange(count, dtype=np.float64) * step_s


def forecast_points(
    states: TrackStates,
    track: dict[str, Any],
    steps_s: NDArray[np.float64],
    plane: SystemPlane,
    settings: TrackingSettings,
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
    settings : TrackingSettings
        How aircraft are taken to move.

    Returns
    -------
    list of dict or None
        One point for each step, with the state of the track and the age of its last update then;
        a track that leaves the plane has points up to there. None when the filter has no such
        track.
    """
    place = int(np.searchsorted(states.track_id, track["track_id"]))
    if place == len(states) or states.track_id[place] != track["track_id"]:
        return None
    state_time_s = float(states.time_s[place])
    time_s = max(state_time_s, track["time_s"] + track["age_s"]) + steps_s
    means, covariances = propagated(states, place, settings, time_s - state_time_s)
    inside = _points_inside(plane, means)
    east_m, north_m = means[:inside, 0], means[:inside, 1]
    latitude_rad, longitude_rad = plane.to_geodetic(east_m, north_m)
    height_m = track["height_m"] or 0.0
    matrix = plane.local_matrix(east_m, north_m, height_m)
    true = matrix @ covariances[:inside, :2, :2] @ matrix.transpose(0, 2, 1)
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
            time_s[:inside].tolist(),
            np.degrees(latitude_rad).tolist(),
            np.degrees(longitude_rad).tolist(),
            true[:, 0, 0].tolist(),
            true[:, 0, 1].tolist(),
            true[:, 1, 1].tolist(),
            strict=True,
        )
    ]


def propagated(
    states: TrackStates, place: int, settings: TrackingSettings, ahead_s: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where a track is expected to be on the plane, as its filter takes it to move.

    Parameters
    ----------
    states : TrackStates
        States of the filter.
    place : int
        Which of them.
    settings : TrackingSettings
        How aircraft are taken to move.
    ahead_s : (k,) ndarray
        Times after the state, s, ascending.

    Returns
    -------
    means : (k, 4) ndarray
        East and north, m, and their rates, m/s.
    covariances : (k, 4, 4) ndarray
        Their covariances.
    """
    mean, modes = states.mean[place], states.modes
    if modes is None:
        return forecast(mean, states.covariance[place], density_of(settings, mean[2:]), ahead_s)
    return forecast_of_modes(
        modes.probability[place],
        modes.mean[place],
        modes.covariance[place],
        forecast_modes_of(settings),
        ahead_s,
    )


def _points_inside(plane: SystemPlane, means: NDArray[np.float64]) -> int:
    # How many points there are before the first that is outside the plane.
    try:
        plane.to_geodetic(means[:, 0], means[:, 1])
    except OutsidePlaneError as error:
        return int(np.argmax((means[:, :2] == error.place).all(axis=1)))
    return len(means)
