"""Compiled closest approach of pairs of tracks: when, where, how near, and how sure that is.

What two tracks err by is taken for independent but for the biases that they share. Symbols:
t = time from now, p, w = position and velocity of the second track relative to the first, in true
metres where they meet; S = covariance of (p, w), upper triangle row by row; T = true metres by
metres on the plane; X = what the biases make common: S = P₁ + P₂ − X.

At the closest approach p ⟂ w, so that to the first order the distance errs by what p errs by
across w, and the time by what p errs by along w, and w across p. Far from zero that is the whole;
near zero the distance is not Gaussian, and only its signed form is: see `_chance_kernels`.

For these the motion is taken as straight between now and the closest approach, along the chord
with the covariance that the forecast gives at both ends.

References
----------
R. A. Paielli, H. Erzberger, "Conflict probability estimation for free flight", Journal of Guidance,
Control, and Dynamics 20 (1997), 588-596: errors of both aircraft as those of one, and the distance
across the relative velocity. The project's own: the chord, pairs that fly together, shared biases.
"""

from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from multiradar.kernels import in_loop, loop
from multiradar.tracking.encounters._path_kernels import cubic, cubic_rate, nearest_part

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Columns of what is found of a pair. Times are from now.
(
    TIME, TIME_SIGMA, DISTANCE, SIGMA, DISTANCE_NOW, TOGETHER, FIRST_EAST, FIRST_NORTH, SECOND_EAST,
    SECOND_NORTH,
) = range(10)  # fmt: skip
FOUND_COUNT = 10
#: Columns of a straight relative motion: position now and velocity; covariance of the position,
#: upper triangle; of the position and the velocity, row by row; of the velocity, upper triangle;
#: how long it lasts.
CHORD_P, CHORD_W, CHORD_A, CHORD_C, CHORD_V, CHORD_END = 0, 2, 4, 7, 11, 14
CHORD_COUNT = 15
#: The relative velocity of two tracks that fly together is none that could be told from zero:
#: the 99 % point of χ² with two degrees of freedom.
TOGETHER_CHI_SQUARED = 9.21
#: A chord is not shorter, s: of a moment it would say nothing of the velocity.
CHORD_MIN_S = 1.0


@loop
def find_approaches(
    t: Floats, means: Floats, covariances: Floats, points: Integers, shared: Floats,
    pairs: Integers, matrices: Floats, distance: float, found: Floats, chords: Floats,
) -> None:  # fmt: skip
    """Fill the rows of ``found`` and ``chords``.

    ``matrices`` (m, 4) are T of the pairs, row by row; ``shared`` (n, 4, c) is what a standard
    deviation of each bias does to the tracks now.
    """
    for row in range(pairs.shape[0]):
        i, j = pairs[row, 0], pairs[row, 1]
        last = min(points[i], points[j]) - 1
        k, u = nearest_point(t, means, i, j, last, matrices[row])
        now = relative_state(t, means, i, j, 0, 0.0, matrices[row])
        spread_now = relative_covariance(t, covariances, shared, i, j, 0, 0.0, matrices[row])
        near_now = now[0] * now[0] + now[1] * now[1] <= distance * distance
        slow = is_slow(now[2], now[3], spread_now)
        together = near_now and slow
        if together:
            k, u = 0, 0.0
        dt = t[k + 1] - t[k]
        there = relative_state(t, means, i, j, k, u, matrices[row])
        spread = relative_covariance(t, covariances, shared, i, j, k, u, matrices[row])
        time = t[k] + u * dt
        found[row, TIME] = time
        found[row, TOGETHER] = 1.0 if together else 0.0
        found[row, DISTANCE] = hypot(there[0], there[1])
        found[row, DISTANCE_NOW] = hypot(now[0], now[1])
        turns = 0.0 < time < t[last]
        found[row, SIGMA] = sigma_of_distance(there, spread, turns)
        found[row, TIME_SIGMA] = sigma_of_time(there, spread) if turns else np.nan
        for axis in range(2):
            found[row, FIRST_EAST + axis] = place_at(means, i, k, u, dt, axis)
            found[row, SECOND_EAST + axis] = place_at(means, j, k, u, dt, axis)
        # Where the relative velocity is as good as none the approach may be at any time.
        reach = t[last] if slow else min(max(time, CHORD_MIN_S), t[last])
        k = 0
        while k < last - 1 and t[k + 1] < reach:
            k += 1
        u = (reach - t[k]) / (t[k + 1] - t[k])
        end = relative_state(t, means, i, j, k, u, matrices[row])
        end_spread = relative_covariance(t, covariances, shared, i, j, k, u, matrices[row])
        lay_chord(now, spread_now, end, end_spread, reach, chords[row])
        chords[row, CHORD_END] = t[last]


