"""The fixed-interval smoother of interacting modes, over all places of many aircraft at once.

Forwards it is the interacting multiple model filter, backwards a Rauch–Tung–Striebel step for each
mode and the mixing of what the later modes say of the earlier ones. Means depend on what is left of
the biases, affinely: x = a + V ς, with one column of V for each bias, so that the covariance that
is told includes them.

References
----------
R. E. Helmick, W. D. Blair, S. A. Hoffman, "Fixed-interval smoothing for Markovian switching
systems", IEEE Transactions on Information Theory 41 (1995) 1845-1855: what the later measurements
say of each pair of modes. N. Nadarajah, R. Tharmarasa, M. McDonald, T. Kirubarajan, "IMM forward
filtering and backward smoothing for maneuvering target tracking", IEEE Transactions on Aerospace
and Electronic Systems 48 (2012) 2673-2678: Rauch–Tung–Striebel steps of the modes. The project's
own: the affine form, and noise raised by surprise.
"""

from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.smoothing.motion_modes import MotionModes
from multiradar.evaluation.smoothing.single_mode import Sightings, Smoothed, smooth
from multiradar.evaluation.trajectories import Flags, Floats, Indices

#: Standard deviation of each component of the velocity before anything is known, m/s.
_VELOCITY_PRIOR_MPS = 300.0
#: Probability of straight flight before anything is known.
_STRAIGHT_AT_FIRST = 0.5
#: Less than this no mode is held for, so that each can come back.
_PROBABILITY_MIN = 1e-9
#: Weight of the newest place in the mean of half the normalised innovation squared; the mean from
#: which noise comes to all modes, its density (m²/s³) for each factor above 1, and the most of it.
_SURPRISE_GAIN, _SURPRISE_FLOOR, _SURPRISE_DENSITY, _FACTOR_MAX = 0.4, 3.0, 256.0, 300.0
#: Aircraft that are smoothed together.
_CHUNK = 16


@dataclass(frozen=True, slots=True, eq=False)
class BiasErrors:
    """How places depend on what is left of the biases.

    Attributes
    ----------
    sensitivity : (n, 2, c) float64
        By how far each place is off, east and north (m), for each unit of each bias.
    covariance : (c, c) float64
        Covariance of what is left.
    """

    sensitivity: Floats
    covariance: Floats


def smooth_modes(
    sightings: Sightings, modes: MotionModes, density: float, biases: BiasErrors | None = None
) -> Smoothed:
    """Smooth the places of aircraft that manoeuvre.

    Parameters
    ----------
    sightings : Sightings
        All of them.
    modes : MotionModes
        How aircraft may move.
    density : float
        Spectral density of the acceleration, m²/s³, with which outliers are told: see
        `smoothing.smooth`.
    biases : BiasErrors, optional
        What is left of the biases; without it nothing.

    Returns
    -------
    Smoothed
        Mean and covariance over all modes, the errors of the biases included.

    References
    ----------
    Helmick, Blair, Hoffman (1995) and Nadarajah et al. (2012), see the head of this module.
    """
    count = len(sightings)
    used = smooth(sightings, density).used
    rows = np.flatnonzero(used)
    taken = sightings.take(rows)
    known = biases or BiasErrors(np.zeros((count, 2, 0)), np.zeros((0, 0)))
    left = BiasErrors(known.sensitivity[rows], known.covariance)
    state, covariance = np.full((count, 4), np.nan), np.full((count, 2, 2), np.nan)
    first = np.flatnonzero(np.append(True, np.diff(taken.aircraft) != 0)[: len(rows)])
    length = np.diff(np.append(first, len(rows)))
    # Aircraft of like length together: little is filled up.
    order = np.argsort(length, kind="stable")
    for begin in range(0, len(order), _CHUNK):
        chosen = order[begin : begin + _CHUNK]
        steps = np.arange(int(length[chosen].max()))
        # Behind its end an aircraft stands still at its last place, without measuring it.
        row = first[chosen, None] + np.minimum(steps, length[chosen, None] - 1)
        live = steps < length[chosen, None]
        mean, spread = _Chunk(taken, left, row, live, modes).run()
        state[rows[row[live]]], covariance[rows[row[live]]] = mean[live], spread[live]
    trace = covariance[:, 0, 0] + covariance[:, 1, 1]
    return Smoothed(state, trace, used, covariance)


