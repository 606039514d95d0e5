"""Compiled forecast of tracks: members of a forecast ensemble, with covariances.

Symbols: v = speed, h = heading, u, w = lateral and longitudinal acceleration, t = time ahead, d =
remaining duration of the last segment, τ = time of straight flight after it, C = covariance of the
six numbers of a final state, F = derivatives of a state by them, R = from along and right to east
and north.

References
----------
IMM UrO RAN report (2016), equation (2.3) for the motion. Linearisation and later manoeuvres are
the project's own.
"""

from math import cos, exp, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks._functional_kernels import h_by_u
from multiradar.restoration.control_tracks._motion_kernels import fly_with_slopes
from multiradar_compiled.kernels import in_loop, inner_loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Members of each continuation: nothing new, later a right or left turn, later a change of speed.
ON, LATER_RIGHT, LATER_LEFT, LATER_SPEED = range(4)
LATER = 4
# Indices of the parameters of an ensemble.
STEP_S, ENDING_RATE, TURN_SHARE, SPEED_CHANGE, DENSITY = range(5)


@inner_loop
def continue_track(
    motion: Floats, C: Floats, d: float, d_variance: float, share: float, ahead_s: Floats,
    later: Floats, rules: Floats, F: Floats, P: Floats, R: Floats, weight: Floats, state: Floats,
    covariance: Floats,
) -> None:  # fmt: skip
    """Write the four members of one final state and duration: (k, 4), (k, 4, 4), (k, 4, 4, 4)."""
    for k in range(len(ahead_s)):
        t = ahead_s[k]
        run = min(t, d)
        straight = t - run
        v, h = reach(motion, run, straight, F, state[k, ON])
        spread(F, C, P)
        if straight > 0.0:
            add_end_variance(motion[4], motion[5], v, h, straight, d_variance, P)
        add_noise(rules[DENSITY], t, P)
        # Turns and changes of speed start at separate rates; after a turn both count as turn.
        stays = exp(-straight * rules[ENDING_RATE])
        no_turn = exp(-straight * rules[ENDING_RATE] * rules[TURN_SHARE])
        weight[k, ON] = share * stays
        weight[k, LATER_RIGHT] = 0.5 * share * (1.0 - no_turn)
        weight[k, LATER_LEFT] = 0.5 * share * (1.0 - no_turn)
        weight[k, LATER_SPEED] = share * (no_turn - stays)
        copy(P, covariance[k, ON])
        axes(h, R)
        for side in range(LATER_RIGHT, LATER_LEFT + 1):
            later_turn(
                state[k, ON], P, v, straight, later, rules[STEP_S], 3.0 - 2.0 * side, R,
                state[k, side], covariance[k, side],
            )  # fmt: skip
        later_speed(
            state[k, ON], P, straight, rules[SPEED_CHANGE], R, state[k, LATER_SPEED],
            covariance[k, LATER_SPEED],
        )  # fmt: skip


@in_loop
def reach(
    motion: Floats, run: float, straight: float, F: Floats, state: Floats
) -> tuple[float, float]:
    """Write the state after segment and straight flight, and F; return speed and heading."""
    v0, h0, u, w = motion[2], motion[3], motion[4], motion[5]
    (de, dn, v, h, e_v, e_h, e_u, e_w, n_v, n_h, n_u, n_w, h_v, h_w) = fly_with_slopes(
        v0, h0, u, w, run
    )
    s, c = sin(h), cos(h)
    for j in range(6):
        # Derivatives of speed and heading at the end of the segment.
        by_v = 1.0 if j == 2 else (run if j == 5 else 0.0)
        by_h = 0.0
        if j == 2:
            by_h = h_v
        elif j == 3:
            by_h = 1.0
        elif j == 4:
            by_h = h_by_u(v0, w, run)
        elif j == 5:
            by_h = h_w
        F[2, j] = s * by_v + v * c * by_h
        F[3, j] = c * by_v - v * s * by_h
        F[0, j] = straight * F[2, j]
        F[1, j] = straight * F[3, j]
    F[0, 0] += 1.0
    F[1, 1] += 1.0
    F[0, 2] += e_v
    F[0, 3] += e_h
    F[0, 4] += e_u
    F[0, 5] += e_w
    F[1, 2] += n_v
    F[1, 3] += n_h
    F[1, 4] += n_u
    F[1, 5] += n_w
    state[0] = motion[0] + de + v * s * straight
    state[1] = motion[1] + dn + v * c * straight
    state[2] = v * s
    state[3] = v * c
    return v, h


