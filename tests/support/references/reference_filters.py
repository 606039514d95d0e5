"""Plain NumPy filters, written for readability: references for the compiled filters.

All have the same four verbs: `start` an aircraft with a prior, `observe` a measurement, `walk` the
biases on, `end` an aircraft. Each measurement is linearised at the filter's own estimate. Aircraft
move by constant velocity with white acceleration.

Symbols: χ = state of an aircraft (east, north, velocity east, velocity north), ς = biases of all
radars, H = ∂h/∂χ, J = ∂z/∂ς, W = noise, ν = z − h(χ) without any bias.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, null_space
from scipy.optimize import minimize_scalar

from multiradar.estimation.gaussian import symmetric_part
from support.references.constant_velocity import process_noise, transition

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Observation:
    """One plot (range and azimuth, or a bearing whose range is lost), or one reported position."""

    time_s: float
    aircraft: int
    radar: int
    value: Floats
    height_m: float = 0.0
    is_position: bool = False
    is_bearing: bool = False


@dataclass(frozen=True)
class Linearised:
    """A measurement near a state: ν, H (2, 4), J (2, c), W (2, 2)."""

    innovation: Floats
    by_state: Floats
    by_bias: Floats
    noise: Floats


class MeasurementModel(Protocol):
    def linearise(self, observation: Observation, state: Floats) -> Linearised: ...


@dataclass(frozen=True)
class BiasPrior:
    """What is known of ς beforehand, and how it walks: σ after one second."""

    mean: Floats
    covariance: Floats
    drift: Floats


class ReferenceFilter(Protocol):
    def start(self, aircraft: int, time_s: float, mean: Floats, covariance: Floats) -> None: ...
    def observe(self, observation: Observation) -> None: ...
    def walk(self, duration_s: float) -> None: ...
    def end(self, aircraft: int) -> None: ...
    def aircraft(self, aircraft: int) -> tuple[Floats, Floats]: ...
    def biases(self) -> tuple[Floats, Floats]: ...


class JointKalman:
    """The optimal filter over all aircraft and biases at once, (1.28)-(1.33)."""

    def __init__(self, model: MeasurementModel, prior: BiasPrior, acceleration: float) -> None:
        self._model, self._prior, self._acceleration = model, prior, acceleration
        self._mean, self._covariance = prior.mean.copy(), prior.covariance.copy()
        self._count = len(prior.mean)
        self._ids: list[int] = []
        self._times: dict[int, float] = {}

    def start(self, aircraft: int, time_s: float, mean: Floats, covariance: Floats) -> None:
        size = len(self._mean)
        grown = np.zeros((size + 4, size + 4))
        grown[:size, :size] = self._covariance
        grown[size:, size:] = covariance
        self._mean, self._covariance = np.concatenate([self._mean, mean]), grown
        self._ids.append(aircraft)
        self._times[aircraft] = time_s

    def observe(self, observation: Observation) -> None:
        place = self._place(observation.aircraft)
        self._predict(place, observation)
        seen = self._model.linearise(observation, self._mean[place])
        matrix = np.zeros((2, len(self._mean)))  # C of (1.10)
        matrix[:, : self._count], matrix[:, place] = seen.by_bias, seen.by_state
        spread = self._covariance @ matrix.T
        innovation = seen.innovation - seen.by_bias @ self._mean[: self._count]
        expected = matrix @ spread + seen.noise  # Λ, (1.29)
        self.compared = innovation, expected
        gain = np.linalg.solve(expected, spread.T).T
        self._mean = self._mean + gain @ innovation
        self._covariance = symmetric_part(self._covariance - gain @ expected @ gain.T)

    def walk(self, duration_s: float) -> None:
        places = np.arange(self._count)
        self._covariance[places, places] += self._prior.drift**2 * duration_s

    def end(self, aircraft: int) -> None:
        place = self._place(aircraft)
        kept = np.delete(np.arange(len(self._mean)), np.arange(place.start, place.stop))
        self._mean, self._covariance = self._mean[kept], self._covariance[np.ix_(kept, kept)]
        self._ids.remove(aircraft)

    def aircraft(self, aircraft: int) -> tuple[Floats, Floats]:
        place = self._place(aircraft)
        return self._mean[place], self._covariance[place, place]

    def biases(self) -> tuple[Floats, Floats]:
        return self._mean[: self._count], self._covariance[: self._count, : self._count]

    def _place(self, aircraft: int) -> slice:
        first = self._count + 4 * self._ids.index(aircraft)
        return slice(first, first + 4)

    def _predict(self, place: slice, observation: Observation) -> None:
        interval = observation.time_s - self._times[observation.aircraft]
        self._times[observation.aircraft] = observation.time_s
        step = transition(interval)
        self._mean[place] = step @ self._mean[place]
        self._covariance[place] = step @ self._covariance[place]
        self._covariance[:, place] = self._covariance[:, place] @ step.T
        self._covariance[place, place] += process_noise(interval, self._acceleration)


@dataclass
class Conditional:
    """An aircraft given the biases: χ | ς ~ N(a + V ς, P)."""

    time_s: float
    mean: Floats
    covariance: Floats
    sensitivity: Floats


class TwoStage:
    """Friedland's separate-bias estimation carried over to many aircraft.

    With `by_epochs` the estimate of ς, at which measurements are linearised and which is read, is
    the one of the last `publish`.
    """

    def __init__(
        self,
        model: MeasurementModel,
        prior: BiasPrior,
        acceleration: float,
        *,
        by_epochs: bool = False,
    ) -> None:
        self._model, self._prior, self._acceleration = model, prior, acceleration
        self._by_epochs = by_epochs
        # Metres and radians differ by powers of ten: Y is kept in units of the prior's sigmas.
        self._scale = np.sqrt(np.diagonal(prior.covariance))
        self._aircraft: dict[int, Conditional] = {}
        self._bias, self._covariance = prior.mean, prior.covariance
        self._information, self._vector = self._weigh()

    def start(self, aircraft: int, time_s: float, mean: Floats, covariance: Floats) -> None:
        none = np.zeros((4, len(self._prior.mean)))
        self._aircraft[aircraft] = Conditional(time_s, mean.copy(), covariance.copy(), none)

    def observe(self, observation: Observation) -> None:
        one = self._aircraft[observation.aircraft]
        interval = observation.time_s - one.time_s
        step = transition(interval)
        one.time_s = observation.time_s
        one.mean, one.sensitivity = step @ one.mean, step @ one.sensitivity
        one.covariance = step @ one.covariance @ step.T
        one.covariance = one.covariance + process_noise(interval, self._acceleration)
        estimate = one.mean + one.sensitivity @ self._bias
        seen = self._model.linearise(observation, estimate)
        # ν = z − h(a) at ς = 0, with h taken linear around a + V ς̂.
        innovation = seen.innovation + seen.by_state @ (estimate - one.mean)
        sensitivity = seen.by_state @ one.sensitivity + seen.by_bias  # U
        spread = one.covariance @ seen.by_state.T
        expected = seen.by_state @ spread + seen.noise  # S
        gain = np.linalg.solve(expected, spread.T).T
        one.mean = one.mean + gain @ innovation
        one.sensitivity = one.sensitivity - gain @ sensitivity
        one.covariance = symmetric_part(one.covariance - gain @ expected @ gain.T)
        weighted = np.linalg.solve(expected, sensitivity * self._scale)
        self._information = self._information + (sensitivity * self._scale).T @ weighted
        self._vector = self._vector + weighted.T @ innovation
        if not self._by_epochs:
            self.publish()

    def publish(self) -> None:
        covariance = np.linalg.inv(self._information)
        self._bias = self._scale * (covariance @ self._vector)
        self._covariance = symmetric_part(self._scale[:, None] * covariance * self._scale)

    def walk(self, duration_s: float) -> None:
        self.publish()
        drift = np.diag(self._prior.drift**2 * duration_s)
        walked = self._covariance + drift
        scale = np.outer(self._scale, self._scale)
        kept = np.linalg.solve(walked / scale, self._covariance / scale).T  # G, scaled
        kept = self._scale[:, None] * kept / self._scale
        for one in self._aircraft.values():
            one.mean = one.mean + one.sensitivity @ (self._bias - kept @ self._bias)
            one.covariance = symmetric_part(
                one.covariance + one.sensitivity @ kept @ drift @ one.sensitivity.T
            )
            one.sensitivity = one.sensitivity @ kept
        self._covariance = walked
        self._information, self._vector = self._weigh()

    def end(self, aircraft: int) -> None:
        del self._aircraft[aircraft]

    def aircraft(self, aircraft: int) -> tuple[Floats, Floats]:
        one = self._aircraft[aircraft]
        tied = one.sensitivity @ self._covariance @ one.sensitivity.T
        return one.mean + one.sensitivity @ self._bias, one.covariance + tied

    def biases(self) -> tuple[Floats, Floats]:
        return self._bias, self._covariance

    # Y and y of the current estimate, in units of the prior's sigmas.
    def _weigh(self) -> tuple[Floats, Floats]:
        scale = np.outer(self._scale, self._scale)
        information = symmetric_part(np.linalg.inv(self._covariance / scale))
        return information, information @ (self._bias / self._scale)


class Separated(ABC):
    """What Blom's filters and covariance intersection share: no cross-covariances are kept."""

    def __init__(self, model: MeasurementModel, prior: BiasPrior, acceleration: float) -> None:
        self._model, self._prior, self._acceleration = model, prior, acceleration
        self._bias, self._covariance = prior.mean.copy(), prior.covariance.copy()
        self._aircraft: dict[int, tuple[float, Floats, Floats]] = {}

    def start(self, aircraft: int, time_s: float, mean: Floats, covariance: Floats) -> None:
        self._aircraft[aircraft] = time_s, mean, covariance

    def observe(self, observation: Observation) -> None:
        time_s, mean, covariance = self._aircraft[observation.aircraft]
        interval = observation.time_s - time_s
        step = transition(interval)
        mean = step @ mean
        covariance = step @ covariance @ step.T + process_noise(interval, self._acceleration)
        seen = self._model.linearise(observation, mean)
        innovation = seen.innovation - seen.by_bias @ self._bias
        gain, covariance, bias_gain, self._covariance = self._correct(seen, covariance)
        self._bias = self._bias + bias_gain @ innovation
        self._aircraft[observation.aircraft] = (
            observation.time_s,
            mean + gain @ innovation,
            covariance,
        )

    def walk(self, duration_s: float) -> None:
        self._covariance = self._covariance + np.diag(self._prior.drift**2 * duration_s)

    def end(self, aircraft: int) -> None:
        del self._aircraft[aircraft]

    def aircraft(self, aircraft: int) -> tuple[Floats, Floats]:
        return self._aircraft[aircraft][1:]

    def biases(self) -> tuple[Floats, Floats]:
        return self._bias, self._covariance

    @abstractmethod
    def _correct(self, seen: Linearised, covariance: Floats) -> tuple[Floats, ...]: ...


