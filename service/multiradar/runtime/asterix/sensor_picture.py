"""The sensors as ASTERIX tells of them: their biases, and whether they are heard."""

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

#: A bias is told once its sigma is below this part of that beforehand.
SETTLED_RATIO = 0.5
NO_CODES = -1
_SECONDARY, _PRIMARY = 0, 1


class SensorPicture:
    """What is known of the sensors now; one owner.

    Parameters
    ----------
    sensors : SensorTable
        The sensors; those without codes of ASTERIX are not told of.
    silent_after_s : float
        A sensor that was not heard for so long counts as silent.
    """

    def __init__(self, sensors: SensorTable, silent_after_s: float) -> None:
        self._sensors = sensors
        self._codes = np.array(sensors.asterix_codes, np.int64)
        self._silent_after_s = silent_after_s
        shape = len(sensors), len(PARAMETER_NAMES)
        self._estimate = np.zeros(shape)
        self._sigma = np.full(shape, np.inf)
        self._prior_sigma = np.full(shape, np.nan)
        owner, kind = sensors.parameter_sensor, sensors.parameter_kind
        self._prior_sigma[owner, kind] = sensors.prior_sigma
        self._estimated = ~np.isnan(self._prior_sigma)
        self._heard_s = np.full(len(sensors), -np.inf)
        self._plots = np.zeros((len(sensors), 2), np.bool_)
        self._alarms = np.zeros(len(sensors), np.int64)

    @property
    def codes(self) -> NDArray[np.int64]:
        """Area code times 256 and identification code of each sensor, -1 for none."""
        return self._codes

    def learn_biases(self, records: BiasRecords) -> None:
        """Take estimates; the last of each parameter counts."""
        self._estimate[records.sensor, records.parameter] = records.estimate
        self._sigma[records.sensor, records.parameter] = records.sigma

    def learn_health(self, records: HealthRecords) -> None:
        """Take what was said of the health of radars; the last row of each counts."""
        self._alarms[records.sensor] = records.alarms

    def hear(
        self, sensor: NDArray[np.int32], time_s: Floats, *, plot: NDArray[np.bool_],
        primary: NDArray[np.bool_],
    ) -> None:  # fmt: skip
        """Note that sensors were heard, and whether it was a radar's plot, and a primary one."""
        np.maximum.at(self._heard_s, sensor, time_s)
        self._plots[sensor[plot & ~primary], _SECONDARY] = True
        self._plots[sensor[plot & primary], _PRIMARY] = True

    def without_biases(
        self, sensor: NDArray[np.int32], range_m: Floats, azimuth_rad: Floats
    ) -> tuple[Floats, Floats]:
        """Return plots with the estimated biases taken off, as the standard corrects them."""
        return polar_without_biases(range_m, azimuth_rad, self._estimate[sensor])

    def reports(self, time_s: float) -> SensorReports:
        """Return the sensors that have codes."""
        named = np.flatnonzero(self._codes != NO_CODES)
        whole, gain = self._range_biases()
        known = self._sensors.known_bias
        azimuth = self._estimate[:, PARAMETER_AZIMUTH_OFFSET] + known[:, PARAMETER_AZIMUTH_OFFSET]
        late = self._estimate[:, PARAMETER_TIME_OFFSET] + known[:, PARAMETER_TIME_OFFSET]
        silent = (time_s - self._heard_s > self._silent_after_s) | (
            self._alarms >> ALARM_SILENT & 1
        ).astype(np.bool_)
        condition = np.where(self._alarms != 0, DEGRADED, OPERATIONAL)
        condition = np.where(self._unsettled().any(axis=1), INITIALISING, condition)
        ranges = (PARAMETER_RANGE_OFFSET, PARAMETER_RANGE_GAIN)
        told_range = self._told(*ranges)
        return SensorReports(
            time_s=time_s,
            sensor=self._codes[named],
            condition=np.where(silent, NOT_CONNECTED, condition)[named],
            silent=silent[named],
            time_offset_s=np.where(self._told(PARAMETER_TIME_OFFSET), late, np.nan)[named],
            range_gain=np.where(told_range, gain, np.nan)[named],
            range_offset_m=np.where(told_range, whole, np.nan)[named],
            azimuth_offset_deg=np.degrees(
                np.where(self._told(PARAMETER_AZIMUTH_OFFSET), azimuth, np.nan)
            )[named],
            secondary=self._plots[named, _SECONDARY],
            primary=self._plots[named, _PRIMARY],
        )

    def _range_biases(self) -> tuple[Floats, Floats]:
        # Known biases are taken off first, so what is estimated is that of what is left; together:
        # r (1 + g₁)(1 + g₀) + b₁ (1 + g₀) + b₀.
        known, found = self._sensors.known_bias, self._estimate
        gain = 1.0 + known[:, PARAMETER_RANGE_GAIN]
        offset = known[:, PARAMETER_RANGE_OFFSET] + found[:, PARAMETER_RANGE_OFFSET] * gain
        return offset, gain * (1.0 + found[:, PARAMETER_RANGE_GAIN]) - 1.0

    def _unsettled(self) -> NDArray[np.bool_]:
        settled = self._sigma < SETTLED_RATIO * self._prior_sigma
        return np.asarray(self._estimated & ~settled)

    def _told(self, *kinds: int) -> NDArray[np.bool_]:
        # Something is known of the parameters, and what is estimated of them has settled.
        columns = list(kinds)
        known = (self._estimated | (self._sensors.known_bias != 0.0))[:, columns].any(axis=1)
        return np.asarray(known & ~self._unsettled()[:, columns].any(axis=1))
