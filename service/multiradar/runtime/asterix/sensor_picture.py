"""Sensor status for ASTERIX: biases, and whether measurements are received."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.known_biases import polar_without_biases
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_NAMES,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
    SensorTable,
)
from multiradar.tracking.health.health_records import ALARM_SILENT, HealthRecords
from multiradar.tracking.outputs import BiasRecords
from multiradar_converters.asterix.writing.status_reports import (
    DEGRADED,
    INITIALISING,
    NOT_CONNECTED,
    OPERATIONAL,
    SensorReports,
)

Floats = NDArray[np.float64]

#: A bias is reported once its sigma is below this fraction of the prior sigma.
SETTLED_RATIO = 0.5
NO_CODES = -1
_SECONDARY, _PRIMARY = 0, 1


class SensorPicture:
    """Present state of the sensors; one owner.

    Parameters
    ----------
    sensors : SensorTable
        The sensors; those without SAC/SIC are not reported.
    silent_after_s : float
        A sensor without measurements for so long is silent, s.
    """

    def __init__(self, sensors: SensorTable, silent_after_s: float) -> None:
        self._silent_after_s = silent_after_s
        self._begin(sensors)

    def _begin(self, sensors: SensorTable) -> None:
        self._sensors = sensors
        self._codes = np.array(sensors.asterix_codes, np.int64)
        shape = len(sensors), len(PARAMETER_NAMES)
        self._estimate = np.zeros(shape)
        self._sigma = np.full(shape, np.inf)
        self._prior_sigma = np.full(shape, np.nan)
        owner, kind = sensors.parameter_sensor, sensors.parameter_kind
        self._prior_sigma[owner, kind] = sensors.prior_sigma
        self._estimated = ~np.isnan(self._prior_sigma)
        self._last_plot_s = np.full(len(sensors), -np.inf)
        self._plots = np.zeros((len(sensors), 2), np.bool_)
        self._alarms = np.zeros(len(sensors), np.int64)

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors: those so far at their places."""
        names = ("_estimate", "_sigma", "_last_plot_s", "_plots", "_alarms")
        known = {name: getattr(self, name) for name in names}
        self._begin(sensors)
        for name, array in known.items():
            kept = min(len(array), len(sensors))
            getattr(self, name)[:kept] = array[:kept]

    @property
    def codes(self) -> NDArray[np.int64]:
        """SAC times 256 plus SIC of each sensor, -1 for none."""
        return self._codes

    def update_biases(self, records: BiasRecords) -> None:
        """Set bias estimates; the last of each parameter applies."""
        self._estimate[records.sensor, records.parameter] = records.estimate
        self._sigma[records.sensor, records.parameter] = records.sigma

    def update_health(self, records: HealthRecords) -> None:
        """Set the alarms of radars; the last row of each applies."""
        self._alarms[records.sensor] = records.alarms

    def record_plots(
        self, sensor: NDArray[np.int32], time_s: Floats, *, secondary: NDArray[np.bool_],
        primary: NDArray[np.bool_],
    ) -> None:  # fmt: skip
        """Record the times of measurements, and whether each is a secondary and a primary plot."""
        np.maximum.at(self._last_plot_s, sensor, time_s)
        self._plots[sensor[secondary], _SECONDARY] = True
        self._plots[sensor[primary], _PRIMARY] = True

    def without_biases(
        self, sensor: NDArray[np.int32], range_m: Floats, azimuth_rad: Floats
    ) -> tuple[Floats, Floats]:
        """Return plots corrected for the estimated biases, as the standard defines them."""
        return polar_without_biases(range_m, azimuth_rad, self._estimate[sensor])

    def reports(self, time_s: float) -> SensorReports:
        """Return the sensors that have codes."""
        named = np.flatnonzero(self._codes != NO_CODES)
        whole, gain = self._range_biases()
        known = self._sensors.known_bias
        azimuth = self._estimate[:, PARAMETER_AZIMUTH_OFFSET] + known[:, PARAMETER_AZIMUTH_OFFSET]
        late = self._estimate[:, PARAMETER_TIME_OFFSET] + known[:, PARAMETER_TIME_OFFSET]
        silent = (time_s - self._last_plot_s > self._silent_after_s) | (
            self._alarms >> ALARM_SILENT & 1
        ).astype(np.bool_)
        condition = np.where(self._alarms != 0, DEGRADED, OPERATIONAL)
        condition = np.where(self._unsettled().any(axis=1), INITIALISING, condition)
        ranges = (PARAMETER_RANGE_OFFSET, PARAMETER_RANGE_GAIN)
        range_reported = self._reported(*ranges)
        return SensorReports(
            time_s=time_s,
            sensor=self._codes[named],
            condition=np.where(silent, NOT_CONNECTED, condition)[named],
            silent=silent[named],
            time_offset_s=np.where(self._reported(PARAMETER_TIME_OFFSET), late, np.nan)[named],
            range_gain=np.where(range_reported, gain, np.nan)[named],
            range_offset_m=np.where(range_reported, whole, np.nan)[named],
            azimuth_offset_deg=np.degrees(
                np.where(self._reported(PARAMETER_AZIMUTH_OFFSET), azimuth, np.nan)
            )[named],
            secondary=self._plots[named, _SECONDARY],
            primary=self._plots[named, _PRIMARY],
        )

    def _range_biases(self) -> tuple[Floats, Floats]:
        # Known biases are corrected first, so the estimates are residual biases; combined:
        # r (1 + g₁)(1 + g₀) + b₁ (1 + g₀) + b₀.
        known, found = self._sensors.known_bias, self._estimate
        gain = 1.0 + known[:, PARAMETER_RANGE_GAIN]
        offset = known[:, PARAMETER_RANGE_OFFSET] + found[:, PARAMETER_RANGE_OFFSET] * gain
        return offset, gain * (1.0 + found[:, PARAMETER_RANGE_GAIN]) - 1.0

    def _unsettled(self) -> NDArray[np.bool_]:
        settled = self._sigma < SETTLED_RATIO * self._prior_sigma
        return np.asarray(self._estimated & ~settled)

    def _reported(self, *kinds: int) -> NDArray[np.bool_]:
        # The parameters are known or estimated, and the estimates have settled.
        columns = list(kinds)
        known = (self._estimated | (self._sensors.known_bias != 0.0))[:, columns].any(axis=1)
        return np.asarray(known & ~self._unsettled()[:, columns].any(axis=1))
