"""Compiled plausibility checks of ADS-B reports, and the resulting integrity states.

References
----------
The project's own. The comparison itself is in `_comparison_kernels`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import HEIGHT_MAX, IMPLAUSIBLE_SLOT, VALUE_MAX
from multiradar.estimation.filters.arrays import Model, Rows
from multiradar.estimation.measurement._kernels import is_bearing
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.tracking._identity_kernels import look_up
from multiradar.tracking.lifecycle.lifecycle import Lifecycle
from multiradar.tracking.lifecycle.report_integrity import (
    EAST,
    EAST_RATE,
    GHOST,
    IMPLAUSIBLE,
    NORTH,
    NORTH_RATE,
    PLAUSIBLE,
    PLOT_HEIGHT,
    PLOT_TIME,
    PLOT_VARIANCE,
    PLOT_Z0,
    PLOT_Z1,
    SIGMA,
    SUSPECT,
    TIME,
    WAITING_MAX,
    ReportIntegrity,
    Watch,
)
from multiradar.tracking.plausibility._comparison_kernels import common_offset, compare_all, vote
from multiradar.tracking.plausibility._coverage_kernels import (
    is_ghost,
    sector_of,
    sine_of_elevation,
)
from multiradar.tracking.roster import NEW_TRACK, Roster, RowIdentities
from multiradar_compiled.kernels import fetch_ahead, in_loop, loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Maximum time between two reports for interpolation, s.
REPORT_GAP_S = 20.0
# Minimum time between two reports for a comparison, s.
REPORT_STEP_S = 0.3
# Maximum deviation of a report from the extrapolation of the last ones, in sigmas and by an
# acceleration, m/s²; maximum speed, m/s.
JUMP_SIGMAS = 8.0
JUMP_ACCELERATION = 60.0
SPEED_MAX = 700.0
# Time after which the rates are of little use, s; then a usual speed, m/s, is accepted.
SLOW_REPORTS_S = 5.0
USUAL_SPEED = 300.0
# Weight of the newest report in the rates: constant, and per second since the last one.
RATE_GAIN = 0.2
RATE_GAIN_PER_S = 0.2
# Number of consecutive agreements that restore plausibility, and of agreements that exclude a
# ghost.
AGREEMENTS_MIN = 6
HITS_MIN = 3
# Number of inconsistent reports that suffice, and its decrease with each consistent one.
INCONSISTENCIES_MAX = 4.0
INCONSISTENCY_DECAY = 0.5
# Number of rows by which the aircraft of a row is prefetched.
ROWS_AHEAD = 4


@loop
def check_rows(
    first: int,
    last: int,
    rows: Rows,
    track_ids: Integers,
    watch: Watch,
    model: Model,
    bias: Floats,
    bias_covariance: Floats,
    integrity: ReportIntegrity,
    flagged: Integers,
) -> tuple[int, int, int, float]:
    """Check rows until the integrity state of an aircraft changes.

    Returns that row, the slot of the aircraft, its new state, which is not yet set, and the offset
    of its reports, m; without a change the last row, and −1 for the slot.
    """
    for row in range(first, last):
        if row + ROWS_AHEAD < last:
            fetch_integrity(rows.slot[row + ROWS_AHEAD], integrity)
        k, s, q, time = rows.slot[row], rows.sensor[row], rows.seen[row], rows.time[row]
        z0, z1, height = rows.z[row, 0], rows.z[row, 1], rows.height[row]
        if k < 0 or is_bearing(rows.kind[row]):
            continue
        if not (abs(time) < VALUE_MAX and abs(z0) < VALUE_MAX and abs(z1) < VALUE_MAX):
            continue
        before = integrity.state[k]
        after, offset = before, 0.0
        if watch.self_reported[s] == 0:
            record_plot(k, s, q, time, z0, z1, height, track_ids[row], model, watch, integrity)
        else:
            after, aside, offset = check_report(
                k, q, time, z0, z1, height, track_ids[row], model, bias, bias_covariance, watch,
                integrity,
            )  # fmt: skip
            if aside:
                rows.slot[row] = IMPLAUSIBLE_SLOT
        flagged[row] = after in (IMPLAUSIBLE, GHOST)
        if after != before:
            return row, k, after, offset
    return last, -1, PLAUSIBLE, 0.0


@loop
def reassign_reports(
    first: int,
    last: int,
    rows: Rows,
    addresses: Integers,
    watch: Watch,
    roster: Roster,
    life: Lifecycle,
    identities: RowIdentities,
) -> None:
    """Reassign reports far from the aircraft with their address to it if other sensors see it.

    They initiate no track: every contradicted report would add one.
    """
    for row in range(first, last):
        if identities.slot[row] == NEW_TRACK and watch.self_reported[rows.sensor[row]] != 0:
            k = look_up(roster.address_keys, roster.address_slots, addresses[row])
            if k >= 0:
                for s in range(watch.kind.shape[0]):
                    silent = rows.time[row] - life.last_seen[k, s]
                    if watch.self_reported[s] == 0 and silent <= watch.support_s:
                        identities.slot[row] = k


@in_loop
def fetch_integrity(k: int, integrity: ReportIntegrity) -> None:
    """Prefetch what each row reads or resets of an aircraft: a number of each sensor."""
    if k >= 0:
        fetch_ahead(integrity.owner, k, 0)
        fetch_ahead(integrity.seen, k, 0)
        fetch_ahead(integrity.report, k, 0)
        fetch_ahead(integrity.other, k, 0)
        for line in range((integrity.waiting.shape[1] + 7) // 8):
            fetch_ahead(integrity.waiting, k, line)
            fetch_ahead(integrity.unseen, k, line)


@in_loop
def record_plot(
    k: int, s: int, q: int, time: float, z0: float, z1: float, height: float, track: int,
    model: Model, watch: Watch, integrity: ReportIntegrity,
) -> None:  # fmt: skip
    """Store a plot until the next report, and update the coverage of its radar.

    ``q`` is `Rows.seen`: a position may have its own accuracy.
    """
    watch.alive[s] = time
    if watch.kind[s] == KIND_RADAR and z0 > 0.0:
        watch.farthest[s] = max(watch.farthest[s], z0)
        if abs(height) < HEIGHT_MAX:
            sector = sector_of(z1)
            sine = sine_of_elevation(height - model.noises[s, 3], z0)
            watch.lowest[s, sector] = min(watch.lowest[s, sector], sine)
    if integrity.owner[k] == track:
        integrity.seen[k] = time
        for other in range(watch.kind.shape[0]):
            integrity.unseen[k, other] = np.nan
        at = min(integrity.waiting[k, s], WAITING_MAX - 1)
        integrity.plot[k, s, at, PLOT_TIME] = time
        integrity.plot[k, s, at, PLOT_Z0] = z0
        integrity.plot[k, s, at, PLOT_Z1] = z1
        integrity.plot[k, s, at, PLOT_HEIGHT] = height
        integrity.plot[k, s, at, PLOT_VARIANCE] = model.noises[q, 2]
        integrity.waiting[k, s] = at + 1


@in_loop
def check_report(
    k: int, q: int, time: float, east: float, north: float, height: float, track: int,
    model: Model, bias: Floats, bias_covariance: Floats, watch: Watch, integrity: ReportIntegrity,
) -> tuple[int, bool, float]:  # fmt: skip
    """Return the state after a report, whether it is rejected, and its offset, m.

    ``q`` is `Rows.seen`: the report may have its own accuracy.
    """
    if integrity.owner[k] != track:
        initialise(k, track, integrity)
    sigma = math.sqrt(model.noises[q, 2])
    state = integrity.state[k]
    supported = time - integrity.seen[k] <= watch.support_s
    elapsed = time - integrity.report[k, TIME]
    passed = time - integrity.other[k, TIME]
    jumped = elapsed <= REPORT_GAP_S and is_jump(k, elapsed, east, north, sigma, integrity)
    compared = 0
    offset = 0.0
    broke = False
    if jumped:
        beside = math.hypot(east - integrity.other[k, EAST], north - integrity.other[k, NORTH])
        integrity.inconsistencies[k] += 1.0
        integrity.agreements[k] = 0
        if (
            REPORT_STEP_S <= passed <= REPORT_GAP_S
            and beside <= JUMP_SIGMAS * max(sigma, integrity.other[k, SIGMA]) + SPEED_MAX * passed
        ):
            broke = True
            reset_comparisons(k, integrity)
            compared, offset = compare_all(
                k, time, east, north, height, sigma, integrity.other, model, bias, bias_covariance,
                watch, integrity,
            )  # fmt: skip
            accept_report(k, time, east, north, sigma, integrity.other, integrity)
        elif not passed < REPORT_STEP_S:
            integrity.other[k, TIME], integrity.other[k, EAST], integrity.other[k, NORTH] = (
                time,
                east,
                north,
            )
            integrity.other[k, SIGMA] = sigma
    elif not elapsed < REPORT_STEP_S:
        integrity.inconsistencies[k] = max(0.0, integrity.inconsistencies[k] - INCONSISTENCY_DECAY)
        if elapsed <= REPORT_GAP_S:
            compared, offset = compare_all(
                k, time, east, north, height, sigma, integrity.report, model, bias, bias_covariance,
                watch, integrity,
            )  # fmt: skip
        accept_report(k, time, east, north, sigma, integrity.report, integrity)
    after = state
    if broke and supported and state in (PLAUSIBLE, GHOST):
        after = SUSPECT
    if compared > 0 or after == SUSPECT or integrity.inconsistencies[k] >= INCONSISTENCIES_MAX:
        against, backed = vote(k, time, model.site_numbers, watch, integrity)
        elsewhere, by = common_offset(k, time, model.site_numbers, watch, integrity)
        if elsewhere:
            against, backed, offset = True, False, max(offset, by)
        against = against or (supported and integrity.inconsistencies[k] >= INCONSISTENCIES_MAX)
        after = next_state(k, after, against, backed, compared, integrity)
        late = state == SUSPECT and time - integrity.since[k] > watch.suspect_s
        if after == SUSPECT and (late or not supported):
            after = PLAUSIBLE
    young = after == PLAUSIBLE and integrity.hits[k] < HITS_MIN
    if young and is_ghost(k, time, east, north, height, model, watch, integrity):
        after = GHOST
    aside = after in (SUSPECT, IMPLAUSIBLE) or (jumped and supported and not broke)
    return after, aside, offset


@in_loop
def next_state(
    k: int, state: int, against: bool, backed: bool, compared: int, integrity: ReportIntegrity
) -> int:
    """Return the state after a vote; `backed` says whether more sites agree than contradict."""
    after = state
    if state == IMPLAUSIBLE:
        integrity.agreements[k] = 0 if against else integrity.agreements[k] + compared
        if integrity.agreements[k] >= AGREEMENTS_MIN:
            after = PLAUSIBLE
    elif against:
        after = IMPLAUSIBLE
        integrity.agreements[k] = 0
    elif (backed and state == SUSPECT) or (integrity.hits[k] >= HITS_MIN and state == GHOST):
        after = PLAUSIBLE
    return after


@in_loop
def initialise(k: int, track: int, integrity: ReportIntegrity) -> None:
    """Initialise the integrity of an aircraft with its first report."""
    integrity.owner[k] = track
    integrity.state[k] = PLAUSIBLE
    integrity.since[k] = -np.inf
    integrity.report[k, TIME] = -np.inf
    integrity.other[k, TIME] = np.nan
    integrity.inconsistencies[k] = 0.0
    integrity.deviation[k] = 0.0
    integrity.seen[k] = -np.inf
    integrity.hits[k] = 0
    integrity.agreements[k] = 0
    reset_comparisons(k, integrity)
    for s in range(integrity.waiting.shape[1]):
        integrity.waiting[k, s] = 0
        integrity.unseen[k, s] = np.nan


@in_loop
def reset_comparisons(k: int, integrity: ReportIntegrity) -> None:
    """Reset the comparisons after a jump of the reports."""
    for s in range(integrity.waiting.shape[1]):
        integrity.tests[k, s] = 0
        integrity.outliers[k, s] = 0
        integrity.contradictions[k, s] = 0
        integrity.agreement[k, s] = 0
        integrity.compared_at[k, s] = -np.inf


@in_loop
def is_jump(
    k: int, elapsed: float, east: float, north: float, sigma: float, integrity: ReportIntegrity
) -> bool:
    """Return whether no aircraft can fly from the last reports to this one."""
    report = integrity.report
    east_rate, north_rate = report[k, EAST_RATE], report[k, NORTH_RATE]
    worse = max(sigma, report[k, SIGMA])
    most = JUMP_SIGMAS * worse + 0.5 * JUMP_ACCELERATION * elapsed * elapsed
    if np.isnan(east_rate):
        east_rate, north_rate = 0.0, 0.0
        most = JUMP_SIGMAS * worse + SPEED_MAX * elapsed
    d0 = east - report[k, EAST] - elapsed * east_rate
    d1 = north - report[k, NORTH] - elapsed * north_rate
    flown = math.hypot(east - report[k, EAST], north - report[k, NORTH])
    usual = elapsed >= SLOW_REPORTS_S and flown <= USUAL_SPEED * elapsed
    return d0 * d0 + d1 * d1 > most * most and not usual


@in_loop
def accept_report(
    k: int, time: float, east: float, north: float, sigma: float, base: Floats,
    integrity: ReportIntegrity,
) -> None:  # fmt: skip
    """Store a report as the last one; `base` holds the one before it."""
    report = integrity.report
    elapsed = time - base[k, TIME]
    e = (east - base[k, EAST]) / elapsed
    n = (north - base[k, NORTH]) / elapsed
    known = not (np.isnan(report[k, EAST_RATE]) or np.isnan(base[k, EAST_RATE]))
    if known:
        gain = min(RATE_GAIN + RATE_GAIN_PER_S * elapsed, 1.0)
        e = report[k, EAST_RATE] + gain * (e - report[k, EAST_RATE])
        n = report[k, NORTH_RATE] + gain * (n - report[k, NORTH_RATE])
    # The motion over a gap is unknown.
    joined = elapsed <= REPORT_GAP_S
    report[k, EAST_RATE] = e if joined else np.nan
    report[k, NORTH_RATE] = n if joined else np.nan
    report[k, TIME], report[k, EAST], report[k, NORTH] = time, east, north
    report[k, SIGMA] = sigma
    integrity.other[k, TIME] = np.nan
    for s in range(integrity.waiting.shape[1]):
        integrity.waiting[k, s] = 0
