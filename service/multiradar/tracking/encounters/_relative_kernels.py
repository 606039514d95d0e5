"""Compiled relative covariances of pairs of tracks, without their common errors.

A, C, U are the covariance of a track's position now, its cross-covariance with the velocity now,
and the covariance of that velocity; V that of its mean velocity since now: the usual one or, in the
fraction `RARE_SHARE` of cases, the rare one. x = covariance common to two tracks by biases; T =
true metres per metre on the plane; k, u = piece of the horizon and fraction of it.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop

Floats = NDArray[np.float64]

#: Columns of the two V of a track, upper triangles, and the fraction of the rare one.
USUAL, RARE = 0, 3
RARE_SHARE = 0.25


@in_loop
def relative_covariance(
    now: Floats,
    x: tuple[float, float, float, float, float, float, float, float, float, float],
    i: int,
    j: int,
    matrix: Floats,
) -> tuple[float, float, float, float, float, float, float, float, float, float]:
    """Return the covariance of position and velocity now, upper triangle, in true metres.

    ``x`` is the covariance common to both tracks.
    """
    a, b = now[i], now[j]
    m0, m1, m2, m3 = matrix[0], matrix[1], matrix[2], matrix[3]
    s01, s23 = a[1] + b[1] - x[1], a[8] + b[8] - x[8]
    p = turned(m0, m1, m2, m3, a[0] + b[0] - x[0], s01, s01, a[4] + b[4] - x[4])
    c = turned(
        m0, m1, m2, m3, a[2] + b[2] - x[2], a[3] + b[3] - x[3], a[5] + b[5] - x[5],
        a[6] + b[6] - x[6],
    )  # fmt: skip
    v = turned(m0, m1, m2, m3, a[7] + b[7] - x[7], s23, s23, a[9] + b[9] - x[9])
    return p[0], p[1], c[0], c[1], p[3], c[2], c[3], v[0], v[1], v[3]


@in_loop
def relative_velocity_spread(
    velocity_spreads: Floats,
    x: tuple[float, float, float, float, float, float, float, float, float, float], i: int, j: int,
    k: int, u: float, first: float, second: float, matrix: Floats,
) -> tuple[float, float, float]:  # fmt: skip
    """Return V within piece k, upper triangle, in true metres.

    ``first`` and ``second`` are the weights of the rare V of each track.
    """
    v00 = track_velocity_spread(velocity_spreads, i, k, u, first, 0) + track_velocity_spread(
        velocity_spreads, j, k, u, second, 0
    )
    v01 = track_velocity_spread(velocity_spreads, i, k, u, first, 1) + track_velocity_spread(
        velocity_spreads, j, k, u, second, 1
    )
    v11 = track_velocity_spread(velocity_spreads, i, k, u, first, 2) + track_velocity_spread(
        velocity_spreads, j, k, u, second, 2
    )
    v01 -= x[8]
    v = turned(matrix[0], matrix[1], matrix[2], matrix[3], v00 - x[7], v01, v01, v11 - x[9])
    return v[0], v[1], v[3]


@in_loop
def track_velocity_spread(
    velocity_spreads: Floats, i: int, k: int, u: float, rare: float, column: int
) -> float:
    """Return an element of the V of a track within piece k."""
    a, b = velocity_spreads[i, k], velocity_spreads[i, k + 1]
    usual = (1.0 - u) * a[USUAL + column] + u * b[USUAL + column]
    far = (1.0 - u) * a[RARE + column] + u * b[RARE + column]
    value: float = (1.0 - rare) * usual + rare * far
    return value


@in_loop
def common_covariance(
    shared: Floats, i: int, j: int
) -> tuple[float, float, float, float, float, float, float, float, float, float]:
    """Return the covariance common to two tracks by biases, twice, upper triangle."""
    x00, x01, x02, x03, x11 = 0.0, 0.0, 0.0, 0.0, 0.0
    x12, x13, x22, x23, x33 = 0.0, 0.0, 0.0, 0.0, 0.0
    for bias in range(shared.shape[2]):
        a0, a1, a2, a3 = (
            shared[i, 0, bias], shared[i, 1, bias], shared[i, 2, bias], shared[i, 3, bias],
        )  # fmt: skip
        b0, b1, b2, b3 = (
            shared[j, 0, bias], shared[j, 1, bias], shared[j, 2, bias], shared[j, 3, bias],
        )  # fmt: skip
        x00 += 2.0 * a0 * b0
        x01 += a0 * b1 + b0 * a1
        x02 += a0 * b2 + b0 * a2
        x03 += a0 * b3 + b0 * a3
        x11 += 2.0 * a1 * b1
        x12 += a1 * b2 + b1 * a2
        x13 += a1 * b3 + b1 * a3
        x22 += 2.0 * a2 * b2
        x23 += a2 * b3 + b2 * a3
        x33 += 2.0 * a3 * b3
    return x00, x01, x02, x03, x11, x12, x13, x22, x23, x33


@in_loop
def turned(
    t00: float, t01: float, t10: float, t11: float, a: float, b: float, c: float, d: float
) -> tuple[float, float, float, float]:
    """Return T M Tᵀ of M = (a b; c d)."""
    ta, tb = t00 * a + t01 * c, t00 * b + t01 * d
    tc, td = t10 * a + t11 * c, t10 * b + t11 * d
    return (ta * t00 + tb * t01, ta * t10 + tb * t11, tc * t00 + td * t01, tc * t10 + td * t11)
