"""Forecasts from bundles: the fan on the plane, its regions, and its members on the Earth."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ForecastError
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.restoration.forecast.ensemble import (
    LATER_NAMES,
    REGION_MEMBERS,
    ForecastEnsemble,
    Members,
)
from multiradar.restoration.forecast.forecast import forecast
from multiradar.restoration.forecast.settings import AHEAD_MAX_S
from multiradar.runtime.trajectories.document import require_tracks
from multiradar.runtime.trajectories.fan_scores import SETTINGS
from multiradar.runtime.trajectories.pool import Reading
from multiradar.tracking.forecast.forecast_scores import Plan
from multiradar.tracking.forecast.regions import region_factors

Floats = NDArray[np.float64]

#: So many members are told one by one, the rest as one more.
MEMBERS_MAX = 15


class FanCourse(NamedTuple):
    """Where a bundle expects its aircraft.

    Attributes
    ----------
    means, covariances : (k, 2) and (k, 2, 2) float64
        East and north in the plane, m and m².
    factors : (k,) float64
        The region of the probability asked for is {x : (x − m)ᵀ C⁻¹ (x − m) ≤ factor}.
    calibrated : (k,) bool
        Whether earlier forecasts as far ahead have told how large it must be; elsewhere it is that
        of the mixture.
    fan : ForecastEnsemble
        All of it.
    members : Members
        Those that are told.
    """

    means: Floats
    covariances: Floats
    factors: Floats
    calibrated: NDArray[np.bool_]
    fan: ForecastEnsemble
    members: Members


def fan_course(reading: Reading, time_s: Floats, probability: float) -> FanCourse:
    """Return where a bundle expects its aircraft.

    Parameters
    ----------
    reading : Reading
        The bundle.
    time_s : (k,) ndarray
        Ascending data times, s. Before the last plot of the bundle nothing is forecast: such a time
        is told as that of the plot.
    probability : float
        That of the regions.

    Returns
    -------
    FanCourse
        At these times.

    Raises
    ------
    TrajectoryError
        If there are no trajectories yet: `TOO_FEW_PLOTS`, `NO_TRIPLE`.
    ForecastError
        If a time is too far ahead.
    """
    bundle = reading.bundle
    require_tracks(bundle)
    ends = bundle.final_states()
    ahead_s = np.maximum(time_s - ends.time_s, 0.0)
    if ahead_s[-1] > AHEAD_MAX_S:
        reason = (
            f"expected at most {AHEAD_MAX_S:g} s after the last plot of the bundle, "
            f"was {ahead_s[-1]:.1f} s"
        )
        raise ForecastError("horizon_s", reason)
    fan = forecast(ends, ahead_s, SETTINGS, bundle.manoeuvre_history)
    covariances = fan.spread()[:, :2, :2]
    plan = reading.learnt.plan(ahead_s, probability)
    factors = _factors(plan, fan, ends.shared_m2, probability)
    return FanCourse(
        fan.mean()[:, :2], covariances, factors, plan.calibrated, fan, fan.heaviest(MEMBERS_MAX)
    )


# As large as past errors ask, or as the mixture itself where none have been judged.
def _factors(plan: Plan, fan: ForecastEnsemble, shared_m2: Floats, probability: float) -> Floats:
    # No surer than of what plots share, such as biases: no later place of a bundle tells that.
    part = np.linalg.solve(fan.spread()[:, :2, :2], shared_m2)
    least = 0.5 * plan.single * np.trace(part, axis1=1, axis2=2)
    factors: Floats = np.maximum(plan.factor, least)
    untold = ~plan.calibrated
    if untold.any():
        places = fan.heaviest(REGION_MEMBERS)
        factors[untold] = region_factors(
            places.weight[untold], places.state[untold, :, :2],
            places.covariance[untold, :, :2, :2], probability,
        )  # fmt: skip
    return factors


def told_members(course: FanCourse, plane: SystemPlane, height_m: float) -> list[list[Any]]:
    """Return the members of each time as they are told.

    Parameters
    ----------
    course : FanCourse
        Of a bundle.
    plane : SystemPlane
        The plane of the bundle.
    height_m : float
        Height at which a metre is a metre.

    Returns
    -------
    list of list of dict
        Fields of `ForecastMember` of the schemas, by falling weight; without those
        that have left the plane.
    """
    members, fan = course.members, course.fan
    places = members.state[..., :2]
    inside = (members.weight > 0.0) & plane.contains(places[..., 0], places[..., 1])
    time = np.nonzero(inside)[0]
    state, member = members.state[inside], members.member[inside]
    latitude_rad, longitude_rad = plane.to_geodetic(state[:, 0], state[:, 1])
    matrix = plane.local_matrix(state[:, 0], state[:, 1], height_m)
    velocity = np.einsum("nij,nj->ni", matrix, state[:, 2:])
    covariance = matrix @ members.covariance[inside][:, :2, :2] @ matrix.swapaxes(-1, -2)
    columns = {
        "weight": members.weight[inside],
        "latitude_deg": np.degrees(latitude_rad),
        "longitude_deg": np.degrees(longitude_rad),
        "velocity_east_mps": velocity[:, 0],
        "velocity_north_mps": velocity[:, 1],
        "covariance_east_m2": covariance[:, 0, 0],
        "covariance_east_north_m2": covariance[:, 0, 1],
        "covariance_north_m2": covariance[:, 1, 1],
    }
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    told: list[list[Any]] = [[] for _ in range(len(course.means))]
    for at, number, row in zip(time.tolist(), member.tolist(), rows, strict=True):
        told[at].append({**dict(zip(columns, row, strict=True)), **_named(fan, number)})
    return told


def _named(fan: ForecastEnsemble, member: int) -> dict[str, Any]:
    if member < 0:
        return {"trajectory": None, "lasts_s": None, "later": None}
    lasts_s = float(fan.lasts_s[member])
    return {
        "trajectory": int(fan.track[member]),
        "lasts_s": lasts_s if np.isfinite(lasts_s) else None,
        "later": LATER_NAMES[int(fan.later[member])],
    }
