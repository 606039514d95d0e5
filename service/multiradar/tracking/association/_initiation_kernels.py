"""Compiled decision which track a plot without identity updates, or that it initiates one."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Aircraft, Rows
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.tracking._identity_kernels import differ
from multiradar.tracking.association._assignment_kernels import assign_scan
from multiradar.tracking.association._clutter_kernels import ring_of
from multiradar.tracking.association._young_kernels import reset_velocity, score_of_twin
from multiradar.tracking.association.track_grid import (
    Candidates,
    RowScores,
    TrackGrid,
)
from multiradar.tracking.lifecycle.lifecycle import TENTATIVE, Lifecycle
from multiradar.tracking.roster import (
    MISSING,
    NEW_TRACK,
    TWIN,
    ReportedIdentities,
    RowIdentities,
)
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Score difference below which an association is ambiguous: odds of about 100.
AMBIGUOUS = 4.6
# Distance within which plots of two sensors initiate one track, as a fraction of both search radii,
# and their maximum height difference, m.
NEAR_START = 0.4
START_HEIGHTS_M = 300.0


@kernel
def assign_or_initiate(
    first: int,
    last: int,
    sensors: int,
    reported: ReportedIdentities,
    rows: Rows,
    log_clutters: Floats,
    speed_variance: float,
    aircraft: Aircraft,
    life: Lifecycle,
    candidates: Candidates,
    grid: TrackGrid,
    identities: RowIdentities,
    scores: RowScores,
) -> None:
    """Assign the rows first…last of each sensor; unassigned ones initiate tracks.

    ``scores`` receives scores and shadows.
    """
    n = last - first
    chosen = np.full(n, MISSING, np.int64)
    plots = np.empty(n, np.int64)
    initiators = np.empty(n, np.int64)
    initiated = 0
    for s in range(sensors):
        count = 0
        for i in range(n):
            if rows.sensor[first + i] == s and candidates.number[i] != MISSING:
                plots[count] = i
                count += 1
        if count > 0:
            assign_scan(plots[:count], candidates, grid, chosen)
    for i in range(n):
        row = first + i
        if identities.slot[row] >= 0:
            life.bias_excluded[identities.slot[row]] = life.stage[identities.slot[row]] == TENTATIVE
        for c in range(max(candidates.number[i], 0)):
            k = candidates.slot[i, c]
            life.bias_excluded[k] = life.stage[k] == TENTATIVE
    for i in range(n):
        row = first + i
        count = candidates.number[i]
        if count == MISSING:
            continue
        if chosen[i] == MISSING:
            scores.shadow[i] = count > 0
            scores.score[i] = 0.0
            named = reported.track_number[row] >= 0 or reported.mode_s_address[row] >= 0
            if named and not scores.released[i]:
                continue
            j = find_initiating_plot(i, first, initiators[:initiated], reported, rows, candidates)
            if j == MISSING:
                identities.slot[row] = NEW_TRACK
                initiators[initiated] = i
                initiated += 1
            elif identities.slot[first + j] == NEW_TRACK:
                ring = ring_of(rows.z[row, 0]) if rows.kind[row] == KIND_RADAR else 0
                score = score_of_twin(i, j, candidates, log_clutters[rows.sensor[row], ring])
                if score > 0.0:
                    identities.slot[row] = TWIN - (i - j)
                    scores.score[i] = score
            continue
        k = candidates.slot[i, chosen[i]]
        identities.slot[row] = k
        scores.score[i] = candidates.score[i, chosen[i]]
        if candidates.reinitialised[i, chosen[i]]:
            reset_velocity(k, speed_variance, aircraft, life)
        for c in range(count):
            if c != chosen[i] and candidates.score[i, c] > scores.score[i] - AMBIGUOUS:
                life.bias_excluded[k] = 1
                life.bias_excluded[candidates.slot[i, c]] = 1


@kernel
def find_initiating_plot(
    i: int,
    first: int,
    initiators: Integers,
    reported: ReportedIdentities,
    rows: Rows,
    candidates: Candidates,
) -> int:
    """Return the initiating plot of another sensor in this window that matches, −1 for none."""
    row = first + i
    for j in initiators:
        other = first + j
        if rows.sensor[other] == rows.sensor[row]:
            continue
        d0 = candidates.position[i, 0] - candidates.position[j, 0]
        d1 = candidates.position[i, 1] - candidates.position[j, 1]
        near = NEAR_START * (candidates.position[i, 2] + candidates.position[j, 2])
        if d0 * d0 + d1 * d1 > near * near:
            continue
        if differ(reported.mode_3a[row], reported.mode_3a[other]):
            continue
        if differ(reported.mode_s_address[row], reported.mode_s_address[other]):
            continue
        if abs(rows.height[row] - rows.height[other]) > START_HEIGHTS_M:  # False for NaN.
            continue
        return int(j)
    return MISSING