class BlomSeparated(Separated):
    """Each half corrected as if the other were known, (1.34)-(1.38)."""

    def _correct(self, seen: Linearised, covariance: Floats) -> tuple[Floats, ...]:
        return (
            *_as_if_known(covariance, seen.by_state, seen.noise),
            *_as_if_known(self._covariance, seen.by_bias, seen.noise),
        )


class BlomMacro(Separated):
    """Aircraft as by `BlomSeparated`; biases by the latest plots of several radars, stacked.

    The place of the aircraft, common to the stacked plots, is eliminated by what is orthogonal to
    how it enters; the velocity that carries the plots to one time adds its uncertainty to the
    noise. Stacked and folded by `publish`, as at the end of an epoch.
    """

    def __init__(self, model: MeasurementModel, prior: BiasPrior, acceleration: float) -> None:
        super().__init__(model, prior, acceleration)
        self._recent: dict[int, dict[int, Observation]] = {}

    def observe(self, observation: Observation) -> None:
        super().observe(observation)
        self._recent.setdefault(observation.aircraft, {})[observation.radar] = observation

    def walk(self, duration_s: float) -> None:
        self.publish()
        super().walk(duration_s)

    def end(self, aircraft: int) -> None:
        super().end(aircraft)
        self._recent.pop(aircraft, None)

    def publish(self) -> None:
        # All stacks are read with the biases of before, so that their order does not matter.
        folded = [self._eliminated(one) for one, seen in self._recent.items() if len(seen) > 1]
        self._recent.clear()
        if not folded:
            return
        innovation, matrix = (np.concatenate(part) for part in zip(*folded, strict=True))
        expected = matrix @ self._covariance @ matrix.T + np.eye(len(innovation))
        gain = np.linalg.solve(expected, matrix @ self._covariance).T
        self._bias = self._bias + gain @ (innovation - matrix @ self._bias)
        self._covariance = symmetric_part(self._covariance - gain @ expected @ gain.T)

    # What the stack of one aircraft says of ς alone: innovations (n,) of unit noise, and (n, c).
    def _eliminated(self, aircraft: int) -> tuple[Floats, Floats]:
        time_s, mean, covariance = self._aircraft[aircraft]
        plots = list(self._recent[aircraft].values())
        middle = float(np.mean([one.time_s for one in plots]))
        seen = [self._model.linearise(one, transition(one.time_s - time_s) @ mean) for one in plots]
        # In units of the noise: metres and radians differ by many powers of ten.
        root = np.linalg.cholesky(block_diag(*[one.noise for one in seen]))
        place, matrix, innovation = (
            np.linalg.solve(root, np.concatenate(part))
            for part in (
                [one.by_state[:, :2] for one in seen],
                [one.by_bias for one in seen],
                [one.innovation for one in seen],
            )
        )
        moved = np.repeat([one.time_s - middle for one in plots], 2)[:, None]
        velocity = moved * place
        left = null_space(place.T).T  # left @ place = 0
        noise = left @ (np.eye(len(place)) + velocity @ covariance[2:, 2:] @ velocity.T) @ left.T
        unit = np.linalg.cholesky(noise)
        return np.linalg.solve(unit, left @ innovation), np.linalg.solve(unit, left @ matrix)

    def _correct(self, seen: Linearised, covariance: Floats) -> tuple[Floats, ...]:
        none = np.zeros((len(self._bias), 2))
        return *_as_if_known(covariance, seen.by_state, seen.noise), none, self._covariance