@in_loop
def place_at(means: Floats, i: int, k: int, u: float, dt: float, axis: int) -> float:
    """Return one coordinate of a track within piece k of its way."""
    a, b = means[i, k], means[i, k + 1]
    place: float = cubic(u, dt, a[axis], b[axis], a[axis + 2], b[axis + 2])
    return place


@in_loop
def relative_point(
    means: Floats, i: int, j: int, k: int, matrix: Floats
) -> tuple[float, float, float, float]:
    """Return position and velocity at one point of the forecasts, in true metres."""
    a, b = means[i, k], means[j, k]
    x, y, vx, vy = b[0] - a[0], b[1] - a[1], b[2] - a[2], b[3] - a[3]
    return (
        matrix[0] * x + matrix[1] * y,
        matrix[2] * x + matrix[3] * y,
        matrix[0] * vx + matrix[1] * vy,
        matrix[2] * vx + matrix[3] * vy,
    )


@in_loop
def relative_state(
    t: Floats, means: Floats, i: int, j: int, k: int, u: float, matrix: Floats
) -> tuple[float, float, float, float]:
    """Return position and velocity within piece k."""
    dt = t[k + 1] - t[k]
    a = relative_point(means, i, j, k, matrix)
    b = relative_point(means, i, j, k + 1, matrix)
    return (
        cubic(u, dt, a[0], b[0], a[2], b[2]),
        cubic(u, dt, a[1], b[1], a[3], b[3]),
        cubic_rate(u, dt, a[0], b[0], a[2], b[2]),
        cubic_rate(u, dt, a[1], b[1], a[3], b[3]),
    )


@in_loop
def nearest_point(
    t: Floats, means: Floats, i: int, j: int, last: int, matrix: Floats
) -> tuple[int, float]:
    """Return the piece, and the part of it, in which the expected positions are nearest."""
    nearest, at, part = np.inf, 0, 0.0
    b = relative_point(means, i, j, 0, matrix)
    for k in range(last):
        a = b
        b = relative_point(means, i, j, k + 1, matrix)
        u, square = nearest_part(
            t[k + 1] - t[k], a[0], a[1], b[0], b[1], a[2], a[3], b[2], b[3]
        )  # fmt: skip
        if square < nearest:
            nearest, at, part = square, k, u
    return at, part


@in_loop
def covariance_within(
    covariances: Floats, i: int, k: int, u: float, dt: float
) -> tuple[float, float, float, float, float, float, float, float, float, float]:
    """Return the covariance of a track within piece k; the rate of each block is the next one."""
    a, b = covariances[i, k], covariances[i, k + 1]
    return (
        cubic(u, dt, a[0], b[0], 2.0 * a[2], 2.0 * b[2]),
        cubic(u, dt, a[1], b[1], a[3] + a[5], b[3] + b[5]),
        cubic(u, dt, a[2], b[2], a[7], b[7]),
        cubic(u, dt, a[3], b[3], a[8], b[8]),
        cubic(u, dt, a[4], b[4], 2.0 * a[6], 2.0 * b[6]),
        cubic(u, dt, a[5], b[5], a[8], b[8]),
        cubic(u, dt, a[6], b[6], a[9], b[9]),
        a[7] + u * (b[7] - a[7]),
        a[8] + u * (b[8] - a[8]),
        a[9] + u * (b[9] - a[9]),
    )


@in_loop
def turned(
    t00: float, t01: float, t10: float, t11: float, a: float, b: float, c: float, d: float
) -> tuple[float, float, float, float]:
    """Return T M Tᵀ of M = (a b; c d)."""
    ta, tb = t00 * a + t01 * c, t00 * b + t01 * d
    tc, td = t10 * a + t11 * c, t10 * b + t11 * d
    return (ta * t00 + tb * t01, ta * t10 + tb * t11, tc * t00 + td * t01, tc * t10 + td * t11)


@in_loop
def relative_covariance(
    t: Floats, covariances: Floats, shared: Floats, i: int, j: int, k: int, u: float,
    matrix: Floats,
) -> tuple[float, float, float, float, float, float, float, float, float, float]:  # fmt: skip
    """Return S within piece k, in true metres."""
    dt = t[k + 1] - t[k]
    a = covariance_within(covariances, i, k, u, dt)
    b = covariance_within(covariances, j, k, u, dt)
    x = common_covariance(shared, i, j, t[k] + u * dt)
    m0, m1, m2, m3 = matrix[0], matrix[1], matrix[2], matrix[3]
    s01 = a[1] + b[1] - x[1]
    s23 = a[8] + b[8] - x[8]
    p = turned(m0, m1, m2, m3, a[0] + b[0] - x[0], s01, s01, a[4] + b[4] - x[4])
    c = turned(
        m0, m1, m2, m3, a[2] + b[2] - x[2], a[3] + b[3] - x[3], a[5] + b[5] - x[5],
        a[6] + b[6] - x[6],
    )  # fmt: skip
    v = turned(m0, m1, m2, m3, a[7] + b[7] - x[7], s23, s23, a[9] + b[9] - x[9])
    return p[0], p[1], c[0], c[1], p[3], c[2], c[3], v[0], v[1], v[3]


