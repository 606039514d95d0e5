"""Compiled modes of motion: how an aircraft passes from one to another, mixes them, moves in each.

Mode 0 is the hub: straight flight. The others, the arms, are manoeuvres. An aircraft leaves the hub
at the rate λ₀, for every arm alike, and an arm at the rate λ₁, for the hub.

Symbols: μ = probabilities of the modes, a, V, P = a mode's conditional mean, sensitivity to the
biases and covariance, x = a + V ς̂ = its estimate at the published biases, c = probabilities of the
modes after a passage, w = share of what an aircraft was in what it is now.

References
----------
Blom, H. A. P., Bar-Shalom, Y., "The interacting multiple model algorithm for systems with
Markovian switching coefficients", IEEE Transactions on Automatic Control 33 (1988), 780-783: the
mixing. The project's own: its two-stage form, passages over any interval, turns by a bank.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import READOUT_MODES, SLOW_SPEED_SQUARED
from multiradar.estimation.motion._kernels import Density, Packed, load_covariance, store_covariance
from multiradar.kernels import in_loop
from multiradar.lane_kernels import LANES, lane_of, lanes_of, load_lanes, store_lanes

Floats = NDArray[np.float64]

Course = tuple[float, float, float, float]

# Columns of `Model.modes`: acceleration across the velocity, m/s², right positive; densities of
# white acceleration along the velocity and across it, m²/s³; rate of leaving the mode, 1/s.
LATERAL = 0
ALONG = 1
ACROSS = 2
LEAVING = 3
MODE_COUNT = 4

# Columns of the shares of `pass_modes`.
SHARE_COUNT = 3

# Probability of straight flight, the hub, before the second measurement.
STRAIGHT_AT_FIRST = 0.5
# Less than this no mode is held for, so that each can come back.
PROBABILITY_MIN = 1e-9


@in_loop
def spread_over_modes(
    k: int, count: int, means: Floats, covariances: Floats, V: Floats, mode_means: Floats,
    mode_covariances: Floats, mode_V: Floats, probabilities: Floats,
) -> None:  # fmt: skip
    """Let aircraft k, of which one state is known, be in any mode: by halves hub and arms."""
    for j in range(count):
        row = k * count + j
        rest = (1.0 - STRAIGHT_AT_FIRST) / (count - 1)
        probabilities[k, j] = STRAIGHT_AT_FIRST if j == 0 else rest
        store_covariance(mode_covariances, row, load_covariance(covariances, k))
        for i in range(4):
            mode_means[row, i] = means[k, i]
            for c in range(V.shape[2]):
                mode_V[row, i, c] = V[k, i, c]


@in_loop
def pass_modes(
    k: int, count: int, dt: float, modes: Floats, probabilities: Floats, C: Floats, shares: Floats
) -> None:
    """Fill C with c, and row j of ``shares`` with how mode j is mixed, by the exponential of rates.

    Every arm gives the same to a mode that it is not: what is in mode j is then ``shares[j, 0]`` of
    the hub, ``shares[j, 1]`` of the sum over all arms of μ times what they are, and ``shares[j,
    2]`` of what was in mode j already.
    """
    arms = count - 1
    hub = modes[1, LEAVING] / (modes[0, LEAVING] + modes[1, LEAVING])
    stays = math.exp(-modes[1, LEAVING] * dt)
    forgets = math.exp(-modes[0, LEAVING] * dt) * stays
    to_hub = hub * (1.0 - forgets)
    to_arm = (1.0 - hub) * (1.0 - forgets) / arms
    other = max(0.0, 1.0 - to_hub - stays) / arms
    manoeuvring = 0.0
    for j in range(1, count):
        manoeuvring += probabilities[k, j]
    for j in range(count):
        of_hub = (1.0 - arms * to_arm if j == 0 else to_arm) * probabilities[k, 0]
        of_arms = to_hub if j == 0 else other
        own = 0.0 if j == 0 else stays * probabilities[k, j]
        C[j] = of_hub + of_arms * manoeuvring + own
        shares[j, 0] = of_hub / C[j]
        shares[j, 1] = of_arms / C[j]
        shares[j, 2] = own / C[j]


@in_loop
def estimate_modes(
    k: int, count: int, bias: Floats, mode_means: Floats, mode_V: Floats, X: Floats
) -> None:
    """Fill X with x of each mode at the published biases: as `component`, two of them at once."""
    n = bias.shape[0]
    pairs = n & ~1
    for i in range(count):
        row = k * count + i
        for r in range(0, 4, 2):
            # The sums of even and of odd columns, of both components.
            sums = lanes_of(mode_means[row, r], 0.0, mode_means[row, r + 1], 0.0)
            for c in range(0, pairs, 2):
                ways = lanes_of(
                    mode_V[row, r, c], mode_V[row, r, c + 1],
                    mode_V[row, r + 1, c], mode_V[row, r + 1, c + 1],
                )  # fmt: skip
                sums = sums + ways * lanes_of(bias[c], bias[c + 1], bias[c], bias[c + 1])
            first, second = lane_of(sums, 0), lane_of(sums, 2)
            if pairs < n:
                first += mode_V[row, r, pairs] * bias[pairs]
                second += mode_V[row, r + 1, pairs] * bias[pairs]
            X[i, r] = first + lane_of(sums, 1)
            X[i, r + 1] = second + lane_of(sums, 3)


@in_loop
def mix_modes(
    k: int, count: int, probabilities: Floats, shares: Floats, mode_means: Floats,
    mode_covariances: Floats, mode_V: Floats, X: Floats, A: Floats, S: Floats, B: Floats,
    T: Floats, Z: Floats,
) -> None:  # fmt: skip
    """Fill A, B, T and Z with the mixed a, P, V and x of each mode; X holds x, S is room.

    a₀ = Σ w a and V₀ = Σ w V, affine in the biases; P₀ = Σ w (P + (x − x₀) (x − x₀)ᵀ), by second
    moments about the mean of all modes, so that nothing large is subtracted. The last row of A, S
    and X takes the sums over the arms.
    """
    first = k * count
    n = T.shape[2]
    refer_to_middle(k, count, probabilities, X, Z)
    for i in range(count):
        second_moment(first + i, i, mode_covariances, X, S)
    for r in range(4):
        A[count, r] = 0.0
        X[count, r] = 0.0
    for m in range(10):
        S[count, m] = 0.0
    for i in range(1, count):
        p = probabilities[k, i]
        for m in range(10):
            S[count, m] += p * S[i, m]
        for r in range(4):
            A[count, r] += p * mode_means[first + i, r]
            X[count, r] += p * X[i, r]
    for j in range(count):
        u, v, w = shares[j, 0], shares[j, 1], shares[j, 2]
        for m in range(10):
            B[j, m] = u * S[0, m] + v * S[count, m] + w * S[j, m]
        for r in range(4):
            Z[j, r] = u * X[0, r] + v * X[count, r] + w * X[j, r]
        centre(j, B, Z)
        for r in range(4):
            Z[j, r] += Z[count, r]
            A[j, r] = u * mode_means[first, r] + v * A[count, r] + w * mode_means[first + j, r]
    whole = n - n % LANES
    for c in range(0, whole, LANES):
        mix_columns(c, LANES, k, count, probabilities, shares, mode_V, T)
    if whole < n:
        mix_columns(whole, n - whole, k, count, probabilities, shares, mode_V, T)


@in_loop
def mix_columns(
    c: int, lanes: int, k: int, count: int, probabilities: Floats, shares: Floats, mode_V: Floats,
    T: Floats,
) -> None:  # fmt: skip
    """Fill T with the mixed V of each mode, columns from c on."""
    first = k * count
    for r in range(4):
        hub = load_lanes(mode_V, first, r, c, lanes)
        arms = probabilities[k, 1] * load_lanes(mode_V, first + 1, r, c, lanes) + 0.0
        for i in range(2, count):
            arms = arms + probabilities[k, i] * load_lanes(mode_V, first + i, r, c, lanes)
        for j in range(count):
            own = load_lanes(mode_V, first + j, r, c, lanes)
            mixed = shares[j, 0] * hub + shares[j, 1] * arms + shares[j, 2] * own
            store_lanes(T, j, r, c, lanes, mixed)


@in_loop
def refer_to_middle(k: int, count: int, weights: Floats, X: Floats, Z: Floats) -> None:
    """Take from each row of X their mean by ``weights[k]``, which is put into the last row of Z."""
    for r in range(4):
        mean = 0.0
        for i in range(count):
            mean += weights[k, i] * X[i, r]
        for i in range(count):
            X[i, r] -= mean
        Z[count, r] = mean


@in_loop
def second_moment(row: int, i: int, mode_covariances: Floats, X: Floats, S: Floats) -> None:
    """Set row i of S to P + x xᵀ."""
    x0, x1, x2, x3 = X[i, 0], X[i, 1], X[i, 2], X[i, 3]
    S[i, 0] = mode_covariances[row, 0] + x0 * x0
    S[i, 1] = mode_covariances[row, 1] + x0 * x1
    S[i, 2] = mode_covariances[row, 2] + x0 * x2
    S[i, 3] = mode_covariances[row, 3] + x0 * x3
    S[i, 4] = mode_covariances[row, 4] + x1 * x1
    S[i, 5] = mode_covariances[row, 5] + x1 * x2
    S[i, 6] = mode_covariances[row, 6] + x1 * x3
    S[i, 7] = mode_covariances[row, 7] + x2 * x2
    S[i, 8] = mode_covariances[row, 8] + x2 * x3
    S[i, 9] = mode_covariances[row, 9] + x3 * x3


@in_loop
def centre(j: int, B: Floats, Z: Floats) -> None:
    """Make row j of B, second moments, the covariance about row j of Z."""
    x0, x1, x2, x3 = Z[j, 0], Z[j, 1], Z[j, 2], Z[j, 3]
    B[j, 0] -= x0 * x0
    B[j, 1] -= x0 * x1
    B[j, 2] -= x0 * x2
    B[j, 3] -= x0 * x3
    B[j, 4] -= x1 * x1
    B[j, 5] -= x1 * x2
    B[j, 6] -= x1 * x3
    B[j, 7] -= x2 * x2
    B[j, 8] -= x2 * x3
    B[j, 9] -= x3 * x3


@in_loop
def move_mode(
    row: int, j: int, dt: float, modes: Floats, more: float, mode_means: Floats,
    mode_covariances: Floats, mode_V: Floats, X: Floats, A: Floats, B: Floats, T: Floats,
    Z: Floats,
) -> None:  # fmt: skip
    """Set row, and row j of X, to the mixed state of mode j, moved on as the mode moves.

    ``more`` is a density that comes to those of the mode, m²/s³, in every direction.
    """
    v0, v1 = Z[j, 2], Z[j, 3]
    P = load_covariance(B, j)
    course = course_of(modes[j, LATERAL], v0, v1, P[7] + P[9], dt)
    s, c, cosine, sine = course
    X[j, 0] = Z[j, 0] + s * v0 + c * v1
    X[j, 1] = Z[j, 1] + s * v1 - c * v0
    X[j, 2] = cosine * v0 + sine * v1
    X[j, 3] = cosine * v1 - sine * v0
    # The noise belongs to the middle of the way.
    density = frame_density(
        0.5 * (v0 + X[j, 2]), 0.5 * (v1 + X[j, 3]), modes[j, ALONG] + more, modes[j, ACROSS] + more
    )
    store_covariance(mode_covariances, row, turned_covariance(P, course, dt, density))
    mode_means[row, 0] = A[j, 0] + s * A[j, 2] + c * A[j, 3]
    mode_means[row, 1] = A[j, 1] + s * A[j, 3] - c * A[j, 2]
    mode_means[row, 2] = cosine * A[j, 2] + sine * A[j, 3]
    mode_means[row, 3] = cosine * A[j, 3] - sine * A[j, 2]
    n = T.shape[2]
    whole = n - n % LANES
    for m in range(0, whole, LANES):
        move_columns(m, LANES, row, j, course, mode_V, T)
    if whole < n:
        move_columns(whole, n - whole, row, j, course, mode_V, T)


@in_loop
def move_columns(
    m: int, lanes: int, row: int, j: int, course: Course, mode_V: Floats, T: Floats
) -> None:
    """Set row of V, columns from m on, to row j of T, moved on."""
    s, c, cosine, sine = course
    t0 = load_lanes(T, j, 0, m, lanes)
    t1 = load_lanes(T, j, 1, m, lanes)
    t2 = load_lanes(T, j, 2, m, lanes)
    t3 = load_lanes(T, j, 3, m, lanes)
    store_lanes(mode_V, row, 0, m, lanes, t0 + s * t2 + c * t3)
    store_lanes(mode_V, row, 1, m, lanes, t1 + s * t3 - c * t2)
    store_lanes(mode_V, row, 2, m, lanes, cosine * t2 + sine * t3)
    store_lanes(mode_V, row, 3, m, lanes, cosine * t3 - sine * t2)


@in_loop
def course_of(lateral: float, v0: float, v1: float, variance: float, dt: float) -> Course:
    """Return ∫cos ωt, ∫sin ωt over dt, cos ω dt and sin ω dt of a turn with a lateral acceleration.

    ω = lateral / speed, clockwise positive; less where the variance of the velocity leaves the
    speed unknown, and none at rest.
    """
    squared = v0 * v0 + v1 * v1
    s, c, cosine, sine = dt, 0.0, 1.0, 0.0
    rate = lateral * math.sqrt(squared) / max(squared + variance, SLOW_SPEED_SQUARED)
    angle = rate * dt
    if abs(angle) > 1e-6:
        cosine = math.cos(angle)
        sine = math.sin(angle)
        s = sine / rate
        c = (1.0 - cosine) / rate
    return s, c, cosine, sine


@in_loop
def frame_density(v0: float, v1: float, along: float, across: float) -> Density:
    """Return the density of white acceleration along and across a velocity: 00, 01, 11.

    The same in all directions, their mean, for an aircraft at rest; what is between is continuous.
    """
    ee = v0 * v0
    nn = v1 * v1
    m = max(ee + nn, SLOW_SPEED_SQUARED)
    rest = 0.5 * (along + across) * (1.0 - (ee + nn) / m)
    return (
        (along * ee + across * nn) / m + rest,
        (along - across) * v0 * v1 / m,
        (along * nn + across * ee) / m + rest,
    )


@in_loop
def turned_covariance(P: Packed, course: Course, dt: float, density: Density) -> Packed:
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


@in_loop
def join_modes(
    k: int, count: int, probabilities: Floats, means: Floats, covariances: Floats, V: Floats,
    mode_means: Floats, mode_covariances: Floats, mode_V: Floats, X: Floats, S: Floats, Z: Floats,
) -> None:  # fmt: skip
    """Set the state of aircraft k to that of its modes as a whole: the same moments.

    X holds x of each mode; it, S and Z are overwritten.
    """
    first = k * count
    n = V.shape[2]
    refer_to_middle(k, count, probabilities, X, Z)
    for m in range(10):
        covariances[k, m] = 0.0
    for i in range(count):
        p = probabilities[k, i]
        second_moment(first + i, i, mode_covariances, X, S)
        for m in range(10):
            covariances[k, m] += p * S[i, m]
    for r in range(4):
        a = 0.0
        for i in range(count):
            a += probabilities[k, i] * mode_means[first + i, r]
        means[k, r] = a
    whole = n - n % LANES
    for c in range(0, whole, LANES):
        join_columns(c, LANES, k, count, probabilities, V, mode_V)
    if whole < n:
        join_columns(whole, n - whole, k, count, probabilities, V, mode_V)


@in_loop
def join_columns(
    c: int, lanes: int, k: int, count: int, probabilities: Floats, V: Floats, mode_V: Floats
) -> None:
    """Set V of aircraft k, columns from c on, to the mean of its modes."""
    first = k * count
    for r in range(4):
        mean = probabilities[k, 0] * load_lanes(mode_V, first, r, c, lanes)
        for i in range(1, count):
            mean = mean + probabilities[k, i] * load_lanes(mode_V, first + i, r, c, lanes)
        store_lanes(V, k, r, c, lanes, mean)


@in_loop
def read_modes(
    row: int, k: int, count: int, modes: Floats, probabilities: Floats, readouts: Floats
) -> None:
    """Add to a readout how likely a right turn, a left one and a change of speed are, if known."""
    right, left, speeding = 0.0, 0.0, 0.0
    for j in range(1, count):
        p = probabilities[k, j]
        # Before the second plot the first probability alone says that none is known.
        p = np.nan if np.isnan(probabilities[k, 0]) else p
        if modes[j, LATERAL] > 0.0:
            right += p
        elif modes[j, LATERAL] < 0.0:
            left += p
        else:
            speeding += p
    readouts[row, READOUT_MODES] = right
    readouts[row, READOUT_MODES + 1] = left
    readouts[row, READOUT_MODES + 2] = speeding
