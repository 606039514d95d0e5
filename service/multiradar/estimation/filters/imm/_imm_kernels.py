"""Compiled correction of interacting modes, each with the two-stage form.

Symbols beside those of `_kernels`, `_two_stage_kernels` and `_mode_kernels`: r = innovation at the
published biases, L = likelihood of a mode. A plot informs about the biases as one Gaussian with the
moments of the mixture: U = Σ c U_j, ν = Σ c ν_j, S = Σ c (S_j + (r_j − r) (r_j − r)ᵀ), so that a
plot about which the modes differ informs less.

References
----------
Blom, H. A. P., Bar-Shalom, Y., "The interacting multiple model algorithm for systems with
Markovian switching coefficients", IEEE Transactions on Automatic Control 33 (1988), 780-783: the
probabilities. The information of interacting modes about common biases is the project's own.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    CONE,
    CONE_RATIO,
    DOWNWEIGHT_NIS,
    EXPECTED_NIS,
    REJECT_NIS,
    REJECTED,
    SINGULAR,
    SINGULAR_RATIO,
    SPEED_MAX,
    UPDATED,
    GainOf,
    corrected_covariance,
    covariance_times_transposed,
    gain_of,
    gated,
    inverse,
    position_part,
    record_innovation,
    squared_norm,
    updated_fading_nis,
)
from multiradar.estimation.filters.arrays import Aircraft, BiasSums, Model, Sight
from multiradar.estimation.filters.imm._column_list_kernels import (
    NOT_LISTED,
    inform_of_columns,
    spread_of_columns,
)
from multiradar.estimation.filters.imm._mode_column_kernels import correct_columns, predict_columns
from multiradar.estimation.filters.imm._mode_delay_kernels import (
    add_delay_to_modes,
    inform_of_modes,
)
from multiradar.estimation.filters.imm._mode_kernels import PROBABILITY_MIN
from multiradar.estimation.filters.imm._mode_scratch_kernels import (
    GAIN,
    MODES,
    POSTERIOR,
    PREDICTED,
    SLOPE,
    Covariances,
    ModeScratch,
    State,
    get_row,
    set_row,
)
from multiradar.estimation.filters.imm._slow_state_kernels import (
    correct_slow_states,
    slow_spread,
    with_shift,
)
from multiradar.estimation.filters.two_stage._information_kernels import inform, spread_of_biases
from multiradar.estimation.filters.two_stage._time_offset_kernels import offset_velocity
from multiradar.estimation.measurement._kernels import (
    NoiseOf,
    SlopeOf,
    bias_column,
    bias_column_of_sight,
    expected_sight,
    locate_measurement,
    measures_azimuth,
)
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar_compiled.kernels import in_both, in_loop
from multiradar_compiled.lane_function_kernels import angle_of, exponential
from multiradar_compiled.lane_kernels import (
    Lanes,
    chosen,
    every_lane,
    lane_of,
    largest_of,
    root,
    store_row,
    sum_of,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Triple = tuple[float, float, float]
Mixture = tuple[float, float, float, float, float]
Pair = tuple[Lanes, Lanes]
# Share of the variance of the noise that linearisation may add.
CURVED_SHARE_MIN = 0.01
# Sigmas of the velocity by which an update may exceed the maximum speed: see DECISIONS.
SPEED_SIGMAS = 0.5
# Components of `expected_sight`: the first of the measurement, x and y.
Direction = tuple[Lanes, Lanes, Lanes]
# Measurement of each mode: r, ν, H, N = H P Hᵀ, W, line of sight, ground range.
Seen = tuple[Pair, Pair, SlopeOf[Lanes], NoiseOf[Lanes], NoiseOf[Lanes], Direction, Lanes]


@in_loop
def correct_modes(
    sight: Sight, k: int, s: int, informs: bool, model: Model, aircraft: Aircraft, a: State,
    x: State, P: Covariances, predicted: Lanes, sums: BiasSums, mine: ModeScratch,
    innovations: Floats, row: int, used: tuple[int, int],
) -> tuple[int, Lanes, State, State, Covariances]:  # fmt: skip
    """Update the modes of aircraft k, predicted to the time of a measurement by sensor s.

    Returns the outcome, and μ, a, x and P afterwards. ``predicted`` is c. With ``informs`` the
    measurement contributes to the biases. A range is without the delay of the transponder at the
    published biases. ``used``: the blocks of biases on which the aircraft
    depends, and the number of those in `ModeScratch.columns`.
    """
    kind, z0, z1, height = sight.kind, sight.z0, sight.z1, sight.height
    blocks, listed = used
    sites, noises, starts = model.sites, model.noises, model.starts
    parameters, options = model.parameters, model.options
    bias_covariance, count = model.bias_covariance, model.modes.shape[0]
    mode_V, probabilities = aircraft.mode_sensitivity, aircraft.mode_probability
    fading_nis = aircraft.fading_nis
    Y, y, U, R = sums
    mode_U, scratch, has_slow = mine.by_mode, mine.rows, not np.isnan(aircraft.slow[k, 0])
    delayed = aircraft.delay.shape[1] > 0
    v0, v1 = offset_velocity(aircraft.velocity, k)
    at = (x[0], x[1])
    for again in (True, False):
        e, nu, h, N, W, seen, ground = predict_for_modes(sight, s, model, at, v0, v1, a, x, P)
        if not (again and is_curved(kind, N, W, ground, predicted)):
            break
        b0, b1 = measured_bias(kind, z0, z1, s, model)
        found, east, north = locate_measurement(
            kind, model.plane, sites[s], z0 - b0, z1 - b1, height
        )
        if not found:
            break
        at = (every_lane(east), every_lane(north))
    set_row(scratch, PREDICTED, predicted)
    set_row(scratch, SLOPE, h[0])
    set_row(scratch, SLOPE + 1, h[1])
    set_row(scratch, SLOPE + 2, h[2])
    set_row(scratch, SLOPE + 3, h[3])
    predict_columns(k, count, scratch, mode_V, mode_U, U, blocks)
    for c in range(starts[s], starts[s + 1]):
        rate0, rate1 = h[0] * v0 + h[1] * v1, h[2] * v0 + h[3] * v1
        j0, j1 = bias_column_of_sight(
            kind, parameters[c], sites[s], seen[0], seen[1], seen[2], rate0, rate1
        )
        add_column(c, count, predicted, j0, j1, mode_U, U)
    if delayed:
        # Innovations at bias zero become right by `correct_modes_with_delay`.
        add_delay_to_modes(k, count, kind, s, model, aircraft.delay, U, mine)
    if listed == NOT_LISTED:
        b = spread_of_biases(U, bias_covariance, R)
    else:
        b = spread_of_columns(U, bias_covariance, R, mine.columns, listed)
    r0, r1, s00, s01, s11 = mixture_moments(predicted, e, N, W, 1.0)
    o = (0.0, 0.0, 0.0)
    if has_slow:
        # Their effect on the innovation is independent of that of the biases.
        o = slow_spread(k, count, scratch, aircraft, mine.slow)
        s00, s01, s11 = s00 + o[0], s01 + o[1], s11 + o[2]
    record_innovation(row, r0, r1, s00, s01, s11, b[0], b[1], b[2], innovations)
    nis = squared_norm(s00, s01, s11, r0, r1)
    weight = 1.0
    # The gates are written so that NaN fails them.
    harmless = min(EXPECTED_NIS, min(options[DOWNWEIGHT_NIS], options[REJECT_NIS]))
    if not nis <= harmless and nis < np.inf:
        nis = squared_norm(s00 + b[0], s01 + b[1], s11 + b[2], r0, r1)
        if nis < np.inf:
            weight = max(1.0, nis / options[DOWNWEIGHT_NIS])
    outcome = gated(nis, options[REJECT_NIS])
    if sum_of(predicted * ground) < options[CONE_RATIO] * (height - noises[s, 3]):
        outcome = CONE
    S = (N[0] + weight * W[0], N[1] + weight * W[1], N[2] + weight * W[2])
    if has_slow:
        b = (b[0] + o[0], b[1] + o[1], b[2] + o[2])
    if outcome == UPDATED and any_singular(S, b):
        outcome = SINGULAR
    posterior = predicted
    if outcome == UPDATED:
        posterior = updated_probabilities(predicted, e, S, b, get_row(scratch, MODES))
        after_a, after_x, after_P = corrected(a, x, P, h, S, e, nu, scratch)
        # A second plot at the same instant only corrects the velocity that the first one gave.
        if aircraft.updated[k] < aircraft.time[k] and is_too_fast(
            predicted, x, posterior, after_x, after_P, b, scratch, options
        ):
            outcome, posterior = REJECTED, predicted
    if outcome == UPDATED:
        fading_nis[k] = updated_fading_nis(fading_nis[k], nis, options)
        if (informs or has_slow) and weight > 1.0:
            r0, r1, s00, s01, s11 = mixture_moments(predicted, e, N, W, weight)
            if has_slow:
                s00, s01, s11 = s00 + o[0], s01 + o[1], s11 + o[2]
        if informs:
            i00, i01, i11 = inverse(s00, s01, s11)
            nu0, nu1 = sum_of(predicted * nu[0]), sum_of(predicted * nu[1])
            if delayed:
                inform_of_modes(k, i00, i01, i11, nu0, nu1, aircraft.delay, sums, mine.delay)
            elif listed != NOT_LISTED:
                inform_of_columns(i00, i01, i11, nu0, nu1, U, R, Y, y, mine.columns, listed)
            else:
                inform(i00, i01, i11, nu0, nu1, U, R, Y, y)
        store_row(probabilities, k, 0, count, posterior)
        a, x, P = after_a, after_x, after_P
        correct_columns(k, count, scratch, mode_V, mode_U, blocks)
        if has_slow:
            # The biases are part of b, the slow states of both.
            S_all = (s00 + b[0] - o[0], s01 + b[1] - o[1], s11 + b[2] - o[2])
            correct_slow_states(k, count, (r0, r1), S_all, scratch, aircraft, mine.slow)
            a, x = with_shift(a, mine.slow.shift), with_shift(x, mine.slow.shift)
    set_row(scratch, POSTERIOR, posterior)
    return outcome, posterior, a, x, P


@in_loop
def predict_for_modes(
    sight: Sight, s: int, model: Model, at: Pair, v0: float, v1: float, a: State, x: State,
    P: Covariances,
) -> Seen:  # fmt: skip
    """Return the expected measurement of each mode, and the innovations.

    The measurement is linearised at the position ``at``: e = z − h(at) − H (x − at) − J ς̂. Time
    offsets are linearised at the velocity (v0, v1).
    """
    kind, z0, z1 = sight.kind, sight.z0, sight.z1
    starts, parameters, site = model.starts, model.parameters, model.sites[s]
    p0, across, ahead, ground, h, W = expected_sight(
        kind, model.plane, site, model.noises[s], at[0], at[1], sight.height, sight.height_variance
    )
    e0, e1 = z0 - p0, z1 - ahead
    if measures_azimuth(kind):
        # The angle from the line of sight to the direction measured.
        sine, cosine = math.sin(z1), math.cos(z1)
        e1 = angle_of(sine * ahead - cosine * across, cosine * ahead + sine * across, ground)
    f0, f1 = x[0] - at[0], x[1] - at[1]
    e0, e1 = e0 - (h[0] * f0 + h[1] * f1), e1 - (h[2] * f0 + h[3] * f1)
    d0, d1 = x[0] - a[0], x[1] - a[1]
    nu = (e0 + h[0] * d0 + h[1] * d1, e1 + h[2] * d0 + h[3] * d1)
    for c in range(starts[s], starts[s + 1]):
        rate0, rate1 = h[0] * v0 + h[1] * v1, h[2] * v0 + h[3] * v1
        j0, j1 = bias_column_of_sight(kind, parameters[c], site, p0, across, ahead, rate0, rate1)
        e0 = e0 - j0 * model.bias[c]
        e1 = e1 - j1 * model.bias[c]
    N = position_part(h, covariance_times_transposed(P, h))
    return (e0, e1), nu, h, N, W, (p0, across, ahead), ground


@in_both
def is_curved(
    kind: int, N: NoiseOf[Lanes], W: NoiseOf[Lanes], ground: Lanes, predicted: Lanes
) -> bool:
    """Return whether positions are too uncertain to linearise a plot at the predicted ones.

    With independent errors a along and c across the line of sight, at the ground range R, the
    second-order remainders are c² / 2R in range, of variance (var c)² / 2R² (besides its mean), and
    a c / R² in azimuth, of variance var a · var c / R⁴. Here N₀₀ = var a and N₁₁ = var c / R². The
    plot is linearised again where these variances, relative to those of the noise, exceed
    `CURVED_SHARE_MIN` in the mean of the modes.
    """
    curved = False
    if kind == KIND_RADAR:
        of_range = 0.5 * N[2] * N[2] * ground * ground / W[0]
        of_azimuth = N[0] * N[2] / (ground * ground * W[2])
        curved = sum_of(predicted * (of_range + of_azimuth)) > CURVED_SHARE_MIN
    return curved


@in_loop
def measured_bias(kind: int, z0: float, z1: float, s: int, model: Model) -> tuple[float, float]:
    """Return the published biases of a sensor in the components of a measurement."""
    b0, b1 = 0.0, 0.0
    for c in range(model.starts[s], model.starts[s + 1]):
        j0, j1 = bias_column(kind, model.parameters[c], model.sites[s], z0, z1, 0.0, 0.0)
        b0 += j0 * model.bias[c]
        b1 += j1 * model.bias[c]
    return b0, b1


@in_loop
def add_column(
    c: int, count: int, predicted: Lanes, j0: Lanes, j1: Lanes, mode_U: Floats, U: Floats
) -> None:
    """Add the column of one bias of the sensor, of each mode and of their mixture."""
    for j in range(count):
        mode_U[j, 0, c] += lane_of(j0, j)
        mode_U[j, 1, c] += lane_of(j1, j)
    U[0, c] += sum_of(predicted * j0)
    U[1, c] += sum_of(predicted * j1)


@in_both
def is_too_fast(
    predicted: Lanes,
    x: State,
    posterior: Lanes,
    after: State,
    P: Covariances,
    b: Triple,
    scratch: Floats,
    options: Floats,
) -> bool:
    """Return whether an update would accelerate an aircraft beyond the maximum speed.

    `SPEED_SIGMAS` of the velocity after the update are allowed in addition, as after its second
    plot a track knows its velocity only roughly. ``b`` is what the biases add to S.
    """
    v0, v1 = sum_of(posterior * after[2]), sum_of(posterior * after[3])
    d0, d1 = after[2] - v0, after[3] - v1
    # The part of the biases is that of K b Kᵀ.
    k0, k1 = get_row(scratch, GAIN + 4), get_row(scratch, GAIN + 5)
    k2, k3 = get_row(scratch, GAIN + 6), get_row(scratch, GAIN + 7)
    of_biases = (k0 * k0 + k2 * k2) * b[0] + 2.0 * (k0 * k1 + k2 * k3) * b[1]
    of_biases = of_biases + (k1 * k1 + k3 * k3) * b[2]
    variance = sum_of(posterior * (P[7] + P[9] + d0 * d0 + d1 * d1 + of_biases))
    limit = options[SPEED_MAX] + SPEED_SIGMAS * math.sqrt(variance)
    before0, before1 = sum_of(predicted * x[2]), sum_of(predicted * x[3])
    squared = v0 * v0 + v1 * v1
    return squared > limit * limit and squared > before0 * before0 + before1 * before1


@in_both
def any_singular(S: NoiseOf[Lanes], b: Triple) -> bool:
    """Return whether S of any mode is singular, with or without the covariance of the biases."""
    return largest_of(singular_lanes(S[0], S[1], S[2])) > 0.0 or (
        largest_of(singular_lanes(S[0] + b[0], S[1] + b[1], S[2] + b[2])) > 0.0
    )


@in_both
def singular_lanes(s00: Lanes, s01: Lanes, s11: Lanes) -> Lanes:
    """Return 1 where S is not positive definite beyond rounding, else 0."""
    sound = chosen(s00 * s11 - s01 * s01, SINGULAR_RATIO * s00 * s11, 0.0, 1.0)
    found: Lanes = chosen(s00, 0.0, sound, 1.0)
    return found


@in_both
def mixture_moments(
    predicted: Lanes, e: Pair, N: NoiseOf[Lanes], W: NoiseOf[Lanes], weight: float
) -> Mixture:
    """Return r and S of the mixture: r₀, r₁, S₀₀, S₀₁, S₁₁; the noise times ``weight``."""
    r0, r1 = sum_of(predicted * e[0]), sum_of(predicted * e[1])
    d0, d1 = e[0] - r0, e[1] - r1
    s00 = sum_of(predicted * (N[0] + weight * W[0] + d0 * d0))
    s01 = sum_of(predicted * (N[1] + weight * W[1] + d0 * d1))
    s11 = sum_of(predicted * (N[2] + weight * W[2] + d1 * d1))
    return r0, r1, s00, s01, s11


@in_both
def updated_probabilities(
    predicted: Lanes, e: Pair, S: NoiseOf[Lanes], b: Triple, modes: Lanes
) -> Lanes:
    """Return μ, c L normalised; S of L includes the covariance of the biases."""
    s00, s01, s11 = S[0] + b[0], S[1] + b[1], S[2] + b[2]
    det = s00 * s11 - s01 * s01
    norm = (s11 * e[0] * e[0] - 2.0 * s01 * e[0] * e[1] + s00 * e[1] * e[1]) / det
    likelihood = exponential(-0.5 * (norm + largest_of(-norm))) / root(det)
    posterior: Lanes = predicted * (likelihood / largest_of(likelihood)) + PROBABILITY_MIN * modes
    return posterior / sum_of(posterior)


@in_both
def corrected(
    a: State, x: State, P: Covariances, h: SlopeOf[Lanes], S: NoiseOf[Lanes], e: Pair, nu: Pair,
    scratch: Floats,
) -> tuple[State, State, Covariances]:  # fmt: skip
    """Return the updated a, x and P of each mode, and store K; x changes by K r."""
    scale = 1.0 / (S[0] * S[2] - S[1] * S[1])
    G = covariance_times_transposed(P, h)
    K = gain_of(G, S[2] * scale, -S[1] * scale, S[0] * scale)
    set_row(scratch, GAIN, K[0])
    set_row(scratch, GAIN + 1, K[1])
    set_row(scratch, GAIN + 2, K[2])
    set_row(scratch, GAIN + 3, K[3])
    set_row(scratch, GAIN + 4, K[4])
    set_row(scratch, GAIN + 5, K[5])
    set_row(scratch, GAIN + 6, K[6])
    set_row(scratch, GAIN + 7, K[7])
    P = corrected_covariance(P, G, K)
    return shifted(a, K, nu), shifted(x, K, e), P


@in_both
def shifted(x: State, K: GainOf[Lanes], e: Pair) -> State:
    """Return x + K e of each mode."""
    return (
        x[0] + (K[0] * e[0] + K[1] * e[1]),
        x[1] + (K[2] * e[0] + K[3] * e[1]),
        x[2] + (K[4] * e[0] + K[5] * e[1]),
        x[3] + (K[6] * e[0] + K[7] * e[1]),
    )
