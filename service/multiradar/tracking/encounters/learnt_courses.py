"""Where tracks are expected to be, and how surely, as the run has taught.

Symbols: P = covariance of the state, B = what the biases do to it, D = C − B = what errs by itself
in the covariance C of a forecast, D₀ = D of the state; λ = how large errors are, over C; y = part
of the growth D − D₀ that is taken.

What tracks err by alike parts nobody, and no later update of a track tells of it: what was learnt,
λ C, is what errs by itself. So y is such that D₀ + y (D − D₀) is as large as λ C, on the average of
all directions. λ C is never less than the covariance by the filter's own motion: what the traffic
has done widens, as it does not tell what an aircraft will do next. From the state to the
shortest time that is judged λ C goes on from D, as regions go on from the covariance; beyond the
longest that is, λ grows with the time.

Few aircraft turn, and those are far off: λ is one of two, see `two_sizes`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.encounters._relative_kernels import RARE_SHARE
from multiradar.tracking.encounters.pairs import walks_of
from multiradar.tracking.encounters.two_sizes import HALF, MOST, two_sizes
from multiradar.tracking.forecast.forecast_calibration import ForecastCalibration
from multiradar.tracking.forecast.forecast_scores import HORIZONS_S, ForecastScores
from multiradar.tracking.forecast.persistent_walk import carried
from multiradar.tracking.outputs import TrackStates

Floats = NDArray[np.float64]

#: A state that is not so old, s, has errors of its velocity as it is.
FRESH_S = 1.0
# Below this a share of a covariance is a rounding error.
_SHARE_MIN = 1e-9


class Courses(NamedTuple):
    """Where tracks are expected to be.

    Attributes
    ----------
    means : (n, k, 4) float64
        East and north on the plane, m, and their rates, m/s.
    now : (n, 10) float64
        Upper triangles of their covariances at the first of the times, row by row.
    walks : (n, k, 6) float64
        Covariances of the mean velocities since then, as in `pairs.Paths`, (m/s)².
    """

    means: Floats
    now: Floats
    walks: Floats


def learnt_courses(
    calibration: ForecastCalibration, states: TrackStates, ahead_s: Floats, times_s: Floats
) -> Courses:
    """Return where tracks are expected to be, by the motion that has fitted the traffic best.

    Parameters
    ----------
    calibration : ForecastCalibration
        What was learnt so far.
    states : TrackStates
        Of n tracks.
    ahead_s : (n,) ndarray
        How long after its state now is, for each track, s, not negative.
    times_s : (k,) ndarray
        Times after now, s, ascending from 0.

    Returns
    -------
    Courses
        At these times. As long as nothing has been judged as far ahead, covariances are those of
        aircraft that turn all the time.
    """
    at_s = ahead_s[:, None] + times_s
    motion, sizes = _sizes(calibration.scores, at_s)
    means, covariances = calibration.family.courses(motion, states, at_s)
    if sizes is None:
        covariances = calibration.family.careful_covariances(means[..., :2], states, at_s)
    shared = np.zeros((len(states), 4, 4))
    if states.shared is not None:
        shared = states.shared @ states.shared.swapaxes(-1, -2)
    alike = carried(shared, at_s)
    alone = states.covariance - shared
    first = alone[:, None, :2, :2]
    growth = covariances - alike - first
    # What of the growth is the velocity of the state.
    led = carried(alone, at_s) - first
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
    walks = []
    for spread in spreads:
        # Who has strayed by now goes on to stray.
        now[:, :2, :2] = spread[:, 0]
        walks.append(walks_of(times_s, _upper(now), _upper(spread)))
    now[:, :2, :2] = first[:, 0] + mean[:, None, None] * growth[:, 0] + alike[:, 0]
    return Courses(means, _upper(now), np.concatenate(walks, axis=-1))


# The motion, and how large usual and rare errors are; None before anything has been judged.
def _sizes(scores: ForecastScores, at_s: Floats) -> tuple[int, tuple[Floats, Floats] | None]:
    judged_s = scores.calibrated_to_s
    near_s = np.minimum(at_s, judged_s)
    half = scores.plan(near_s, HALF)
    # Another thread may learn meanwhile: the motion stays.
    most = scores.plan(near_s, MOST, half.motion)
    if judged_s == 0.0:
        return half.motion, None
    beyond = np.maximum(at_s / judged_s, 1.0)
    usual, rare = two_sizes(half.factor, most.factor)
    return half.motion, (beyond * usual, beyond * rare)


# The y of the growth, for errors of a size.
def _part(
    size: Floats, at_s: Floats, covariances: Floats, matrices: tuple[Floats, Floats]
) -> Floats:
    begun, grown = (_share(covariances, one) for one in matrices)
    alone = np.clip(begun + grown, _SHARE_MIN, 1.0)
    # The part of the way to the shortest time that is judged, as regions go it.
    way = np.minimum(np.log1p(at_s / HORIZONS_S[0]) / np.log(2.0), 1.0)
    wanted = size * alone ** (1.0 - way)
    part: Floats = np.ones_like(wanted)
    np.divide(np.maximum(wanted - begun, 0.0), grown, out=part, where=grown > _SHARE_MIN)
    return part


# Upper triangles of symmetric matrices, row by row.
def _upper(matrices: Floats) -> Floats:
    rows, columns = np.triu_indices(matrices.shape[-1])
    pairs = zip(rows.tolist(), columns.tolist(), strict=True)
    return np.stack([matrices[..., i, j] for i, j in pairs], axis=-1)


# Half the trace of C⁻¹ M: how large M is beside C, 1 for C itself.
def _share(covariances: Floats, matrices: Floats) -> Floats:
    a, b, d = (covariances[..., i, j] for i, j in ((0, 0), (0, 1), (1, 1)))
    crossed = 2.0 * b * matrices[..., 0, 1]
    top = d * matrices[..., 0, 0] - crossed + a * matrices[..., 1, 1]
    determinant = a * d - b * b
    out = np.ones_like(top)
    return np.asarray(0.5 * np.divide(top, determinant, out=out, where=determinant > 0.0))


# Covariances of states some time later, the noise being as that of a white acceleration with this
# effect on the position; of that of position and velocity only a part is taken.
def _joint(covariance: Floats, ahead_s: Floats, noise: Floats, part: Floats) -> Floats:
    old_s = np.maximum(ahead_s, FRESH_S)[:, None, None]
    noise = np.where(ahead_s[:, None, None] < FRESH_S, 0.0, noise)
    rate = covariance[:, 2:, 2:]
    cross = covariance[:, :2, 2:] + ahead_s[:, None, None] * rate + 1.5 * noise / old_s
    found = np.empty_like(covariance)
    found[:, :2, :2] = carried(covariance, ahead_s[:, None])[:, 0] + noise
    found[:, :2, 2:] = part[:, None, None] * cross
    found[:, 2:, :2] = found[:, :2, 2:].swapaxes(-1, -2)
    found[:, 2:, 2:] = rate + 3.0 * noise / old_s**2
    return found