class CovarianceIntersection(Separated):
    """Bounds R that hold whatever the cross-covariances, (1.43)-(1.45).

    The trace to be minimised adds m² and (m/s)², or m² and rad²: velocities count as the way of
    `scale_time_s`, biases in units of their prior's sigmas.
    """

    def __init__(
        self,
        model: MeasurementModel,
        prior: BiasPrior,
        acceleration: float,
        scale_time_s: float = 10.0,
    ) -> None:
        super().__init__(model, prior, acceleration)
        self._scale_time_s = scale_time_s

    def _correct(self, seen: Linearised, covariance: Floats) -> tuple[Floats, ...]:
        of_state = seen.by_state @ covariance @ seen.by_state.T
        of_bias = seen.by_bias @ self._covariance @ seen.by_bias.T
        state_weights = np.array([1.0, 1.0, self._scale_time_s**2, self._scale_time_s**2])
        gain, bound = intersect(covariance, seen.by_state, of_bias, seen.noise, state_weights)
        # (1.39): only the measuring radar's biases are corrected, all others stay as they are.
        own = np.flatnonzero(seen.by_bias.any(axis=0))
        block = np.ix_(own, own)
        own_gain, own_bound = intersect(
            self._covariance[block],
            seen.by_bias[:, own],
            of_state,
            seen.noise,
            1.0 / np.diagonal(self._prior.covariance)[own],
        )
        bias_gain = np.zeros((len(self._bias), 2))
        bias_gain[own] = own_gain
        bias_bound = self._covariance.copy()
        bias_bound[block] = own_bound
        return gain, bound, bias_gain, bias_bound


