"""Forecasts of live tracks, as points on the Earth."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ForecastError
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.queries.forecast_methods import Course, Known, Method
from multiradar.runtime.trajectories.fans import told_members
from multiradar.tracking.forecast.regions import ellipses
from multiradar.tracking.outputs import TrackStates

#: Bounds of a forecast and what is taken where nothing is said, the same for everybody who asks, s.
HORIZON_DEFAULT_S = 60.0
HORIZON_MAX_S = 3600.0
STEP_DEFAULT_S = 5.0
STEP_MIN_S = 0.1
#: Probabilities of regions.
PROBABILITY_DEFAULT = 0.95
PROBABILITY_MIN = 0.01
PROBABILITY_MAX = 0.999


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


def checked_probability(probability: float) -> float:
    """Return the probability of a region, or say why there is none of it.

    Raises
    ------
    ForecastError
        If it is out of its bounds or no number.
    """
    # Written so that NaN fails.
    if not PROBABILITY_MIN <= probability <= PROBABILITY_MAX:
        reason = f"expected {PROBABILITY_MIN:g} to {PROBABILITY_MAX:g}, was {probability}"
        raise ForecastError("probability", reason)
    return probability


def forecast_document(
    track_id: int, probability: float, by: str, points: list[dict[str, Any]]
) -> dict[str, Any]:
    """Return an answer: the fields of `multiradar_schemas.products.forecast.Forecast`."""
    return {"track_id": track_id, "probability": probability, "by": by, "points": points}


def ahead_of(
    states: TrackStates, place: int, track: dict[str, Any], steps_s: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return times after the state of a track.

    Parameters
    ----------
    states : TrackStates
        States of the filter.
    place : int
        Which of them.
    track : dict
        The track as published, with its honest age.
    steps_s : (k,) ndarray
        Times after the data time of now, s.

    Returns
    -------
    (k,) ndarray
        Times after the state, s. A state that is newer than the data time is not turned back.
    """
    state_time_s = float(states.time_s[place])
    now_s = max(state_time_s, track["time_s"] + track["age_s"])
    ahead_s: NDArray[np.float64] = now_s + steps_s - state_time_s
    return ahead_s


def forecast_points(
    course: Course, time_s: NDArray[np.float64], track: dict[str, Any], plane: SystemPlane
) -> list[dict[str, Any]]:
    """Return the points of a forecast as they are told.

    Parameters
    ----------
    course : Course
        Where the track is expected to be on the plane.
    time_s : (k,) ndarray
        Data times of its points, s.
    track : dict
        The track as published, with its honest state.
    plane : SystemPlane
        The plane of the course.

    Returns
    -------
    list of dict
        Fields of `ForecastPoint` of the schemas, with the state of the track and the
        age of its last update then. A track that leaves the plane has points up to there.
    """
    inside = int(points_inside(plane, course.means))
    east_m, north_m = course.means[:inside].T
    latitude_rad, longitude_rad = plane.to_geodetic(east_m, north_m)
    matrix = plane.local_matrix(east_m, north_m, track["height_m"] or 0.0)
    true = matrix @ course.covariances[:inside] @ matrix.transpose(0, 2, 1)
    region = ellipses(true, course.factors[:inside])
    columns = {
        "time_s": time_s[:inside],
        "latitude_deg": np.degrees(latitude_rad),
        "longitude_deg": np.degrees(longitude_rad),
        "covariance_east_m2": true[:, 0, 0],
        "covariance_east_north_m2": true[:, 0, 1],
        "covariance_north_m2": true[:, 1, 1],
        "position_sigma_m": np.sqrt(true[:, 0, 0] + true[:, 1, 1]),
        "region_major_m": region.major_m,
        "region_minor_m": region.minor_m,
        "region_azimuth_deg": np.degrees(region.azimuth_rad),
        "region_factor": course.factors[:inside],
        "calibrated": course.calibrated[:inside],
        "age_s": time_s[:inside] - track["time_s"],
    }
    told = {"height_m": track["height_m"], "state": track["state"], "motion": course.motion}
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    points = [{**dict(zip(columns, row, strict=True)), **told} for row in rows]
    if course.fan is None:
        return points
    members = told_members(course.fan, plane, track["height_m"] or 0.0)
    return [{**point, "members": each} for point, each in zip(points, members, strict=False)]


def forecast_from(
    known: Known,
    track: dict[str, Any],
    plane: SystemPlane,
    steps_s: NDArray[np.float64],
    method: Method,
) -> list[dict[str, Any]]:
    """Return the points of a forecast from the data time of now on.

    Parameters
    ----------
    known : Known
        What the track is forecast from.
    track : dict
        The track as published, with its honest state and age.
    plane : SystemPlane
        The plane of the states.
    steps_s : (k,) ndarray
        Times after the data time of now, s.
    method : callable
        Of `forecast_methods.method_of`.

    Returns
    -------
    list of dict
        As `forecast_points`.
    """
    ahead_s = ahead_of(known.states, known.place, track, steps_s)
    course = method(known, ahead_s)
    return forecast_points(course, known.states.time_s[known.place] + ahead_s, track, plane)


def points_inside(plane: SystemPlane, means: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return how many points of paths there are before the first that is outside the plane.

    Parameters
    ----------
    plane : SystemPlane
        The plane.
    means : (..., k, 2 or more) ndarray
        East and north of the points, m, in the first two columns.

    Returns
    -------
    (...) int64
        0 to k.
    """
    inside = plane.contains(means[..., 0], means[..., 1])
    outside = np.argmin(inside, axis=-1)
    return np.asarray(np.where(inside.all(axis=-1), means.shape[-2], outside), np.int64)
