"""Compiled step of a bundle: slide the window, add a plot, fit, branch, thin.

References
----------
IMM UrO RAN report (2016), section 2.2: the order of the steps. The project's own: branches start in
cells of time, one for each kind of control, and not through the plot.
"""

from math import ceil, exp, floor, log, sqrt

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.bundle._window_kernels import drop_plot
from multiradar.restoration.control_tracks._arc_kernels import branch_by_arc, count_outliers
from multiradar.restoration.control_tracks._fit_kernels import copy_track, fit_track
from multiradar.restoration.control_tracks._layout import (
    APART_M,
    APART_SIGMAS,
    BEGIN,
    BRANCH_WEIGHT,
    CELL_S,
    COUNT,
    EAST_EAST,
    EAST_NORTH,
    ENDING,
    EXPECTED,
    FOLLOWING,
    KIND,
    KINDS,
    LATERAL,
    LATERAL_BEYOND,
    LATERAL_MAX,
    LATERAL_MEAN,
    LONGITUDINAL,
    LONGITUDINAL_MAX,
    LONGITUDINAL_MEAN,
    MERGED_WEIGHT,
    NORTH_NORTH,
    SEGMENT_COUNT,
    SEGMENT_MIN_S,
    SEGMENTS,
    SEGMENTS_MAX,
    TIME,
    WEIGHT,
    WINDOW_PLOTS_MAX,
    WINDOW_S,
)
from multiradar.restoration.control_tracks._scratch import BundleScratch, FitScratch
from multiradar.restoration.control_tracks._thinning_kernels import rank, thin, trace
from multiradar_compiled.kernels import in_loop, loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Rescue: if at least `OUTLIERS_MIN` of the `RECENT` last plots, including the newest, are outliers
# of the best track, arcs to the newest plot are added and the tracks are fitted with additional
# iterations.
RECENT, OUTLIERS_MIN, RESCUE_ROUNDS = 6, 3, 6
# After a gap of this length, s, one outlier suffices: a turn then exceeds the convergence range of
# a fit from straight flight.
RARE_S = 8.0
# A window keeps at least this many plots, if they are not older than this multiple of its length.
WINDOW_PLOTS_MIN, LONGER = 6, 2.0
# Maximum number of cells opened after a gap between plots.
CELLS_MAX = 4
# Number of tracks that are compared, per track kept.
CONSIDERED = 6


@loop
def push_plot(
    tracks: Floats,
    live: int,
    capacity: int,
    anchor_s: float,
    plots: Floats,
    first: int,
    last: int,
    since_s: float,
    kinds: Floats,
    rules: Floats,
    rounds: int,
    fit: FitScratch,
    scratch: BundleScratch,
) -> tuple[int, int, float]:
    """Process the plot in row last − 1; return the number of tracks, the first row, the anchor.

    Branches start in the cells that open after `since_s`.
    """
    A, B, grid, traces, order, kept = scratch
    usual = (rules[LATERAL_MAX], rules[LONGITUDINAL_MAX])
    now_s = plots[last - 1, TIME]
    before_s = plots[last - 2, TIME]
    while plot_expires(plots, first, last, rules[WINDOW_S]):
        for i in range(live):
            weight = tracks[i, WEIGHT]
            drop_plot(tracks[i], anchor_s, plots, first, kinds, rules, A, B)
            fit_track(
                tracks[i], plots[first, TIME], plots, first + 1, last - 1, before_s, kinds, rules,
                0, fit,
            )  # fmt: skip
            tracks[i, MERGED_WEIGHT] += weight - tracks[i, WEIGHT]
            tracks[i, WEIGHT] = weight
        anchor_s = plots[first, TIME]
        first += 1
    recent = max(first, last - RECENT)
    outliers = count_outliers(tracks[0], anchor_s, plots, recent, last)
    # The best track is kept if the newest plot is an outlier of it, since that may be wrong: where
    # plots are rare, the many segments that may start between two of them would displace it.
    kept_anyway = -1
    if count_outliers(tracks[0], anchor_s, plots, last - 1, last):
        kept_anyway = 0
    if kept_anyway == 0 and (outliers >= OUTLIERS_MIN or now_s - before_s >= RARE_S):
        rounds += RESCUE_ROUNDS
        # Wider limits rather than track loss.
        if outliers >= OUTLIERS_MIN:
            for part in range(2):
                rules[LATERAL_MAX + part] = rules[LATERAL_BEYOND + part]
        live = rescue(tracks, live, fit.spare, anchor_s, plots, first, last, rules, fit.g, fit.g2)
    for i in range(live):
        fit_track(tracks[i], anchor_s, plots, first, last, now_s, kinds, rules, rounds, fit)
    parents = live
    live = branch(tracks, live, since_s, now_s, kinds, rules)
    for i in range(parents, live):
        # No plot informs about a segment that has not started.
        if tracks[i, SEGMENTS + SEGMENT_COUNT * (int(tracks[i, COUNT]) - 1) + BEGIN] < now_s:
            fit_track(tracks[i], anchor_s, plots, first, last, now_s, kinds, rules, rounds, fit)
    for part in range(2):
        rules[LATERAL_MAX + part] = usual[part]
    discard_unlikely(tracks, live, CONSIDERED * capacity, order, kept_anyway)
    # Whole seconds: tracks are compared at the same times, independent of their switches.
    begin_s = ceil(now_s - rules[WINDOW_S])
    for k in range(len(grid)):
        grid[k] = begin_s + k
    for i in range(live):
        if tracks[i, WEIGHT] > -np.inf:
            trace(tracks[i], anchor_s, grid, traces[i])
    apart_m = max(rules[APART_M], rules[APART_SIGMAS] * sigma_of(plots, first, last))
    chosen = thin(tracks, live, capacity, traces, len(grid), apart_m, order, kept, kept_anyway)
    compact(tracks, kept, order, chosen)
    return chosen, first, anchor_s


