"""Compiled geometric tracks, the distance between them, and the thinning of a bundle by it.

References
----------
IMM UrO RAN report (2016), sections 2.2.3 and 2.2.4: of each group of close tracks the best is kept;
the distance is the mean over a uniform grid of the window. Extending the grid beyond the last plot,
and assigning the weight of a group to its best track, is the project's own.
"""

from math import exp, hypot, log1p

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks._layout import (
    BEGIN,
    COUNT,
    EAST,
    HEADING,
    LATERAL,
    LONGITUDINAL,
    MERGED_WEIGHT,
    NORTH,
    SEGMENT_COUNT,
    SEGMENTS,
    SPEED,
    WEIGHT,
)
from multiradar.restoration.control_tracks._motion_kernels import fly
from multiradar_compiled.kernels import in_loop, loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@loop
def trace(track: Floats, anchor_s: float, time_s: Floats, out: Floats) -> None:
    """Write position, speed and heading (k, 4) at ascending times, also before the anchor."""
    count, points = int(track[COUNT]), len(time_s)
    east, north = track[EAST], track[NORTH]
    v, heading = track[SPEED], track[HEADING]
    begin, k = anchor_s, 0
    for i in range(count):
        at = SEGMENTS + SEGMENT_COUNT * i
        u, w = track[at + LATERAL], track[at + LONGITUDINAL]
        end = np.inf
        if i < count - 1:
            end = track[at + SEGMENT_COUNT + BEGIN]
        while k < points and time_s[k] < end:
            out[k, 0], out[k, 1], out[k, 2], out[k, 3] = fly(
                east, north, v, heading, u, w, time_s[k] - begin
            )
            k += 1
        if i < count - 1:
            east, north, v, heading = fly(east, north, v, heading, u, w, end - begin)
            begin = end


@in_loop
def are_close(one: Floats, other: Floats, points: int, apart_m: float) -> bool:
    """Return whether the mean distance of two geometric tracks is below `apart_m`."""
    total, k, most = 0.0, points - 1, apart_m * points
    # Backwards: tracks differ most at the end, so the sum stops early.
    while k >= 0 and total < most:
        total += hypot(one[k, 0] - other[k, 0], one[k, 1] - other[k, 1])
        k -= 1
    return total < most


@in_loop
def rank(tracks: Floats, live: int, order: Integers) -> None:
    """Write the indices of the tracks into `order`, the best first."""
    for i in range(live):
        j = i
        while j > 0 and tracks[order[j - 1], WEIGHT] < tracks[i, WEIGHT]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = i


@loop
def thin(
    tracks: Floats, live: int, capacity: int, traces: Floats, points: int, apart_m: float,
    order: Integers, kept: Integers, always: int,
) -> int:  # fmt: skip
    """Write the tracks that are kept into `kept`, the best first, and return their number.

    Of a group of tracks less than `apart_m` apart the best is kept, with the weight of all. The
    track `always` (−1: none) has a reserved position, regardless of weights.
    """
    rank(tracks, live, order)
    chosen, reserved = 0, 1 if always >= 0 else 0
    for i in range(live):
        one = order[i]
        if one == always:
            reserved = 0
        group = -1
        for j in range(chosen):
            if are_close(traces[one], traces[kept[j]], points, apart_m):
                group = kept[j]
                break
        if group >= 0:
            more = log1p(exp(tracks[one, WEIGHT] - tracks[group, WEIGHT]))
            tracks[group, MERGED_WEIGHT] += more
            tracks[group, WEIGHT] += more
        elif chosen < capacity - reserved and tracks[one, WEIGHT] > -np.inf:
            kept[chosen] = one
            chosen += 1
    return chosen
