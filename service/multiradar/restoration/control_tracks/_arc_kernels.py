"""Compiled branching: arcs of constant speed from a track to a plot.

Symbols: A, B = two points of the track, P = the plot, κ = curvature of the circle through the
three, u = κ v². An arc leaves the track at A with its position, heading and speed there.

References
----------
IMM UrO RAN report (2016), section 2.2.2: the points are on the track, the state at A is kept, and
the choice with the best weight is used; section 2.2.4: the weight. The selection of points is the
project's own.
"""

from math import exp, hypot, log

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks._fit_kernels import copy_track
from multiradar.restoration.control_tracks._layout import (
    BEGIN,
    COUNT,
    EAST,
    EAST_EAST,
    EAST_NORTH,
    EXPECTED,
    FLOOR,
    HEADING,
    KIND,
    LATERAL,
    LATERAL_MAX,
    LEFT,
    LONGITUDINAL,
    NORTH,
    NORTH_NORTH,
    PLOT_EAST,
    PLOT_NORTH,
    RIGHT,
    SEGMENT_COUNT,
    SEGMENT_MIN_S,
    SEGMENTS,
    SEGMENTS_MAX,
    SPEED,
    STRAIGHT,
    TIME,
)
from multiradar.restoration.control_tracks._motion_kernels import fly
from multiradar_compiled.kernels import in_loop, loop

Floats = NDArray[np.float64]

# Times before the plot at which arcs leave the track, s, if no segment becomes too short; then the
# second point of the track, as a fraction of the time to the plot.
LEAVES_S = (4.0, 8.0, 10.0, 12.0, 16.0, 20.0, 26.0, 32.0, 40.0)
PARTS = (0.0, 0.3, 0.6)
# Lateral acceleration below which an arc counts as straight flight, m/s².
STRAIGHT_BELOW = 0.5


@loop
def misfit(track: Floats, anchor_s: float, plots: Floats, first: int, last: int) -> float:
    """Return the functional of the plots alone, without priors."""
    count = int(track[COUNT])
    east, north = track[EAST], track[NORTH]
    v, heading = track[SPEED], track[HEADING]
    begin, row, total = anchor_s, first, 0.0
    for i in range(count):
        at = SEGMENTS + SEGMENT_COUNT * i
        u, w = track[at + LATERAL], track[at + LONGITUDINAL]
        end = np.inf
        if i < count - 1:
            end = track[at + SEGMENT_COUNT + BEGIN]
        while row < last and plots[row, TIME] < end:
            state = fly(east, north, v, heading, u, w, plots[row, TIME] - begin)
            total += part_of_plot(plots, row, state[0], state[1])
            row += 1
        if i < count - 1:
            east, north, v, heading = fly(east, north, v, heading, u, w, end - begin)
            begin = end
    return total


@in_loop
def part_of_plot(plots: Floats, row: int, east: float, north: float) -> float:
    """Return −ln(e^(−ρ²/2) + e^floor) of a plot relative to a position."""
    x, y = east - plots[row, PLOT_EAST], north - plots[row, PLOT_NORTH]
    half = 0.5 * (
        plots[row, EAST_EAST] * x * x
        + 2.0 * plots[row, EAST_NORTH] * x * y
        + plots[row, NORTH_NORTH] * y * y
    )
    floor = plots[row, FLOOR]
    if half < -floor:
        part: float = half - log(1.0 + exp(half + floor))
    else:
        part = -floor - log(1.0 + exp(-half - floor))
    return part


@loop
def count_outliers(track: Floats, anchor_s: float, plots: Floats, first: int, last: int) -> int:
    """Return the number of plots that are more likely outliers of a track than plots of it."""
    count = 0
    for row in range(first, last):
        total = misfit(track, anchor_s, plots, row, row + 1)
        # At equal odds of both the part is −floor − ln 2.
        if total > -plots[row, FLOOR] - log(2.0):
            count += 1
    return count


@loop
def state_at(track: Floats, anchor_s: float, time_s: float, state: Floats) -> int:
    """Write position, speed and heading at a time, and return the segment."""
    count = int(track[COUNT])
    east, north = track[EAST], track[NORTH]
    v, heading = track[SPEED], track[HEADING]
    begin, i = anchor_s, 0
    while i < count - 1 and track[SEGMENTS + SEGMENT_COUNT * (i + 1) + BEGIN] <= time_s:
        at = SEGMENTS + SEGMENT_COUNT * i
        end = track[at + SEGMENT_COUNT + BEGIN]
        east, north, v, heading = fly(
            east, north, v, heading, track[at + LATERAL], track[at + LONGITUDINAL], end - begin
        )
        begin = end
        i += 1
    at = SEGMENTS + SEGMENT_COUNT * i
    state[0], state[1], state[2], state[3] = fly(
        east, north, v, heading, track[at + LATERAL], track[at + LONGITUDINAL], time_s - begin
    )
    return i


@loop
def branch_by_arc(
    track: Floats, best: Floats, trial: Floats, anchor_s: float, plots: Floats, first: int,
    last: int, rules: Floats, a: Floats, b: Floats,
) -> float:  # fmt: skip
    """Write the best branch to the last plot; return its increase of the functional, or ∞."""
    now_s = plots[last - 1, TIME]
    east, north = plots[last - 1, PLOT_EAST], plots[last - 1, PLOT_NORTH]
    found = np.inf
    for leaves in LEAVES_S:
        begin = now_s - leaves
        if begin > anchor_s and leaves >= rules[SEGMENT_MIN_S]:
            segment = state_at(track, anchor_s, begin, a)
            # Plots before the start of the arc are unaffected.
            row = last
            while row > first and plots[row - 1, TIME] >= begin:
                row -= 1
            before = misfit(track, anchor_s, plots, row, last)
            since = anchor_s
            if segment > 0:
                since = track[SEGMENTS + SEGMENT_COUNT * segment + BEGIN]
            for part in PARTS:
                state_at(track, anchor_s, begin + max(part * leaves, 0.01), b)
                u = curvature(a, b, east, north) * a[2] * a[2]
                short = begin - since < rules[SEGMENT_MIN_S]
                if segment + 1 < SEGMENTS_MAX and abs(u) <= rules[LATERAL_MAX] and not short:
                    copy_track(track, trial)
                    append(trial, segment + 1, begin, u)
                    total = misfit(trial, anchor_s, plots, row, last) - before
                    if total < found:
                        found = total
                        copy_track(trial, best)
    return found


@in_loop
def curvature(a: Floats, b: Floats, east: float, north: float) -> float:
    """Return the curvature of the circle through three points, positive to the right."""
    x, y = b[0] - a[0], b[1] - a[1]
    p, q = east - a[0], north - a[1]
    sides = hypot(x, y) * hypot(p, q) * hypot(p - x, q - y)
    bend: float = 2.0 * (y * p - x * q) / max(sides, 1e-9)
    return bend


@in_loop
def append(track: Floats, segment: int, begin_s: float, u: float) -> None:
    """Continue a track by an arc as its segment of this number."""
    track[COUNT] = segment + 1.0
    at = SEGMENTS + SEGMENT_COUNT * segment
    track[at + BEGIN] = begin_s
    track[at + EXPECTED] = begin_s
    track[at + LATERAL] = u
    track[at + LONGITUDINAL] = 0.0
    kind = STRAIGHT
    if u > STRAIGHT_BELOW:
        kind = RIGHT
    elif u < -STRAIGHT_BELOW:
        kind = LEFT
    track[at + KIND] = kind