@in_loop
def plot_expires(plots: Floats, first: int, last: int, window_s: float) -> bool:
    """Return whether the oldest plot leaves the window; later if plots are few."""
    count, age_s = last - first, plots[last - 1, TIME] - plots[first, TIME]
    old = age_s > window_s and (count > WINDOW_PLOTS_MIN or age_s > LONGER * window_s)
    return count > 2 and (old or count > WINDOW_PLOTS_MAX)


@in_loop
def sigma_of(plots: Floats, first: int, last: int) -> float:
    """Return the standard deviation of a position from all plots of the window together, m."""
    information = 0.0
    for row in range(first, last):
        a, b, c = plots[row, EAST_EAST], plots[row, EAST_NORTH], plots[row, NORTH_NORTH]
        information += sqrt(max(a * c - b * b, 0.0))
    return 1.0 / sqrt(information)


@in_loop
def branch(
    tracks: Floats, live: int, before_s: float, now_s: float, kinds: Floats, rules: Floats
) -> int:
    """Add branches of all other kinds in each cell of time that opens; return the track count."""
    cell_s = rules[CELL_S]
    # A cell opens half a cell before its middle.
    cell = floor(now_s / cell_s + 0.5)
    opened = max(floor(before_s / cell_s + 0.5) + 1.0, cell - CELLS_MAX + 1.0)
    best, parents = -np.inf, live
    for i in range(parents):
        best = max(best, tracks[i, WEIGHT])
    while opened <= cell:
        for i in range(parents):
            count = int(tracks[i, COUNT])
            at = SEGMENTS + SEGMENT_COUNT * (count - 1)
            kind = int(tracks[i, at + KIND])
            young = count > 1 and opened * cell_s - tracks[i, at + BEGIN] < rules[SEGMENT_MIN_S]
            heavy = exp(tracks[i, WEIGHT] - best) >= rules[BRANCH_WEIGHT]
            if count < SEGMENTS_MAX and heavy and not young:
                for other in range(KINDS):
                    if other != kind and live < len(tracks):
                        copy_track(tracks[i], tracks[live])
                        tracks[live, COUNT] = count + 1.0
                        new = at + SEGMENT_COUNT
                        tracks[live, new + BEGIN] = opened * cell_s
                        tracks[live, new + EXPECTED] = opened * cell_s
                        tracks[live, new + KIND] = other
                        tracks[live, new + LATERAL] = kinds[other, LATERAL_MEAN]
                        tracks[live, new + LONGITUDINAL] = kinds[other, LONGITUDINAL_MEAN]
                        # Contribution of a segment that has not started to `constants`, and of its
                        # prior to the determinant: the probability that it starts in this cell.
                        tracks[live, WEIGHT] += kinds[kind, FOLLOWING + other] + log(
                            kinds[kind, ENDING] * cell_s
                        )
                        live += 1
        opened += 1.0
    return live


@in_loop
def discard_unlikely(tracks: Floats, live: int, most: int, order: Integers, always: int) -> None:
    """Set the weight of all but the best tracks to zero, except of track `always`."""
    rank(tracks, live, order)
    for i in range(most, live):
        if order[i] != always:
            tracks[order[i], WEIGHT] = -np.inf


@in_loop
def rescue(
    tracks: Floats, live: int, spare: Floats, anchor_s: float, plots: Floats, first: int,
    last: int, rules: Floats, a: Floats, b: Floats,
) -> int:  # fmt: skip
    """Add the best arc from each track to the last plot; return the number of tracks."""
    parents = live
    for i in range(parents):
        if live < len(tracks):
            found = branch_by_arc(
                tracks[i], tracks[live], spare, anchor_s, plots, first, last, rules, a, b
            )
            if found < np.inf:
                live += 1
    return live


@in_loop
def compact(tracks: Floats, kept: Integers, order: Integers, chosen: int) -> None:
    """Move the tracks kept to the front, the best first, by swapping rows."""
    # order[i]: present row of the track that was in row i.
    for i in range(len(order)):
        order[i] = i
    for i in range(chosen):
        present = order[kept[i]]
        if present != i:
            for column in range(tracks.shape[1]):
                value = tracks[i, column]
                tracks[i, column] = tracks[present, column]
                tracks[present, column] = value
            for j in range(len(order)):
                if order[j] == i:
                    order[j] = present
                    break
            order[kept[i]] = i
