"""The fixed-interval smoother of interacting multiple models, over many aircraft at once.

Forwards it is the interacting multiple model filter; backwards a Rauch–Tung–Striebel step for each
mode, with mixing over the later modes. Means depend on the residual biases, affinely: x = a + V ς,
with one column of V for each bias, so that the reported covariance includes them.

References
----------
R. E. Helmick, W. D. Blair, S. A. Hoffman, "Fixed-interval smoothing for Markovian switching
systems", IEEE Transactions on Information Theory 41 (1995) 1845-1855: what the later measurements
say of each pair of modes. N. Nadarajah, R. Tharmarasa, M. McDonald, T. Kirubarajan, "IMM forward
filtering and backward smoothing for maneuvering target tracking", IEEE Transactions on Aerospace
and Electronic Systems 48 (2012) 2673-2678: Rauch–Tung–Striebel steps of the modes. The project's
own: the affine form, and process noise increased by the normalised innovation squared.
"""

from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.smoothing.motion_modes import MotionModes
from multiradar.evaluation.smoothing.single_mode import (
    PositionMeasurements,
    Smoothed,
    chunks,
    smooth,
)
from multiradar.evaluation.trajectories import Flags, Floats, Indices

#: Prior standard deviation of each component of the velocity, m/s.
_VELOCITY_PRIOR_MPS = 300.0
#: Prior probability of straight flight.
_STRAIGHT_AT_FIRST = 0.5
#: Minimum probability of a mode, so that each can recover.
_PROBABILITY_MIN = 1e-9
#: Gain of the running mean of half the normalised innovation squared (NIS); the mean above which
#: process noise is added to all modes, its density (m²/s³) for each factor above 1, maximum factor.
_NIS_GAIN, _NIS_FLOOR, _NIS_DENSITY, _FACTOR_MAX = 0.4, 3.0, 256.0, 300.0
#: Number of aircraft smoothed together, and of their steps in memory at once: with 16 biases and
#: eight modes, 20 kB each.
_AIRCRAFT_MAX, _STEPS_MAX = 16, 16_384


@dataclass(frozen=True, slots=True, eq=False)
class ResidualBiases:
    """Dependence of positions on the residual biases.

    Attributes
    ----------
    sensitivity : (n, 2, c) float64
        Error of each position, east and north (m), per unit of each bias.
    covariance : (c, c) float64
        Covariance of the residual biases.
    """

    sensitivity: Floats
    covariance: Floats


def smooth_modes(
    measured: PositionMeasurements,
    modes: MotionModes,
    density: float,
    biases: ResidualBiases | None = None,
) -> Smoothed:
    """Smooth the positions of manoeuvring aircraft.

    Parameters
    ----------
    measured : PositionMeasurements
        Positions of all aircraft.
    modes : MotionModes
        Modes of motion.
    density : float
        Spectral density of the acceleration, m²/s³, for outlier detection: see
        `single_mode.smooth`.
    biases : ResidualBiases, optional
        Residual biases; without them none.

    Returns
    -------
    Smoothed
        Mean and covariance over all modes, including the errors of the biases.

    References
    ----------
    Helmick, Blair, Hoffman (1995) and Nadarajah et al. (2012), see the head of this module.
    """
    count = len(measured)
    used = smooth(measured, density).used
    rows = np.flatnonzero(used)
    selected = measured.select(rows)
    known = biases or ResidualBiases(np.zeros((count, 2, 0)), np.zeros((0, 0)))
    left = ResidualBiases(known.sensitivity[rows], known.covariance)
    state, covariance = np.full((count, 4), np.nan), np.full((count, 2, 2), np.nan)
    first = np.flatnonzero(np.append(True, np.diff(selected.aircraft) != 0)[: len(rows)])
    length = np.diff(np.append(first, len(rows)))
    for chosen in chunks(length, _AIRCRAFT_MAX, _STEPS_MAX):
        steps = np.arange(int(length[chosen].max()))
        # Padding: beyond its end an aircraft keeps its last position, without measuring it.
        row = first[chosen, None] + np.minimum(steps, length[chosen, None] - 1)
        live = steps < length[chosen, None]
        mean, spread = _Chunk(selected, left, row, live, modes).run()
        state[rows[row[live]]], covariance[rows[row[live]]] = mean[live], spread[live]
    trace = covariance[:, 0, 0] + covariance[:, 1, 1]
    return Smoothed(state, trace, used, covariance)


@dataclass(slots=True, eq=False)
class _Mixture:
    # States of aircraft in each mode: probabilities (a, j), means (a, j, 4, 1 + c) with a column
    # for each bias after that of the estimate, covariances (a, j, 4, 4).
    probability: Floats
    mean: Floats
    covariance: Floats

    def merged(self, weight: Floats) -> tuple[Floats, Floats]:
        """Return means and covariances by weights (a, i, k) over the modes i."""
        mean = np.einsum("aik,aimc->akmc", weight, self.mean)
        apart = self.mean[:, :, None, :, 0] - mean[:, None, :, :, 0]
        covariance = np.einsum("aik,aimn->akmn", weight, self.covariance)
        return mean, covariance + np.einsum("aik,aikm,aikn->akmn", weight, apart, apart)


