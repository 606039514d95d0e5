"""Correction of measurements for known or estimated biases."""

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
    """Return measurements corrected for known biases.

    Parameters
    ----------
    measured : Measured
        As measured, (n,) each; NaN stays NaN.
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
    offset, plus gain · true for the range. Unlike J, the time offset is exact.
    """
    range_m, azimuth_rad = polar_without_biases(measured.range_m, measured.azimuth_rad, known)
    time_s = measured.time_s - known[:, PARAMETER_TIME_OFFSET]
    return Measured(time_s=time_s, range_m=range_m, azimuth_rad=azimuth_rad)


def polar_without_biases(
    range_m: Floats, azimuth_rad: Floats, biases: Floats
) -> tuple[Floats, Floats]:
    """Return ranges and azimuths corrected for biases; times are unchanged.

    Parameters
    ----------
    range_m, azimuth_rad : (n,) float64
        As measured, m and rad; NaN stays NaN.
    biases : (n, 4) float64
        Known or estimated biases of the sensor of each measurement.

    Returns
    -------
    range_m, azimuth_rad : (n,) float64
        As in `without_known_biases`.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.5) solved for the true measurement.
    """
    offset, gain = biases[:, PARAMETER_RANGE_OFFSET], biases[:, PARAMETER_RANGE_GAIN]
    corrected = azimuth_rad - biases[:, PARAMETER_AZIMUTH_OFFSET]
    return (range_m - offset) / (1.0 + gain), np.mod(corrected, 2.0 * np.pi)
