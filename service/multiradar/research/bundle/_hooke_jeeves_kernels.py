"""Compiled search of Hooke and Jeeves over controls and switching times of a track (report).

Varied are u and w of every segment, and the start of every segment but the first. The state at the
anchor is fixed. Where a limit is violated, a penalty in proportion to the violation replaces the
functional.

References
----------
IMM UrO RAN report (2016), section 2.5: steps, limits, penalty. R. Hooke, T. A. Jeeves, "Direct
search solution of numerical and statistical problems", Journal of the ACM 8 (1961), 212-229.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks._arc_kernels import misfit
from multiradar.restoration.control_tracks._fit_kernels import copy_track
from multiradar.restoration.control_tracks._layout import (
    BEGIN,
    COUNT,
    LATERAL,
    LONGITUDINAL,
    SEGMENT_COUNT,
    SEGMENTS,
)
from multiradar_compiled.kernels import in_loop, loop

Floats = NDArray[np.float64]

# The published steps, first and last, and their reduction factor: m/s² across, m/s² along, s.
LATERAL_STEP, LATERAL_LAST = 0.5, 0.01
LONGITUDINAL_STEP, LONGITUDINAL_LAST = 0.25, 0.01
BEGIN_STEP_S, BEGIN_LAST_S = 32.0, 0.02
SHRINK = 0.5
# Above any functional, which is below 20 for each of some hundred plots.
PENALTY = 1e6
EVALUATIONS_MAX = 20_000


@loop
def search(
    track: Floats, base: Floats, trial: Floats, anchor_s: float, plots: Floats, first: int,
    last: int, limits: Floats, evaluations: Floats,
) -> float:  # fmt: skip
    """Improve a track in place; return its functional, and write the number of evaluations.

    limits: lateral, longitudinal acceleration, minimum duration of a segment, of the last one.
    """
    now_s = plots[last - 1, 0]
    evaluations[0] = 1.0
    best = penalised_misfit(track, anchor_s, plots, first, last, now_s, limits)
    scale = 1.0
    copy_track(track, base)
    while evaluations[0] < EVALUATIONS_MAX and (
        LATERAL_STEP * scale >= LATERAL_LAST
        or LONGITUDINAL_STEP * scale >= LONGITUDINAL_LAST
        or BEGIN_STEP_S * scale >= BEGIN_LAST_S
    ):
        copy_track(base, track)
        found = explore(
            track, best, scale, anchor_s, plots, first, last, now_s, limits, evaluations
        )
        if not found < best:
            scale *= SHRINK
        while found < best and evaluations[0] < EVALUATIONS_MAX:
            # Pattern move: the successful step again, followed by an exploration.
            for i in range(len(track)):
                trial[i] = 2.0 * track[i] - base[i]
            trial[COUNT] = track[COUNT]
            copy_track(track, base)
            best = found
            ahead = penalised_misfit(trial, anchor_s, plots, first, last, now_s, limits)
            evaluations[0] += 1.0
            found = explore(
                trial, ahead, scale, anchor_s, plots, first, last, now_s, limits, evaluations
            )
            if found < best:
                copy_track(trial, track)
    copy_track(base, track)
    return best


@in_loop
def explore(
    track: Floats, value: float, scale: float, anchor_s: float, plots: Floats, first: int,
    last: int, now_s: float, limits: Floats, evaluations: Floats,
) -> float:  # fmt: skip
    """Try a step in both directions of each parameter, keep improvements, return the functional."""
    for i in range(int(track[COUNT])):
        at = SEGMENTS + SEGMENT_COUNT * i
        for part in range(3):
            if part == 0:
                column, step = at + LATERAL, scale * LATERAL_STEP
            elif part == 1:
                column, step = at + LONGITUDINAL, scale * LONGITUDINAL_STEP
            else:
                column, step = at + BEGIN, scale * BEGIN_STEP_S
            if part < 2 or i > 0:
                kept = track[column]
                for direction in range(2):
                    track[column] = kept + (step if direction == 0 else -step)
                    found = penalised_misfit(track, anchor_s, plots, first, last, now_s, limits)
                    evaluations[0] += 1.0
                    if found < value:
                        value = found
                        break
                    track[column] = kept
    return value


@in_loop
def penalised_misfit(
    track: Floats,
    anchor_s: float,
    plots: Floats,
    first: int,
    last: int,
    now_s: float,
    limits: Floats,
) -> float:
    """Return the functional, or the penalty where limits are violated."""
    over = 0.0
    begin = anchor_s
    count = int(track[COUNT])
    for i in range(count):
        at = SEGMENTS + SEGMENT_COUNT * i
        over += max(abs(track[at + LATERAL]) - limits[0], 0.0)
        over += max(abs(track[at + LONGITUDINAL]) - limits[1], 0.0)
        end = track[at + SEGMENT_COUNT + BEGIN] if i < count - 1 else now_s
        least = limits[2] if i < count - 1 else limits[3]
        if count > 1:
            over += max(least - (end - begin), 0.0)
        begin = end
    found = PENALTY * (1.0 + over)
    if over == 0.0:
        found = misfit(track, anchor_s, plots, first, last)
    return found
