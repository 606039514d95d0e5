"""Compiled search for duplicate tracks of one aircraft.

Symbols: d = difference of two states χ = a + V ς, C = its covariance; the biases are common to
both: C = P₁ + P₂ + (V₁ − V₂) P_ς (V₁ − V₂)ᵀ.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Aircraft, Model
from multiradar.tracking._identity_kernels import differ
from multiradar.tracking.association._grid_kernels import CELL_M, bucket_of
from multiradar.tracking.association.track_grid import TrackGrid
from multiradar.tracking.lifecycle.lifecycle import BY_IDENTITY, CONFIRMED, TENTATIVE, Lifecycle
from multiradar.tracking.roster import MISSING, Roster
from multiradar_compiled.kernels import in_loop, inner_loop, kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Squared distance of two states, four degrees of freedom, exceeded by one pair in a thousand.
MEETING_SQUARED = 18.5
# Maximum distance of duplicate tracks, m.
APART_MAX_M = 8_000.0
HEIGHTS_APART_M = 300.0
# Consecutive tests that must find two tracks at one position.
MEETINGS_NEEDED = 4
# Number of tests (negative) without merging after one sensor saw two tracks in one scan.
LEFT_ALONE = -8
# Number of measurements that establish a track as an aircraft of its own.
ESTABLISHED_HITS = 20


@kernel
def find_merges(
    time: float,
    longest: float,
    model: Model,
    aircraft: Aircraft,
    roster: Roster,
    life: Lifecycle,
    periods: Floats,
    grid: TrackGrid,
    patience: int,
    merged: Integers,
    into: Integers,
) -> int:
    """Fill ``merged`` with the slots of tracks that duplicate an older one; return how many.

    ``into`` receives the slots of the older ones.

    ``grid`` is filled for ``time``. A track initiated by a false plot may be anywhere: nothing is
    merged into a track with a single plot, nor a confirmed track into a tentative one. Two tracks
    that a sensor has seen in one scan at one position, or that were both established before they
    met, are not merged for ``patience`` more tests.
    """
    return search_merges(
        time, longest, model, aircraft, roster, life, periods, grid, patience, merged, into,
        np.empty(4), np.empty((4, 4)), np.empty((4, aircraft.sensitivity.shape[2])),
    )  # fmt: skip


@inner_loop
def search_merges(
    time: float,
    longest: float,
    model: Model,
    aircraft: Aircraft,
    roster: Roster,
    life: Lifecycle,
    periods: Floats,
    grid: TrackGrid,
    patience: int,
    merged: Integers,
    into: Integers,
    difference: Floats,
    C: Floats,
    D: Floats,
) -> int:
    """As `find_merges`, with given scratch arrays."""
    mask = grid.heads.shape[0] - 1
    count = 0
    for k in range(roster.track_id.shape[0]):
        if (
            roster.track_id[k] == MISSING
            or np.isnan(aircraft.time[k])
            or life.stage[k] == BY_IDENTITY
            or life.hits[k] < 2
        ):
            continue
        found = MISSING
        other = MISSING
        seen_apart = False
        wide = min(np.sqrt(grid.reach[k] ** 2 + longest**2), APART_MAX_M)
        east, north = grid.state[k, 0], grid.state[k, 1]
        for ce in range(
            int(np.floor((east - wide) / CELL_M)), int(np.floor((east + wide) / CELL_M)) + 1
        ):
            for cn in range(
                int(np.floor((north - wide) / CELL_M)), int(np.floor((north + wide) / CELL_M)) + 1
            ):
                j = grid.heads[bucket_of(ce, cn, mask)]
                while j != MISSING:
                    if (
                        grid.cell[j, 0] == ce
                        and grid.cell[j, 1] == cn
                        and roster.track_id[j] < roster.track_id[k]
                        and (life.hits[j] > 1 or life.stage[j] == BY_IDENTITY)
                        and not (life.stage[k] == CONFIRMED and life.stage[j] == TENTATIVE)
                        and may_be_one(k, j, aircraft, roster, grid)
                    ):
                        if seen_by_one(time, k, j, periods, life):
                            seen_apart = seen_apart or life.partner[k] == j
                            if (
                                patience > 0
                                and distance_squared(
                                    time, k, j, model, aircraft, grid, difference, C, D
                                )
                                < MEETING_SQUARED
                            ):
                                other = j
                        elif (
                            found == MISSING or roster.track_id[j] < roster.track_id[found]
                        ) and distance_squared(
                            time, k, j, model, aircraft, grid, difference, C, D
                        ) < MEETING_SQUARED:
                            found = j
                    j = grid.following[j]
        if other != MISSING:
            life.partner[k] = other
            life.meetings[k] = -patience
        elif seen_apart:
            life.meetings[k] = LEFT_ALONE
        elif found == MISSING:
            life.partner[k] = MISSING
            life.meetings[k] = 0
        elif life.partner[k] != found:
            life.partner[k] = found
            life.meetings[k] = 1
            if min(life.hits[k], life.hits[found]) >= ESTABLISHED_HITS:
                life.meetings[k] -= patience
        else:
            life.meetings[k] += 1
        if found != MISSING and life.meetings[k] >= MEETINGS_NEEDED:
            merged[count] = k
            into[count] = found
            count += 1
    return count


@in_loop
def may_be_one(k: int, j: int, aircraft: Aircraft, roster: Roster, grid: TrackGrid) -> bool:
    """Return whether position, height and identity allow two tracks to be one aircraft."""
    d0 = grid.state[k, 0] - grid.state[j, 0]
    d1 = grid.state[k, 1] - grid.state[j, 1]
    near = grid.reach[k] * grid.reach[k] + grid.reach[j] * grid.reach[j]
    close = d0 * d0 + d1 * d1 <= min(near, APART_MAX_M * APART_MAX_M)
    return (
        close
        and not abs(aircraft.height[k] - aircraft.height[j]) > HEIGHTS_APART_M  # False for NaN.
        and not differ(roster.mode_3a[k], roster.mode_3a[j])
        and not differ(roster.track_number[k], roster.track_number[j])
        and not differ(roster.mode_s_address[k], roster.mode_s_address[j])
    )


@in_loop
def seen_by_one(time: float, k: int, j: int, periods: Floats, life: Lifecycle) -> bool:
    """Return whether a sensor measured both tracks in its latest scan."""
    seen = False
    for s in range(periods.shape[0]):
        first, second = life.last_seen[k, s], life.last_seen[j, s]
        recent = min(first, second) > time - 1.5 * periods[s]
        seen = seen or (recent and abs(first - second) < 0.5 * periods[s])
    return seen


@in_loop
def distance_squared(
    time: float,
    k: int,
    j: int,
    model: Model,
    aircraft: Aircraft,
    grid: TrackGrid,
    difference: Floats,
    C: Floats,
    D: Floats,
) -> float:
    """Return dᵀ C⁻¹ d of two tracks; the last three arrays are scratch."""
    n = D.shape[1]
    V = aircraft.sensitivity
    t1, t2 = time - aircraft.time[k], time - aircraft.time[j]
    for a in range(4):
        for b in range(4):
            C[a, b] = 0.0
    P = aircraft.covariance
    for which in range(2):
        i = k if which == 0 else j
        ahead = t1 if which == 0 else t2
        C[0, 0] += P[i, 0] + ahead * (2.0 * P[i, 2] + ahead * P[i, 7])
        C[0, 1] += P[i, 1] + ahead * (P[i, 3] + P[i, 5] + ahead * P[i, 8])
        C[0, 2] += P[i, 2] + ahead * P[i, 7]
        C[0, 3] += P[i, 3] + ahead * P[i, 8]
        C[1, 1] += P[i, 4] + ahead * (2.0 * P[i, 6] + ahead * P[i, 9])
        C[1, 2] += P[i, 5] + ahead * P[i, 8]
        C[1, 3] += P[i, 6] + ahead * P[i, 9]
        C[2, 2] += P[i, 7]
        C[2, 3] += P[i, 8]
        C[3, 3] += P[i, 9]
    for c in range(n):
        D[2, c] = V[k, 2, c] - V[j, 2, c]
        D[3, c] = V[k, 3, c] - V[j, 3, c]
        D[0, c] = V[k, 0, c] + t1 * V[k, 2, c] - V[j, 0, c] - t2 * V[j, 2, c]
        D[1, c] = V[k, 1, c] + t1 * V[k, 3, c] - V[j, 1, c] - t2 * V[j, 3, c]
    for c in range(n):
        for e in range(n):
            p = model.bias_covariance[c, e]
            for a in range(4):
                for b in range(a, 4):
                    C[a, b] += D[a, c] * p * D[b, e]
    for i in range(4):
        difference[i] = grid.state[k, i] - grid.state[j, i]
    # Cholesky decomposition of the upper triangle, applied to the difference.
    total = 0.0
    for i in range(4):
        # A pivot of zero makes the sum infinite.
        pivot = max(C[i, i], 0.0)
        value = difference[i]
        total += value * value / pivot
        for a in range(i + 1, 4):
            factor = C[i, a] / pivot
            difference[a] -= factor * value
            for b in range(a, 4):
                C[a, b] -= factor * C[i, b]
    return total
