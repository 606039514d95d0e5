"""Compiled closest point of approach (CPA) of pairs of tracks, with uncertainties.

Errors of two tracks are taken as independent, except for common biases. Symbols: t = time from now,
p, w = position of the second track relative to the first and its mean velocity since now, in true
metres where they meet; A, C, U = covariance of the position now, its cross-covariance with the
velocity now, and the covariance of that velocity; V = covariance of w, so that the position at t
has the covariance A + t (C + Cᵀ) + t² V; T = true metres per metre on the plane. A track has two V,
the usual one and, in the fraction `RARE_SHARE` of cases, the rare one: a pair has four.

At the closest approach p ⟂ w. To first order, the error of the distance is that of p across w, and
the error of the time is that of p along w and of w across p. Near zero the distance is not
Gaussian, only its signed form is: see `_conflict_kernels`.

Probabilities use a straight motion between now and the closest approach, along the chord, with the
covariance of the forecast at both ends. For white acceleration of density q, V = U + q t / 3 is
linear in time, and interpolation between two points of a forecast is exact.

References
----------
R. A. Paielli, H. Erzberger, "Conflict probability estimation for free flight", Journal of Guidance,
Control, and Dynamics 20 (1997), 588-596: combined error covariance of both aircraft, and the
distance across the relative velocity. The project's own: the chord, pairs that fly together, shared
biases.
"""

from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.encounters._path_kernels import cubic, cubic_rate, is_within, nearest_part
from multiradar.tracking.encounters._relative_kernels import (
    RARE_SHARE,
    common_covariance,
    relative_covariance,
    relative_velocity_spread,
)
from multiradar_compiled.kernels import in_loop, loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Columns of the results of a pair. Times are from now.
(
    TIME, TIME_SIGMA, DISTANCE, SIGMA, DISTANCE_NOW, TOGETHER, FIRST_EAST, FIRST_NORTH, SECOND_EAST,
    SECOND_NORTH,
) = range(10)  # fmt: skip
FOUND_COUNT = 10
#: Columns of a straight relative motion: position now and velocity; covariance of the position,
#: upper triangle; cross-covariance of position and velocity, row by row; duration; covariance of
#: the velocity, upper triangle, for each of the `VARIANTS`.
CHORD_P, CHORD_W, CHORD_A, CHORD_C, CHORD_END, CHORD_V = 0, 2, 4, 7, 11, 12
#: Usual V of both tracks, rare V of the first, of the second, of both.
VARIANTS = 4
CHORD_COUNT = CHORD_V + 3 * VARIANTS
#: The relative velocity of two tracks that fly together does not differ significantly from zero:
#: the 99 % point of χ² with two degrees of freedom.
TOGETHER_CHI_SQUARED = 9.21
#: Below this, (m/s)², the variance of a velocity is a rounding error.
VELOCITY_FLOOR = 1e-9
#: Minimum duration of a chord, s: shorter ones do not determine the velocity.
CHORD_MIN_S = 1.0