@dataclass(frozen=True, slots=True, eq=False)
class _Transition:
    # From one position to the next: the states before, the mixing probabilities of each mode
    # (a, i, j), the mixed states, their transition matrices, and the predicted states.
    before: _Mixture
    fraction: Floats
    mixed: _Mixture
    motion: Floats
    ahead: _Mixture


class _Chunk:
    # Aircraft side by side: arrays (aircraft, step, …).
    def __init__(
        self, measured: PositionMeasurements, biases: ResidualBiases, row: Indices, live: Flags,
        modes: MotionModes,
    ) -> None:  # fmt: skip
        self._position, self._noise = measured.position_m[row], measured.covariance_m2[row]
        self._sensitivity, self._bias = biases.sensitivity[row], biases.covariance
        time_s = measured.time_s[row]
        self._step_s = np.diff(time_s, axis=1, prepend=time_s[:, :1])
        self._live, self._modes = live, modes
        self._mean_nis = np.ones(len(row))

    def run(self) -> tuple[Floats, Floats]:
        """Return states (a, s, 4) and covariances of positions (a, s, 2, 2)."""
        many, steps = self._live.shape
        state, covariance = np.empty((many, steps, 4)), np.empty((many, steps, 2, 2))
        # Only the states at the start of each block are kept: its transitions are computed again
        # when the smoother gets there.
        block = max(_STEPS_MAX // many, 1)
        now = self._begin()
        starts = [(now, self._mean_nis.copy())]
        for end in range(block, steps, block):
            now, _ = self._filter(now, end - block, end)
            starts.append((now, self._mean_nis.copy()))
        later: _Mixture | None = None
        for number, (start, mean_nis) in reversed([*enumerate(starts)]):
            first, last = number * block, min((number + 1) * block, steps - 1)
            self._mean_nis = mean_nis
            now, transitions = self._filter(start, first, last)
            now = now if later is None else later
            for step in range(last, first, -1):
                state[:, step], covariance[:, step] = self._merged(now)
                now = _earlier(transitions[step - first - 1], now)
            later = now
        state[:, 0], covariance[:, 0] = self._merged(now)
        return state, covariance

    # Filter the positions after the first step, up to the last one.
    def _filter(self, now: _Mixture, first: int, last: int) -> tuple[_Mixture, list[_Transition]]:
        transitions = []
        for step in range(first + 1, last + 1):
            transitions.append(self._predict(now, self._step_s[:, step]))
            now = self._update(transitions[-1].ahead, step)
        return now, transitions

    # Over all modes: states, and covariances of positions with the errors of the biases.
    def _merged(self, now: _Mixture) -> tuple[Floats, Floats]:
        mean, spread = now.merged(now.probability[..., None])
        bias = mean[:, 0, :2, 1:]
        return mean[:, 0, :, 0], spread[:, 0, :2, :2] + bias @ self._bias @ bias.swapaxes(1, 2)

    def _begin(self) -> _Mixture:
        many, count = len(self._live), len(self._modes)
        probability = np.full((many, count), (1.0 - _STRAIGHT_AT_FIRST) / max(count - 1, 1))
        probability[:, 0] = 1.0 - probability[:, 1:].sum(axis=1)
        mean = np.zeros((many, count, 4, 1 + len(self._bias)))
        mean[:, :, :2, 0] = self._position[:, None, 0]
        mean[:, :, :2, 1:] = -self._sensitivity[:, None, 0]
        covariance = np.zeros((many, count, 4, 4))
        covariance[:, :, :2, :2] = self._noise[:, None, 0]
        covariance[:, :, 2:, 2:] = _VELOCITY_PRIOR_MPS**2 * np.eye(2)
        return _Mixture(probability, mean, covariance)

    def _predict(self, now: _Mixture, step_s: Floats) -> _Transition:
        joint = self._modes.transition_probabilities(step_s) * now.probability[:, :, None]
        probability = joint.sum(axis=1)
        # In a step of zero length a mode may be unreachable: any mixing weights will do.
        safe = np.where(probability > 0.0, probability, 1.0)
        mean, covariance = now.merged(joint / safe[:, None])
        velocity = mean[..., 2:, 0]
        variance = covariance[..., 2, 2] + covariance[..., 3, 3]
        motion = self._modes.motion(step_s, velocity, variance)
        moved = motion @ mean
        middle = 0.5 * (velocity + moved[..., 2:, 0])
        excess = np.maximum(1.0, self._mean_nis / _NIS_FLOOR) ** 4
        more = _NIS_DENSITY * (np.minimum(excess, _FACTOR_MAX) - 1.0)
        spread = motion @ covariance @ motion.swapaxes(-1, -2)
        spread = _symmetric(spread + self._modes.noise(step_s, middle, more))
        return _Transition(
            now,
            joint,
            _Mixture(probability, mean, covariance),
            motion,
            _Mixture(probability, moved, spread),
        )

    def _update(self, ahead: _Mixture, step: int) -> _Mixture:
        updated = self._live[:, step]
        innovation = -ahead.mean[..., :2, :]
        innovation[..., 0] += self._position[:, None, step]
        # The mean falls by V ς as the position rises by its own part of ς.
        innovation[..., 1:] -= self._sensitivity[:, None, step]
        total = ahead.covariance[..., :2, :2] + self._noise[:, None, step]
        gain = np.linalg.solve(total, ahead.covariance[..., :2, :]).swapaxes(-1, -2)
        gain = gain * updated[:, None, None, None]
        mean = ahead.mean + gain @ innovation
        covariance = _symmetric(ahead.covariance - gain @ ahead.covariance[..., :2, :])
        bias = innovation[..., 1:]
        innovation_covariance = total + bias @ self._bias @ bias.swapaxes(-1, -2)
        off = innovation[..., 0]
        squared = np.einsum(
            "ajm,ajm->aj", off, np.linalg.solve(innovation_covariance, off[..., None])[..., 0]
        )
        fit = -0.5 * (squared + np.log(np.linalg.det(innovation_covariance)))
        likely = ahead.probability * np.exp(fit - fit.max(axis=1, keepdims=True)) + _PROBABILITY_MIN
        probability = np.where(updated[:, None], likely, ahead.probability)
        probability /= probability.sum(axis=1, keepdims=True)
        nis = 0.5 * np.einsum("aj,aj->a", ahead.probability, squared)
        self._mean_nis += np.where(updated, _NIS_GAIN * (nis - self._mean_nis), 0.0)
        return _Mixture(probability, mean, covariance)


# The smoothed state at a position, given that at the next.
def _earlier(transition: _Transition, later: _Mixture) -> _Mixture:
    mixed, ahead, before = transition.mixed, transition.ahead, transition.before
    # Rauch et al. (1965): G = P Fᵀ P(k+1|k)⁻¹, for each later mode.
    back = np.linalg.solve(ahead.covariance, transition.motion @ mixed.covariance).swapaxes(-1, -2)
    change = back @ (later.mean - ahead.mean)
    smoothed = mixed.covariance + back @ (later.covariance - ahead.covariance) @ back.swapaxes(
        -1, -2
    )
    information, vector = _later_information(mixed.covariance, smoothed, change)
    # With each earlier mode in place of the mixture: pairs (a, i, j).
    own = np.linalg.inv(before.covariance)
    apart = before.mean[:, :, None] - mixed.mean[:, None]
    total = own[:, :, None] + information[:, None]
    covariance = np.linalg.inv(total)
    right = own[:, :, None] @ apart + vector[:, None]
    mean = covariance @ right
    fit = 0.5 * (
        np.einsum("aijm,aijm->aij", right[..., 0], mean[..., 0])
        - np.einsum("aijm,aijm->aij", apart[..., 0], (own[:, :, None] @ apart)[..., 0])
        + np.log(np.linalg.det(own))[:, :, None]
        - np.log(np.linalg.det(total))
    )
    possible = transition.fraction > 0.0
    fit = np.where(possible, fit + np.log(np.where(possible, transition.fraction, 1.0)), -np.inf)
    weight = np.exp(fit - fit.max(axis=1, keepdims=True))
    weight /= weight.sum(axis=1, keepdims=True)
    joint = weight * later.probability[:, None]
    probability = joint.sum(axis=2)
    fraction = joint / np.maximum(probability, 1e-300)[..., None]
    absolute = mean + mixed.mean[:, None]
    whole = np.einsum("aij,aijmc->aimc", fraction, absolute)
    off = absolute[..., 0] - whole[:, :, None, :, 0]
    spread = np.einsum("aij,aijmn->aimn", fraction, covariance)
    spread = spread + np.einsum("aij,aijm,aijn->aimn", fraction, off, off)
    return _Mixture(probability / probability.sum(axis=1, keepdims=True), whole, _symmetric(spread))


# Information Y and vector y about the mean that later positions add to a known mean and
# covariance. A mixture of later modes may be wider than what was known before; it then adds
# nothing, not negative information.
def _later_information(known: Floats, smoothed: Floats, change: Floats) -> tuple[Floats, Floats]:
    # Rounding must not make it indefinite.
    rounded = known * (1.0 + 1e-10 * np.eye(known.shape[-1]))
    white = np.linalg.inv(np.linalg.cholesky(rounded))
    values, vectors = np.linalg.eigh(_symmetric(white @ smoothed @ white.swapaxes(-1, -2)))
    values = np.maximum(values, 1e-12)
    back = white.swapaxes(-1, -2) @ vectors
    information = (back * np.maximum(0.0, 1.0 / values - 1.0)[..., None, :]) @ back.swapaxes(-1, -2)
    # With B = L⁻ᵀ U, smoothed⁻¹ = B diag(1/e) Bᵀ.
    vector = (back / values[..., None, :]) @ (back.swapaxes(-1, -2) @ change)
    return _symmetric(information), vector


# Rounding errors of asymmetry grow over hundreds of steps.
def _symmetric(matrix: Floats) -> Floats:
    half: Floats = 0.5 * (matrix + matrix.swapaxes(-1, -2))
    return half