@dataclass(slots=True, eq=False)
class _Mixture:
    # States of aircraft in each mode: probabilities (a, j), means (a, j, 4, 1 + c) with a column
    # for each bias behind that of the estimate, covariances (a, j, 4, 4).
    chance: Floats
    mean: Floats
    covariance: Floats

    def merged(self, weight: Floats) -> tuple[Floats, Floats]:
        """Return means and covariances by weights (a, i, k) over the modes i."""
        mean = np.einsum("aik,aimc->akmc", weight, self.mean)
        apart = self.mean[:, :, None, :, 0] - mean[:, None, :, :, 0]
        covariance = np.einsum("aik,aimn->akmn", weight, self.covariance)
        return mean, covariance + np.einsum("aik,aikm,aikn->akmn", weight, apart, apart)


@dataclass(frozen=True, slots=True, eq=False)
class _Passage:
    # From one place to the next: the states there before, what of them is mixed into each mode
    # (a, i, j), the states so mixed, and how they move.
    before: _Mixture
    share: Floats
    mixed: _Mixture
    motion: Floats
    ahead: _Mixture


class _Chunk:
    # Aircraft side by side: arrays (aircraft, step, …).
    def __init__(
        self, sightings: Sightings, biases: BiasErrors, row: Indices, live: Flags,
        modes: MotionModes,
    ) -> None:  # fmt: skip
        self._place, self._noise = sightings.position_m[row], sightings.covariance_m2[row]
        self._sensitivity, self._bias = biases.sensitivity[row], biases.covariance
        time_s = sightings.time_s[row]
        self._step_s = np.diff(time_s, axis=1, prepend=time_s[:, :1])
        self._live, self._modes = live, modes
        self._surprise = np.ones(len(row))

    def run(self) -> tuple[Floats, Floats]:
        """Return states (a, s, 4) and covariances of positions (a, s, 2, 2)."""
        many, steps = self._live.shape
        state, covariance = np.empty((many, steps, 4)), np.empty((many, steps, 2, 2))
        now, passages = self._begin(), []
        for step in range(1, steps):
            passage = self._pass(now, self._step_s[:, step])
            passages.append(passage)
            now = self._correct(passage.ahead, step)
        for step in range(steps - 1, -1, -1):
            mean, spread = now.merged(now.chance[..., None])
            bias = mean[:, 0, :2, 1:]
            state[:, step] = mean[:, 0, :, 0]
            covariance[:, step] = spread[:, 0, :2, :2] + bias @ self._bias @ bias.swapaxes(1, 2)
            if step:
                now = _earlier(passages[step - 1], now)
        return state, covariance

    def _begin(self) -> _Mixture:
        many, count = len(self._live), len(self._modes)
        chance = np.full((many, count), (1.0 - _STRAIGHT_AT_FIRST) / max(count - 1, 1))
        chance[:, 0] = 1.0 - chance[:, 1:].sum(axis=1)
        mean = np.zeros((many, count, 4, 1 + len(self._bias)))
        mean[:, :, :2, 0] = self._place[:, None, 0]
        mean[:, :, :2, 1:] = -self._sensitivity[:, None, 0]
        covariance = np.zeros((many, count, 4, 4))
        covariance[:, :, :2, :2] = self._noise[:, None, 0]
        covariance[:, :, 2:, 2:] = _VELOCITY_PRIOR_MPS**2 * np.eye(2)
        return _Mixture(chance, mean, covariance)

    def _pass(self, now: _Mixture, step_s: Floats) -> _Passage:
        joint = self._modes.passages(step_s) * now.chance[:, :, None]
        chance = joint.sum(axis=1)
        # Where no time goes by no mode can be entered: any share of it will do.
        safe = np.where(chance > 0.0, chance, 1.0)
        mean, covariance = now.merged(joint / safe[:, None])
        velocity = mean[..., 2:, 0]
        variance = covariance[..., 2, 2] + covariance[..., 3, 3]
        motion = self._modes.motion(step_s, velocity, variance)
        moved = motion @ mean
        middle = 0.5 * (velocity + moved[..., 2:, 0])
        excess = np.maximum(1.0, self._surprise / _SURPRISE_FLOOR) ** 4
        more = _SURPRISE_DENSITY * (np.minimum(excess, _FACTOR_MAX) - 1.0)
        spread = motion @ covariance @ motion.swapaxes(-1, -2)
        spread = _symmetric(spread + self._modes.noise(step_s, middle, more))
        return _Passage(
            now, joint, _Mixture(chance, mean, covariance), motion, _Mixture(chance, moved, spread)
        )

    def _correct(self, ahead: _Mixture, step: int) -> _Mixture:
        taken = self._live[:, step]
        innovation = -ahead.mean[..., :2, :]
        innovation[..., 0] += self._place[:, None, step]
        # The mean falls by V ς as the place rises by its own part of ς.
        innovation[..., 1:] -= self._sensitivity[:, None, step]
        total = ahead.covariance[..., :2, :2] + self._noise[:, None, step]
        gain = np.linalg.solve(total, ahead.covariance[..., :2, :]).swapaxes(-1, -2)
        gain = gain * taken[:, None, None, None]
        mean = ahead.mean + gain @ innovation
        covariance = _symmetric(ahead.covariance - gain @ ahead.covariance[..., :2, :])
        bias = innovation[..., 1:]
        judged = total + bias @ self._bias @ bias.swapaxes(-1, -2)
        off = innovation[..., 0]
        squared = np.einsum("ajm,ajm->aj", off, np.linalg.solve(judged, off[..., None])[..., 0])
        fit = -0.5 * (squared + np.log(np.linalg.det(judged)))
        likely = ahead.chance * np.exp(fit - fit.max(axis=1, keepdims=True)) + _PROBABILITY_MIN
        chance = np.where(taken[:, None], likely, ahead.chance)
        chance /= chance.sum(axis=1, keepdims=True)
        surprise = 0.5 * np.einsum("aj,aj->a", ahead.chance, squared)
        self._surprise += np.where(taken, _SURPRISE_GAIN * (surprise - self._surprise), 0.0)
        return _Mixture(chance, mean, covariance)


