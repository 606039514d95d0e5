"""Compiled judgement of what aircraft report: what is set aside, and what trust in them becomes.

References
----------
The project's own. The comparison itself is in `_comparison_kernels`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import HEIGHT_MAX, IMPLAUSIBLE_SLOT, VALUE_MAX
from multiradar.estimation.filters.arrays import Model, Rows
from multiradar.estimation.measurement._kernels import KIND_RADAR, is_bearing
from multiradar.tracking._kernels import look_up
from multiradar.tracking.lifecycle.lifecycle import Lifecycle
from multiradar.tracking.plausibility._comparison_kernels import common_offset, compare_all, vote
from multiradar.tracking.plausibility._cover_kernels import is_ghost, sector_of, sine_of_elevation
from multiradar.tracking.plausibility.trust import (
    DISTRUSTED,
    EAST,
    EAST_RATE,
    GHOST,
    NORTH,
    NORTH_RATE,
    PLOT_HEIGHT,
    PLOT_TIME,
    PLOT_Z0,
    PLOT_Z1,
    SUSPECT,
    TIME,
    TRUSTED,
    WAITING_MAX,
    Trust,
    Watch,
)
from multiradar.tracking.roster import NEW_TRACK, Roster, RowIdentities
from multiradar_compiled.kernels import in_loop, loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Two reports farther apart in time, s, are not joined.
REPORT_GAP_S = 20.0
# Reports that follow sooner, s, are checked and not compared.
REPORT_STEP_S = 0.3
# How far, in sigmas of a report and with what acceleration, m/s², one may be from where the last
# ones lead; and no aircraft flies faster, m/s.
JUMP_SIGMAS = 8.0
JUMP_ACCELERATION = 60.0
SPEED_MAX = 700.0
# Over so long, s, a late report makes the rates mean little; then a usual speed, m/s, is enough.
SLOW_REPORTS_S = 5.0
USUAL_SPEED = 300.0
# Weight of the newest report in the rates: this, and this more a second that it brings.
RATE_GAIN = 0.2
RATE_GAIN_PER_S = 0.2
# Comparisons in a row that bring trust back, and comparisons after which no aircraft is a ghost.
AGREEMENTS_MIN = 6
HITS_MIN = 3
# Reports that do not go on from each other, fading by half a one at each that does.
STRAYS_MAX = 4.0
STRAY_FADES = 0.5


@loop
def judge(
    first: int,
    last: int,
    rows: Rows,
    track_ids: Integers,
    watch: Watch,
    model: Model,
    bias: Floats,
    bias_covariance: Floats,
    trust: Trust,
    flagged: Integers,
) -> tuple[int, int, int, float]:
    """Judge rows until trust in an aircraft changes.

    Returns that row, the slot of the aircraft, its new state, which is not yet set, and how far, m,
    its reports are off; without a change the last row, and −1 for the slot.
    """
    for row in range(first, last):
        k, s, time = rows.slot[row], rows.sensor[row], rows.time[row]
        z0, z1, height = rows.z[row, 0], rows.z[row, 1], rows.height[row]
        if k < 0 or is_bearing(rows.kind[row]):
            continue
        if not (abs(time) < VALUE_MAX and abs(z0) < VALUE_MAX and abs(z1) < VALUE_MAX):
            continue
        before = trust.state[k]
        after, offset = before, 0.0
        if watch.own[s] == 0:
            take_plot(k, s, time, z0, z1, height, track_ids[row], model, watch, trust)
        else:
            after, aside, offset = take_report(
                k, s, time, z0, z1, height, track_ids[row], model, bias, bias_covariance, watch,
                trust,
            )  # fmt: skip
            if aside:
                rows.slot[row] = IMPLAUSIBLE_SLOT
        flagged[row] = after in (DISTRUSTED, GHOST)
        if after != before:
            return row, k, after, offset
    return last, -1, TRUSTED, 0.0


@loop
def claim(
    first: int,
    last: int,
    rows: Rows,
    addresses: Integers,
    watch: Watch,
    roster: Roster,
    life: Lifecycle,
    identities: RowIdentities,
) -> None:
    """Give reports far from the aircraft of their address back to it where others measure it.

    They begin no track of their own: it would be one more with each that is contradicted.
    """
    for row in range(first, last):
        if identities.slot[row] == NEW_TRACK and watch.own[rows.sensor[row]] != 0:
            k = look_up(roster.address_keys, roster.address_slots, addresses[row])
            if k >= 0:
                for s in range(watch.kind.shape[0]):
                    silent = rows.time[row] - life.heard[k, s]
                    if watch.own[s] == 0 and silent <= watch.support_s:
                        identities.slot[row] = k


@in_loop
def take_plot(
    k: int, s: int, time: float, z0: float, z1: float, height: float, track: int, model: Model,
    watch: Watch, trust: Trust,
) -> None:  # fmt: skip
    """Keep a plot until the next report, and note what its radar sees."""
    watch.alive[s] = time
    if watch.kind[s] == KIND_RADAR and z0 > 0.0:
        watch.farthest[s] = max(watch.farthest[s], z0)
        if abs(height) < HEIGHT_MAX:
            sector = sector_of(z1)
            sine = sine_of_elevation(height - model.noises[s, 3], z0)
            watch.lowest[s, sector] = min(watch.lowest[s, sector], sine)
    if trust.owner[k] == track:
        trust.seen[k] = time
        for other in range(watch.kind.shape[0]):
            trust.unseen[k, other] = np.nan
        at = min(trust.waiting[k, s], WAITING_MAX - 1)
        trust.plot[k, s, at, PLOT_TIME] = time
        trust.plot[k, s, at, PLOT_Z0] = z0
        trust.plot[k, s, at, PLOT_Z1] = z1
        trust.plot[k, s, at, PLOT_HEIGHT] = height
        trust.waiting[k, s] = at + 1


@in_loop
def take_report(
    k: int, s: int, time: float, east: float, north: float, height: float, track: int,
    model: Model, bias: Floats, bias_covariance: Floats, watch: Watch, trust: Trust,
) -> tuple[int, bool, float]:  # fmt: skip
    """Return the state after a report, whether it is set aside, and how far, m, it is off."""
    if trust.owner[k] != track:
        begin(k, track, trust)
    sigma = math.sqrt(model.noises[s, 2])
    state = trust.state[k]
    supported = time - trust.seen[k] <= watch.support_s
    elapsed = time - trust.report[k, TIME]
    passed = time - trust.other[k, TIME]
    jumped = elapsed <= REPORT_GAP_S and breaks_off(k, elapsed, east, north, sigma, trust)
    compared = 0
    offset = 0.0
    broke = False
    if jumped:
        beside = math.hypot(east - trust.other[k, EAST], north - trust.other[k, NORTH])
        trust.strays[k] += 1.0
        trust.agreements[k] = 0
        if (
            REPORT_STEP_S <= passed <= REPORT_GAP_S
            and beside <= JUMP_SIGMAS * sigma + SPEED_MAX * passed
        ):
            broke = True
            forget_verdicts(k, trust)
            compared, offset = compare_all(
                k, time, east, north, height, sigma, trust.other, model, bias, bias_covariance,
                watch, trust,
            )  # fmt: skip
            go_on(k, time, east, north, trust.other, trust)
        elif not passed < REPORT_STEP_S:
            trust.other[k, TIME], trust.other[k, EAST], trust.other[k, NORTH] = time, east, north
    elif not elapsed < REPORT_STEP_S:
        trust.strays[k] = max(0.0, trust.strays[k] - STRAY_FADES)
        if elapsed <= REPORT_GAP_S:
            compared, offset = compare_all(
                k, time, east, north, height, sigma, trust.report, model, bias, bias_covariance,
                watch, trust,
            )  # fmt: skip
        go_on(k, time, east, north, trust.report, trust)
    after = state
    if broke and supported and state in (TRUSTED, GHOST):
        after = SUSPECT
    if compared > 0 or after == SUSPECT or trust.strays[k] >= STRAYS_MAX:
        against, backed = vote(k, time, model.site_numbers, watch, trust)
        elsewhere, by = common_offset(k, time, model.site_numbers, watch, trust)
        if elsewhere:
            against, backed, offset = True, False, max(offset, by)
        against = against or (supported and trust.strays[k] >= STRAYS_MAX)
        after = next_state(k, after, against, backed, compared, trust)
        late = state == SUSPECT and time - trust.since[k] > watch.suspect_s
        if after == SUSPECT and (late or not supported):
            after = TRUSTED
    young = after == TRUSTED and trust.hits[k] < HITS_MIN
    if young and is_ghost(k, time, east, north, height, model, watch, trust):
        after = GHOST
    aside = after in (SUSPECT, DISTRUSTED) or (jumped and supported and not broke)
    return after, aside, offset


@in_loop
def next_state(k: int, state: int, against: bool, backed: bool, compared: int, trust: Trust) -> int:
    """Return the state after a vote; `backed` says whether more places agree than contradict."""
    after = state
    if state == DISTRUSTED:
        trust.agreements[k] = 0 if against else trust.agreements[k] + compared
        if trust.agreements[k] >= AGREEMENTS_MIN:
            after = TRUSTED
    elif against:
        after = DISTRUSTED
        trust.agreements[k] = 0
    elif (backed and state == SUSPECT) or (trust.hits[k] >= HITS_MIN and state == GHOST):
        after = TRUSTED
    return after


@in_loop
def begin(k: int, track: int, trust: Trust) -> None:
    """Open the books of an aircraft of which a first report came."""
    trust.owner[k] = track
    trust.state[k] = TRUSTED
    trust.since[k] = -np.inf
    trust.report[k, TIME] = -np.inf
    trust.other[k, TIME] = np.nan
    trust.strays[k] = 0.0
    trust.bent[k] = 0.0
    trust.seen[k] = -np.inf
    trust.hits[k] = 0
    trust.agreements[k] = 0
    forget_verdicts(k, trust)
    for s in range(trust.waiting.shape[1]):
        trust.waiting[k, s] = 0
        trust.unseen[k, s] = np.nan


@in_loop
def forget_verdicts(k: int, trust: Trust) -> None:
    """Forget what was said of reports that others followed without going on from them."""
    for s in range(trust.waiting.shape[1]):
        trust.tests[k, s] = 0
        trust.odd[k, s] = 0
        trust.runs[k, s] = 0
        trust.verdict[k, s] = 0
        trust.judged[k, s] = -np.inf


@in_loop
def breaks_off(
    k: int, elapsed: float, east: float, north: float, sigma: float, trust: Trust
) -> bool:
    """Return whether no aircraft could fly from the last reports to this one."""
    report = trust.report
    east_rate, north_rate = report[k, EAST_RATE], report[k, NORTH_RATE]
    most = JUMP_SIGMAS * sigma + 0.5 * JUMP_ACCELERATION * elapsed * elapsed
    if np.isnan(east_rate):
        east_rate, north_rate = 0.0, 0.0
        most = JUMP_SIGMAS * sigma + SPEED_MAX * elapsed
    d0 = east - report[k, EAST] - elapsed * east_rate
    d1 = north - report[k, NORTH] - elapsed * north_rate
    flown = math.hypot(east - report[k, EAST], north - report[k, NORTH])
    usual = elapsed >= SLOW_REPORTS_S and flown <= USUAL_SPEED * elapsed
    return d0 * d0 + d1 * d1 > most * most and not usual


@in_loop
def go_on(k: int, time: float, east: float, north: float, base: Floats, trust: Trust) -> None:
    """Make a report the last one; `base` holds the one that it goes on from."""
    report = trust.report
    elapsed = time - base[k, TIME]
    e = (east - base[k, EAST]) / elapsed
    n = (north - base[k, NORTH]) / elapsed
    known = not (np.isnan(report[k, EAST_RATE]) or np.isnan(base[k, EAST_RATE]))
    if known:
        gain = min(RATE_GAIN + RATE_GAIN_PER_S * elapsed, 1.0)
        e = report[k, EAST_RATE] + gain * (e - report[k, EAST_RATE])
        n = report[k, NORTH_RATE] + gain * (n - report[k, NORTH_RATE])
    # Nothing is known of the motion over a gap.
    joined = elapsed <= REPORT_GAP_S
    report[k, EAST_RATE] = e if joined else np.nan
    report[k, NORTH_RATE] = n if joined else np.nan
    report[k, TIME], report[k, EAST], report[k, NORTH] = time, east, north
    trust.other[k, TIME] = np.nan
    for s in range(trust.waiting.shape[1]):
        trust.waiting[k, s] = 0