@in_loop
def common_covariance(
    shared: Floats, i: int, j: int, time: float
) -> tuple[float, float, float, float, float, float, float, float, float, float]:
    """Return X, a time from now."""
    x00, x01, x02, x03, x11 = 0.0, 0.0, 0.0, 0.0, 0.0
    x12, x13, x22, x23, x33 = 0.0, 0.0, 0.0, 0.0, 0.0
    for bias in range(shared.shape[2]):
        a2, a3, b2, b3 = (
            shared[i, 2, bias],
            shared[i, 3, bias],
            shared[j, 2, bias],
            shared[j, 3, bias],
        )
        a0, a1 = shared[i, 0, bias] + time * a2, shared[i, 1, bias] + time * a3
        b0, b1 = shared[j, 0, bias] + time * b2, shared[j, 1, bias] + time * b3
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
def is_slow(
    wx: float, wy: float,
    spread: tuple[float, float, float, float, float, float, float, float, float, float],
) -> bool:  # fmt: skip
    """Return whether a relative velocity cannot be told from zero: w S⁻¹ w below its bound."""
    a, b, d = spread[7], spread[8], spread[9]
    determinant = max(a * d - b * b, 0.0)
    return wx * wx * d - 2.0 * wx * wy * b + wy * wy * a <= TOGETHER_CHI_SQUARED * determinant


@in_loop
def sigma_of_distance(
    state: tuple[float, float, float, float],
    spread: tuple[float, float, float, float, float, float, float, float, float, float],
    turns: bool,
) -> float:
    """Return the standard deviation of the signed distance.

    It is across the relative velocity where the distance has its minimum there, and else in the
    direction in which the one sees the other; where there is none it is the largest.
    """
    x, y = state[0], state[1]
    if turns and hypot(state[2], state[3]) > 0.0:
        x, y = -state[3], state[2]
    a, b, d = spread[0], spread[1], spread[4]
    square = x * x + y * y
    if square > 0.0:
        variance = (x * x * a + 2.0 * x * y * b + y * y * d) / square
    else:
        variance = 0.5 * (a + d) + sqrt(0.25 * (a - d) * (a - d) + b * b)
    return sqrt(max(variance, 0.0))


@in_loop
def sigma_of_time(
    state: tuple[float, float, float, float],
    spread: tuple[float, float, float, float, float, float, float, float, float, float],
) -> float:
    """Return the standard deviation of the time at which p · w = 0."""
    x, y, wx, wy = state
    square = wx * wx + wy * wy
    pp = wx * wx * spread[0] + 2.0 * wx * wy * spread[1] + wy * wy * spread[4]
    pv = wx * (spread[2] * x + spread[3] * y) + wy * (spread[5] * x + spread[6] * y)
    vv = x * x * spread[7] + 2.0 * x * y * spread[8] + y * y * spread[9]
    return sqrt(max(pp + 2.0 * pv + vv, 0.0)) / square if square > 0.0 else np.nan


@in_loop
def lay_chord(
    now: tuple[float, float, float, float],
    spread: tuple[float, float, float, float, float, float, float, float, float, float],
    end: tuple[float, float, float, float],
    end_spread: tuple[float, float, float, float, float, float, float, float, float, float],
    reach: float, chord: Floats,
) -> None:  # fmt: skip
    """Fill a straight motion from now to a later time, and its covariance.

    That of the velocity follows from those of the position at both ends.
    """
    scale = 1.0 / reach
    chord[CHORD_P], chord[CHORD_P + 1] = now[0], now[1]
    chord[CHORD_W] = (end[0] - now[0]) * scale
    chord[CHORD_W + 1] = (end[1] - now[1]) * scale
    chord[CHORD_A], chord[CHORD_A + 1], chord[CHORD_A + 2] = spread[0], spread[1], spread[4]
    chord[CHORD_C], chord[CHORD_C + 1] = spread[2], spread[3]
    chord[CHORD_C + 2], chord[CHORD_C + 3] = spread[5], spread[6]
    square = scale * scale
    chord[CHORD_V] = (end_spread[0] - spread[0] - 2.0 * reach * spread[2]) * square
    chord[CHORD_V + 1] = (end_spread[1] - spread[1] - reach * (spread[3] + spread[5])) * square
    chord[CHORD_V + 2] = (end_spread[4] - spread[4] - 2.0 * reach * spread[6]) * square
