"""Compiled closest approach of pairs of tracks: when, where, how near, and how sure that is.

What two tracks err by is taken for independent but for the biases that they share. Symbols:
t = time from now, p, w = position of the second track relative to the first and its mean rate since
now, in true metres where they meet; A, C, U = covariance of the position now, of it with the
velocity now, and of that velocity; V = covariance of w, so that the position at t has the
covariance A + t (C + Cᵀ) + t² V; T = true metres by metres on the plane.

At the closest approach p ⟂ w, so that to the first order the distance errs by what p errs by
across w, and the time by what p errs by along w, and w across p. Far from zero that is the whole;
near zero the distance is not Gaussian, and only its signed form is: see `_chance_kernels`.

For these the motion is taken as straight between now and the closest approach, along the chord
with the covariance that the forecast gives at both ends. For white acceleration of density q it is
V = U + q t / 3: a straight line of time, so that nothing is lost between two points of a forecast.

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
#: Below this, (m/s)², the variance of a velocity is a rounding error.
VELOCITY_FLOOR = 1e-9
#: A chord is not shorter, s: of a moment it would say nothing of the velocity.
CHORD_MIN_S = 1.0


@loop
def find_approaches(
    t: Floats, means: Floats, now: Floats, walks: Floats, points: Integers, shared: Floats,
    pairs: Integers, matrices: Floats, distance: float, found: Floats, chords: Floats,
) -> None:  # fmt: skip
    """Fill the rows of ``found`` and ``chords``.

    ``now`` (n, 10) and ``walks`` (n, k, 3) are A, C, U and V of the tracks, ``matrices`` (m, 4) T
    of the pairs, row by row; ``shared`` (n, 4, c) is what a standard deviation of each bias does.
    """
    for row in range(pairs.shape[0]):
        i, j = pairs[row, 0], pairs[row, 1]
        last = min(points[i], points[j]) - 1
        k, u = nearest_point(t, means, i, j, last, matrices[row])
        begin = relative_state(t, means, i, j, 0, 0.0, matrices[row])
        spread = relative_covariance(now, shared, i, j, matrices[row])
        slow = is_slow(begin[2], begin[3], spread)
        together = slow and begin[0] * begin[0] + begin[1] * begin[1] <= distance * distance
        if together:
            k, u = 0, 0.0
        dt = t[k + 1] - t[k]
        there = relative_state(t, means, i, j, k, u, matrices[row])
        time = t[k] + u * dt
        walk = relative_walk(t, walks, shared, i, j, k, u, matrices[row])
        turns = 0.0 < time < t[last]
        found[row, TIME] = time
        found[row, TOGETHER] = 1.0 if together else 0.0
        found[row, DISTANCE] = hypot(there[0], there[1])
        found[row, DISTANCE_NOW] = hypot(begin[0], begin[1])
        found[row, SIGMA] = sigma_of_distance(there, spread, walk, time, turns)
        sigma = sigma_of_time(there, spread, walk, time)
        # Less certain than the horizon is long, the time is open.
        found[row, TIME_SIGMA] = sigma if turns and sigma <= t[last] else np.nan
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
        walk = relative_walk(t, walks, shared, i, j, k, u, matrices[row])
        lay_chord(begin, spread, end, walk, reach, chords[row])
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
def turned(
    t00: float, t01: float, t10: float, t11: float, a: float, b: float, c: float, d: float
) -> tuple[float, float, float, float]:
    """Return T M Tᵀ of M = (a b; c d)."""
    ta, tb = t00 * a + t01 * c, t00 * b + t01 * d
    tc, td = t10 * a + t11 * c, t10 * b + t11 * d
    return (ta * t00 + tb * t01, ta * t10 + tb * t11, tc * t00 + td * t01, tc * t10 + td * t11)


@in_loop
def relative_covariance(
    now: Floats, shared: Floats, i: int, j: int, matrix: Floats
) -> tuple[float, float, float, float, float, float, float, float, float, float]:
    """Return the covariance of position and velocity now, upper triangle, in true metres."""
    x = common_covariance(shared, i, j)
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
def relative_walk(
    t: Floats, walks: Floats, shared: Floats, i: int, j: int, k: int, u: float, matrix: Floats
) -> tuple[float, float, float]:
    """Return V within piece k, upper triangle, in true metres."""
    x = common_covariance(shared, i, j)
    a, b, c, d = walks[i, k], walks[i, k + 1], walks[j, k], walks[j, k + 1]
    rest = 1.0 - u
    v00 = rest * (a[0] + c[0]) + u * (b[0] + d[0]) - x[7]
    v01 = rest * (a[1] + c[1]) + u * (b[1] + d[1]) - x[8]
    v11 = rest * (a[2] + c[2]) + u * (b[2] + d[2]) - x[9]
    v = turned(matrix[0], matrix[1], matrix[2], matrix[3], v00, v01, v01, v11)
    return v[0], v[1], v[3]


@in_loop
def common_covariance(
    shared: Floats, i: int, j: int
) -> tuple[float, float, float, float, float, float, float, float, float, float]:
    """Return what the biases make common to two tracks, counted twice, upper triangle."""
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
def is_slow(
    wx: float, wy: float,
    spread: tuple[float, float, float, float, float, float, float, float, float, float],
) -> bool:  # fmt: skip
    """Return whether a relative velocity cannot be told from zero: w S⁻¹ w below its bound."""
    # Of velocities without errors only equal ones are.
    a, b, d = spread[7] + VELOCITY_FLOOR, spread[8], spread[9] + VELOCITY_FLOOR
    determinant = max(a * d - b * b, 0.0)
    return wx * wx * d - 2.0 * wx * wy * b + wy * wy * a <= TOGETHER_CHI_SQUARED * determinant


@in_loop
def sigma_of_distance(
    state: tuple[float, float, float, float],
    spread: tuple[float, float, float, float, float, float, float, float, float, float],
    walk: tuple[float, float, float], time: float, turns: bool,
) -> float:  # fmt: skip
    """Return the standard deviation of the signed distance.

    It is across the relative velocity where the distance has its minimum there, and else in the
    direction in which the one sees the other; where there is none it is the largest.
    """
    x, y = state[0], state[1]
    if turns and hypot(state[2], state[3]) > 0.0:
        x, y = -state[3], state[2]
    a = spread[0] + time * (2.0 * spread[2] + time * walk[0])
    b = spread[1] + time * (spread[3] + spread[5] + time * walk[1])
    d = spread[4] + time * (2.0 * spread[6] + time * walk[2])
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
    walk: tuple[float, float, float], time: float,
) -> float:  # fmt: skip
    """Return the standard deviation of the time at which p · w = 0: of w · δp + p · δw over w²."""
    x, y, wx, wy = state
    square = wx * wx + wy * wy
    # The position now counts by w, the velocity since then by w times the time, and by p.
    ux, uy = time * wx + x, time * wy + y
    pp = wx * wx * spread[0] + 2.0 * wx * wy * spread[1] + wy * wy * spread[4]
    pv = wx * (spread[2] * ux + spread[3] * uy) + wy * (spread[5] * ux + spread[6] * uy)
    vv = ux * ux * walk[0] + 2.0 * ux * uy * walk[1] + uy * uy * walk[2]
    return sqrt(max(pp + 2.0 * pv + vv, 0.0)) / square if square > 0.0 else np.nan


@in_loop
def lay_chord(
    begin: tuple[float, float, float, float],
    spread: tuple[float, float, float, float, float, float, float, float, float, float],
    end: tuple[float, float, float, float],
    walk: tuple[float, float, float], reach: float, chord: Floats,
) -> None:  # fmt: skip
    """Fill a straight motion from now to a later time, and its covariance."""
    scale = 1.0 / reach
    chord[CHORD_P], chord[CHORD_P + 1] = begin[0], begin[1]
    chord[CHORD_W] = (end[0] - begin[0]) * scale
    chord[CHORD_W + 1] = (end[1] - begin[1]) * scale
    chord[CHORD_A], chord[CHORD_A + 1], chord[CHORD_A + 2] = spread[0], spread[1], spread[4]
    chord[CHORD_C], chord[CHORD_C + 1] = spread[2], spread[3]
    chord[CHORD_C + 2], chord[CHORD_C + 3] = spread[5], spread[6]
    chord[CHORD_V], chord[CHORD_V + 1], chord[CHORD_V + 2] = walk[0], walk[1], walk[2]
