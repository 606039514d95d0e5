"""A plain NumPy filter of interacting modes: reference for the compiled filter.

Symbols as in `reference_filters`; of mode j: a_j, V_j, P_j, probability μ_j, x_j = a_j + V_j ς̂.
Written for reading: whole matrices, and the exponential of the matrix of rates.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from multiradar.estimation.gaussian import symmetric_part
from support.references.reference_filters import (
    BiasPrior,
    Linearised,
    MeasurementModel,
    Observation,
)

Floats = NDArray[np.float64]

#: The probability that is added to each mode.
PROBABILITY_MIN = 1e-9
#: Longer intervals are divided into equal steps, s.
STEP_MAX_S = 8.0
#: Slower, m/s, an aircraft has no direction.
SLOW_MPS = 10.0


@dataclass
class Mode:
    """χ | ς, mode ~ N(a + V ς, P)."""

    mean: Floats
    covariance: Floats
    sensitivity: Floats

    def at(self, bias: Floats) -> Floats:
        return np.asarray(self.mean + self.sensitivity @ bias)


@dataclass
class Modes:
    """An aircraft: its modes, their probabilities, and all as one, joined at the newest plot."""

    time_s: float
    parts: list[Mode]
    probabilities: Floats
    whole: Mode


def mixture(parts: list[Mode], weights: Floats, bias: Floats) -> Mode:
    """One Gaussian with the moments of many, whatever ς for the mean, at ς = bias for the rest."""
    mean = sum((w * one.mean for w, one in zip(weights, parts, strict=True)), np.zeros(4))
    sensitivity = sum(
        (w * one.sensitivity for w, one in zip(weights, parts, strict=True)),
        np.zeros_like(parts[0].sensitivity),
    )
    centre = mean + sensitivity @ bias
    covariance = sum(
        (
            w * (one.covariance + np.outer(one.at(bias) - centre, one.at(bias) - centre))
            for w, one in zip(weights, parts, strict=True)
        ),
        np.zeros((4, 4)),
    )
    return Mode(mean, covariance, sensitivity)


def switching(table: Floats, interval: float) -> Floats:
    """Probabilities (i, j) of being in j after the interval when in i: exp of the rates."""
    count = len(table)
    rates = np.zeros((count, count))
    rates[0, 1:] = table[0, 3] * table[1:, 5]
    rates[1:, 0] = table[1:, 3]
    return np.asarray(expm(interval * (rates - np.diag(rates.sum(axis=1)))))


def halves(count: int) -> Floats:
    """Half straight flight, half the manoeuvres."""
    return np.array([0.5, *[0.5 / (count - 1)] * (count - 1)])


def motion(mode: Floats, one: Mode, bias: Floats, interval: float) -> tuple[Floats, Floats]:
    """Transition and noise of a mode over an interval, at its own velocity."""
    lateral, along, across = mode[:3]
    velocity = one.at(bias)[2:]
    squared = float(velocity @ velocity)
    spread = float(np.trace(one.covariance[2:, 2:]))
    rate = lateral * np.sqrt(squared) / max(squared + spread, SLOW_MPS**2)
    generator = np.zeros((4, 4))
    generator[:2, 2:] = np.eye(2)
    generator[2:, 2:] = rate * np.array([[0.0, 1.0], [-1.0, 0.0]])
    step = np.asarray(expm(interval * generator))
    east, north = 0.5 * (velocity + step[2:, 2:] @ velocity)
    base = max(east**2 + north**2, SLOW_MPS**2)
    tangent = np.outer([east, north], [east, north]) / base
    normal = np.outer([north, -east], [north, -east]) / base
    unknown = 0.5 * (along + across) * (1.0 - (east**2 + north**2) / base)
    density = along * tangent + across * normal + unknown * np.eye(2)
    way = np.array([[interval**3 / 3.0, interval**2 / 2.0], [interval**2 / 2.0, interval]])
    return step, np.kron(way, density)


class Imm:
    """Interacting modes, each Friedland's form, which share what they say of the biases."""

    def __init__(self, model: MeasurementModel, prior: BiasPrior, table: Floats) -> None:
        self._model, self._prior, self._table = model, prior, table
        self._scale = np.sqrt(np.diagonal(prior.covariance))
        self._aircraft: dict[int, Modes] = {}
        self._bias, self._covariance = prior.mean, prior.covariance

    def start(self, aircraft: int, time_s: float, mean: Floats, covariance: Floats) -> None:
        none = np.zeros((4, len(self._prior.mean)))
        parts = [Mode(mean.copy(), covariance.copy(), none) for _ in self._table]
        self._aircraft[aircraft] = Modes(time_s, parts, halves(len(self._table)), parts[0])

    def observe(self, observation: Observation) -> None:
        one = self._aircraft[observation.aircraft]
        interval = observation.time_s - one.time_s
        one.time_s = observation.time_s
        steps = int(interval / STEP_MAX_S) + 1
        for _ in range(steps if interval > 0.0 else 0):
            self._move(one, interval / steps)
        bias, chances = self._bias, one.probabilities
        seen = [self._model.linearise(observation, part.at(bias)) for part in one.parts]
        # ν, U and S of each mode, and r = ν − U ς̂.
        news = [
            each.innovation + each.by_state @ (part.at(bias) - part.mean)
            for each, part in zip(seen, one.parts, strict=True)
        ]
        slopes = [
            each.by_state @ part.sensitivity + each.by_bias
            for each, part in zip(seen, one.parts, strict=True)
        ]
        spreads = [
            each.by_state @ part.covariance @ each.by_state.T + each.noise
            for each, part in zip(seen, one.parts, strict=True)
        ]
        lefts = [each - slope @ bias for each, slope in zip(news, slopes, strict=True)]
        slope = np.einsum("j,jab->ab", chances, slopes)
        left = chances @ np.array(lefts)
        apart = np.array(lefts) - left
        spread = np.einsum("j,jab->ab", chances, spreads)
        spread = spread + np.einsum("j,ja,jb->ab", chances, apart, apart)
        of_biases = slope @ self._covariance @ slope.T
        logs = np.array(
            [log_density(each, own + of_biases) for each, own in zip(lefts, spreads, strict=True)]
        )
        likely = chances * np.exp(logs - logs.max()) + PROBABILITY_MIN
        one.probabilities = likely / likely.sum()
        one.parts = [
            corrected(*parts) for parts in zip(one.parts, seen, news, slopes, spreads, strict=True)
        ]
        self._learn(slope, chances @ np.array(news), spread)
        one.whole = mixture(one.parts, one.probabilities, self._joined_at(bias))

    # The biases at which the modes are joined: those of before.
    def _joined_at(self, before: Floats) -> Floats:
        return before

    def walk(self, duration_s: float) -> None:
        drift = np.diag(self._prior.drift**2 * duration_s)
        walked = self._covariance + drift
        scale = np.outer(self._scale, self._scale)
        kept = np.linalg.solve(walked / scale, self._covariance / scale).T
        kept = self._scale[:, None] * kept / self._scale
        for one in self._aircraft.values():
            *one.parts, one.whole = [
                Mode(
                    part.mean + part.sensitivity @ (self._bias - kept @ self._bias),
                    symmetric_part(
                        part.covariance + part.sensitivity @ kept @ drift @ part.sensitivity.T
                    ),
                    part.sensitivity @ kept,
                )
                for part in (*one.parts, one.whole)
            ]
        self._covariance = walked

    def end(self, aircraft: int) -> None:
        del self._aircraft[aircraft]

    def aircraft(self, aircraft: int) -> tuple[Floats, Floats]:
        whole = self._aircraft[aircraft].whole
        tied = whole.sensitivity @ self._covariance @ whole.sensitivity.T
        return whole.at(self._bias), whole.covariance + tied

    def probabilities(self, aircraft: int) -> Floats:
        return self._aircraft[aircraft].probabilities

    def biases(self) -> tuple[Floats, Floats]:
        return self._bias, self._covariance

    # From each mode to each by the rates, and on as each moves.
    def _move(self, one: Modes, interval: float) -> None:
        joint = one.probabilities[:, None] * switching(self._table, interval)
        chances = joint.sum(axis=0)
        moved = []
        for j, mode in enumerate(self._table):
            mixed = mixture(one.parts, joint[:, j] / chances[j], self._bias)
            step, noise = motion(mode, mixed, self._bias, interval)
            moved.append(
                Mode(
                    step @ mixed.mean,
                    symmetric_part(step @ mixed.covariance @ step.T + noise),
                    step @ mixed.sensitivity,
                )
            )
        one.parts, one.probabilities = moved, chances

    # The biases, corrected by a measurement of ς alone: ν = U ς + noise of covariance S.
    def _learn(self, slope: Floats, news: Floats, spread: Floats) -> None:
        scaled = np.linalg.inv(self._covariance / np.outer(self._scale, self._scale))
        slope = slope * self._scale
        weighted = np.linalg.solve(spread, slope)
        vector = scaled @ (self._bias / self._scale) + weighted.T @ news
        covariance = symmetric_part(np.linalg.inv(scaled + slope.T @ weighted))
        self._bias = self._scale * (covariance @ vector)
        self._covariance = self._scale[:, None] * covariance * self._scale


def log_density(left: Floats, spread: Floats) -> float:
    """Logarithm of a Gaussian density, but for a constant."""
    _, determinant = np.linalg.slogdet(spread)
    return float(-0.5 * (left @ np.linalg.solve(spread, left) + determinant))


def corrected(part: Mode, seen: Linearised, news: Floats, slope: Floats, spread: Floats) -> Mode:
    """A mode after a measurement, as in the two-stage form."""
    gain = np.linalg.solve(spread, seen.by_state @ part.covariance).T
    return Mode(
        part.mean + gain @ news,
        symmetric_part(part.covariance - gain @ spread @ gain.T),
        part.sensitivity - gain @ slope,
    )
