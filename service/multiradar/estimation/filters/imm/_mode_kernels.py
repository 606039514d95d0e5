"""Compiled modes of motion: transition, mixing and prediction.

Mode 0 is the hub: straight flight. The others, the arms, are manoeuvres. An aircraft leaves the hub
at the rate λ₀, for arm i with the probability s_i, and any arm at the rate λ₁, for the hub.

All modes of an aircraft are processed at once, one per lane: see `_mode_scratch_kernels`.

Symbols: μ = probabilities of the modes, a, V, P = a mode's conditional mean, sensitivity to the
biases and covariance, x = a + V ς̂ = its estimate at the published biases, c = probabilities of the
modes after the transition, w = mixing weights.

References
----------
Blom, H. A. P., Bar-Shalom, Y., "The interacting multiple model algorithm for systems with
Markovian switching coefficients", IEEE Transactions on Automatic Control 33 (1988), 780-783: the
mixing. Its two-stage form, transitions over any interval and the turn model are the project's own.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import READOUT_MODES, SLOW_SPEED_SQUARED
from multiradar.estimation.filters.imm._mode_scratch_kernels import (
    ACROSS,
    ALONG,
    ARMS,
    COURSE,
    ENTERING,
    HUB,
    LATERAL,
    LEAVING,
    MODES,
    SHARES,
    TABLE,
    UNMODELLED,
    CourseOf,
    Covariances,
    State,
    get_row,
    set_row,
)
from multiradar.estimation.motion._kernels import DensityOf, load_covariance, store_covariance
from multiradar_compiled.kernels import in_both, in_loop
from multiradar_compiled.lane_function_kernels import sine_and_cosine
from multiradar_compiled.lane_kernels import (
    Lanes,
    chosen,
    every_lane,
    lane_of,
    larger,
    load_row,
    root,
    store_row,
    sum_of,
    sums_of,
)

Floats = NDArray[np.float64]

# Probability of straight flight, the hub, before the second measurement.
STRAIGHT_AT_FIRST = 0.5
# Minimum probability of a mode, so that each can recover.
PROBABILITY_MIN = 1e-9


@in_loop
def initialise_modes(
    k: int, count: int, means: Floats, covariances: Floats, V: Floats, mode_means: Floats,
    mode_covariances: Floats, mode_V: Floats, probabilities: Floats,
) -> None:  # fmt: skip
    """Set all modes of aircraft k to its single state: the hub and all arms with 0.5 each."""
    for j in range(count):
        row = k * count + j
        rest = (1.0 - STRAIGHT_AT_FIRST) / (count - 1)
        probabilities[k, j] = STRAIGHT_AT_FIRST if j == 0 else rest
        store_covariance(mode_covariances, row, load_covariance(covariances, k))
        for i in range(4):
            mode_means[row, i] = means[k, i]
            for c in range(V.shape[2]):
                mode_V[row, i, c] = V[k, i, c]


@in_both
def transition_modes(
    k: int, count: int, dt: float, modes: Floats, probabilities: Floats, scratch: Floats
) -> tuple[Lanes, Lanes]:
    """Return μ and c, and store the mixing weights; transitions are the exponential of the rates.

    As all arms have one rate λ₁, hub and arms together are a process of two states. An aircraft in
    an arm it was not in before has passed through the hub, so it is in arm i with the share s_i.
    All arms therefore contribute alike to any other mode, and the weights of a mode are three: of
    the hub, of the sum over all arms weighted by μ, and of the mode itself.
    """
    hub = modes[1, LEAVING] / (modes[0, LEAVING] + modes[1, LEAVING])
    stays = math.exp(-modes[1, LEAVING] * dt)
    decay = math.exp(-modes[0, LEAVING] * dt) * stays
    to_hub = hub * (1.0 - decay)
    leaves = (1.0 - hub) * (1.0 - decay)
    other = max(0.0, 1.0 - to_hub - stays)
    before = load_row(probabilities, k, 0, count)
    is_hub, is_arm = get_row(scratch, HUB), get_row(scratch, ARMS)
    entered = get_row(scratch, TABLE + ENTERING)
    own = stays * (is_arm * before)
    of_hub = ((1.0 - leaves) * is_hub + leaves * entered) * lane_of(before, 0)
    of_arms = to_hub * is_hub + other * entered
    predicted = of_hub + of_arms * sum_of(is_arm * before) + own
    scale = 1.0 / predicted
    set_row(scratch, SHARES, of_hub * scale)
    set_row(scratch, SHARES + 1, of_arms * scale)
    set_row(scratch, SHARES + 2, own * scale)
    return before, predicted * get_row(scratch, MODES)


@in_both
def mix_modes(
    before: Lanes, a: State, x: State, P: Covariances, scratch: Floats
) -> tuple[State, State, Covariances]:
    """Return the mixed a, x and P of each mode; ``before`` is μ.

    a₀ = Σ w a, affine in the biases; P₀ = Σ w (P + (x − x₀) (x − x₀)ᵀ), by second moments about the
    mean of all modes, so that no large numbers are subtracted.
    """
    u, v, w = (
        get_row(scratch, SHARES),
        get_row(scratch, SHARES + 1),
        get_row(scratch, SHARES + 2),
    )
    arms = before * get_row(scratch, ARMS)
    means = sums_of(
        before * x[0], before * x[1], before * x[2], before * x[3],
        arms * a[0], arms * a[1], arms * a[2], arms * a[3],
    )  # fmt: skip
    m0, m1, m2, m3 = lane_of(means, 0), lane_of(means, 1), lane_of(means, 2), lane_of(means, 3)
    d = (x[0] - m0, x[1] - m1, x[2] - m2, x[3] - m3)
    S = second_moments(P, d)
    some = sums_of(
        arms * S[0], arms * S[1], arms * S[2], arms * S[3],
        arms * S[4], arms * S[5], arms * S[6], arms * S[7],
    )  # fmt: skip
    none = every_lane(0.0)
    others = sums_of(
        arms * S[8], arms * S[9], arms * d[0], arms * d[1], arms * d[2], arms * d[3], none, none
    )  # fmt: skip
    z = (
        mixed(u, v, w, d[0], lane_of(others, 2)),
        mixed(u, v, w, d[1], lane_of(others, 3)),
        mixed(u, v, w, d[2], lane_of(others, 4)),
        mixed(u, v, w, d[3], lane_of(others, 5)),
    )
    return (
        (
            mixed(u, v, w, a[0], lane_of(means, 4)),
            mixed(u, v, w, a[1], lane_of(means, 5)),
            mixed(u, v, w, a[2], lane_of(means, 6)),
            mixed(u, v, w, a[3], lane_of(means, 7)),
        ),
        (z[0] + m0, z[1] + m1, z[2] + m2, z[3] + m3),
        (
            mixed(u, v, w, S[0], lane_of(some, 0)) - z[0] * z[0],
            mixed(u, v, w, S[1], lane_of(some, 1)) - z[0] * z[1],
            mixed(u, v, w, S[2], lane_of(some, 2)) - z[0] * z[2],
            mixed(u, v, w, S[3], lane_of(some, 3)) - z[0] * z[3],
            mixed(u, v, w, S[4], lane_of(some, 4)) - z[1] * z[1],
            mixed(u, v, w, S[5], lane_of(some, 5)) - z[1] * z[2],
            mixed(u, v, w, S[6], lane_of(some, 6)) - z[1] * z[3],
            mixed(u, v, w, S[7], lane_of(some, 7)) - z[2] * z[2],
            mixed(u, v, w, S[8], lane_of(others, 0)) - z[2] * z[3],
            mixed(u, v, w, S[9], lane_of(others, 1)) - z[3] * z[3],
        ),
    )


@in_both
def mixed(u: Lanes, v: Lanes, w: Lanes, own: Lanes, arms: float) -> Lanes:
    """Return the mixture of hub, sum over the arms and the mode itself, of each mode."""
    return u * lane_of(own, 0) + v * arms + w * own


@in_both
def second_moments(P: Covariances, x: State) -> Covariances:
    """Return P + x xᵀ of each mode."""
    return (
        P[0] + x[0] * x[0],
        P[1] + x[0] * x[1],
        P[2] + x[0] * x[2],
        P[3] + x[0] * x[3],
        P[4] + x[1] * x[1],
        P[5] + x[1] * x[2],
        P[6] + x[1] * x[3],
        P[7] + x[2] * x[2],
        P[8] + x[2] * x[3],
        P[9] + x[3] * x[3],
    )


@in_both
def move_modes(
    dt: float, more: float, a: State, x: State, P: Covariances, scratch: Floats
) -> tuple[State, State, Covariances]:
    """Return the predicted a, x and P of each mode, and store the turns in the scratch array.

    ``more`` is an isotropic density, m²/s³, added for modes with the `UNMODELLED` flag.
    """
    course = courses(get_row(scratch, TABLE + LATERAL), x[2], x[3], P[7] + P[9], dt)
    set_row(scratch, COURSE, course[0])
    set_row(scratch, COURSE + 1, course[1])
    set_row(scratch, COURSE + 2, course[2])
    set_row(scratch, COURSE + 3, course[3])
    there = moved_state(x, course)
    fading_nis = more * get_row(scratch, TABLE + UNMODELLED)
    # The noise is that of the velocity in the middle of the interval.
    density = frame_density(
        0.5 * (x[2] + there[2]),
        0.5 * (x[3] + there[3]),
        get_row(scratch, TABLE + ALONG) + fading_nis,
        get_row(scratch, TABLE + ACROSS) + fading_nis,
    )
    return moved_state(a, course), there, turned_covariance(P, course, dt, density)


@in_both
def moved_state(x: State, course: CourseOf[Lanes]) -> State:
    """Return the predicted state of each mode."""
    s, c, cosine, sine = course
    return (
        x[0] + s * x[2] + c * x[3],
        x[1] + s * x[3] - c * x[2],
        cosine * x[2] + sine * x[3],
        cosine * x[3] - sine * x[2],
    )


@in_both
def courses(lateral: Lanes, v0: Lanes, v1: Lanes, variance: Lanes, dt: float) -> CourseOf[Lanes]:
    """Return ∫cos ωt, ∫sin ωt over dt, cos ω dt and sin ω dt of turns with lateral accelerations.

    ω = lateral / speed, clockwise positive; less where the variance of the velocity makes the speed
    uncertain, and 0 at rest.
    """
    squared = v0 * v0 + v1 * v1
    rate = lateral * root(squared) / larger(squared + variance, SLOW_SPEED_SQUARED)
    angle = rate * dt
    turns = angle * angle
    sine, cosine = sine_and_cosine(angle)
    divisor = chosen(turns, STRAIGHT_SQUARED, rate, 1.0)
    return (
        chosen(turns, STRAIGHT_SQUARED, sine / divisor, dt),
        chosen(turns, STRAIGHT_SQUARED, (1.0 - cosine) / divisor, 0.0),
        chosen(turns, STRAIGHT_SQUARED, cosine, 1.0),
        chosen(turns, STRAIGHT_SQUARED, sine, 0.0),
    )


# Square of a negligible angle, rad.
STRAIGHT_SQUARED = 1e-12


@in_both
def frame_density(v0: Lanes, v1: Lanes, along: Lanes, across: Lanes) -> DensityOf[Lanes]:
    """Return the density of white acceleration along and across a velocity: 00, 01, 11.

    Isotropic, with their mean, for an aircraft at rest; continuous in between.
    """
    ee = v0 * v0
    nn = v1 * v1
    part = 1.0 / larger(ee + nn, SLOW_SPEED_SQUARED)
    rest = 0.5 * (along + across) * (1.0 - (ee + nn) * part)
    return (
        (along * ee + across * nn) * part + rest,
        (along - across) * v0 * v1 * part,
        (along * nn + across * ee) * part + rest,
    )


@in_both
def turned_covariance(
    P: Covariances, course: CourseOf[Lanes], dt: float, density: DensityOf[Lanes]
) -> Covariances:
    """Return F P Fᵀ + Q with F = [[I, B], [0, R]], B = [[s, c], [−c, s]], R = a rotation."""
    s, c, cosine, sine = course
    # Position with velocity, and B times the covariance of the velocity.
    g00 = P[2] + s * P[7] + c * P[8]
    g01 = P[3] + s * P[8] + c * P[9]
    g10 = P[5] + s * P[8] - c * P[7]
    g11 = P[6] + s * P[9] - c * P[8]
    q00, q01, q11 = density[0] * dt, density[1] * dt, density[2] * dt
    half = 0.5 * dt
    third = dt * dt / 3.0
    return (
        P[0] + s * (P[2] + g00) + c * (P[3] + g01) + q00 * third,
        P[1] + s * (P[5] + g01) + c * (P[6] - g00) + q01 * third,
        cosine * g00 + sine * g01 + q00 * half,
        cosine * g01 - sine * g00 + q01 * half,
        P[4] + s * (P[6] + g11) - c * (P[5] + g10) + q11 * third,
        cosine * g10 + sine * g11 + q01 * half,
        cosine * g11 - sine * g10 + q11 * half,
        cosine * cosine * P[7] + 2.0 * cosine * sine * P[8] + sine * sine * P[9] + q00,
        (cosine * cosine - sine * sine) * P[8] + cosine * sine * (P[9] - P[7]) + q01,
        cosine * cosine * P[9] - 2.0 * cosine * sine * P[8] + sine * sine * P[7] + q11,
    )


@in_both
def combine_modes(
    k: int, posterior: Lanes, a: State, x: State, P: Covariances, means: Floats, covariances: Floats
) -> None:
    """Set a and P of aircraft k to the moments of the mixture of its modes."""
    middle = sums_of(
        posterior * x[0], posterior * x[1], posterior * x[2], posterior * x[3],
        posterior * a[0], posterior * a[1], posterior * a[2], posterior * a[3],
    )  # fmt: skip
    for r in range(4):
        means[k, r] = lane_of(middle, 4 + r)
    S = second_moments(
        P,
        (
            x[0] - lane_of(middle, 0),
            x[1] - lane_of(middle, 1),
            x[2] - lane_of(middle, 2),
            x[3] - lane_of(middle, 3),
        ),
    )
    some = sums_of(
        posterior * S[0], posterior * S[1], posterior * S[2], posterior * S[3],
        posterior * S[4], posterior * S[5], posterior * S[6], posterior * S[7],
    )  # fmt: skip
    store_row(covariances, k, 0, 8, some)
    covariances[k, 8] = sum_of(posterior * S[8])
    covariances[k, 9] = sum_of(posterior * S[9])


@in_loop
def read_modes(
    row: int, k: int, count: int, modes: Floats, probabilities: Floats, readouts: Floats
) -> None:
    """Add the probabilities of a right turn, a left turn and a change of speed to a readout."""
    right, left, accelerating = 0.0, 0.0, 0.0
    for j in range(1, count):
        p = probabilities[k, j]
        # Before the second plot only the first probability is NaN.
        p = np.nan if np.isnan(probabilities[k, 0]) else p
        if modes[j, LATERAL] > 0.0:
            right += p
        elif modes[j, LATERAL] < 0.0:
            left += p
        else:
            accelerating += p
    readouts[row, READOUT_MODES] = right
    readouts[row, READOUT_MODES + 1] = left
    readouts[row, READOUT_MODES + 2] = accelerating
