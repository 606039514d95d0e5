"""Compiled lives of tracks: which plots begin one, what confirms it, when it ends."""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import RESTARTED
from multiradar.estimation.filters.arrays import Aircraft, Result, Rows
from multiradar.estimation.measurement._kernels import KIND_RADAR, is_bearing
from multiradar.tracking.association._assignment_kernels import assign_scan
from multiradar.tracking.association._clutter_kernels import ring_of
from multiradar.tracking.association._young_kernels import forget_velocity, score_of_twin
from multiradar.tracking.association.sky import DROP_AFTER, HITS_MIN, SCORE_MIN, Candidates, Sky
from multiradar.tracking.lifecycle.lifecycle import BY_IDENTITY, CONFIRMED, TENTATIVE, Lifecycle
from multiradar.tracking.lifecycle.transitions import SILENT, UNCONFIRMED, UNLIKELY
from multiradar.tracking.roster import MISSING, NEW_TRACK, TWIN, Roster, RowIdentities
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Turns without a plot after which a track that is not confirmed ends, and turns that it has.
SILENT_TURNS = 3.0
TENTATIVE_TURNS = 6.0
# Hits that a track needs whose first plot could have been of a track that had a likelier one.
SHADOW_HITS = 5
# More missed turns of one sensor than this say that it does not see the aircraft any more.
MISSED_MAX = 4.0
# Two scores that differ by less leave open which is right: odds of about 100.
AMBIGUOUS = 4.6

# Part of the reaches of two plots of two sensors within which they begin one track, and how far
# apart their heights may be, m.
NEAR_START = 0.4
START_HEIGHTS_M = 300.0
# What a missed turn of a sensor adds to a score, and where a score ends: a track of three radars
# that has it coasts for about a minute.
LOG_MISSED = math.log(0.1)
SCORE_MAX = 80.0
# A confirmed track with less than this is no better than false plots.
SCORE_LOST = 0.0

# Positions in the counts of transitions.
STARTED = 0
CONFIRMATIONS = 1
ENDED_UNCONFIRMED = 2
ENDED_SILENT = 3
MERGED = 4
TRANSITION_COUNT = 5


@kernel
def choose_tracks(
    first: int,
    last: int,
    sensors: int,
    track_numbers: Integers,
    addresses: Integers,
    codes: Integers,
    rows: Rows,
    log_clutters: Floats,
    speed_variance: float,
    aircraft: Aircraft,
    life: Lifecycle,
    candidates: Candidates,
    sky: Sky,
    identities: RowIdentities,
    doubted: Integers,
    scores: Floats,
    shadows: Integers,
) -> None:
    """Assign the rows first…last of each sensor; those without a track begin one.

    ``scores`` gets the score of each row from the first on, ``shadows`` whether it could have been
    of a track that took another.
    """
    n = last - first
    chosen = np.full(n, MISSING, np.int64)
    plots = np.empty(n, np.int64)
    begun = np.empty(n, np.int64)
    beginnings = 0
    for s in range(sensors):
        count = 0
        for i in range(n):
            if rows.sensor[first + i] == s and candidates.number[i] != MISSING:
                plots[count] = i
                count += 1
        if count > 0:
            assign_scan(plots[:count], candidates, sky, chosen)
    for i in range(n):
        row = first + i
        if identities.slot[row] >= 0:
            life.quiet[identities.slot[row]] = life.stage[identities.slot[row]] == TENTATIVE
        for c in range(max(candidates.number[i], 0)):
            k = candidates.slot[i, c]
            life.quiet[k] = life.stage[k] == TENTATIVE
    for i in range(n):
        row = first + i
        count = candidates.number[i]
        if count == MISSING:
            continue
        if chosen[i] == MISSING:
            shadows[i] = count > 0
            scores[i] = 0.0
            if not doubted[i] and (track_numbers[row] >= 0 or addresses[row] >= 0):
                continue
            j = has_begun(i, first, begun[:beginnings], codes, rows, candidates)
            if j == MISSING:
                identities.slot[row] = NEW_TRACK
                begun[beginnings] = i
                beginnings += 1
            elif identities.slot[first + j] == NEW_TRACK:
                ring = ring_of(rows.z[row, 0]) if rows.kind[row] == KIND_RADAR else 0
                score = score_of_twin(i, j, candidates, log_clutters[rows.sensor[row], ring])
                if score > 0.0:
                    identities.slot[row] = TWIN - (i - j)
                    scores[i] = score
            continue
        k = candidates.slot[i, chosen[i]]
        identities.slot[row] = k
        scores[i] = candidates.score[i, chosen[i]]
        if candidates.anew[i, chosen[i]]:
            forget_velocity(k, speed_variance, aircraft, life)
        for c in range(count):
            if c != chosen[i] and candidates.score[i, c] > scores[i] - AMBIGUOUS:
                life.quiet[k] = 1
                life.quiet[candidates.slot[i, c]] = 1


