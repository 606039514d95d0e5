"""Compiled measurement model: what a sensor sees, and how its biases enter.

Symbols: H = derivative of the measurement by east and north, W = variances of its noise, J = how
the biases of the measuring sensor enter.

A row of ``noises`` is: variance of range (m²), of azimuth (rad²), of a reported position on each
axis (m²), and the height of the site (m).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from multiradar.geodesy._kernels import predict_polar

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

KIND_RADAR = 0
KIND_POSITION = 1
PARAMETER_RANGE_OFFSET = 0
PARAMETER_AZIMUTH_OFFSET = 1
PARAMETER_RANGE_GAIN = 2
# Twice the mean radius of the Earth.
EARTH_DIAMETER_M = 12_742_000.0


@njit(cache=True, nogil=True, error_model="numpy")
def predict_measurement(
    kind: int,
    plane: Floats,
    site: Floats,
    noise: Floats,
    east: float,
    north: float,
    height: float,
    height_variance: float,
    H: Floats,
    W: Floats,
) -> tuple[float, float, float]:
    """Fill H and W; return both predicted components and the ground range (NaN without a site)."""
    if kind == KIND_POSITION:
        H[0, 0] = 1.0
        H[0, 1] = 0.0
        H[1, 0] = 0.0
        H[1, 1] = 1.0
        W[0] = noise[2]
        W[1] = noise[2]
        return east, north, np.nan
    r, az, r_e, r_n, az_e, az_n, ground = predict_polar(plane, site, east, north, height)
    H[0, 0] = r_e
    H[0, 1] = r_n
    H[1, 0] = az_e
    H[1, 1] = az_n
    # Slope of the slant range with the height: sine of the elevation seen from the aircraft.
    slope = (height - noise[3]) / max(r, 1.0) + r / EARTH_DIAMETER_M
    W[0] = noise[0] + slope * slope * height_variance
    W[1] = noise[1]
    return r, az, ground


@njit(cache=True, nogil=True, error_model="numpy")
def bias_column(parameter: int, r: float, r_rate: float, az_rate: float) -> tuple[float, float]:
    """Return one column of J: how a bias parameter enters range and azimuth."""
    if parameter == PARAMETER_RANGE_OFFSET:
        return 1.0, 0.0
    if parameter == PARAMETER_AZIMUTH_OFFSET:
        return 0.0, 1.0
    if parameter == PARAMETER_RANGE_GAIN:
        return r, 0.0
    # The stamp is late by the offset, so the aircraft was measured where it was before.
    return -r_rate, -az_rate


@njit(cache=True, nogil=True, error_model="numpy")
def bias_spread(
    first: int,
    last: int,
    parameters: Integers,
    covariance: Floats,
    r: float,
    r_rate: float,
    az_rate: float,
) -> tuple[float, float, float]:
    """Return J P_ς Jᵀ of one sensor."""
    b00 = 0.0
    b01 = 0.0
    b11 = 0.0
    for c in range(first, last):
        j0, j1 = bias_column(parameters[c], r, r_rate, az_rate)
        for d in range(first, last):
            k0, k1 = bias_column(parameters[d], r, r_rate, az_rate)
            p = covariance[c, d]
            b00 += j0 * p * k0
            b01 += 0.5 * (j0 * k1 + j1 * k0) * p
            b11 += j1 * p * k1
    return b00, b01, b11