def _as_if_known(covariance: Floats, matrix: Floats, noise: Floats) -> tuple[Floats, Floats]:
    expected = matrix @ covariance @ matrix.T + noise
    gain = np.asarray(np.linalg.solve(expected, matrix @ covariance).T, np.float64)
    return gain, symmetric_part(covariance - gain @ expected @ gain.T)


def intersection_bound(
    gamma: float, bound: Floats, matrix: Floats, other: Floats, noise: Floats
) -> tuple[Floats, Floats]:
    """K* and the new R of (1.45); `other` is C R Cᵀ of the other half, `matrix` C of this one."""
    expected = (1 + gamma) * matrix @ bound @ matrix.T + (1 + 1 / gamma) * other + noise
    gain = np.asarray((1 + gamma) * np.linalg.solve(expected, matrix @ bound).T, np.float64)
    return gain, symmetric_part((1 + gamma) * bound - gain @ expected @ gain.T)


def intersect(
    bound: Floats, matrix: Floats, other: Floats, noise: Floats, weights: Floats
) -> tuple[Floats, Floats]:
    """K* and R of (1.45) with the γ of the least weighted trace; K = 0 if no γ improves it."""

    own, spread = matrix @ bound @ matrix.T, (matrix @ bound * weights) @ (matrix @ bound).T
    before = float(weights @ np.diagonal(bound))

    def trace(exponent: float | Floats) -> Floats:
        g, h = 1.0 + np.exp(exponent), 1.0 + np.exp(-np.asarray(exponent))
        a, b, c = (g * own[row] + h * other[row] + noise[row] for row in ((0, 0), (0, 1), (1, 1)))
        kept = spread[0, 0] * c - 2.0 * spread[0, 1] * b + spread[1, 1] * a
        return np.asarray(g * (before - g * kept / (a * c - b * b)))

    # A grid first: the trace may have a flat shoulder where a search alone would stop.
    grid = np.log(np.geomspace(1e-6, 1e2, 93))
    near = int(np.argmin(trace(grid)))
    ends = grid[max(near - 1, 0)], grid[min(near + 1, len(grid) - 1)]
    found = minimize_scalar(trace, bounds=ends, method="bounded", options={"xatol": 1e-9})
    if not found.fun < before:
        return np.zeros(matrix.T.shape), bound
    return intersection_bound(float(np.exp(found.x)), bound, matrix, other, noise)
