"""The sensors and their bias parameters as columns."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

PARAMETER_RANGE_OFFSET = 0
PARAMETER_AZIMUTH_OFFSET = 1
PARAMETER_RANGE_GAIN = 2
PARAMETER_TIME_OFFSET = 3

#: Names of the bias parameters on the wire, by kind (azimuth: degrees there, radians here).
PARAMETER_NAMES = ("range_offset_m", "azimuth_offset_deg", "range_gain", "time_offset_s")


@dataclass(frozen=True, slots=True)
class SensorTable:
    """All sensors, sorted by identifier, and the bias vector they share.

    A bias is *measured minus true*. The bias vector stacks the named parameters of all sensors;
    its columns are grouped by sensor, in the order of the sensors.

    Attributes
    ----------
    ids : tuple of str
        Identifiers, sorted.
    kinds : (m,) int8
        What the sensor measures: the kinds of `MeasurementBatch.kind`.
    latitude_rad, longitude_rad, height_m : (m,) float64
        WGS 84 site; NaN where the kind of sensor has none.
    range_sigma_m, azimuth_sigma_rad, position_sigma_m : (m,) float64
        Standard deviations of the random errors (position: per horizontal axis).
    range_max_m, rotation_period_s : (m,) float64
        Instrumented range (infinite when unknown) and antenna turn time (NaN when unknown).
    parameter_sensor : (c,) int32
        Sensor of each bias parameter.
    parameter_kind : (c,) int8
        `PARAMETER_RANGE_OFFSET` (m), `PARAMETER_AZIMUTH_OFFSET` (rad), `PARAMETER_RANGE_GAIN`
        (ratio) or `PARAMETER_TIME_OFFSET` (s).
    prior_mean, prior_sigma : (c,) float64
        What is known of each parameter beforehand.
    drift : (c,) float64
        Random walk of each parameter: standard deviation after one second.
    aliases : tuple of (str, int)
        Further names that measurements may use, with the index of the sensor.
    """

    ids: tuple[str, ...]
    kinds: NDArray[np.int8]
    latitude_rad: NDArray[np.float64]
    longitude_rad: NDArray[np.float64]
    height_m: NDArray[np.float64]
    range_sigma_m: NDArray[np.float64]
    azimuth_sigma_rad: NDArray[np.float64]
    position_sigma_m: NDArray[np.float64]
    range_max_m: NDArray[np.float64]
    rotation_period_s: NDArray[np.float64]
    parameter_sensor: NDArray[np.int32]
    parameter_kind: NDArray[np.int8]
    prior_mean: NDArray[np.float64]
    prior_sigma: NDArray[np.float64]
    drift: NDArray[np.float64]
    aliases: tuple[tuple[str, int], ...] = ()

    def __len__(self) -> int:
        return len(self.ids)
