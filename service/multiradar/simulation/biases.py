"""True biases of the sensors over time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import PARAMETER_AZIMUTH_SINE
from multiradar.simulation.scenario.model import PARAMETERS, Sensor

Floats = NDArray[np.float64]

# Step of the random walks; between steps a bias is linear.
STEP_S = 1.0

# Kinds of bias before those that depend on the direction.
_FIRST = PARAMETER_AZIMUTH_SINE


@dataclass(frozen=True, slots=True)
class TrueBiases:
    """The biases of all sensors on a grid of times.

    Attributes
    ----------
    time_s : (t,) ndarray
        Times, from 0 to the end of the scenario or just beyond.
    values : (t, m, p) ndarray
        For each sensor, in the order of `PARAMETER_NAMES`; m, rad, 1 or s; measured minus true.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.6), with A^ς = I of (1.7).
    """

    time_s: Floats
    values: Floats

    def at(self, sensor: int, time_s: Floats) -> Floats:
        """Return (4, n) the bias parameters of a sensor at times (n,).

        References
        ----------
        IMM UrO RAN report (2016), equation (1.6). Linear interpolation between two steps is the
        project's own.
        """
        columns = self.values[:, sensor].T
        return np.array([np.interp(time_s, self.time_s, column) for column in columns])


def simulate_biases(
    sensors: Sequence[Sensor], duration_s: float, rng: np.random.Generator
) -> TrueBiases:
    """Simulate the biases of sensors as random walks with jumps.

    Parameters
    ----------
    sensors : sequence of Sensor
        The m sensors.
    duration_s : float
        Duration of the scenario.
    rng : Generator
        For the steps; biases without drift are constant.

    Returns
    -------
    TrueBiases
        One value per second.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.7). Jumps are the project's own.
    """
    time_s = STEP_S * np.arange(np.ceil(duration_s / STEP_S) + 1.0)
    start = np.array([[bias.value for bias in one.biases] for one in sensors])
    drift = np.array([[bias.drift for bias in one.biases] for one in sensors])
    # The first ones are drawn first, so that further kinds of bias change no number of a scenario.
    shape = len(time_s) - 1, len(sensors)
    draws = [rng.normal(size=(*shape, count)) for count in (_FIRST, PARAMETERS - _FIRST)]
    steps = np.concatenate(draws, axis=-1) * np.sqrt(STEP_S) * drift
    walk = np.concatenate([np.zeros((1, *start.shape)), np.cumsum(steps, axis=0)])
    jump = np.array([[bias.jump for bias in one.biases] for one in sensors])
    jump_s = np.array([[bias.jump_s for bias in one.biases] for one in sensors])
    jumped = jump * (time_s[:, None, None] >= jump_s)
    return TrueBiases(time_s, start + walk + jumped)