# What is known at a place when all is known at the next.
def _earlier(passage: _Passage, later: _Mixture) -> _Mixture:
    mixed, ahead, before = passage.mixed, passage.ahead, passage.before
    # Rauch et al. (1965): G = P Fᵀ P(k+1|k)⁻¹, for each later mode.
    back = np.linalg.solve(ahead.covariance, passage.motion @ mixed.covariance).swapaxes(-1, -2)
    change = back @ (later.mean - ahead.mean)
    smoothed = mixed.covariance + back @ (later.covariance - ahead.covariance) @ back.swapaxes(
        -1, -2
    )
    told, vector = _later_information(mixed.covariance, smoothed, change)
    # With each earlier mode in place of the mixture: pairs (a, i, j).
    own = np.linalg.inv(before.covariance)
    apart = before.mean[:, :, None] - mixed.mean[:, None]
    total = own[:, :, None] + told[:, None]
    covariance = np.linalg.inv(total)
    right = own[:, :, None] @ apart + vector[:, None]
    mean = covariance @ right
    fit = 0.5 * (
        np.einsum("aijm,aijm->aij", right[..., 0], mean[..., 0])
        - np.einsum("aijm,aijm->aij", apart[..., 0], (own[:, :, None] @ apart)[..., 0])
        + np.log(np.linalg.det(own))[:, :, None]
        - np.log(np.linalg.det(total))
    )
    possible = passage.share > 0.0
    fit = np.where(possible, fit + np.log(np.where(possible, passage.share, 1.0)), -np.inf)
    weight = np.exp(fit - fit.max(axis=1, keepdims=True))
    weight /= weight.sum(axis=1, keepdims=True)
    joint = weight * later.chance[:, None]
    chance = joint.sum(axis=2)
    share = joint / np.maximum(chance, 1e-300)[..., None]
    absolute = mean + mixed.mean[:, None]
    whole = np.einsum("aij,aijmc->aimc", share, absolute)
    off = absolute[..., 0] - whole[:, :, None, :, 0]
    spread = np.einsum("aij,aijmn->aimn", share, covariance)
    spread = spread + np.einsum("aij,aijm,aijn->aimn", share, off, off)
    return _Mixture(chance / chance.sum(axis=1, keepdims=True), whole, _symmetric(spread))


# What later places say of a state of which a mean and a covariance were known before: information Y
# and vector y about the mean. A mixture of what still later modes say may be wider than what was
# known before; it then says nothing, not less than that.
def _later_information(known: Floats, smoothed: Floats, change: Floats) -> tuple[Floats, Floats]:
    # Rounding must not leave it without a root.
    rounded = known * (1.0 + 1e-10 * np.eye(known.shape[-1]))
    white = np.linalg.inv(np.linalg.cholesky(rounded))
    values, ways = np.linalg.eigh(_symmetric(white @ smoothed @ white.swapaxes(-1, -2)))
    values = np.maximum(values, 1e-12)
    back = white.swapaxes(-1, -2) @ ways
    told = (back * np.maximum(0.0, 1.0 / values - 1.0)[..., None, :]) @ back.swapaxes(-1, -2)
    # Of B = L⁻ᵀ U is smoothed⁻¹ = B diag(1/e) Bᵀ.
    vector = (back / values[..., None, :]) @ (back.swapaxes(-1, -2) @ change)
    return _symmetric(told), vector


# Rounding makes a covariance asymmetric, and over hundreds of steps that grows.
def _symmetric(matrix: Floats) -> Floats:
    half: Floats = 0.5 * (matrix + matrix.swapaxes(-1, -2))
    return half
