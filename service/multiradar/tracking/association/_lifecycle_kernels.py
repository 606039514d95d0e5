"""Compiled track lifecycles: confirmation and termination; `_initiation_kernels` initiates."""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import RESTARTED
from multiradar.estimation.filters.arrays import Aircraft, Result, Rows
from multiradar.estimation.measurement._kernels import is_bearing
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.tracking.association._clutter_kernels import ring_of
from multiradar.tracking.association.track_grid import (
    DROP_AFTER,
    HITS_MIN,
    SCORE_MIN,
    Gating,
    RowScores,
)
from multiradar.tracking.lifecycle.lifecycle import BY_IDENTITY, CONFIRMED, TENTATIVE, Lifecycle
from multiradar.tracking.lifecycle.transitions import SILENT, UNCONFIRMED, UNLIKELY
from multiradar.tracking.roster import (
    MISSING,
    Roster,
    RowIdentities,
)
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Number of scans without a plot after which a tentative track is dropped, and its maximum age in
# scans.
SILENT_SCANS = 3.0
TENTATIVE_SCANS = 6.0
# Hits needed to confirm a track whose first plot may belong to another track.
SHADOW_HITS = 5
# Number of missed scans after which a sensor is taken not to cover the aircraft any more.
MISSED_MAX = 4.0
# Score of a missed scan of a sensor, and maximum score: a track of three radars with it coasts for
# about a minute.
LOG_MISSED = math.log(0.1)
SCORE_MAX = 80.0
# Score below which a confirmed track is no likelier than false plots.
SCORE_LOST = 0.0


@kernel
def update_lifecycles(
    first: int,
    last: int,
    rows: Rows,
    result: Result,
    gating: Gating,
    usual: float,
    shadow_hits: int,
    counts: Floats,
    life: Lifecycle,
    identities: RowIdentities,
    scores: RowScores,
    confirmed: Integers,
) -> None:
    """Update the lifecycles of tracks with the outcomes of rows; confirm tracks."""
    for row in range(first, last):
        k = identities.slot[row]
        if k < 0 or result.outcome[row] > RESTARTED:
            continue
        if is_bearing(rows.kind[row]):
            # A bearing shows that there is something in its direction, maybe another aircraft.
            if life.stage[k] != BY_IDENTITY:
                confirmed[row] = life.stage[k] == CONFIRMED
            continue
        s = rows.sensor[row]
        before = life.last_seen[k, s]
        life.last_seen[k, s] = rows.time[row]
        life.last_azimuth[k, s] = rows.z[row, 1]
        if life.stage[k] == BY_IDENTITY:
            continue
        life.period[k] = max(life.period[k], gating.periods[s])
        if life.hits[k] == 0:
            life.born[k] = rows.time[row]
            life.hits_needed[k] = (
                shadow_hits if scores.shadow[row - first] else int(gating.rules[HITS_MIN])
            )
            # Where false plots are rare a new aircraft is as likely as one.
            ring = ring_of(rows.z[row, 0]) if rows.kind[row] == KIND_RADAR else 0
            life.score[k] = min(usual - gating.log_clutters[s, ring], 0.0)
            life.first_sensor[k] = s
            life.first_ring[k] = ring
            counts[s, ring] += 1.0
        missed = missed_scans(rows.time[row] - before, gating.periods[s])
        life.hits[k] += 1
        life.score[k] = min(
            life.score[k] + scores.score[row - first] + missed * LOG_MISSED, SCORE_MAX
        )
        if (
            life.stage[k] == TENTATIVE
            and life.hits[k] >= life.hits_needed[k]
            and life.score[k] >= gating.rules[SCORE_MIN]
        ):
            life.stage[k] = CONFIRMED
            if life.first_sensor[k] != MISSING:
                # Its first plot is no longer counted as false.
                counts[life.first_sensor[k], life.first_ring[k]] -= 1.0
        confirmed[row] = life.stage[k] == CONFIRMED


@kernel
def missed_scans(since: float, period: float) -> float:
    """Return the number of missed scans, 0 for a sensor without an earlier plot."""
    return max(np.floor(since / period + 0.5) - 1.0, 0.0) if since < np.inf else 0.0


@kernel
def score_at(time: float, k: int, periods: Floats, life: Lifecycle) -> float:
    """Return the score of a track including the scans missed since each sensor's last plot.

    The missed scans of one sensor are bounded by `MISSED_MAX`.
    """
    score: float = life.score[k]
    for s in range(periods.shape[0]):
        since = time - life.last_seen[k, s]
        if since < np.inf:
            missed = max(np.floor(since / periods[s] - 0.25), 0.0)
            score += min(missed, MISSED_MAX) * LOG_MISSED
    return score


@kernel
def find_dropped(
    time: float,
    aircraft: Aircraft,
    roster: Roster,
    life: Lifecycle,
    periods: Floats,
    rules: Floats,
    dropped: Integers,
    reasons: Integers,
) -> tuple[int, int]:
    """Fill ``dropped`` with the slots of tracks to drop, ascending; return also how many remain.

    ``reasons`` receives the reasons.

    A confirmed track may coast as long as it has lived, and three scans at least.
    """
    count = 0
    alive = 0
    for k in range(roster.track_id.shape[0]):
        if roster.track_id[k] == MISSING or life.stage[k] == BY_IDENTITY:
            continue
        period = life.period[k]
        silent = time - aircraft.updated[k]
        if life.stage[k] == TENTATIVE:
            late = time - life.born[k] > TENTATIVE_SCANS * period
            over = not silent <= SILENT_SCANS * period or late
            why = UNCONFIRMED
        else:
            lived = aircraft.updated[k] - life.born[k]
            over = not silent <= min(rules[DROP_AFTER], max(SILENT_SCANS * period, lived))
            why = SILENT
            if not over and score_at(time, k, periods, life) < SCORE_LOST:
                over, why = True, UNLIKELY
        if over:
            dropped[count] = k
            reasons[count] = why
            count += 1
        else:
            alive += 1
    return count, alive
