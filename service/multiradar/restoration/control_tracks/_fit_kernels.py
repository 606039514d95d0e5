"""Compiled fit of the parameters of a control track, and its weight by Laplace's method.

Symbols: H, g = derivatives of the functional J by the parameters θ (see `_functional_kernels`).
An iteration is one step of Gauss–Newton within the limits of the accelerations, with
Levenberg–Marquardt damping where it does not lower J. The weight of a track is the probability of
its plots, integrated over θ near the optimum: ln P = −J + ½ ln det (prior) − ½ ln det H, with a
rate for each change of control.

References
----------
IMM UrO RAN report (2016), section 2.5: limits. D. J. C. MacKay, "Information Theory, Inference, and
Learning Algorithms", Cambridge 2003, section 27: Laplace's method. The rest is the project's own.
"""

from math import log, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks._functional_kernels import assess, factorise, solve
from multiradar.restoration.control_tracks._layout import (
    BEGIN,
    CELL_SIGMA_S,
    COUNT,
    EAST,
    ENDING,
    FOLLOWING,
    KIND,
    LATERAL,
    LATERAL_BEYOND,
    LATERAL_MAX,
    LATERAL_SIGMA,
    LONGITUDINAL_SIGMA,
    MERGED_WEIGHT,
    PRIOR_LOGARITHM,
    SEGMENT_COUNT,
    SEGMENT_MIN_S,
    SEGMENTS,
    SPEED,
    WEIGHT,
)
from multiradar.restoration.control_tracks._motion_kernels import SPEED_MIN
from multiradar.restoration.control_tracks._scratch import FitScratch
from multiradar_compiled.kernels import in_loop, loop

Floats = NDArray[np.float64]

# Attempts with growing damping, first damping and its factor; maximum step of the start of a
# segment, s.
ATTEMPTS_MAX, DAMPING_FIRST, DAMPING_STEP = 4, 0.03, 10.0
BEGIN_STEP_MAX_S = 6.0
# Tolerance of J against rounding, and the decrease of J that ends the iterations.
ROUNDING, DECREASE_MIN = 1e-9, 1e-4


@loop
def fit_track(
    track: Floats,
    anchor_s: float,
    plots: Floats,
    first: int,
    last: int,
    now_s: float,
    kinds: Floats,
    rules: Floats,
    rounds: int,
    scratch: FitScratch,
) -> float:
    """Iterate, write the weight of the track, and return its functional."""
    trial, H, g, H2, g2, S, T, M, r = scratch
    sigma = rules[CELL_SIGMA_S]
    size = 6 + 3 * (int(track[COUNT]) - 1)
    value = assess(track, anchor_s, plots, first, last, kinds, sigma, H, g, S, T, M, r)
    damping = 0.0
    for _ in range(rounds):
        better, decrease, found = False, 0.0, value
        for _ in range(ATTEMPTS_MAX):
            for i in range(size):
                g2[i] = -g[i]
                for j in range(i + 1):
                    H2[i, j] = H[i, j]
                H2[i, i] *= 1.0 + damping
            fix_at_limits(track, H2, g2, size, rules)
            if not np.isnan(factorise(H2, size)):
                solve(H2, g2, size)
                decrease = 0.0
                for i in range(size):
                    decrease -= g[i] * g2[i]
                    T[4, i] = g2[i]
                shift(track, trial, T, anchor_s, rules)
                found = assess(
                    trial, anchor_s, plots, first, last, kinds, sigma, H2, g2, S, T, M, r
                )
                better = found <= value + ROUNDING
            if better:
                break
            damping = max(DAMPING_STEP * damping, DAMPING_FIRST)
        if not better:
            break
        damping = damping / DAMPING_STEP if damping > DAMPING_FIRST else 0.0
        value = found
        copy_track(trial, track)
        for i in range(size):
            g[i] = g2[i]
            for j in range(i + 1):
                H[i, j] = H2[i, j]
        if decrease < DECREASE_MIN:
            break
    track[WEIGHT] = (
        track[MERGED_WEIGHT]
        - value
        + constants(track, anchor_s, now_s, kinds)
        - 0.5 * factorise(H, size)
    )
    # A weight that cannot be computed is zero.
    if np.isnan(track[WEIGHT]):
        track[WEIGHT] = -np.inf
    return value


@in_loop
def fix_at_limits(track: Floats, H: Floats, g: Floats, size: int, rules: Floats) -> None:
    """Exclude accelerations at their limit from a step that would exceed it."""
    for i in range(int(track[COUNT])):
        at = SEGMENTS + SEGMENT_COUNT * i
        own = 4 if i == 0 else 7 + 3 * (i - 1)
        for part in range(2):
            value = track[at + LATERAL + part]
            column = own + part
            if abs(value) >= limit(value, part, rules) and value * g[column] > 0.0:
                g[column] = 0.0
                for j in range(size):
                    if j < column:
                        H[column, j] = 0.0
                    elif j > column:
                        H[j, column] = 0.0
                H[column, column] = 1.0


@in_loop
def limit(value: float, part: int, rules: Floats) -> float:
    """Return the limit of an acceleration: the wider one if the usual one is exceeded already."""
    usual: float = rules[LATERAL_MAX + part]
    wider: float = rules[LATERAL_BEYOND + part]
    return usual if abs(value) <= usual else wider


@in_loop
def copy_track(track: Floats, to: Floats) -> None:
    """Copy all columns of a track."""
    for column in range(len(track)):
        to[column] = track[column]


@in_loop
def shift(track: Floats, trial: Floats, step: Floats, anchor_s: float, rules: Floats) -> None:
    """Write the track after a step, row 4 of `step`, within the limits."""
    copy_track(track, trial)
    for i in range(4):
        trial[EAST + i] += step[4, i]
    trial[SPEED] = max(trial[SPEED], SPEED_MIN)
    before = anchor_s
    for i in range(int(track[COUNT])):
        at = SEGMENTS + SEGMENT_COUNT * i
        own = 4 if i == 0 else 7 + 3 * (i - 1)
        if i > 0:
            by = min(max(step[4, own - 1], -BEGIN_STEP_MAX_S), BEGIN_STEP_MAX_S)
            trial[at + BEGIN] = max(track[at + BEGIN] + by, before + rules[SEGMENT_MIN_S])
            before = trial[at + BEGIN]
        for part in range(2):
            value = track[at + LATERAL + part]
            most = limit(value, part, rules)
            trial[at + LATERAL + part] = min(max(value + step[4, own + part], -most), most)


@in_loop
def constants(track: Floats, anchor_s: float, now_s: float, kinds: Floats) -> float:
    """Return the part of the weight that does not depend on plots: rates, and sizes of priors."""
    total: float = 0.5 * track[PRIOR_LOGARITHM]
    begin = anchor_s
    count = int(track[COUNT])
    for i in range(count):
        at = SEGMENTS + SEGMENT_COUNT * i
        kind = int(track[at + KIND])
        end = track[at + SEGMENT_COUNT + BEGIN] if i < count - 1 else now_s
        total -= kinds[kind, ENDING] * max(min(end, now_s) - begin, 0.0)
        begin = end
        if i > 0:
            before = int(track[at - SEGMENT_COUNT + KIND])
            # Probability that one kind follows the other within a cell; the sigma of the cell
            # cancels with the determinant of its prior.
            total += kinds[before, FOLLOWING + kind] + log(kinds[before, ENDING] * sqrt(2.0 * pi))
            total -= log(kinds[kind, LATERAL_SIGMA] * kinds[kind, LONGITUDINAL_SIGMA])
    return total
