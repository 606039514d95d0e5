"""Trends of the estimated biases over the last minutes."""

from collections import deque
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.bias.store import BiasState
from multiradar.estimation.measurement.sensor_changes import SensorChange
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.state import Fields

Floats = NDArray[np.float64]

#: Maximum and minimum time span of a trend, s.
TREND_S, TREND_MIN_S = 600.0, 60.0
#: Interval of stored estimates, s.
KEPT_S = 30.0


class BiasTrends:
    """Bias estimates of the last minutes; owned by the sensor health.

    Parameters
    ----------
    sensors : SensorTable
        The sensors and their bias parameters.
    """

    STATE: ClassVar[Fields] = {
        "_since_s": np.ndarray,
        "_kept": deque[tuple[float, np.ndarray, np.ndarray]],
        "_now": tuple[float, np.ndarray, np.ndarray] | None,
    }

    def __init__(self, sensors: SensorTable) -> None:
        self._sensors = sensors
        self._since_s = np.full(len(sensors), -np.inf)
        self._kept: deque[tuple[float, Floats, Floats]] = deque(maxlen=int(TREND_S / KEPT_S) + 1)
        self._now: tuple[float, Floats, Floats] | None = None

    def add(self, time_s: float, biases: BiasState) -> None:
        """Add the biases at the end of an epoch."""
        self._now = (time_s, biases.estimate.copy(), np.diagonal(biases.covariance).copy())
        if not self._kept or time_s - self._kept[-1][0] >= KEPT_S:
            self._kept.append(self._now)

    def reset(self, sensor: int) -> None:
        """Reset a sensor whose biases jumped."""
        self._since_s[sensor] = np.inf if self._now is None else self._now[0]

    def carry(self, old: "BiasTrends", change: SensorChange) -> None:
        """Continue with other sensors; trends of those that are reset or new start again."""
        padding = 0, len(self._sensors.parameter_kind) - len(old._sensors.parameter_kind)

        def wider(one: tuple[float, Floats, Floats]) -> tuple[float, Floats, Floats]:
            return one[0], np.pad(one[1], padding), np.pad(one[2], padding)

        self._kept.extend(map(wider, old._kept))
        self._now = None if old._now is None else wider(old._now)
        count = len(old._sensors)
        self._since_s[:count] = old._since_s
        for sensor in [*np.flatnonzero(change.reset), *range(count, len(self._sensors))]:
            self.reset(int(sensor))

    def trend(self, kind: int) -> Floats:
        """Return the trend of one parameter of each sensor, and its standard deviation.

        Parameters
        ----------
        kind : int
            Kind of the parameter.

        Returns
        -------
        (m, 2) float64
            Per second, in m or rad; NaN where it is not estimated, or not for long enough.

        References
        ----------
        The project's own. For a bias with random walk q per second the variance of the change from
        the earlier estimate to the later one is P_earlier + q Δt − P_later: the later estimate
        includes the information of the earlier one.
        """
        found = np.full((len(self._sensors), 2), np.nan)
        if self._now is None:
            return found
        now_s, estimate, variance = self._now
        for column in np.flatnonzero(self._sensors.parameter_kind == kind).tolist():
            sensor = int(self._sensors.parameter_sensor[column])
            since_s = float(self._since_s[sensor])
            past = next((one for one in self._kept if one[0] > since_s), None)
            if past is None or now_s - past[0] < TREND_MIN_S:
                continue
            past_s, before, spread = past
            span_s = now_s - past_s
            walked = self._sensors.drift[column] ** 2 * span_s
            by_chance = max(spread[column] + walked - variance[column], 0.0)
            found[sensor] = (estimate[column] - before[column]) / span_s, by_chance**0.5 / span_s
        return found
