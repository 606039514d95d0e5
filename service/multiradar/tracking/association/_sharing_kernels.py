"""Compiled sharing: shares of plots between tracks, where the association is ambiguous.

Symbols beside those of `_association_kernels` and `_probability_kernels`: Δr, Δα = differences of
two tracks in range and azimuth as seen by a radar, r₀, α₀ = those resolved in half of all cases.

References
----------
Koch, W., van Keuk, G., "Multiple hypothesis track maintenance with possibly unresolved
measurements", IEEE Transactions on Aerospace and Electronic Systems 33 (1997), 883-892: unresolved
plots of two tracks, and their probability.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import NONE, choose_height
from multiradar.estimation.filters.arrays import Aircraft, Model, Rows
from multiradar.estimation.measurement._kernels import expected_measurement
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.geodesy._kernels import wrap_angle
from multiradar.tracking.association._assignment_kernels import root_of
from multiradar.tracking.association._association_kernels import pair_score
from multiradar.tracking.association._clutter_kernels import log_density_of_clutter
from multiradar.tracking.association._probability_kernels import pair_probabilities
from multiradar.tracking.association.track_grid import BiasScratch, Candidates, TrackGrid
from multiradar.tracking.lifecycle.lifecycle import Lifecycle
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Columns of the shares: see `share_plots`.
SHARE_COLUMNS = 6

# Positions in the vector of sharing rules, and their number: whether only the likeliest events
# count, whether tracks without the velocity needed for time offsets are skipped, rejections after
# which a track is reinitialised, r₀ and α₀.
BEST = 0
TIMED = 1
REJECTIONS_MAX = 2
RESOLVED_RANGE = 3
RESOLVED_AZIMUTH = 4
SHARING_COUNT = 5

# Below this probability of other events the assignment is taken as certain.
DOUBT_MIN = 0.01
# Minimum share of a plot.
SHARE_MIN = 1e-3
# Minimum number of updates of a track: fewer give no velocity.
UPDATES_MIN = 2
# Probability of a missed detection, as in the score of a missed scan.
LOG_MISSED = math.log(0.1)
# Minimum log probability of an unresolved plot.
LOG_UNRESOLVED_MIN = -6.0


@kernel
def share_plots(
    first: int,
    sensors: int,
    window_time: float,
    sharing: Floats,
    rules: Floats,
    log_clutters: Floats,
    rows: Rows,
    model: Model,
    candidates: Candidates,
    grid: TrackGrid,
    slots: Integers,
    life: Lifecycle,
    aircraft: Aircraft,
    shares: Floats,
) -> int:
    """Fill ``shares`` with ambiguous associations; return the number of rows.

    Its columns: first row of the shares of this track in the plots of this sensor, slot of the
    track, row assigned to it (`NONE` for none), row of this share (`NONE` for a missed detection),
    whether the plot is unresolved, probability. ``slots`` are those assigned to the rows.
    """
    n = candidates.number.shape[0]
    parents = np.arange(n)
    for s in range(sensors):
        for i in range(n):
            if rows.sensor[first + i] != s:
                continue
            for c in range(max(candidates.number[i], 0)):
                k = candidates.slot[i, c]
                if grid.owner[k] == NONE:
                    grid.owner[k] = i
                else:
                    a, b = root_of(parents, grid.owner[k]), root_of(parents, i)
                    parents[max(a, b)] = min(a, b)
        for i in range(n):
            for c in range(max(candidates.number[i], 0)):
                grid.owner[candidates.slot[i, c]] = NONE
    for i in range(n):
        parents[i] = root_of(parents, i)
    count = 0
    for i in range(n):
        if parents[i] != i or candidates.number[i] <= 0:
            continue
        plots = np.flatnonzero(parents == i)
        if len(plots) == 1 and candidates.number[i] == 1:
            continue
        tracks, scores = component_of(plots, candidates, grid)
        merged = merged_scores(
            first, window_time, plots, tracks, scores, sharing, rules, log_clutters, rows, model,
            grid, life, aircraft,
        )  # fmt: skip
        count = share_component(
            first, plots, tracks, scores, merged, sharing, slots, aircraft, shares, count
        )
    return count


@kernel
def component_of(
    plots: Integers, candidates: Candidates, grid: TrackGrid
) -> tuple[Integers, Floats]:
    """Return the tracks of a component of plots, and the scores of their pairs.

    The scores are relative to a false plot *and* a missed track; −∞ for an impossible pair.
    """
    tracks = np.empty(candidates.number[plots].sum(), np.int64)
    columns = 0
    for i in plots:
        for c in range(candidates.number[i]):
            k = candidates.slot[i, c]
            if grid.local[k] == NONE:
                grid.local[k] = columns
                tracks[columns] = k
                columns += 1
    scores = np.full((len(plots), columns), -np.inf)
    for a in range(len(plots)):
        for c in range(candidates.number[plots[a]]):
            k = candidates.slot[plots[a], c]
            scores[a, grid.local[k]] = candidates.score[plots[a], c] - LOG_MISSED
    for k in tracks[:columns]:
        grid.local[k] = NONE
    return tracks[:columns], scores


@kernel
def merged_scores(
    first: int,
    window_time: float,
    plots: Integers,
    tracks: Integers,
    scores: Floats,
    sharing: Floats,
    rules: Floats,
    log_clutters: Floats,
    rows: Rows,
    model: Model,
    grid: TrackGrid,
    life: Lifecycle,
    aircraft: Aircraft,
) -> Floats:
    """Return the scores (plots, tracks, tracks) of unresolved plots; −∞ for none.

    An unresolved plot lies in the middle of two tracks: shifted by half their difference, it has
    the likelihood of a plot of one of them.
    """
    columns = len(tracks)
    merged = np.full((len(plots), columns, columns), -np.inf)
    if sharing[RESOLVED_RANGE] <= 0.0 or sharing[RESOLVED_AZIMUTH] <= 0.0:
        return merged
    n = model.bias.shape[0]
    sigmas = np.sqrt(np.diag(model.bias_covariance))
    scratch = BiasScratch(sigmas, np.empty((2, n)), np.empty((2, n)))
    for a in range(len(plots)):
        row = first + plots[a]
        if rows.kind[row] != KIND_RADAR:
            continue
        ahead = rows.time[row] - window_time
        log_clutter = log_density_of_clutter(
            rows.kind[row], rows.sensor[row], rows.z[row, 0], log_clutters
        )
        one = Rows(
            rows.slot[row : row + 1], rows.time[row : row + 1], rows.kind[row : row + 1],
            rows.sensor[row : row + 1], rows.z[row : row + 1].copy(), rows.height[row : row + 1],
            rows.seen[row : row + 1], rows.ground[row : row + 1], rows.motion,
        )  # fmt: skip
        for b in range(columns):
            for c in range(b + 1, columns):
                if scores[a, b] == -np.inf or scores[a, c] == -np.inf:
                    continue
                d0, d1 = apart(row, tracks[b], tracks[c], ahead, rows, model, aircraft, grid)
                p0, p1 = d0 / sharing[RESOLVED_RANGE], d1 / sharing[RESOLVED_AZIMUTH]
                unresolved = -math.log(2.0) * (p0 * p0 + p1 * p1)
                if not unresolved > LOG_UNRESOLVED_MIN:
                    continue
                score = 0.0
                for side in range(2):
                    k = tracks[b] if side == 0 else tracks[c]
                    half = -0.5 if side == 0 else 0.5
                    one.z[0, 0] = rows.z[row, 0] + half * d0
                    one.z[0, 1] = rows.z[row, 1] + half * d1
                    score += 0.5 * pair_score(
                        0, k, ahead, life.period[k], one, model, aircraft, grid, rules, log_clutter,
                        scratch,
                    )  # fmt: skip
                merged[a, b, c] = score + unresolved - 2.0 * LOG_MISSED
    return merged


@kernel
def apart(
    row: int,
    k: int,
    m: int,
    ahead: float,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    grid: TrackGrid,
) -> tuple[float, float]:
    """Return Δr and Δα, track m minus track k, as expected by the sensor of a plot."""
    s = rows.sensor[row]
    height, variance = choose_height(rows.height[row], aircraft.height[k], model.options)
    there, other, _, _, _ = expected_measurement(
        rows.kind[row], model.plane, model.sites[s], model.noises[s],
        grid.state[k, 0] + ahead * grid.state[k, 2], grid.state[k, 1] + ahead * grid.state[k, 3],
        height, variance,
    )  # fmt: skip
    p0, p1, _, _, _ = expected_measurement(
        rows.kind[row], model.plane, model.sites[s], model.noises[s],
        grid.state[m, 0] + ahead * grid.state[m, 2], grid.state[m, 1] + ahead * grid.state[m, 3],
        height, variance,
    )  # fmt: skip
    return p0 - there, wrap_angle(p1 - other)


@kernel
def share_component(
    first: int,
    plots: Integers,
    tracks: Integers,
    scores: Floats,
    merged: Floats,
    sharing: Floats,
    slots: Integers,
    aircraft: Aircraft,
    shares: Floats,
    count: int,
) -> int:
    """As `share_plots` for the plots and tracks of a component."""
    beta = np.zeros(scores.shape)
    gamma = np.zeros(scores.shape)
    solved = pair_probabilities(scores, merged, sharing[BEST] != 0.0, beta, gamma)
    for b in range(len(tracks) if solved else 0):
        k = tracks[b]
        unknown = sharing[TIMED] != 0.0 and np.isnan(aircraft.velocity[k, 0])
        restarts = aircraft.rejections[k] >= sharing[REJECTIONS_MAX]
        if aircraft.updates[k] < UPDATES_MIN or unknown or restarts:
            continue
        own = NONE
        sure = 1.0 - beta[:, b].sum() - gamma[:, b].sum()
        for a in range(len(plots)):
            if slots[first + plots[a]] == k:
                own = first + plots[a]
                sure = beta[a, b]
        if sure < 1.0 - DOUBT_MIN:
            count = write_shares(first, plots, k, own, beta[:, b], gamma[:, b], shares, count)
    return count


@kernel
def write_shares(
    first: int,
    plots: Integers,
    k: int,
    own: int,
    beta: Floats,
    gamma: Floats,
    shares: Floats,
    count: int,
) -> int:
    """Write the shares of one track, of sum one; that of its assigned plot is always kept."""
    begin = count
    total = 0.0
    for a in range(-1, 2 * len(plots)):
        both = a >= len(plots)
        row = NONE if a < 0 else first + plots[a % len(plots)]
        part = max(0.0, 1.0 - beta.sum() - gamma.sum())
        if a >= 0:
            part = gamma[a % len(plots)] if both else beta[a]
        if part < SHARE_MIN and (own != row or a < 0 or both):
            continue
        shares[count, 0] = begin
        shares[count, 1] = k
        shares[count, 2] = own
        shares[count, 3] = row
        shares[count, 4] = 1.0 if both else 0.0
        shares[count, 5] = part
        total += part
        count += 1
    for at in range(begin, count):
        shares[at, 5] /= total
    return count
