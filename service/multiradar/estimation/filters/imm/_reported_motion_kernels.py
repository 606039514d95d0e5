"""Compiled update of interacting modes by what an aircraft reports about its motion.

After its plot, a row may carry the velocity through the air (heading and airspeed), the velocity
over ground (track angle and ground speed) and the acceleration across the velocity (roll, track
angle rate). Velocities update each mode, its slow states and the probabilities of the modes; the
acceleration updates the probabilities only, since it is a parameter of the modes, not a state.
A turn is thus seen in one plot, where positions need several.

Each quantity has a test of its own. The direction and the speed of a velocity are used if the
innovation is below `GATE_SIGMAS` of any mode, so that a turn passes, and a garbled register does
not. The likelihood of an acceleration has a floor, the probability that it is wrong. A report that
repeats the one before, number for number, says nothing new, or is an old one: it is not used. Where
no mode explains the positions, nothing is used, and the slow states are reinitialised.

Symbols: as in `_imm_kernels` and `_slow_state_kernels`; H = [0 I]; d = direction of u.

References
----------
The project's own.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    ALL_BLOCKS,
    MODES_NIS_FLOOR,
    corrected_covariance,
    gain_of,
)
from multiradar.estimation.filters.arrays import Aircraft, BiasSums, Model
from multiradar.estimation.filters.height._height_kernels import RATE
from multiradar.estimation.filters.imm._imm_kernels import (
    mixture_moments,
    shifted,
    updated_probabilities,
)
from multiradar.estimation.filters.imm._mode_column_kernels import combine_columns, correct_columns
from multiradar.estimation.filters.imm._mode_kernels import PROBABILITY_MIN, combine_modes
from multiradar.estimation.filters.imm._mode_scratch_kernels import (
    GAIN,
    LATERAL,
    MODES,
    POSTERIOR,
    PREDICTED,
    TABLE,
    Covariances,
    ModeScratch,
    SlowScratch,
    State,
    evaluate_modes,
    get_row,
    load_modes,
    set_row,
    store_modes,
)
from multiradar.estimation.filters.imm._slow_state_kernels import (
    AGE,
    GROUND,
    LAST,
    LAST_LATERAL,
    NOMINAL_ACCELERATION_MPS2,
    NOMINAL_SPEED_MPS,
    REJECTED_COUNT,
    SCALE,
    SLOWEST_MPS,
    VARIATION,
    WIND,
    absorb_slow_states,
    add_slow_spread,
    correct_slow_states,
    drift_slow_states,
    initialise_slow_states,
    with_shift,
)
from multiradar.estimation.filters.two_stage._information_kernels import spread_of_biases
from multiradar.estimation.measurement.reported_motion import (
    AIRSPEED,
    AIRSPEED_SIGMA_MPS,
    AIRSPEED_VARIANCE,
    GROUND_SPEED,
    HEADING,
    LATERAL_REPORTED,
    LATERAL_VARIANCE,
    TRACK_ANGLE,
)
from multiradar.geodesy._kernels import local_matrix, wrap_angle
from multiradar_compiled.kernels import in_both, in_loop, inner_loop
from multiradar_compiled.lane_function_kernels import exponential
from multiradar_compiled.lane_kernels import (
    Lanes,
    chosen,
    largest_of,
    load_row,
    root,
    store_row,
    sum_of,
)

Floats = NDArray[np.float64]
Pair = tuple[float, float]
# Velocity of each mode compared with a report: e, u, d, variances along and across d.
Seen = tuple[tuple[Lanes, Lanes], Pair, Pair, Pair]

# Sigma of a direction, rad: steps of 0.18°, and sideslip.
DIRECTION_SIGMA_RAD = 0.3 * np.pi / 180.0
# Sigma of reported ground velocities in each direction, and of the effect of gusts, m/s.
GROUND_VELOCITY_SIGMA_MPS = 0.7
GUST_SIGMA_MPS = 1.0
# Sigma of the age of a report about its mean, s: registers are written once or twice a second. In a
# turn the velocity changes meanwhile.
AGE_SIGMA_S = 0.3
# A direction or a speed is used below so many sigmas of any mode.
GATE_SIGMAS = 4.0
# Variance of what is not measured, (m/s)².
UNMEASURED = 1e8
# Headings rejected one after the other until the slow states are reinitialised.
REJECTED_MAX = 4.0
# Sigmas of the acceleration across the velocity about that of the mode, m/s²: half the spacing of
# the modes; small corrections in straight flight.
MANOEUVRE_LATERAL_SIGMA = 0.5
STRAIGHT_LATERAL_SIGMA = 0.3
# Likelihood of any acceleration if the report is wrong: 5 % spread over ± 6 m/s².
WRONG_LIKELIHOOD = 0.05 / 12.0
# Change of a speed that is not reported again, m/s², and the time until it is not used, s.
SPEED_CHANGE_MPS2 = 0.5
SPEED_AGE_MAX_S = 60.0
# Largest acceleration across (50° of bank) and along the velocity between two reports, m/s², and
# the change by noise and gusts, m/s. What exceeds it is wrong.
LATERAL_MAX_MPS2 = 12.0
ACCELERATION_MAX_MPS2 = 3.0
JITTER_MPS = 8.0


@in_loop
def has_motion(motion: Floats, row: int) -> bool:
    """Return whether a row reports a velocity or an acceleration."""
    return not (
        np.isnan(motion[row, HEADING])
        and np.isnan(motion[row, TRACK_ANGLE])
        and np.isnan(motion[row, LATERAL_REPORTED])
    )


@inner_loop
def use_motion(
    k: int, row: int, time: float, motion: Floats, model: Model, aircraft: Aircraft,
    bias_row: Floats, sums: BiasSums, mine: ModeScratch,
) -> None:  # fmt: skip
    """Update aircraft k, already updated by the plot of a row, by what it reports."""
    mode_U, slow, scratch, reported = mine.by_mode, mine.slow, mine.rows, aircraft.reported
    count, probabilities = model.modes.shape[0], aircraft.mode_probability
    if aircraft.fading_nis[k] > model.options[MODES_NIS_FLOOR]:
        # Positions that no mode explains: the reports may be wrong.
        absorb_slow_states(k, count, aircraft)
        return
    if np.isnan(aircraft.slow[k, 0]):
        initialise_slow_states(k, count, time, aircraft)
    if is_repeated(k, row, motion, reported):
        return
    drift_slow_states(k, count, time, aircraft.vertical[k, RATE], aircraft, slow)
    a, P = load_modes(k, count, aircraft.mode_mean, aircraft.mode_covariance)
    x = evaluate_modes(k, count, a, bias_row, aircraft.mode_sensitivity, scratch, ALL_BLOCKS)
    posterior = load_row(probabilities, k, 0, count)
    posterior = weighed_by_acceleration(
        posterior, motion[row, LATERAL_REPORTED], motion[row, LATERAL_VARIANCE], scratch
    )
    if not np.isnan(motion[row, LATERAL_REPORTED]):
        reported[k, LAST_LATERAL] = motion[row, LATERAL_REPORTED]
    for ground in (True, False):
        angle_at, speed_at = (TRACK_ANGLE, GROUND_SPEED) if ground else (HEADING, AIRSPEED)
        angle, speed = motion[row, angle_at], motion[row, speed_at]
        last = LAST + 2 if ground else LAST
        e, u, d, variances = compare_velocity(
            ground, k, angle, speed, motion[row, AIRSPEED_VARIANCE], time, model, aircraft,
            posterior, x, scratch,
        )  # fmt: skip
        if np.isnan(u[0]):
            continue
        # Sensitivities of the velocity to the biases, and to the slow states with J.
        set_row(scratch, PREDICTED, posterior)
        velocity_columns(k, count, scratch, aircraft.mode_sensitivity, mode_U, sums.U)
        velocity_columns(k, count, scratch, aircraft.slow_sensitivity, slow.by_mode, slow.U)
        add_slow_columns(ground, count, u, d, scratch, slow)
        b = spread_of_biases(sums.U, model.bias_covariance, sums.R)
        o = spread_of_biases(slow.U, aircraft.slow_covariance[k], slow.R)
        b = (b[0] + o[0], b[1] + o[1], b[2] + o[2])
        N = (P[7], P[8], P[9])
        W = noise_of(d, variances[0], variances[1], scratch)
        along, across = fits((N[0] + W[0] + b[0], N[1] + W[1] + b[1], N[2] + W[2] + b[2]), e, d)
        across = across and is_steady_angle(k, last, angle, speed, time, reported)
        along = along and is_steady_speed(k, last + 1, speed, time, reported)
        if across:
            reported[k, last], reported[k, last + 4] = angle, time
        if along:
            reported[k, last + 1], reported[k, last + 5] = speed, time
        if not across:
            # A speed alone has no direction.
            if not ground:
                reported[k, REJECTED_COUNT] += 1.0
            continue
        if not (along or np.isnan(speed)):
            W = noise_of(d, UNMEASURED, variances[1], scratch)
        S = (N[0] + W[0], N[1] + W[1], N[2] + W[2])
        r0, r1, s00, s01, s11 = mixture_moments(posterior, e, N, W, 1.0)
        posterior = updated_probabilities(posterior, e, S, b, get_row(scratch, MODES))
        nu = (e[0] + x[2] - a[2], e[1] + x[3] - a[3])
        a, x, P = corrected_by_velocity(a, x, P, S, e, nu, scratch)
        correct_columns(k, count, scratch, aircraft.mode_sensitivity, mode_U, ALL_BLOCKS)
        correct_slow_states(
            k, count, (r0, r1), (s00 + b[0], s01 + b[1], s11 + b[2]), scratch, aircraft, slow
        )
        a, x = with_shift(a, slow.shift), with_shift(x, slow.shift)
        if not ground:
            reported[k, REJECTED_COUNT] = 0.0
    set_row(scratch, POSTERIOR, posterior)
    store_row(probabilities, k, 0, count, posterior)
    store_modes(k, count, a, P, aircraft.mode_mean, aircraft.mode_covariance)
    combine_modes(k, posterior, a, x, P, aircraft.mean, aircraft.covariance)
    combine_columns(k, count, scratch, aircraft.mode_sensitivity, aircraft.sensitivity, ALL_BLOCKS)
    add_slow_spread(k, count, scratch, aircraft)
    if reported[k, REJECTED_COUNT] >= REJECTED_MAX:
        # Another compass, or another source: the next report initialises them again.
        absorb_slow_states(k, count, aircraft)


@in_loop
def is_repeated(k: int, row: int, motion: Floats, reported: Floats) -> bool:
    """Return whether all numbers of a row are those last used of aircraft k."""
    some, same = False, True
    for i in range(5):
        column, last = HEADING, LAST
        if i == 1:
            column, last = AIRSPEED, LAST + 1
        elif i == 2:
            column, last = TRACK_ANGLE, LAST + 2
        elif i == 3:
            column, last = GROUND_SPEED, LAST + 3
        elif i == 4:
            column, last = LATERAL_REPORTED, LAST_LATERAL
        value = motion[row, column]
        if not np.isnan(value):
            some = True
            same = same and value == reported[k, last]
    return same and some


@in_loop
def is_steady_angle(
    k: int, last: int, angle: float, speed: float, time: float, reported: Floats
) -> bool:
    """Return whether the aircraft may have turned so far since the last direction used."""
    steady = True
    if not np.isnan(reported[k, last]):
        fast = SLOWEST_MPS if np.isnan(speed) else max(speed, SLOWEST_MPS)
        limit = LATERAL_MAX_MPS2 * (time - reported[k, last + 4]) + JITTER_MPS
        steady = abs(wrap_angle(angle - reported[k, last])) * fast <= limit
    return steady


@in_loop
def is_steady_speed(k: int, last: int, speed: float, time: float, reported: Floats) -> bool:
    """Return whether there is a speed that the aircraft may have reached since the last one."""
    steady = not np.isnan(speed)
    if steady and not np.isnan(reported[k, last]):
        limit = ACCELERATION_MAX_MPS2 * (time - reported[k, last + 4]) + JITTER_MPS
        steady = abs(speed - reported[k, last]) <= limit
    return steady


@in_loop
def compare_velocity(
    ground: bool, k: int, angle: float, speed: float, speed_variance: float, time: float,
    model: Model, aircraft: Aircraft, posterior: Lanes, x: State, scratch: Floats,
) -> Seen:  # fmt: skip
    """Return e of each mode, u and d on the plane, and the variances along and across d.

    u is NaN without a report. A direction without a speed has the last one, for a while.
    """
    slow = aircraft.slow
    east, north = sum_of(posterior * x[0]), sum_of(posterior * x[1])
    height = aircraft.height[k]
    w0, w1, scale, turn = 0.0, 0.0, 0.0, 0.0
    g0, g1 = 0.0, 0.0
    along = GROUND_VELOCITY_SIGMA_MPS * GROUND_VELOCITY_SIGMA_MPS
    gusts = 0.0
    if ground:
        g0, g1 = slow[k, GROUND], slow[k, GROUND + 1]
    else:
        w0, w1 = slow[k, WIND], slow[k, WIND + 1]
        scale = slow[k, SCALE] * (1.0 / NOMINAL_SPEED_MPS)
        turn = slow[k, VARIATION] * (1.0 / NOMINAL_SPEED_MPS)
        along = AIRSPEED_SIGMA_MPS * AIRSPEED_SIGMA_MPS if np.isnan(speed) else speed_variance
        gusts = GUST_SIGMA_MPS * GUST_SIGMA_MPS
    if np.isnan(speed):
        last = LAST + 3 if ground else LAST + 1
        age = time - aircraft.reported[k, last + 4]
        speed = aircraft.reported[k, last]
        along += (SPEED_CHANGE_MPS2 * age) * (SPEED_CHANGE_MPS2 * age)
        if age > SPEED_AGE_MAX_S:
            angle = np.nan
    if not speed >= SLOWEST_MPS:
        angle = np.nan
    m00, m01, m10, m11 = local_matrix(model.plane, east, north, 0.0 if np.isnan(height) else height)
    u_east, u_north = speed * np.sin(angle), speed * np.cos(angle)
    determinant = m00 * m11 - m01 * m10
    u0 = (m11 * u_east - m01 * u_north) / determinant
    u1 = (m00 * u_north - m10 * u_east) / determinant
    length = np.hypot(u0, u1)
    d = (u0 / length, u1 / length)
    sigma = DIRECTION_SIGMA_RAD * speed
    # The velocity at the time of the report: a is to the right, (d1, −d0).
    old = (slow[k, AGE] * (1.0 / NOMINAL_ACCELERATION_MPS2)) * get_row(scratch, TABLE + LATERAL)
    e0 = (u0 + scale * u0 + turn * u1 + w0 - g0) - x[2] + old * d[1]
    e1 = (u1 + scale * u1 - turn * u0 + w1 - g1) - x[3] - old * d[0]
    return (e0, e1), (u0, u1), d, (along, sigma * sigma + gusts)


@in_loop
def velocity_columns(
    k: int, count: int, scratch: Floats, mode_V: Floats, mode_U: Floats, U: Floats
) -> None:
    """Set U of each mode to the sensitivities of its velocity, and U to their mean by c."""
    for c in range(mode_V.shape[2]):
        mean0, mean1 = 0.0, 0.0
        for j in range(count):
            u0, u1 = mode_V[k * count + j, 2, c], mode_V[k * count + j, 3, c]
            mode_U[j, 0, c] = u0
            mode_U[j, 1, c] = u1
            mean0 += scratch[PREDICTED, j] * u0
            mean1 += scratch[PREDICTED, j] * u1
        U[0, c] = mean0
        U[1, c] = mean1


@in_loop
def add_slow_columns(
    ground: bool, count: int, u: tuple[float, float], d: tuple[float, float], scratch: Floats,
    slow: SlowScratch,
) -> None:  # fmt: skip
    """Add J, the derivative of the reported velocity by the slow states."""
    s0, s1 = u[0] * (1.0 / NOMINAL_SPEED_MPS), u[1] * (1.0 / NOMINAL_SPEED_MPS)
    mean = 0.0
    for j in range(count):
        lateral = scratch[TABLE + LATERAL, j] * (1.0 / NOMINAL_ACCELERATION_MPS2)
        mean += scratch[PREDICTED, j] * lateral
        add_slow_derivative(ground, (s0, s1), d, lateral, slow.by_mode[j])
    add_slow_derivative(ground, (s0, s1), d, mean, slow.U)


@in_loop
def add_slow_derivative(
    ground: bool, s: tuple[float, float], d: tuple[float, float], lateral: float, U: Floats
) -> None:
    """Add J to one U; s is u over `NOMINAL_SPEED_MPS`, the acceleration likewise."""
    if ground:
        U[0, GROUND] += 1.0
        U[1, GROUND + 1] += 1.0
    else:
        U[0, WIND] -= 1.0
        U[1, WIND + 1] -= 1.0
        U[0, SCALE] -= s[0]
        U[1, SCALE] -= s[1]
        U[0, VARIATION] -= s[1]
        U[1, VARIATION] += s[0]
    U[0, AGE] -= lateral * d[1]
    U[1, AGE] += lateral * d[0]


@in_both
def noise_of(
    d: tuple[float, float], along: float, across: float, scratch: Floats
) -> tuple[Lanes, Lanes, Lanes]:
    """Return W of each mode: variances along and across d, and that of the age in a turn."""
    aged = AGE_SIGMA_S * get_row(scratch, TABLE + LATERAL)
    wide = across + aged * aged
    return (
        along * (d[0] * d[0]) + wide * (d[1] * d[1]),
        (along - wide) * (d[0] * d[1]),
        along * (d[1] * d[1]) + wide * (d[0] * d[0]),
    )


@in_both
def fits(
    S: tuple[Lanes, Lanes, Lanes], e: tuple[Lanes, Lanes], d: tuple[float, float]
) -> tuple[bool, bool]:
    """Return whether the innovations along and across d are below the gate in any mode."""
    gate = GATE_SIGMAS * GATE_SIGMAS
    along = e[0] * d[0] + e[1] * d[1]
    across = e[0] * d[1] - e[1] * d[0]
    of_along = S[0] * (d[0] * d[0]) + 2.0 * S[1] * (d[0] * d[1]) + S[2] * (d[1] * d[1])
    of_across = S[0] * (d[1] * d[1]) - 2.0 * S[1] * (d[0] * d[1]) + S[2] * (d[0] * d[0])
    # Written so that NaN fails.
    return (
        largest_of(chosen(gate * of_along, along * along, 1.0, 0.0)) > 0.0,
        largest_of(chosen(gate * of_across, across * across, 1.0, 0.0)) > 0.0,
    )


@in_both
def weighed_by_acceleration(
    posterior: Lanes, lateral: float, variance: float, scratch: Floats
) -> Lanes:
    """Return the probabilities of the modes given a reported acceleration, NaN for none."""
    found = posterior
    if not np.isnan(lateral + variance):
        of_mode = get_row(scratch, TABLE + LATERAL)
        steepest = largest_of(of_mode)
        # Modes stop at a bank; steeper turns belong to the steepest.
        off = min(max(lateral, -steepest), steepest) - of_mode
        turns = chosen(of_mode * of_mode, 0.0, 1.0, 0.0)
        straight = STRAIGHT_LATERAL_SIGMA * STRAIGHT_LATERAL_SIGMA
        manoeuvre = MANOEUVRE_LATERAL_SIGMA * MANOEUVRE_LATERAL_SIGMA
        total = variance + straight + (manoeuvre - straight) * turns
        sigma = np.sqrt(2.0 * np.pi) * root(total)
        likelihood = exponential(-0.5 * (off * off / total)) / sigma + WRONG_LIKELIHOOD
        found = posterior * likelihood + PROBABILITY_MIN * get_row(scratch, MODES)
        found = found / sum_of(found)
    return found


@in_both
def corrected_by_velocity(
    a: State, x: State, P: Covariances, S: tuple[Lanes, Lanes, Lanes], e: tuple[Lanes, Lanes],
    nu: tuple[Lanes, Lanes], scratch: Floats,
) -> tuple[State, State, Covariances]:  # fmt: skip
    """Return the updated a, x and P of each mode, and store K."""
    scale = 1.0 / (S[0] * S[2] - S[1] * S[1])
    G = (P[2], P[3], P[5], P[6], P[7], P[8], P[8], P[9])
    K = gain_of(G, S[2] * scale, -S[1] * scale, S[0] * scale)
    set_row(scratch, GAIN, K[0])
    set_row(scratch, GAIN + 1, K[1])
    set_row(scratch, GAIN + 2, K[2])
    set_row(scratch, GAIN + 3, K[3])
    set_row(scratch, GAIN + 4, K[4])
    set_row(scratch, GAIN + 5, K[5])
    set_row(scratch, GAIN + 6, K[6])
    set_row(scratch, GAIN + 7, K[7])
    return shifted(a, K, nu), shifted(x, K, e), corrected_covariance(P, G, K)
