"""Forecasts of live tracks, as points on the Earth."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ForecastError, TrajectoryError
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.queries.forecast_methods import (
    Known,
    Method,
    PredictedPath,
    known_of,
    method_of,
)
from multiradar.runtime.queries.moment import Moment
from multiradar.runtime.queries.polynomial_forecasts import LastPlots, last_plots
from multiradar.runtime.trajectories.ensemble_paths import member_documents
from multiradar.tracking.forecast.polynomial_forecast import WINDOW_S
from multiradar.tracking.forecast.regions import ellipses
from multiradar.tracking.forecast.state_samples import SAMPLE_EVERY_S
from multiradar.tracking.outputs import TrackStates


def forecast_steps(horizon_s: float, step_s: float, points_max: int) -> NDArray[np.float64]:
    """Return the times of the points of a forecast.

    Parameters
    ----------
    horizon_s, step_s : float
        Horizon and step, s.
    points_max : int
        Maximum number of points, including the present one.

    Returns
    -------
    (k,) ndarray
        Times ahead, s, the first 0.

    Raises
    ------
    ForecastError
        If there are too many points.
    """
    # The tolerance keeps the last point when the step divides the horizon but for rounding.
    count = int(horizon_s / step_s + 1e-9) + 1
    if count > points_max:
        reason = (
            f"expected at most {points_max} points, found {count}: "
            f"a horizon of {horizon_s} s in steps of {step_s} s"
        )
        raise ForecastError("step_s", reason)
    return np.arange(count, dtype=np.float64) * step_s


def ahead_of(
    states: TrackStates, row: int, track: dict[str, Any], steps_s: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return times after the state of a track.

    Parameters
    ----------
    states : TrackStates
        States of the filter.
    row : int
        Index of the track's state.
    track : dict
        The track as published, with its age.
    steps_s : (k,) ndarray
        Times after the present data time, s.

    Returns
    -------
    (k,) ndarray
        Times after the state, s. A state newer than the data time is not extrapolated back.
    """
    state_time_s = float(states.time_s[row])
    now_s = max(state_time_s, track["time_s"] + track["age_s"])
    ahead_s: NDArray[np.float64] = now_s + steps_s - state_time_s
    return ahead_s


def forecast_points(
    course: PredictedPath, time_s: NDArray[np.float64], track: dict[str, Any], plane: SystemPlane
) -> list[dict[str, Any]]:
    """Return the points of a forecast as published.

    Parameters
    ----------
    course : PredictedPath
        Predicted path on the plane.
    time_s : (k,) ndarray
        Data times of its points, s.
    track : dict
        The track as published, with its state.
    plane : SystemPlane
        The plane of the path.

    Returns
    -------
    list of dict
        Fields of `ForecastPoint` of the schemas, with the state of the track and the age of its
        last update at each point. The points end where the track leaves the plane.
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
    same = {"height_m": track["height_m"], "state": track["state"], "motion": course.motion}
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    points = [{**dict(zip(columns, row, strict=True)), **same} for row in rows]
    if course.ensemble is None:
        return points
    members = member_documents(course.ensemble, plane, track["height_m"] or 0.0)
    return [{**point, "members": each} for point, each in zip(points, members, strict=False)]


def forecast_from(
    known: Known,
    track: dict[str, Any],
    plane: SystemPlane,
    steps_s: NDArray[np.float64],
    method: Method,
) -> list[dict[str, Any]]:
    """Return the points of a forecast from the present data time on.

    Parameters
    ----------
    known : Known
        Input of the forecast.
    track : dict
        The track as published, with its state and age.
    plane : SystemPlane
        The plane of the states.
    steps_s : (k,) ndarray
        Times after the present data time, s.
    method : callable
        Of `forecast_methods.method_of`.

    Returns
    -------
    list of dict
        As `forecast_points`.
    """
    ahead_s = ahead_of(known.states, known.row, track, steps_s)
    course = method(known, ahead_s)
    return forecast_points(course, known.states.time_s[known.row] + ahead_s, track, plane)


def points_inside(plane: SystemPlane, means: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the number of points of paths before the first outside the plane.

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


def answer_forecast(
    known: Moment, track_id: int, *, horizon_s: float, step_s: float, probability: float, by: str
) -> dict[str, Any] | None:
    """Return the forecast of a live track, from the present data time on.

    Parameters
    ----------
    known : Moment
        The data.
    track_id : int
        The track.
    horizon_s, step_s : float
        Horizon and step, s. The first point is at the present data time.
    probability : float
        Containment probability of the regions.
    by : str
        One of `forecast_methods.METHODS`.

    Returns
    -------
    dict or None
        The fields of `Forecast` of the schemas, without points outside the system plane. None when
        there is no such live track.

    Raises
    ------
    ForecastError
        If there are too many points.
    TrajectoryError
        If the track has no state at that time (`NO_STATE`), or no bundle or too few plots for the
        method; see `code`.
    """
    steps = forecast_steps(horizon_s, step_s, known.limits.forecast_steps_max)
    track = known.track(track_id)
    if track is None:
        return None
    now = known.states()
    if now is None:
        raise _no_state(track_id)
    states, plane = now
    source = known_of(
        states, track_id, known.calibration, lambda: known.trajectory_feed().read(track_id),
        lambda: last_plots_of(known, plane, track_id),
    )  # fmt: skip
    if source is None:
        raise _no_state(track_id)
    points = forecast_from(source, track, plane, steps, method_of(by, probability))
    return {"track_id": track_id, "probability": probability, "by": by, "points": points}


# A track of the past whose first state was stored later, or is no longer retained.
def _no_state(track_id: int) -> TrajectoryError:
    return TrajectoryError(
        "NO_STATE",
        f"no state of track {track_id} is stored for this time: states are stored every "
        f"{SAMPLE_EVERY_S:.0f} s once a track is confirmed, and the oldest are discarded; "
        "request a later time",
    )


def last_plots_of(known: Moment, plane: SystemPlane, track_id: int) -> LastPlots | None:
    """Return the last plots of a live track for a polynomial; None where there are none."""
    window = known.window(track_id)
    if window is None:
        return None
    return last_plots(plane, window.rows, WINDOW_S, window.biases, known.sensors)