@in_loop
def spread(F: Floats, C: Floats, P: Floats) -> None:
    """Write P = F C Fᵀ."""
    for i in range(4):
        for j in range(i + 1):
            total = 0.0
            for a in range(6):
                part = 0.0
                for b in range(6):
                    part += C[a, b] * F[j, b]
                total += F[i, a] * part
            P[i, j] = total
            P[j, i] = total


@in_loop
def add_end_variance(
    u: float, w: float, v: float, h: float, straight: float, d_variance: float, P: Floats
) -> None:
    """Add the uncertainty of the duration of the segment to P."""
    s, c = sin(h), cos(h)
    east, north = w * s + u * c, w * c - u * s
    # The change of velocity is limited to the velocity.
    size = (east * east + north * north) * d_variance
    factor = sqrt(d_variance * min(1.0, v * v / max(size, 1e-12)))
    east, north = factor * east, factor * north
    slopes = (straight * east, straight * north, east, north)
    for i in range(4):
        for j in range(4):
            P[i, j] += slopes[i] * slopes[j]


@in_loop
def add_noise(density: float, t: float, P: Floats) -> None:
    """Add white acceleration over the whole time."""
    for axis in range(2):
        P[axis, axis] += density * t * t * t / 3.0
        P[axis, axis + 2] += density * t * t / 2.0
        P[axis + 2, axis] += density * t * t / 2.0
        P[axis + 2, axis + 2] += density * t


@in_loop
def axes(h: float, R: Floats) -> None:
    """Write R: columns are along and right, of positions and of velocities."""
    s, c = sin(h), cos(h)
    for i in range(4):
        for j in range(4):
            R[i, j] = 0.0
    for part in range(0, 4, 2):
        R[part, part] = s
        R[part + 1, part] = c
        R[part, part + 1] = c
        R[part + 1, part + 1] = -s


@in_loop
def later_turn(
    on: Floats, P: Floats, v: float, straight: float, later: Floats, step_s: float, side: float,
    R: Floats, state: Floats, covariance: Floats,
) -> None:  # fmt: skip
    """Write state and covariance if a turn starts during straight flight."""
    # The table is for a turn to the right: `side` is 1 for that, −1 for one to the left.
    row = min(int(straight / step_s), len(later) - 2)
    part = min(straight / step_s - row, 1.0)
    for i in range(4):
        total = on[i]
        if i < 2:
            total -= straight * on[i + 2]
        else:
            total = 0.0
        for j in range(4):
            mean = v * ((1.0 - part) * later[row, j] + part * later[row + 1, j])
            total += R[i, j] * (side * mean if j % 2 else mean)
        state[i] = total
    copy(P, covariance)
    column = 4
    for a in range(4):
        for b in range(a, 4):
            value = v * v * ((1.0 - part) * later[row, column] + part * later[row + 1, column])
            if (a + b) % 2:
                value *= side
            column += 1
            for i in range(4):
                for j in range(4):
                    covariance[i, j] += R[i, a] * R[j, b] * value
                    if a != b:
                        covariance[i, j] += R[i, b] * R[j, a] * value


@in_loop
def later_speed(
    on: Floats, P: Floats, straight: float, change: float, R: Floats, state: Floats,
    covariance: Floats,
) -> None:  # fmt: skip
    """Write state and covariance if a change of speed starts during straight flight."""
    copy(P, covariance)
    square = change * change
    # It happens instantly, at a uniformly distributed time.
    position, both = square * straight * straight / 3.0, square * straight / 2.0
    for i in range(4):
        state[i] = on[i]
    for i in range(2):
        for j in range(2):
            along = R[i, 0] * R[j, 0]
            covariance[i, j] += along * position
            covariance[i, j + 2] += along * both
            covariance[i + 2, j] += along * both
            covariance[i + 2, j + 2] += along * square


@in_loop
def copy(one: Floats, other: Floats) -> None:
    """Copy a matrix of four rows."""
    for i in range(4):
        for j in range(4):
            other[i, j] = one[i, j]
