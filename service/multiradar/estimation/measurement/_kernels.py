"""Compiled measurement model: what a sensor sees, and how its biases enter.

Symbols: H = derivative of the measurement by east and north, W = covariance of its noise (upper
triangle: 00 01 11), J = how the biases of the measuring sensor enter, D = derivative of the place
by range and azimuth.

A row of ``noises`` is: variance of range (m²), of azimuth (rad²), of a reported position on each
axis (m²), and the height of the site (m). A row of ``sites`` is that of
`multiradar.geodesy._kernels.site_parameters`; for the flat kinds its first two places are east and
north of the radar (m), and the plane is not looked at.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from multiradar.geodesy._kernels import locate_polar, predict_polar

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

KIND_RADAR = 0
KIND_POSITION = 1
KIND_BEARING = 2
# Range and azimuth on a flat plane; the place that such a plot points to, report, (1.11).
KIND_FLAT_POLAR = 3
KIND_FLAT_PLACE = 4
PARAMETER_RANGE_OFFSET = 0
PARAMETER_AZIMUTH_OFFSET = 1
PARAMETER_RANGE_GAIN = 2
# Twice the mean radius of the Earth.
EARTH_DIAMETER_M = 12_742_000.0


@njit(cache=True, nogil=True, error_model="numpy")
def measures_azimuth(kind: int) -> bool:
    """Return whether the second component is an azimuth, whose differences are wrapped."""
    return kind in (KIND_RADAR, KIND_FLAT_POLAR)


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
    if kind == KIND_RADAR:
        r, az, r_e, r_n, az_e, az_n, ground = predict_polar(plane, site, east, north, height)
        H[0, 0] = r_e
        H[0, 1] = r_n
        H[1, 0] = az_e
        H[1, 1] = az_n
        # Slope of the slant range with the height: sine of the elevation seen from the aircraft.
        slope = (height - noise[3]) / max(r, 1.0) + r / EARTH_DIAMETER_M
        W[0] = noise[0] + slope * slope * height_variance
        W[1] = 0.0
        W[2] = noise[1]
        return r, az, ground
    if kind == KIND_POSITION:
        H[0, 0] = 1.0
        H[0, 1] = 0.0
        H[1, 0] = 0.0
        H[1, 1] = 1.0
        W[0] = noise[2]
        W[1] = 0.0
        W[2] = noise[2]
        return east, north, np.nan
    return predict_flat(kind, site, noise, east, north, H, W)


@njit(cache=True, nogil=True, error_model="numpy")
def predict_flat(
    kind: int, site: Floats, noise: Floats, east: float, north: float, H: Floats, W: Floats
) -> tuple[float, float, float]:
    """Do as `predict_measurement` for the flat kinds.

    At the very place of the radar there is no line of sight: the derivatives are none (NaN).
    """
    dx = east - site[0]
    dy = north - site[1]
    r = math.sqrt(dx * dx + dy * dy)
    if kind == KIND_FLAT_POLAR:
        H[0, 0] = dx / r
        H[0, 1] = dy / r
        H[1, 0] = dy / (r * r)
        H[1, 1] = -dx / (r * r)
        W[0] = noise[0]
        W[1] = 0.0
        W[2] = noise[1]
        return r, math.atan2(dx, dy), r
    H[0, 0] = 1.0
    H[0, 1] = 0.0
    H[1, 0] = 0.0
    H[1, 1] = 1.0
    # D W Dᵀ with D = [line / r, across], (1.11), (1.13).
    ue = dx / r
    un = dy / r
    W[0] = ue * ue * noise[0] + dy * dy * noise[1]
    W[1] = ue * un * noise[0] - dx * dy * noise[1]
    W[2] = un * un * noise[0] + dx * dx * noise[1]
    return east, north, r


@njit(cache=True, nogil=True, error_model="numpy")
def locate_measurement(
    kind: int, plane: Floats, site: Floats, z0: float, z1: float, height: float
) -> tuple[bool, float, float]:
    """Return (ok, east, north): the place that a measurement without errors comes from."""
    if kind == KIND_RADAR:
        return locate_polar(plane, site, z0, z1, height)
    if kind == KIND_FLAT_POLAR:
        return z0 > 0.0, site[0] + z0 * math.sin(z1), site[1] + z0 * math.cos(z1)
    return True, z0, z1


@njit(cache=True, nogil=True, error_model="numpy")
def bias_column(
    kind: int, parameter: int, site: Floats, p0: float, p1: float, rate0: float, rate1: float
) -> tuple[float, float]:
    """Return one column of J: how a bias parameter enters the measurement.

    ``p0``, ``p1`` are the measurement as predicted, the rates its derivative by time.
    """
    if parameter > PARAMETER_RANGE_GAIN:
        # The stamp is late by the offset, so the aircraft was measured where it was before.
        return -rate0, -rate1
    if kind == KIND_FLAT_PLACE:
        dx = p0 - site[0]
        dy = p1 - site[1]
        if parameter == PARAMETER_RANGE_OFFSET:
            r = math.sqrt(dx * dx + dy * dy)
            return dx / r, dy / r
        if parameter == PARAMETER_AZIMUTH_OFFSET:
            return dy, -dx
        return dx, dy
    if parameter == PARAMETER_RANGE_OFFSET:
        return 1.0, 0.0
    if parameter == PARAMETER_AZIMUTH_OFFSET:
        return 0.0, 1.0
    return p0, 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def bias_spread(
    kind: int,
    site: Floats,
    first: int,
    last: int,
    parameters: Integers,
    covariance: Floats,
    p0: float,
    p1: float,
    rate0: float,
    rate1: float,
) -> tuple[float, float, float]:
    """Return J P_ς Jᵀ of one sensor."""
    b00 = 0.0
    b01 = 0.0
    b11 = 0.0
    for c in range(first, last):
        j0, j1 = bias_column(kind, parameters[c], site, p0, p1, rate0, rate1)
        for d in range(first, last):
            k0, k1 = bias_column(kind, parameters[d], site, p0, p1, rate0, rate1)
            p = covariance[c, d]
            b00 += j0 * p * k0
            b01 += 0.5 * (j0 * k1 + j1 * k0) * p
            b11 += j1 * p * k1
    return b00, b01, b11
