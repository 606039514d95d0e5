"""Refraction of radar ranges, by the effective radius of the Earth.

In air whose refractive index n falls linearly with the height h, rays are straight lines above an
Earth whose radius is k times the true one, at the same heights and the same distances along the
surface (Schelleng, Burrows and Ferrell): 1/k = 1 + (R/n) dn/dh. The length of that line is then the
optical path ∫ n ds over the n at the antenna, that is the range of a radar that multiplies the time
of flight by the speed of light in the air around it. A radar that uses the speed in vacuum measures
n times as much, 315 parts per million more: a range gain.

Symbols: s = straight slant range, r = range measured, a, b = heights of antenna and aircraft, R =
radius of the Earth, G = distance along the surface. By the law of cosines, with u = sin²(G / 2R)::

    s² = (b − a)² + 4 (R + a) (R + b) u
    r² = (b − a)² + 4 (R + a/k) (R + b/k) k² sin²(G / 2kR)
    k² sin²(arcsin(√u) / k) = u (1 + (1 − 1/k²) u / 3 + (8 − 10/k² + 2/k⁴) u² / 45 + …)

u is 0.001 at 400 km: the series is exact to centimetres.

References
----------
Schelleng, J. C., Burrows, C. R., Ferrell, E. B., "Ultra-short-wave propagation", Proceedings of the
IRE 21 (1933), 427-463. Recommendation ITU-R P.453: refractivity 315 exp(−h / 7.35 km) of the mean
atmosphere, with which `tests/unit/core/geodesy/test_refraction.py` traces rays.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

#: Mean radius of the Earth, m. One part in 300 is 0.2 m of refraction.
EARTH_RADIUS_M = 6_371_000.0
#: Height of aircraft whose height is not known, m. 1000 m are 5 m of refraction at 300 km.
HEIGHT_M = 8000.0
# Newton iterations; the first value has an error of millimetres.
_ROUNDS = 2


def refracted_range(
    straight_m: ArrayLike, height_m: ArrayLike, site_height_m: ArrayLike, factor: ArrayLike
) -> Floats:
    """Return the ranges that radars measure in air.

    Parameters
    ----------
    straight_m : (...) array_like
        Straight slant ranges, m; NaN stays NaN.
    height_m, site_height_m : (...) array_like
        Heights of aircraft and antennas, m; an unknown one, NaN, counts as `HEIGHT_M`.
    factor : (...) array_like
        Factor k of the effective radius of the Earth; NaN for no refraction.

    Returns
    -------
    (...) float64
        Ranges, m; the straight one where that is shorter than the difference of the heights.

    References
    ----------
    Schelleng, Burrows, Ferrell (1933); the series is the project's own.
    """
    straight = np.asarray(straight_m, np.float64)
    rise2, scale, factors, bends = _terms(height_m, site_height_m, factor)
    level2 = straight**2 - rise2
    u = np.maximum(level2, 0.0) / scale
    bent = np.sqrt(rise2 + factors[0] * scale * _lengthened(u, factors))
    return np.where(bends & (level2 > 0.0), bent, straight)


def straight_range(
    range_m: ArrayLike, height_m: ArrayLike, site_height_m: ArrayLike, factor: ArrayLike
) -> Floats:
    """Return the straight slant ranges of measured ranges; the inverse of `refracted_range`.

    Parameters
    ----------
    range_m : (...) array_like
        Ranges as measured, m; NaN stays NaN.
    height_m, site_height_m, factor : (...) array_like
        As for `refracted_range`.

    Returns
    -------
    (...) float64
        Straight slant ranges, m.

    References
    ----------
    Schelleng, Burrows, Ferrell (1933); the inverse of the series is the project's own.
    """
    measured = np.asarray(range_m, np.float64)
    rise2, scale, factors, bends = _terms(height_m, site_height_m, factor)
    level2 = measured**2 - rise2
    wanted = np.maximum(level2, 0.0) / (factors[0] * scale)
    u = wanted
    for _ in range(_ROUNDS):
        slope = 1.0 + 2.0 * factors[1] * u + 3.0 * factors[2] * u**2
        u = u - (_lengthened(u, factors) - wanted) / slope
    return np.where(bends & (level2 > 0.0), np.sqrt(rise2 + scale * u), measured)


def _lengthened(u: Floats, factors: tuple[Floats, Floats, Floats]) -> Floats:
    lengthened: Floats = u * (1.0 + factors[1] * u + factors[2] * u**2)
    return lengthened


# Squared difference of heights, 4 (R + a) (R + b), factor and coefficients of the series, and
# where there is refraction.
def _terms(
    height_m: ArrayLike, site_height_m: ArrayLike, factor: ArrayLike
) -> tuple[Floats, Floats, tuple[Floats, Floats, Floats], NDArray[np.bool_]]:
    height, site = np.asarray(height_m, np.float64), np.asarray(site_height_m, np.float64)
    height = np.where(np.isnan(height), HEIGHT_M, height)
    k = np.asarray(factor, np.float64)
    bends = np.isfinite(k)
    part = 1.0 / np.where(bends, k, 1.0)
    radius = EARTH_RADIUS_M
    scale = 4.0 * (radius + site) * (radius + height)
    shrunk = 4.0 * (radius + part * site) * (radius + part * height) / scale
    squared = part**2
    series = (1.0 - squared) / 3.0, (8.0 - 10.0 * squared + 2.0 * squared**2) / 45.0
    return (height - site) ** 2, scale, (shrunk, *series), bends
