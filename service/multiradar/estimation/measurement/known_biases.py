"""What a sensor would have measured without the biases that are known of it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
)

Floats = NDArray[np.float64]


class Measured(NamedTuple):
    """Time stamps (s), ranges (m) and azimuths (rad) of measurements."""

    time_s: Floats
    range_m: Floats
    azimuth_rad: Floats


def without_known_biases(measured: Measured, known: Floats) -> Measured:
    """Return measurements with known biases taken off.

    Parameters
    ----------
    measured : Measured
        As the sensors said, (n,) each; NaN stays NaN.
    known : (n, 4) float64
        `SensorTable.known_bias` of the sensor of each measurement.

    Returns
    -------
    Measured
        Time minus time offset, (range minus range offset) / (1 + range gain), and azimuth minus
        azimuth offset in [0, 2π).

    References
    ----------
    IMM UrO RAN report (2016), equation (1.5) solved for the true measurement: measured = true +
    offset, and gain · true besides for the range. Unlike J, the time offset is exact.
    """
    offset, gain = known[:, PARAMETER_RANGE_OFFSET], known[:, PARAMETER_RANGE_GAIN]
    turned = measured.azimuth_rad - known[:, PARAMETER_AZIMUTH_OFFSET]
    return Measured(
        time_s=measured.time_s - known[:, PARAMETER_TIME_OFFSET],
        range_m=(measured.range_m - offset) / (1.0 + gain),
        azimuth_rad=np.mod(turned, 2.0 * np.pi),
    )
