"""Compiled association: candidate tracks of plots, and their likelihood ratios.

Symbols beside those of `filters.two_stage._two_stage_kernels`: χ = a + V ς̂ = state of a track, M =
position variance (m²) of a manoeuvre that begins now, λ = clutter density.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._delay_kernels import add_delay_columns, measures_delay
from multiradar.estimation.filters._kernels import (
    ACCELERATION_DENSITY,
    UPDATED,
    manoeuvre_factor,
)
from multiradar.estimation.filters.arrays import DELAY_MEAN, Aircraft, Model, Rows
from multiradar.estimation.filters.height._height_kernels import check_height
from multiradar.estimation.filters.two_stage._information_kernels import spread_of_biases
from multiradar.estimation.measurement._kernels import (
    Slope,
    bias_column,
    expected_measurement,
    is_bearing,
    measures_azimuth,
)
from multiradar.geodesy._kernels import (
    wrap_angle,
)
from multiradar.tracking._identity_kernels import differ
from multiradar.tracking.association._clutter_kernels import log_density_of_clutter
from multiradar.tracking.association._grid_kernels import (
    CELL_M,
    FAR_CELL_M,
    FAR_M,
    bucket_of,
    locate_plot,
    velocity_error,
)
from multiradar.tracking.association._pair_term_kernels import (
    height_apart,
    height_to_locate,
    log_of_status,
    log_scan_phase,
    paired_height,
)
from multiradar.tracking.association._young_kernels import (
    is_young,
    log_of_speed,
    log_reinitialised,
    slack_of,
)
from multiradar.tracking.association.track_grid import (
    CANDIDATES_MAX,
    MANOEUVRE,
    SPEED_MAX,
    BiasScratch,
    Candidates,
    Gating,
    PlotPosition,
    TrackGrid,
)
from multiradar.tracking.lifecycle.lifecycle import TENTATIVE, Lifecycle
from multiradar.tracking.roster import MISSING, ReportedIdentities, Roster, RowIdentities
from multiradar_compiled.kernels import fetch_ahead, in_loop, inner_loop, kernel
from multiradar_compiled.lane_kernels import LANES, load_lanes, store_row

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


# Logarithms of the fractions of detections on the predicted path, in a manoeuvre, and with a
# velocity that is of little use.
LOG_STRAIGHT = math.log(0.88)
LOG_MANOEUVRING = math.log(0.1)
LOG_VELOCITY_WRONG = math.log(0.02)
# Up to this normalised innovation squared straight flight is always the likeliest.
STRAIGHT_NIS = 4.0
# Fraction of a variance that is neglected.
NEGLIGIBLE = 0.02
LOG_TWO_PI = math.log(2.0 * math.pi)

# Probability of detection. An aircraft that was missed for some scans has more likely left the
# coverage. The number of scans is limited, as radars also fail together.
LOG_DETECTED = math.log(0.9)
LOG_UNSEEN = math.log(0.4)
UNSEEN_SCANS_MAX = 10.0

# Identity as evidence: logarithms of likelihood ratios.
ADDRESS_EQUAL = 12.0
ADDRESS_DIFFERENT = -10.0
CODE_EQUAL = 4.5
CODE_DIFFERENT = -4.0
# Height: rate of change, m/s (1 sigma), resolution, m, and range of heights, m. Most aircraft fly
# level: this fraction continues level, the others climb or descend.
CLIMB_SIGMA = 12.0
HEIGHT_SIGMA = 40.0
LEVEL_SIGMA = 1.0
LEVEL_PART = 0.7
LOG_HEIGHT_SPAN = math.log(10_000.0)
HEIGHT_DIFFERENT = -7.0
# The second plot of a track is searched within the maximum speed, plus at most this for the errors
# of both plots.
START_ERROR_M = 3_000.0
# Scores of tracks with one and with two measurements.
LOG_NEW = -3.0
LOG_YOUNG = -1.5


@in_loop
def log_density(s00: float, s01: float, s11: float, e0: float, e1: float) -> float:
    """Return log N(e; 0, S) with two components; −∞ where S is not positive definite."""
    det = s00 * s11 - s01 * s01
    nis = (s11 * e0 * e0 - 2.0 * s01 * e0 * e1 + s00 * e1 * e1) / det
    value = -0.5 * (nis + math.log(max(det, 1e-300))) - LOG_TWO_PI
    return value if det > 0.0 else -np.inf


@in_loop
def pair_score(
    row: int,
    k: int,
    ahead: float,
    period: float,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    grid: TrackGrid,
    rules: Floats,
    log_clutter: float,
    scratch: BiasScratch,
) -> float:
    """Return the log likelihood ratio of a plot and a track by position alone."""
    sigmas, U, R = scratch.sigmas, scratch.U, scratch.R
    n = aircraft.sensitivity.shape[2]
    kind, s, time = rows.kind[row], rows.sensor[row], rows.time[row]
    seen = rows.seen[row]
    site, noise, bias = model.sites[seen], model.noises[seen], model.bias
    dt = max(time - aircraft.time[k], 0.0)
    # Without a received height the position depends on the assumed height.
    source, measured = paired_height(row, k, rows, noise[3], aircraft)
    _, height, variance = check_height(
        UPDATED, source, measured, s, time, dt, k, aircraft.height, aircraft.vertical, model.options
    )
    x0 = grid.state[k, 0] + ahead * grid.state[k, 2]
    x1 = grid.state[k, 1] + ahead * grid.state[k, 3]
    p0, p1, _, h, w = expected_measurement(kind, model.plane, site, noise, x0, x1, height, variance)
    e0 = rows.z[row, 0] - p0
    e1 = rows.z[row, 1] - p1
    if measures_azimuth(kind):
        e1 = wrap_angle(e1)
    P = aircraft.covariance
    V = aircraft.sensitivity
    density = model.options[ACCELERATION_DENSITY] * manoeuvre_factor(
        aircraft.fading_nis[k], model.options
    )
    q = density * dt * dt * dt / 3.0
    p00 = P[k, 0] + dt * (2.0 * P[k, 2] + dt * P[k, 7]) + q
    p01 = P[k, 1] + dt * (P[k, 3] + P[k, 5] + dt * P[k, 8])
    p11 = P[k, 4] + dt * (2.0 * P[k, 6] + dt * P[k, 9]) + q
    g0 = p00 * h[0] + p01 * h[1]
    g1 = p01 * h[0] + p11 * h[1]
    g2 = p00 * h[2] + p01 * h[3]
    g3 = p01 * h[2] + p11 * h[3]
    s00 = w[0] + h[0] * g0 + h[1] * g1
    s01 = w[1] + h[0] * g2 + h[1] * g3
    s11 = w[2] + h[2] * g2 + h[3] * g3
    # Uncertainty of the biases: those of the track, and those of this sensor.
    for c in range(n, bias.shape[0]):
        U[0, c] = 0.0
        U[1, c] = 0.0
    for c in range(0, n, LANES):
        project_columns(c, min(LANES, n - c), k, dt, h, V, U)
    rate0 = h[0] * grid.state[k, 2] + h[1] * grid.state[k, 3]
    rate1 = h[2] * grid.state[k, 2] + h[3] * grid.state[k, 3]
    for c in range(model.starts[seen], model.starts[seen + 1]):
        j0, j1 = bias_column(kind, model.parameters[c], site, p0, p1, rate0, rate1)
        U[0, c] += j0
        U[1, c] += j1
        e0 -= j0 * bias[c]
        e1 -= j1 * bias[c]
    if aircraft.delay.shape[1] > 0 and measures_delay(kind, s, model):
        e0 -= aircraft.delay[k, DELAY_MEAN] + add_delay_columns(k, aircraft.delay, bias, U)
    most0 = 0.0
    most1 = 0.0
    for c in range(bias.shape[0]):
        most0 += abs(U[0, c]) * sigmas[c]
        most1 += abs(U[1, c]) * sigmas[c]
    # Well-known biases are neglected.
    if not (most0 * most0 < NEGLIGIBLE * s00 and most1 * most1 < NEGLIGIBLE * s11):
        b00, b01, b11 = spread_of_biases(U, model.bias_covariance, R)
        s00 += b00
        s01 += b01
        s11 += b11
    best = LOG_STRAIGHT + log_density(s00, s01, s11, e0, e1)
    if not s11 * e0 * e0 - 2.0 * s01 * e0 * e1 + s00 * e1 * e1 <= STRAIGHT_NIS * (
        s00 * s11 - s01 * s01
    ):
        silent = max(time - aircraft.updated[k], period)
        best = max(
            best, log_density_manoeuvring(s00, s01, s11, e0, e1, h, dt, silent, period, rules)
        )
    return best + LOG_DETECTED - log_clutter


@in_loop
def project_columns(c: int, lanes: int, k: int, dt: float, h: Slope, V: Floats, U: Floats) -> None:
    """Set U, columns from c on, to H V of track k predicted by dt."""
    v0 = load_lanes(V, k, 0, c, lanes) + dt * load_lanes(V, k, 2, c, lanes)
    v1 = load_lanes(V, k, 1, c, lanes) + dt * load_lanes(V, k, 3, c, lanes)
    store_row(U, 0, c, lanes, h[0] * v0 + h[1] * v1)
    store_row(U, 1, c, lanes, h[2] * v0 + h[3] * v1)


@in_loop
def log_density_manoeuvring(
    s00: float, s01: float, s11: float, e0: float, e1: float, h: Slope, dt: float, silent: float,
    period: float, rules: Floats,
) -> float:  # fmt: skip
    """Return the log likelihood of an aircraft that does not fly straight."""
    manoeuvre = rules[MANOEUVRE] * 0.5 * dt * dt
    m00 = h[0] * h[0] + h[1] * h[1]
    m01 = h[0] * h[2] + h[1] * h[3]
    m11 = h[2] * h[2] + h[3] * h[3]
    m = manoeuvre * manoeuvre
    turning = LOG_MANOEUVRING + log_density(s00 + m * m00, s01 + m * m01, s11 + m * m11, e0, e1)
    # The filter lag behind a manoeuvre lasts about one scan, however recent the last plot.
    drift = velocity_error(silent, period, rules) * silent
    m = drift * drift
    lost = LOG_VELOCITY_WRONG + log_density(s00 + m * m00, s01 + m * m01, s11 + m * m11, e0, e1)
    return max(turning, lost)


@in_loop
def log_of_height(off: float, dt: float) -> float:
    """Return the log density, 1/m, of a height difference after dt."""
    level, climbing = HEIGHT_SIGMA + LEVEL_SIGMA * dt, HEIGHT_SIGMA + CLIMB_SIGMA * dt
    density = LEVEL_PART / level * math.exp(-0.5 * (off / level) ** 2)
    density += (1.0 - LEVEL_PART) / climbing * math.exp(-0.5 * (off / climbing) ** 2)
    return math.log(max(density, 1e-300)) - 0.5 * LOG_TWO_PI


@in_loop
def identity_score(
    row: int, k: int, dt: float, reported: ReportedIdentities, rows: Rows, aircraft: Aircraft,
    roster: Roster, life: Lifecycle,
) -> float:  # fmt: skip
    """Return the score of identity, height and missed scans; −∞ for contradicting identities.

    An address that a track has received once may be garbled: it is evidence only.
    """
    number, address = reported.track_number[row], reported.mode_s_address[row]
    code = reported.mode_3a[row]
    score = 0.0
    known_address = max(roster.mode_s_address[k], life.pending_address[k])
    if address >= 0 and known_address >= 0:
        score += ADDRESS_EQUAL if known_address == address else ADDRESS_DIFFERENT
    if code >= 0 and roster.mode_3a[k] >= 0:
        same = code in (roster.mode_3a[k], life.pending_code[k])
        score += CODE_EQUAL if same else CODE_DIFFERENT
    known = aircraft.height[k]
    measured = rows.height[row]
    if not (np.isnan(known) or np.isnan(measured)):
        value = log_of_height(height_apart(k, measured, aircraft), dt)
        score += max(LOG_HEIGHT_SPAN + value, HEIGHT_DIFFERENT)
    score += log_of_status(rows.ground[row], aircraft.on_ground[k])
    if life.stage[k] == TENTATIVE:
        score += LOG_NEW if life.hits[k] == 1 else (LOG_YOUNG if life.hits[k] == 2 else 0.0)
    if life.period[k] > 0.0:
        unseen = max(dt / life.period[k] - 1.0, 0.0)
        score += min(unseen, UNSEEN_SCANS_MAX) * LOG_UNSEEN
    another = differ(roster.track_number[k], number) or differ(roster.mode_s_address[k], address)
    if another:
        score = -np.inf
    return score


@kernel
def find_candidates(
    first: int,
    last: int,
    window_time: float,
    reported: ReportedIdentities,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    roster: Roster,
    life: Lifecycle,
    gating: Gating,
    grid: TrackGrid,
    identities: RowIdentities,
    candidates: Candidates,
) -> None:
    """Fill the candidates of rows first…last without an aircraft."""
    n = model.bias.shape[0]
    sigmas = np.sqrt(np.diag(model.bias_covariance))
    search(
        first, last, window_time, reported, rows, model, aircraft, roster, life, gating, grid,
        identities, candidates, BiasScratch(sigmas, np.empty((2, n)), np.empty((2, n))),
        np.empty((2, grid.reach.shape[0]), np.int64),
    )  # fmt: skip


@inner_loop
def search(
    first: int,
    last: int,
    window_time: float,
    reported: ReportedIdentities,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    roster: Roster,
    life: Lifecycle,
    gating: Gating,
    grid: TrackGrid,
    identities: RowIdentities,
    candidates: Candidates,
    scratch: BiasScratch,
    found: Integers,
) -> None:
    """As `find_candidates`, with given scratch arrays.

    ``found`` holds the tracks near two plots: while those of
    one plot are scored, the data of those near the next are prefetched.
    """
    near, side = MISSING, 0
    for row in range(first, last + 1):
        coming = MISSING
        if row < last:
            candidates.number[row - first] = MISSING
            if identities.slot[row] == MISSING and not is_bearing(rows.kind[row]):
                coming = find_near(
                    row, row - first, window_time, 1 - side, rows, model, aircraft, life, grid,
                    scratch.sigmas, candidates, found,
                )  # fmt: skip
        for number in range(near):
            consider(
                row - 1, row - 1 - first, found[side, number], window_time, reported, rows, model,
                aircraft, roster, life, gating, grid, scratch, candidates,
            )  # fmt: skip
        near, side = coming, 1 - side


@in_loop
def find_near(
    row: int, i: int, window_time: float, side: int, rows: Rows, model: Model, aircraft: Aircraft,
    life: Lifecycle, grid: TrackGrid, sigmas: Floats, candidates: Candidates, found: Integers,
) -> int:  # fmt: skip
    """Write the tracks near a plot to a row of ``found``; return how many, `MISSING` off the plane.

    The position of the plot is stored in its candidates, which are still empty.
    """
    near = MISSING
    kind, s, z0, z1 = rows.kind[row], rows.sensor[row], rows.z[row, 0], rows.z[row, 1]
    height = height_to_locate(row, rows, model)
    ok, east, north, reach = locate_plot(kind, s, z0, z1, height, model, sigmas)
    if ok:
        near = 0
        candidates.number[i] = 0
        candidates.position[i, 0] = east
        candidates.position[i, 1] = north
        candidates.position[i, 2] = reach
        mask = grid.heads.shape[0] - 1
        ahead = rows.time[row] - window_time
        for far in range(2):
            if grid.longest[far] < 0.0:
                continue
            cell = FAR_CELL_M if far else CELL_M
            wide = math.sqrt(reach * reach + grid.longest[far] * grid.longest[far])
            for ce in range(
                int(np.floor((east - wide) / cell)), int(np.floor((east + wide) / cell)) + 1
            ):
                for cn in range(
                    int(np.floor((north - wide) / cell)), int(np.floor((north + wide) / cell)) + 1
                ):
                    bucket = bucket_of(ce, cn, mask)
                    k = grid.far_heads[bucket] if far else grid.heads[bucket]
                    while k != MISSING:
                        following = grid.far_following[k] if far else grid.following[k]
                        if following != MISSING:
                            fetch_ahead(grid.state, following, 0)
                        d0 = grid.state[k, 0] + ahead * grid.state[k, 2] - east
                        d1 = grid.state[k, 1] + ahead * grid.state[k, 3] - north
                        if (
                            d0 * d0 + d1 * d1 <= reach * reach + grid.state[k, 4] * grid.state[k, 4]
                            and (grid.state[k, 4] > FAR_M) == (far == 1)
                            and int(np.floor(grid.state[k, 0] / cell)) == ce
                            and int(np.floor(grid.state[k, 1] / cell)) == cn
                        ):
                            found[side, near] = k
                            near += 1
                            fetch_track(k, aircraft, life)
                        k = following
    return near


@in_loop
def consider(
    row: int, i: int, k: int, window_time: float, reported: ReportedIdentities, rows: Rows,
    model: Model, aircraft: Aircraft, roster: Roster, life: Lifecycle, gating: Gating,
    grid: TrackGrid, scratch: BiasScratch, candidates: Candidates,
) -> None:  # fmt: skip
    """Make a track near a plot a candidate, if their score is positive.

    A radar detects an aircraft at most once in half a scan.
    """
    s, time = rows.sensor[row], rows.time[row]
    if not time - life.last_seen[k, s] < 0.5 * gating.periods[s]:
        ahead = time - window_time
        east, north = candidates.position[i, 0], candidates.position[i, 1]
        d0 = grid.state[k, 0] + ahead * grid.state[k, 2] - east
        d1 = grid.state[k, 1] + ahead * grid.state[k, 3] - north
        log_clutter = log_density_of_clutter(rows.kind[row], s, rows.z[row, 0], gating.log_clutters)
        position = PlotPosition(
            math.sqrt(d0 * d0 + d1 * d1), east, north, candidates.position[i, 2]
        )
        score, reinitialised = association_score(
            row, k, ahead, position, gating.periods[s], reported, rows, model, aircraft, roster,
            life, grid, gating.rules, log_clutter, scratch,
        )  # fmt: skip
        if score > 0.0:
            keep(i, k, score, reinitialised, candidates)


@in_loop
def fetch_track(k: int, aircraft: Aircraft, life: Lifecycle) -> None:
    """Prefetch the data of a track."""
    fetch_ahead(life.last_seen, k, 0)
    fetch_ahead(aircraft.vertical, k, 0)
    fetch_ahead(aircraft.covariance, k, 0)
    fetch_ahead(aircraft.covariance, k, 1)
    fetch_ahead(aircraft.time, k, 0)
    fetch_ahead(aircraft.height, k, 0)
    fetch_ahead(aircraft.fading_nis, k, 0)
    for line in range((4 * aircraft.sensitivity.shape[2] + 7) // 8):
        fetch_ahead(aircraft.sensitivity, k, line)


@in_loop
def association_score(
    row: int, k: int, ahead: float, position: PlotPosition, period: float,
    reported: ReportedIdentities, rows: Rows, model: Model, aircraft: Aircraft, roster: Roster,
    life: Lifecycle, grid: TrackGrid, rules: Floats, log_clutter: float, scratch: BiasScratch,
) -> tuple[float, bool]:  # fmt: skip
    """Return the score of a pair, −∞ if impossible, and whether the track is reinitialised."""
    dt = rows.time[row] - aircraft.time[k]
    score = -np.inf
    flown = position.distance
    if aircraft.updates[k] == 1:
        flown -= min(slack_of(k, position.reach, grid), START_ERROR_M)
    if aircraft.updates[k] > 1 or flown <= rules[SPEED_MAX] * dt:
        score = identity_score(row, k, max(dt, 0.0), reported, rows, aircraft, roster, life)
        score += log_scan_phase(rows.time[row] - life.last_seen[k, rows.sensor[row]], period)
    reinitialised = -np.inf
    if score > -np.inf and is_young(k, life):
        if aircraft.updates[k] > 1:
            reinitialised = score + LOG_DETECTED + log_reinitialised(
                row, k, ahead, position, rows, aircraft, grid, log_clutter
            )  # fmt: skip
        else:
            score += log_of_speed(flown, dt)
    if score > -np.inf:
        score += pair_score(
            row, k, ahead, life.period[k], rows, model, aircraft, grid, rules, log_clutter, scratch
        )
    return max(score, reinitialised), reinitialised > score


@in_loop
def keep(i: int, k: int, score: float, reinitialised: bool, candidates: Candidates) -> None:
    """Insert a candidate by score; beyond `CANDIDATES_MAX` the least likely is dropped."""
    count = candidates.number[i]
    full = count == CANDIDATES_MAX
    if not full or score > candidates.score[i, count - 1]:
        at = count - full
        candidates.number[i] = at + 1
        while at > 0 and (
            candidates.score[i, at - 1] < score
            or (candidates.score[i, at - 1] == score and candidates.slot[i, at - 1] > k)
        ):
            candidates.score[i, at] = candidates.score[i, at - 1]
            candidates.slot[i, at] = candidates.slot[i, at - 1]
            candidates.reinitialised[i, at] = candidates.reinitialised[i, at - 1]
            at -= 1
        candidates.score[i, at] = score
        candidates.reinitialised[i, at] = reinitialised
        candidates.slot[i, at] = k