@loop
def find_approaches(
    t: Floats, means: Floats, now: Floats, velocity_spreads: Floats, points: Integers,
    shared: Floats, pairs: Integers, matrices: Floats, distance: float, found: Floats,
    chords: Floats,
) -> None:  # fmt: skip
    """Fill the rows of ``found`` and ``chords``.

    ``now`` (n, 10) and ``velocity_spreads`` (n, k, 6) are A, C, U and both V of the tracks,
    ``matrices`` (m, 4) T of the pairs, row by row; ``shared`` (n, 4, c) is the effect of one
    standard deviation of each bias.
    """
    for row in range(pairs.shape[0]):
        i, j = pairs[row, 0], pairs[row, 1]
        last = min(points[i], points[j]) - 1
        k, u = nearest_point(t, means, i, j, last, matrices[row])
        begin = relative_state(t, means, i, j, 0, 0.0, matrices[row])
        common = common_covariance(shared, i, j)
        spread = relative_covariance(now, common, i, j, matrices[row])
        slow = is_slow(begin[2], begin[3], spread)
        together = slow and begin[0] * begin[0] + begin[1] * begin[1] <= distance * distance
        if together:
            k, u = 0, 0.0
        dt = t[k + 1] - t[k]
        there = relative_state(t, means, i, j, k, u, matrices[row])
        time = t[k] + u * dt
        spread_w = relative_velocity_spread(
            velocity_spreads, common, i, j, k, u, RARE_SHARE, RARE_SHARE, matrices[row]
        )
        interior = 0.0 < time < t[last]
        found[row, TIME] = time
        found[row, TOGETHER] = 1.0 if together else 0.0
        found[row, DISTANCE] = hypot(there[0], there[1])
        found[row, DISTANCE_NOW] = hypot(begin[0], begin[1])
        found[row, SIGMA] = sigma_of_distance(there, spread, spread_w, time, interior)
        sigma = sigma_of_time(there, spread, spread_w, time)
        # The time is undefined if its error exceeds the horizon.
        found[row, TIME_SIGMA] = sigma if interior and sigma <= t[last] else np.nan
        for axis in range(2):
            found[row, FIRST_EAST + axis] = position_at(means, i, k, u, dt, axis)
            found[row, SECOND_EAST + axis] = position_at(means, j, k, u, dt, axis)
        reach = min(max(time, CHORD_MIN_S), t[last])
        if slow:
            # Without relative velocity the approach may be at any time.
            reach = t[last]
        elif time == 0.0:
            reach = t[
                likely_return(t, means, velocity_spreads, common, i, j, last, matrices[row], spread)
            ]
        k = 0
        while k < last - 1 and t[k + 1] < reach:
            k += 1
        u = (reach - t[k]) / (t[k + 1] - t[k])
        end = relative_state(t, means, i, j, k, u, matrices[row])
        fill_chord(begin, spread, end, reach, chords[row])
        chords[row, CHORD_END] = t[last]
        for variant in range(VARIANTS):
            first, second = float(variant % 2), float(variant // 2)
            spread_w = relative_velocity_spread(
                velocity_spreads, common, i, j, k, u, first, second, matrices[row]
            )
            for column in range(3):
                chords[row, CHORD_V + 3 * variant + column] = spread_w[column]


@in_loop
def likely_return(
    t: Floats, means: Floats, velocity_spreads: Floats,
    common: tuple[float, float, float, float, float, float, float, float, float, float],
    i: int, j: int, last: int, matrix: Floats,
    spread: tuple[float, float, float, float, float, float, float, float, float, float],
) -> int:  # fmt: skip
    """Return the point at which two diverging tracks are likeliest to be close again.

    It has the least distance in terms of its error.
    """
    likeliest, least = 1, np.inf
    for k in range(1, last + 1):
        x, y, _, _ = relative_point(means, i, j, k, matrix)
        v00, _, v11 = relative_velocity_spread(
            velocity_spreads, common, i, j, k - 1, 1.0, RARE_SHARE, RARE_SHARE, matrix
        )
        crossed = 2.0 * t[k] * (spread[2] + spread[6])
        variance = spread[0] + spread[4] + crossed + t[k] * t[k] * (v00 + v11)
        ratio = (x * x + y * y) / max(variance, VELOCITY_FLOOR)
        if ratio < least:
            likeliest, least = k, ratio
    return likeliest


@in_loop
def position_at(means: Floats, i: int, k: int, u: float, dt: float, axis: int) -> float:
    """Return one coordinate of a track within piece k of its path."""
    a, b = means[i, k], means[i, k + 1]
    position: float = cubic(u, dt, a[axis], b[axis], a[axis + 2], b[axis + 2])
    return position


@in_loop
def relative_point(
    means: Floats, i: int, j: int, k: int, matrix: Floats
) -> tuple[float, float, float, float]:
    """Return relative position and velocity at one point of the forecasts, in true metres."""
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
    """Return relative position and velocity within piece k."""
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
    """Return the piece, and the fraction of it, at which the predicted positions are closest."""
    nearest, at, part = np.inf, 0, 0.0
    known = np.inf
    for k in range(last + 1):
        x, y, _, _ = relative_point(means, i, j, k, matrix)
        known = min(known, x * x + y * y)
    known = sqrt(known)
    b = relative_point(means, i, j, 0, matrix)
    for k in range(last):
        a = b
        b = relative_point(means, i, j, k + 1, matrix)
        dt = t[k + 1] - t[k]
        # Pieces farther away than a point of another are skipped.
        if is_within(known, dt, a[0], a[1], b[0], b[1], a[2], a[3], b[2], b[3]):
            u, square = nearest_part(dt, a[0], a[1], b[0], b[1], a[2], a[3], b[2], b[3])
            if square < nearest:
                nearest, at, part = square, k, u
    return at, part


@in_loop
def is_slow(
    wx: float, wy: float,
    spread: tuple[float, float, float, float, float, float, float, float, float, float],
) -> bool:  # fmt: skip
    """Return whether a relative velocity does not differ from zero: w S⁻¹ w below its bound."""
    # Without errors, only equal velocities do not differ.
    a, b, d = spread[7] + VELOCITY_FLOOR, spread[8], spread[9] + VELOCITY_FLOOR
    determinant = max(a * d - b * b, 0.0)
    return wx * wx * d - 2.0 * wx * wy * b + wy * wy * a <= TOGETHER_CHI_SQUARED * determinant


@in_loop
def sigma_of_distance(
    state: tuple[float, float, float, float],
    spread: tuple[float, float, float, float, float, float, float, float, float, float],
    spread_w: tuple[float, float, float], time: float, interior: bool,
) -> float:  # fmt: skip
    """Return the standard deviation of the signed distance.

    It is the error across the relative velocity at an interior minimum, else along the line between
    the aircraft; where both are undefined it is the largest.
    """
    x, y = state[0], state[1]
    if interior and hypot(state[2], state[3]) > 0.0:
        x, y = -state[3], state[2]
    a = spread[0] + time * (2.0 * spread[2] + time * spread_w[0])
    b = spread[1] + time * (spread[3] + spread[5] + time * spread_w[1])
    d = spread[4] + time * (2.0 * spread[6] + time * spread_w[2])
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
    spread_w: tuple[float, float, float], time: float,
) -> float:  # fmt: skip
    """Return the standard deviation of the time with p · w = 0: of w · δp + p · δw over w²."""
    x, y, wx, wy = state
    square = wx * wx + wy * wy
    # The position now is weighted by w, the velocity since then by w times the time plus p.
    ux, uy = time * wx + x, time * wy + y
    pp = wx * wx * spread[0] + 2.0 * wx * wy * spread[1] + wy * wy * spread[4]
    pv = wx * (spread[2] * ux + spread[3] * uy) + wy * (spread[5] * ux + spread[6] * uy)
    vv = ux * ux * spread_w[0] + 2.0 * ux * uy * spread_w[1] + uy * uy * spread_w[2]
    return sqrt(max(pp + 2.0 * pv + vv, 0.0)) / square if square > 0.0 else np.nan


@in_loop
def fill_chord(
    begin: tuple[float, float, float, float],
    spread: tuple[float, float, float, float, float, float, float, float, float, float],
    end: tuple[float, float, float, float], reach: float, chord: Floats,
) -> None:  # fmt: skip
    """Fill a straight motion from now to a later time, and its initial covariance."""
    scale = 1.0 / reach
    chord[CHORD_P], chord[CHORD_P + 1] = begin[0], begin[1]
    chord[CHORD_W] = (end[0] - begin[0]) * scale
    chord[CHORD_W + 1] = (end[1] - begin[1]) * scale
    chord[CHORD_A], chord[CHORD_A + 1], chord[CHORD_A + 2] = spread[0], spread[1], spread[4]
    chord[CHORD_C], chord[CHORD_C + 1] = spread[2], spread[3]
    chord[CHORD_C + 2], chord[CHORD_C + 3] = spread[5], spread[6]
