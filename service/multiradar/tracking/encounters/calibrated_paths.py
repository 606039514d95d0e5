"""Predicted paths of tracks, with covariances calibrated by past forecast errors.

Symbols: P = covariance of the state, B = part of the forecast covariance C due to biases, D = C − B
= independent part, D₀ = D of the state; λ = size of errors in terms of C; y = fraction of the
growth D − D₀ that is used.

Common errors of tracks do not affect their separation, and no later update of a track shows them:
the calibrated size λ C is that of independent errors. y is such that D₀ + y (D − D₀) has the size
of λ C, averaged over all directions. λ C is never less than the covariance by the filter's own
motion model: past traffic may only increase it, as it does not show what an aircraft will do next.
Between the state and the shortest calibrated horizon λ C is interpolated from D, as regions are
from the covariance; beyond the longest one λ grows with time.

Few aircraft turn, and those deviate far: λ is one of two, see `mixture_scales`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.encounters._relative_kernels import RARE_SHARE
from multiradar.tracking.encounters.pairs import velocity_spreads_of
from multiradar.tracking.encounters.scale_mixture import MEDIAN, UPPER, mixture_scales
from multiradar.tracking.forecast.forecast_calibration import ForecastCalibration
from multiradar.tracking.forecast.persistent_walk import propagated_covariance
from multiradar.tracking.forecast.region_sizes import HORIZONS_S, ForecastScores
from multiradar.tracking.outputs import TrackStates

Floats = NDArray[np.float64]

#: Age up to which the velocity errors of a state are used unchanged, s.
FRESH_S = 1.0
# Below this a fraction of a covariance is a rounding error.
_SHARE_MIN = 1e-9


class CalibratedPaths(NamedTuple):
    """Predicted paths.

    Attributes
    ----------
    means : (n, k, 4) float64
        East and north on the plane, m, and their rates, m/s.
    now : (n, 10) float64
        Upper triangles of their covariances at the first time, row by row.
    velocity_spreads : (n, k, 6) float64
        Covariances of the mean velocities since then, as in `pairs.Paths`, (m/s)².
    """

    means: Floats
    now: Floats
    velocity_spreads: Floats


def calibrated_paths(
    calibration: ForecastCalibration, states: TrackStates, ahead_s: Floats, times_s: Floats
) -> CalibratedPaths:
    """Return the predicted paths of tracks by the best-calibrated motion model.

    Parameters
    ----------
    calibration : ForecastCalibration
        Calibration of forecasts.
    states : TrackStates
        States of n tracks.
    ahead_s : (n,) ndarray
        Time from its state to now, for each track, s, not negative.
    times_s : (k,) ndarray
        Times after now, s, ascending from 0.

    Returns
    -------
    CalibratedPaths
        Paths at these times. Without calibration, covariances are those of aircraft that turn all
        the time.
    """
    at_s = ahead_s[:, None] + times_s
    motion, sizes = _sizes(calibration.scores, at_s)
    means, covariances = calibration.family.paths(motion, states, at_s)
    if sizes is None:
        covariances = calibration.family.worst_case_covariances(means[..., :2], states, at_s)
    shared = np.zeros((len(states), 4, 4))
    if states.shared is not None:
        shared = states.shared @ states.shared.swapaxes(-1, -2)
    alike = propagated_covariance(shared, at_s)
    alone = states.covariance - shared
    first = alone[:, None, :2, :2]
    growth = covariances - alike - first
    # Part of the growth due to the velocity of the state.
    led = propagated_covariance(alone, at_s) - first
    parts = [np.ones_like(at_s)] * 2
    if sizes is not None:
        own = calibration.family.own_covariances(motion, states, at_s, covariances)
        own_size = _share(covariances, own)
        sizes = (np.maximum(sizes[0], own_size), np.maximum(sizes[1], own_size))
        parts = [_part(size, at_s, covariances, (first, growth)) for size in sizes]
    spreads = [first + part[..., None, None] * growth + alike for part in parts]
    mean = (1.0 - RARE_SHARE) * parts[0][:, 0] + RARE_SHARE * parts[1][:, 0]
    noise = growth[:, 0] - led[:, 0]
    least = np.minimum(np.minimum(*parts).min(axis=1), 1.0)
    now = _joint(alone, ahead_s, mean[:, None, None] * noise, least)
    now += _joint(shared, ahead_s, np.zeros_like(noise), np.ones_like(least))
    velocity_spreads = []
    for spread in spreads:
        # An aircraft with rare errors by now keeps them.
        now[:, :2, :2] = spread[:, 0]
        velocity_spreads.append(velocity_spreads_of(times_s, _upper(now), _upper(spread)))
    now[:, :2, :2] = first[:, 0] + mean[:, None, None] * growth[:, 0] + alike[:, 0]
    return CalibratedPaths(means, _upper(now), np.concatenate(velocity_spreads, axis=-1))


# Motion model, and sizes of usual and rare errors; None without calibration.
def _sizes(scores: ForecastScores, at_s: Floats) -> tuple[int, tuple[Floats, Floats] | None]:
    calibrated_s = scores.calibrated_to_s
    near_s = np.minimum(at_s, calibrated_s)
    half = scores.plan(near_s, MEDIAN)
    # Another thread may update the calibration: the motion model is kept.
    most = scores.plan(near_s, UPPER, half.motion)
    if calibrated_s == 0.0:
        return half.motion, None
    beyond = np.maximum(at_s / calibrated_s, 1.0)
    usual, rare = mixture_scales(half.factor, most.factor)
    return half.motion, (beyond * usual, beyond * rare)


# Fraction y of the growth, for errors of a size.
def _part(
    size: Floats, at_s: Floats, covariances: Floats, matrices: tuple[Floats, Floats]
) -> Floats:
    initial, grown = (_share(covariances, one) for one in matrices)
    alone = np.clip(initial + grown, _SHARE_MIN, 1.0)
    # Interpolation up to the shortest calibrated horizon, as for regions.
    weight = np.minimum(np.log1p(at_s / HORIZONS_S[0]) / np.log(2.0), 1.0)
    wanted = size * alone ** (1.0 - weight)
    part: Floats = np.ones_like(wanted)
    np.divide(np.maximum(wanted - initial, 0.0), grown, out=part, where=grown > _SHARE_MIN)
    return part


# Upper triangles of symmetric matrices, row by row.
def _upper(matrices: Floats) -> Floats:
    rows, columns = np.triu_indices(matrices.shape[-1])
    pairs = zip(rows.tolist(), columns.tolist(), strict=True)
    return np.stack([matrices[..., i, j] for i, j in pairs], axis=-1)


# Half the trace of C⁻¹ M: size of M in terms of C, 1 for C itself.
def _share(covariances: Floats, matrices: Floats) -> Floats:
    a, b, d = (covariances[..., i, j] for i, j in ((0, 0), (0, 1), (1, 1)))
    crossed = 2.0 * b * matrices[..., 0, 1]
    top = d * matrices[..., 0, 0] - crossed + a * matrices[..., 1, 1]
    determinant = a * d - b * b
    out = np.ones_like(top)
    return np.asarray(0.5 * np.divide(top, determinant, out=out, where=determinant > 0.0))


# Covariances of states some time later, with the noise of a white acceleration that has this effect
# on the position; only a fraction of the cross-covariance is used.
def _joint(covariance: Floats, ahead_s: Floats, noise: Floats, part: Floats) -> Floats:
    old_s = np.maximum(ahead_s, FRESH_S)[:, None, None]
    noise = np.where(ahead_s[:, None, None] < FRESH_S, 0.0, noise)
    rate = covariance[:, 2:, 2:]
    cross = covariance[:, :2, 2:] + ahead_s[:, None, None] * rate + 1.5 * noise / old_s
    found = np.empty_like(covariance)
    found[:, :2, :2] = propagated_covariance(covariance, ahead_s[:, None])[:, 0] + noise
    found[:, :2, 2:] = part[:, None, None] * cross
    found[:, 2:, :2] = found[:, :2, 2:].swapaxes(-1, -2)
    found[:, 2:, 2:] = rate + 3.0 * noise / old_s**2
    return found