@kernel
def has_begun(
    i: int, first: int, begun: Integers, codes: Integers, rows: Rows, candidates: Candidates
) -> int:
    """Return which plot of another sensor in this window may have begun the track, −1 for none."""
    row = first + i
    for j in begun:
        other = first + j
        if rows.sensor[other] == rows.sensor[row]:
            continue
        d0 = candidates.place[i, 0] - candidates.place[j, 0]
        d1 = candidates.place[i, 1] - candidates.place[j, 1]
        near = NEAR_START * (candidates.place[i, 2] + candidates.place[j, 2])
        if d0 * d0 + d1 * d1 > near * near:
            continue
        if codes[row] >= 0 and codes[other] >= 0 and codes[row] != codes[other]:
            continue
        if abs(rows.height[row] - rows.height[other]) > START_HEIGHTS_M:  # NaN is not.
            continue
        return int(j)
    return MISSING


@kernel
def settle(
    first: int,
    last: int,
    rows: Rows,
    result: Result,
    periods: Floats,
    rules: Floats,
    log_clutters: Floats,
    usual: float,
    shadow_hits: int,
    counts: Floats,
    life: Lifecycle,
    identities: RowIdentities,
    scores: Floats,
    shadows: Integers,
    confirmed: Integers,
    transitions: Integers,
) -> None:
    """Note what became of the rows in the lives of their tracks; confirm those that earn it."""
    for row in range(first, last):
        k = identities.slot[row]
        if k < 0 or result.outcome[row] > RESTARTED:
            continue
        if is_bearing(rows.kind[row]):
            # It tells that something is there in that direction, which others are as well.
            if life.stage[k] != BY_IDENTITY:
                confirmed[row] = life.stage[k] == CONFIRMED
            continue
        s = rows.sensor[row]
        before = life.heard[k, s]
        life.heard[k, s] = rows.time[row]
        if life.stage[k] == BY_IDENTITY:
            continue
        life.period[k] = max(life.period[k], periods[s])
        if life.hits[k] == 0:
            life.born[k] = rows.time[row]
            life.hits_needed[k] = shadow_hits if shadows[row - first] else int(rules[HITS_MIN])
            # A new aircraft is as likely as a false plot where these are rare.
            ring = ring_of(rows.z[row, 0]) if rows.kind[row] == KIND_RADAR else 0
            life.score[k] = min(usual - log_clutters[s, ring], 0.0)
            life.first_sensor[k] = s
            life.first_ring[k] = ring
            counts[s, ring] += 1.0
            transitions[STARTED] += 1
        missed = missed_turns(rows.time[row] - before, periods[s])
        life.hits[k] += 1
        life.score[k] = min(life.score[k] + scores[row - first] + missed * LOG_MISSED, SCORE_MAX)
        if (
            life.stage[k] == TENTATIVE
            and life.hits[k] >= life.hits_needed[k]
            and life.score[k] >= rules[SCORE_MIN]
        ):
            life.stage[k] = CONFIRMED
            if life.first_sensor[k] != MISSING:
                # Its first plot was none of the false ones.
                counts[life.first_sensor[k], life.first_ring[k]] -= 1.0
            transitions[CONFIRMATIONS] += 1
        confirmed[row] = life.stage[k] == CONFIRMED


@kernel
def missed_turns(since: float, period: float) -> float:
    """Return how many turns went by without a plot, 0 for a sensor that gave none before."""
    return max(np.floor(since / period + 0.5) - 1.0, 0.0) if since < np.inf else 0.0


@kernel
def score_by(time: float, k: int, periods: Floats, life: Lifecycle) -> float:
    """Return the score of a track with the turns that went by since each sensor's last plot.

    A sensor that has been silent for longer than the track is let coast has no more to say.
    """
    score: float = life.score[k]
    for s in range(periods.shape[0]):
        since = time - life.heard[k, s]
        if since < np.inf:
            missed = max(np.floor(since / periods[s] - 0.25), 0.0)
            score += min(missed, MISSED_MAX) * LOG_MISSED
    return score


@kernel
def find_ended(
    time: float,
    aircraft: Aircraft,
    roster: Roster,
    life: Lifecycle,
    periods: Floats,
    rules: Floats,
    ended: Integers,
    reasons: Integers,
    transitions: Integers,
) -> tuple[int, int]:
    """Fill ``ended`` with the slots of tracks to end, ascending; also return how many live on.

    ``reasons`` gets why they end.

    A track that is confirmed may coast as long as it has lived, three turns at least.
    """
    count = 0
    alive = 0
    for k in range(roster.track_id.shape[0]):
        if roster.track_id[k] == MISSING or life.stage[k] == BY_IDENTITY:
            continue
        turn = life.period[k]
        silent = time - aircraft.updated[k]
        if life.stage[k] == TENTATIVE:
            late = time - life.born[k] > TENTATIVE_TURNS * turn
            over = not silent <= SILENT_TURNS * turn or late
            why = UNCONFIRMED
        else:
            lived = aircraft.updated[k] - life.born[k]
            over = not silent <= min(rules[DROP_AFTER], max(SILENT_TURNS * turn, lived))
            why = SILENT
            if not over and score_by(time, k, periods, life) < SCORE_LOST:
                over, why = True, UNLIKELY
        if over:
            ended[count] = k
            reasons[count] = why
            count += 1
            reason = ENDED_UNCONFIRMED if life.stage[k] == TENTATIVE else ENDED_SILENT
            transitions[reason] += 1
        else:
            alive += 1
    return count, alive
