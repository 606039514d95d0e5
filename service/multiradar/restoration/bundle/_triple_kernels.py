"""Compiled arcs of constant speed through triples of plots of the initial window.

Symbols: A, B, C = the three plots, κ = curvature of the circle through them, positive to the right,
s = distance along the circle from A.

References
----------
IMM UrO RAN report (2016), section 2.2.1: triples that form an arc, and the deviations in time.
"""

from math import asin, atan2, cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Columns of an arc: time, position, speed and heading at its start, lateral acceleration, and the
# sum of the deviations in time over all plots.
ARC_COUNT = 7
# Columns of the limits.
APART_S, APART_M, OFF_M, SPEED_LEAST, SPEED_MOST, CURVATURE_LEAST = range(6)
LIMIT_COUNT = 6


@loop
def triples(
    time_s: Floats, position_m: Floats, chosen: Integers, limits: Floats, arcs: Floats
) -> int:
    """Write the arcs through all triples of chosen plots; return their number."""
    count, many = 0, len(chosen)
    for i in range(many):
        for j in range(i + 1, many):
            near = (
                time_s[chosen[j]] - time_s[chosen[i]] < limits[APART_S]
                or apart(position_m, chosen[i], chosen[j]) < limits[APART_M]
            )
            if not near:
                for k in range(j + 1, many):
                    made = arc_through(
                        time_s, position_m, chosen[i], chosen[j], chosen[k], limits, arcs[count]
                    )
                    if made:
                        count += 1
    return count


@in_loop
def apart(position_m: Floats, i: int, j: int) -> float:
    """Return the distance between two plots."""
    return hypot(position_m[j, 0] - position_m[i, 0], position_m[j, 1] - position_m[i, 1])


@in_loop
def arc_through(
    time_s: Floats, position_m: Floats, i: int, j: int, k: int, limits: Floats, arc: Floats
) -> bool:
    """Write the arc through three plots; return whether there is one."""
    ab, bc, ac = apart(position_m, i, j), apart(position_m, j, k), apart(position_m, i, k)
    made = time_s[k] - time_s[j] >= limits[APART_S] and min(ab, bc, ac) >= limits[APART_M]
    if made:
        east, north = position_m[i, 0], position_m[i, 1]
        x, y = position_m[j, 0] - east, position_m[j, 1] - north
        p, q = position_m[k, 0] - east, position_m[k, 1] - north
        # 4 × area over the product of the sides.
        curvature = 2.0 * (y * (p - x) - x * (q - y)) / (ab * bc * ac)
        # The heading of the chord minus half the angle it spans.
        heading = atan2(x, y) - asin(min(max(0.5 * ab * curvature, -1.0), 1.0))
        least = limits[CURVATURE_LEAST]
        b = distance_along(x, y, heading, curvature, least)
        c = distance_along(p, q, heading, curvature, least)
        # The straight line through the distances (0, b, c) over time, by least squares.
        t, u = time_s[j] - time_s[i], time_s[k] - time_s[i]
        mean_s, mean_m = (t + u) / 3.0, (b + c) / 3.0
        square = mean_s**2 + (t - mean_s) ** 2 + (u - mean_s) ** 2
        speed = (
            mean_s * mean_m + (t - mean_s) * (b - mean_m) + (u - mean_s) * (c - mean_m)
        ) / square
        offset = mean_m - speed * mean_s
        # Deviations of the motion from the plots along the circle.
        off = max(abs(offset), abs(offset + speed * t - b), abs(offset + speed * u - c))
        made = (
            c > b > 0.0
            and limits[SPEED_LEAST] <= speed <= limits[SPEED_MOST]
            and off <= limits[OFF_M]
        )
        if made:
            arc[0], arc[1], arc[2] = time_s[i] - offset / speed, east, north
            arc[3], arc[4], arc[5] = speed, heading, curvature * speed * speed
            arc[6] = 0.0
            for row in range(len(time_s)):
                along = distance_along(
                    position_m[row, 0] - east, position_m[row, 1] - north, heading, curvature, least
                )
                arc[6] += abs(time_s[i] + (along - offset) / speed - time_s[row])
    return bool(made)


@in_loop
def distance_along(x: float, y: float, heading: float, curvature: float, least: float) -> float:
    """Return the distance along the circle to its point nearest to a position, ± half a circle."""
    ahead = x * sin(heading) + y * cos(heading)
    right = x * cos(heading) - y * sin(heading)
    straight = abs(curvature) < least
    return ahead if straight else atan2(ahead * curvature, 1.0 - right * curvature) / curvature
