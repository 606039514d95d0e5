"""Ensemble forecasts from bundles: mean, containment regions and members."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ForecastError
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.restoration.forecast.bundle_forecast import forecast
from multiradar.restoration.forecast.ensemble import (
    LATER_NAMES,
    REGION_MEMBERS,
    ForecastEnsemble,
    Members,
)
from multiradar.restoration.forecast.settings import AHEAD_MAX_S
from multiradar.runtime.trajectories.document import require_tracks
from multiradar.runtime.trajectories.ensemble_scores import SETTINGS
from multiradar.runtime.trajectories.pool import Reading
from multiradar.tracking.forecast.region_sizes import Plan
from multiradar.tracking.forecast.regions import region_factors

Floats = NDArray[np.float64]

#: Maximum members published separately; the rest is merged into one more.
MEMBERS_MAX = 15


class EnsemblePath(NamedTuple):
    """Predicted path of an ensemble forecast.

    Attributes
    ----------
    means, covariances : (k, 2) and (k, 2, 2) float64
        East and north in the plane, m and m².
    factors : (k,) float64
        The region of the requested probability is {x : (x − m)ᵀ C⁻¹ (x − m) ≤ factor}.
    calibrated : (k,) bool
        Whether the region is calibrated by earlier forecasts of that horizon; otherwise it is that
        of the mixture.
    ensemble : ForecastEnsemble
        The ensemble.
    members : Members
        The published members.
    """

    means: Floats
    covariances: Floats
    factors: Floats
    calibrated: NDArray[np.bool_]
    ensemble: ForecastEnsemble
    members: Members


def ensemble_path(reading: Reading, time_s: Floats, probability: float) -> EnsemblePath:
    """Return the ensemble forecast of a bundle.

    Parameters
    ----------
    reading : Reading
        The bundle.
    time_s : (k,) ndarray
        Ascending data times, s; times before the last plot of the bundle are set to that of the
        plot.
    probability : float
        Probability of the regions.

    Returns
    -------
    EnsemblePath
        The forecast at these times.

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
    ensemble = forecast(ends, ahead_s, SETTINGS, bundle.manoeuvre_history)
    covariances = ensemble.spread()[:, :2, :2]
    plan = reading.sizes.plan(ahead_s, probability)
    factors = _factors(plan, ensemble, ends.shared_m2, probability)
    return EnsemblePath(
        ensemble.mean()[:, :2],
        covariances,
        factors,
        plan.calibrated,
        ensemble,
        ensemble.heaviest(MEMBERS_MAX),
    )


# Regions calibrated by past errors; uncalibrated ones are those of the mixture.
def _factors(
    plan: Plan, ensemble: ForecastEnsemble, shared_m2: Floats, probability: float
) -> Floats:
    # At least the error shared by all plots, such as biases: the bundle does not observe it.
    part = np.linalg.solve(ensemble.spread()[:, :2, :2], shared_m2)
    least = 0.5 * plan.single * np.trace(part, axis1=1, axis2=2)
    factors: Floats = np.maximum(plan.factor, least)
    uncalibrated = ~plan.calibrated
    if uncalibrated.any():
        mixture = ensemble.heaviest(REGION_MEMBERS)
        factors[uncalibrated] = region_factors(
            mixture.weight[uncalibrated], mixture.state[uncalibrated, :, :2],
            mixture.covariance[uncalibrated, :, :2, :2], probability,
        )  # fmt: skip
    return factors


def member_documents(course: EnsemblePath, plane: SystemPlane, height_m: float) -> list[list[Any]]:
    """Return the published members at each time.

    Parameters
    ----------
    course : EnsemblePath
        The forecast of a bundle.
    plane : SystemPlane
        The plane of the bundle.
    height_m : float
        Height of true scale.

    Returns
    -------
    list of list of dict
        Fields of `ForecastMember` of the schemas, by descending weight; without members outside the
        plane.
    """
    members, ensemble = course.members, course.ensemble
    positions = members.state[..., :2]
    inside = (members.weight > 0.0) & plane.contains(positions[..., 0], positions[..., 1])
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
    documents: list[list[Any]] = [[] for _ in range(len(course.means))]
    for at, number, row in zip(time.tolist(), member.tolist(), rows, strict=True):
        documents[at].append({**dict(zip(columns, row, strict=True)), **_named(ensemble, number)})
    return documents


def _named(ensemble: ForecastEnsemble, member: int) -> dict[str, Any]:
    if member < 0:
        return {"trajectory": None, "lasts_s": None, "later": None}
    lasts_s = float(ensemble.lasts_s[member])
    return {
        "trajectory": int(ensemble.track[member]),
        "lasts_s": lasts_s if np.isfinite(lasts_s) else None,
        "later": LATER_NAMES[int(ensemble.later[member])],
    }
