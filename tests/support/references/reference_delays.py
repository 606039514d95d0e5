"""Delays of transponders in the reference filters: a bias more for each aircraft.

The joint filter then estimates the delays of all aircraft at once with the biases of the sensors,
which is optimal. With drifting biases the two-stage filter is not the joint one; its plain form has
the delay as a fifth component of the state.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from multiradar.estimation.gaussian import symmetric_part
from multiradar.estimation.measurement.sensors import SensorTable
from support.references.constant_velocity import process_noise, transition
from support.references.reference_filters import (
    BiasPrior,
    Conditional,
    Linearised,
    MeasurementModel,
    Observation,
    TwoStage,
)
from support.references.reference_modes import Imm

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class DelayedModel:
    """Any measurement; ranges of some sensors include the delay of the aircraft."""

    model: MeasurementModel
    sensors: SensorTable
    aircraft: int

    def linearise(self, observation: Observation, state: Floats) -> Linearised:
        seen = self.model.linearise(observation, state)
        own = np.zeros((2, self.aircraft))
        if not observation.is_position and self.sensors.delayed[observation.radar]:
            own[0, observation.aircraft] = 1.0
        return replace(seen, by_bias=np.hstack([seen.by_bias, own]))


def with_delays(prior: BiasPrior, sigma_m: float, aircraft: int) -> BiasPrior:
    """The prior of the biases, then of the delay of each aircraft."""
    none = np.zeros(aircraft)
    return BiasPrior(
        np.append(prior.mean, none),
        block_diag(prior.covariance, sigma_m**2 * np.eye(aircraft)),
        np.append(prior.drift, none),
    )


class DelayedImm(Imm):
    """Joined at the delay of after the measurement: it is known at once, the biases at the end."""

    def __init__(
        self, model: MeasurementModel, prior: BiasPrior, table: Floats, sensors: SensorTable
    ) -> None:
        super().__init__(model, prior, table)
        self._shared = len(sensors.parameter_kind)

    def _joined_at(self, before: Floats) -> Floats:
        n, scale = self._shared, self._scale
        covariance = self._covariance / np.outer(scale, scale)
        back = np.linalg.solve(covariance[:n, :n], (before[:n] - self._bias[:n]) / scale[:n])
        delays = self._bias[n:] + scale[n:] * (covariance[n:, :n] @ back)
        return np.append(before[:n], delays)


class DelayedTwoStage(TwoStage):
    """The two-stage form with the delay as the fifth component of each state."""

    def __init__(
        self, model: MeasurementModel, prior: BiasPrior, acceleration: float, sensors: SensorTable
    ) -> None:
        super().__init__(model, prior, acceleration)
        self._sensors = sensors

    def start(self, aircraft: int, time_s: float, mean: Floats, covariance: Floats) -> None:
        wide = block_diag(covariance, [[self._sensors.delay_sigma_m**2]])
        none = np.zeros((5, len(self._prior.mean)))
        self._aircraft[aircraft] = Conditional(time_s, np.append(mean, 0.0), wide, none)

    def observe(self, observation: Observation) -> None:
        one = self._aircraft[observation.aircraft]
        interval = observation.time_s - one.time_s
        one.time_s = observation.time_s
        step = block_diag(transition(interval), [[1.0]])
        one.mean, one.sensitivity = step @ one.mean, step @ one.sensitivity
        one.covariance = step @ one.covariance @ step.T
        one.covariance[:4, :4] += process_noise(interval, self._acceleration)
        estimate = one.mean + one.sensitivity @ self._bias
        seen = self._model.linearise(observation, estimate[:4])
        delayed = not observation.is_position and self._sensors.delayed[observation.radar]
        by_state = np.hstack([seen.by_state, [[float(delayed)], [0.0]]])
        innovation = seen.innovation - by_state @ one.mean + seen.by_state @ estimate[:4]
        sensitivity = by_state @ one.sensitivity + seen.by_bias
        expected = by_state @ one.covariance @ by_state.T + seen.noise
        gain = np.linalg.solve(expected, by_state @ one.covariance).T
        one.mean = one.mean + gain @ innovation
        one.sensitivity = one.sensitivity - gain @ sensitivity
        one.covariance = symmetric_part(one.covariance - gain @ expected @ gain.T)
        weighted = np.linalg.solve(expected, sensitivity * self._scale)
        self._information = self._information + (sensitivity * self._scale).T @ weighted
        self._vector = self._vector + weighted.T @ innovation
        self.publish()

    def aircraft(self, aircraft: int) -> tuple[Floats, Floats]:
        mean, covariance = super().aircraft(aircraft)
        return mean[:4], covariance[:4, :4]

    def delay(self, aircraft: int) -> tuple[float, float]:
        mean, covariance = super().aircraft(aircraft)
        return float(mean[4]), float(covariance[4, 4])
