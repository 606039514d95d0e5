"""Plain form of the two-stage filter with time offsets: `_time_offset_kernels`, for reading."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import PARAMETER_TIME_OFFSET, SensorTable
from support.references.reference_filters import (
    BiasPrior,
    Conditional,
    Linearised,
    MeasurementModel,
    Observation,
    TwoStage,
)

Floats = NDArray[np.float64]

PLOTS_MIN = 4
VELOCITY_SIGMA_MAX = 30.0
# From far off, Newton's steps find the place of a plot to the last digit.
NEWTON_STEPS = 8


class TimedModel:
    """Any measurement, its time offsets linearised at a velocity that is kept beside each."""

    def __init__(self, model: MeasurementModel, sensors: SensorTable) -> None:
        self._model, self._sensors = model, sensors
        self.velocity: dict[int, Floats] = {}

    def linearise(self, observation: Observation, state: Floats) -> Linearised:
        seen = self._model.linearise(observation, state)
        own = np.flatnonzero(
            (self._sensors.parameter_sensor == observation.radar)
            & (self._sensors.parameter_kind == PARAMETER_TIME_OFFSET)
        )
        by_bias = seen.by_bias.copy()
        velocity = self.velocity.get(observation.aircraft, np.zeros(2))
        by_bias[:, own] = -(seen.by_state[:, :2] @ velocity)[:, None]
        return replace(seen, by_bias=by_bias)


class TimedTwoStage(TwoStage):
    """Does not update the biases until a velocity is known; then it is reinitialised and tracks."""

    def __init__(
        self, model: MeasurementModel, sensors: SensorTable, prior: BiasPrior, acceleration: float
    ) -> None:
        self._timed = TimedModel(model, sensors)
        super().__init__(self._timed, prior, acceleration)
        self._late = np.flatnonzero(sensors.parameter_kind == PARAMETER_TIME_OFFSET)
        self._plots: dict[int, int] = {}

    def observe(self, observation: Observation) -> None:
        one = observation.aircraft
        known = one in self._timed.velocity
        kept = self._information, self._vector
        before = self._bias, self._covariance
        super().observe(observation)
        self._plots[one] = self._plots.get(one, 0) + 1
        if known:
            self._follow(one, *before)
            return
        self._information, self._vector = kept
        self._bias, self._covariance = before
        mean, covariance = self.aircraft(one)
        spread = float(np.trace(covariance[2:, 2:]))
        if self._plots[one] >= PLOTS_MIN and spread < VELOCITY_SIGMA_MAX**2:
            self._begin(observation, mean, spread)

    def _begin(self, observation: Observation, mean: Floats, spread: float) -> None:
        state = mean.copy()
        for _ in range(NEWTON_STEPS):
            seen = self._timed.linearise(observation, state)
            miss = seen.innovation - seen.by_bias @ self._bias
            state[:2] += np.linalg.solve(seen.by_state[:, :2], miss)
        self._timed.velocity[observation.aircraft] = mean[2:].copy()
        seen = self._timed.linearise(observation, state)
        back = np.linalg.inv(seen.by_state[:, :2])
        sensitivity = np.zeros((4, len(self._bias)))
        sensitivity[:2] = -back @ seen.by_bias
        covariance = np.diag([0.0, 0.0, spread, spread])
        covariance[:2, :2] = back @ seen.noise @ back.T
        own = np.zeros(len(self._bias))
        own[self._late] = self._bias[self._late]
        # The plot was located without the lateness; with it the aircraft is farther on.
        state = state + sensitivity @ own
        self._aircraft[observation.aircraft] = Conditional(
            observation.time_s, state - sensitivity @ self._bias, covariance, sensitivity
        )

    def _follow(self, aircraft: int, bias: Floats, _: Floats) -> None:
        one, old = self._aircraft[aircraft], self._timed.velocity[aircraft]
        # With the biases that the plot met: they are published after it.
        new = (one.mean + one.sensitivity @ bias)[2:]
        share = np.zeros(len(bias))
        share[self._late] = one.sensitivity[:2, self._late].T @ old / (old @ old)
        change = np.outer(new - old, share)
        one.sensitivity = one.sensitivity.copy()
        one.sensitivity[:2] += change
        one.mean = one.mean.copy()
        one.mean[:2] -= change @ bias
        self._timed.velocity[aircraft] = new
