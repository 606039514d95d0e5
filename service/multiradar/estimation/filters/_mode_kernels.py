"""Compiled modes of motion: how an aircraft passes from one to another, mixes them, moves in each.

Mode 0 is the hub: straight flight. The others, the arms, are manoeuvres. An aircraft leaves the hub
at the rate λ₀, for every arm alike, and an arm at the rate λ₁, for the hub.

Symbols: μ = probabilities of the modes, a, V, P = a mode's conditional mean, sensitivity to the
biases and covariance, x = a + V ς̂ = its estimate at the published biases, c = probabilities of the
modes after a passage, w = share of what an aircraft was in what it is now.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import SLOW_SPEED_SQUARED
from multiradar.estimation.filters._two_stage_kernels import component
from multiradar.estimation.motion._kernels import Density, Packed, load_covariance, store_covariance
from multiradar.kernels import in_loop

Floats = NDArray[np.float64]

Course = tuple[float, float, float, float]

# Columns of `Model.modes`: acceleration across the velocity, m/s², right positive; densities of
# white acceleration along the velocity and across it, m²/s³; rate of leaving the mode, 1/s.
LATERAL = 0
ALONG = 1
ACROSS = 2
LEAVING = 3
MODE_COUNT = 4

# Less than this no mode is held for, so that each can come back.
PROBABILITY_MIN = 1e-9


@in_loop
def spread_over_modes(
    k: int, count: int, modes: Floats, means: Floats, covariances: Floats, V: Floats,
    mode_means: Floats, mode_covariances: Floats, mode_V: Floats, probabilities: Floats,
) -> None:  # fmt: skip
    """Let aircraft k, of which one state is known, be in any mode, as often as modes are."""
    hub = resting_share(count, modes)
    for j in range(count):
        row = k * count + j
        probabilities[k, j] = hub if j == 0 else (1.0 - hub) / (count - 1)
        store_covariance(mode_covariances, row, load_covariance(covariances, k))
        for i in range(4):
            mode_means[row, i] = means[k, i]
            for c in range(V.shape[2]):
                mode_V[row, i, c] = V[k, i, c]


@in_loop
def resting_share(count: int, modes: Floats) -> float:
    """Return which part of the time an aircraft is in the hub."""
    share = 1.0
    if count > 1:
        share = modes[1, LEAVING] / (modes[0, LEAVING] + modes[1, LEAVING])
    return share


@in_loop
def pass_modes(
    k: int, count: int, dt: float, modes: Floats, probabilities: Floats, C: Floats, shares: Floats
) -> None:
    """Fill C with c and shares[i, j] with w, by the exact exponential of the rates."""
    hub = resting_share(count, modes)
    arms = max(count - 1, 1)
    stays = math.exp(-modes[min(1, count - 1), LEAVING] * dt)
    forgets = math.exp(-modes[0, LEAVING] * dt) * stays if count > 1 else 1.0
    to_hub = hub * (1.0 - forgets)
    to_arm = (1.0 - hub) * (1.0 - forgets) / arms
    other = max(0.0, 1.0 - to_hub - stays) / arms
    for j in range(count):
        total = 0.0
        for i in range(count):
            p = to_arm if i == 0 else other
            if j == 0:
                p = to_hub
            if i == j:
                p = 1.0 - arms * to_arm if i == 0 else other + stays
            shares[i, j] = p * probabilities[k, i]
            total += shares[i, j]
        C[j] = total
        for i in range(count):
            shares[i, j] /= total


@in_loop
def mix_modes(
    k: int, count: int, bias: Floats, shares: Floats, mode_means: Floats, mode_covariances: Floats,
    mode_V: Floats, X: Floats, A: Floats, B: Floats, T: Floats,
) -> None:  # fmt: skip
    """Fill A, B and T with the mixed a, P and V of each mode.

    a₀ = Σ w a and V₀ = Σ w V, affine in the biases; P₀ = Σ w (P + (x − x₀) (x − x₀)ᵀ).
    """
    first = k * count
    for i in range(count):
        for r in range(4):
            X[i, r] = component(mode_means, mode_V, bias, first + i, r)
    for j in range(count):
        for r in range(4):
            a = 0.0
            for i in range(count):
                a += shares[i, j] * mode_means[first + i, r]
            A[j, r] = a
        gather(j, count, first, shares[:, j], mode_covariances, X, B)
        for r in range(4):
            for c in range(bias.shape[0]):
                T[j, r, c] = shares[0, j] * mode_V[first, r, c]
            for i in range(1, count):
                w = shares[i, j]
                for c in range(bias.shape[0]):
                    T[j, r, c] += w * mode_V[first + i, r, c]


@in_loop
def gather(
    j: int, count: int, first: int, weights: Floats, mode_covariances: Floats, X: Floats, B: Floats
) -> None:
    """Set row j of B to the covariance of a mixture: of its parts, and of their estimates."""
    x0, x1, x2, x3 = 0.0, 0.0, 0.0, 0.0
    for i in range(count):
        w = weights[i]
        x0 += w * X[i, 0]
        x1 += w * X[i, 1]
        x2 += w * X[i, 2]
        x3 += w * X[i, 3]
    for m in range(10):
        B[j, m] = 0.0
    for i in range(count):
        w = weights[i]
        row = first + i
        d0, d1, d2, d3 = X[i, 0] - x0, X[i, 1] - x1, X[i, 2] - x2, X[i, 3] - x3
        B[j, 0] += w * (mode_covariances[row, 0] + d0 * d0)
        B[j, 1] += w * (mode_covariances[row, 1] + d0 * d1)
        B[j, 2] += w * (mode_covariances[row, 2] + d0 * d2)
        B[j, 3] += w * (mode_covariances[row, 3] + d0 * d3)
        B[j, 4] += w * (mode_covariances[row, 4] + d1 * d1)
        B[j, 5] += w * (mode_covariances[row, 5] + d1 * d2)
        B[j, 6] += w * (mode_covariances[row, 6] + d1 * d3)
        B[j, 7] += w * (mode_covariances[row, 7] + d2 * d2)
        B[j, 8] += w * (mode_covariances[row, 8] + d2 * d3)
        B[j, 9] += w * (mode_covariances[row, 9] + d3 * d3)


@in_loop
def move_mode(
    row: int, j: int, dt: float, modes: Floats, bias: Floats, mode_means: Floats,
    mode_covariances: Floats, mode_V: Floats, A: Floats, B: Floats, T: Floats,
) -> None:  # fmt: skip
    """Set row to the mixed state of mode j, moved on as the mode moves."""
    v0 = component(A, T, bias, j, 2)
    v1 = component(A, T, bias, j, 3)
    P = load_covariance(B, j)
    course = course_of(modes[j, LATERAL], v0, v1, P[7] + P[9], dt)
    s, c, cosine, sine = course
    # The noise belongs to the middle of the way.
    density = frame_density(
        v0 + 0.5 * ((cosine - 1.0) * v0 + sine * v1), v1 + 0.5 * ((cosine - 1.0) * v1 - sine * v0),
        modes[j, ALONG], modes[j, ACROSS],
    )  # fmt: skip
    store_covariance(mode_covariances, row, turned_covariance(P, course, dt, density))
    mode_means[row, 0] = A[j, 0] + s * A[j, 2] + c * A[j, 3]
    mode_means[row, 1] = A[j, 1] + s * A[j, 3] - c * A[j, 2]
    mode_means[row, 2] = cosine * A[j, 2] + sine * A[j, 3]
    mode_means[row, 3] = cosine * A[j, 3] - sine * A[j, 2]
    for m in range(bias.shape[0]):
        mode_V[row, 0, m] = T[j, 0, m] + s * T[j, 2, m] + c * T[j, 3, m]
    for m in range(bias.shape[0]):
        mode_V[row, 1, m] = T[j, 1, m] + s * T[j, 3, m] - c * T[j, 2, m]
    for m in range(bias.shape[0]):
        mode_V[row, 2, m] = cosine * T[j, 2, m] + sine * T[j, 3, m]
    for m in range(bias.shape[0]):
        mode_V[row, 3, m] = cosine * T[j, 3, m] - sine * T[j, 2, m]


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
    k: int, count: int, bias: Floats, probabilities: Floats, means: Floats, covariances: Floats,
    V: Floats, mode_means: Floats, mode_covariances: Floats, mode_V: Floats, X: Floats, B: Floats,
) -> None:  # fmt: skip
    """Set the state of aircraft k to that of its modes as a whole: the same moments."""
    first = k * count
    for i in range(count):
        for r in range(4):
            X[i, r] = component(mode_means, mode_V, bias, first + i, r)
    gather(0, count, first, probabilities[k], mode_covariances, X, B)
    store_covariance(covariances, k, load_covariance(B, 0))
    for r in range(4):
        a = 0.0
        for i in range(count):
            a += probabilities[k, i] * mode_means[first + i, r]
        means[k, r] = a
        for c in range(bias.shape[0]):
            V[k, r, c] = probabilities[k, 0] * mode_V[first, r, c]
        for i in range(1, count):
            w = probabilities[k, i]
            for c in range(bias.shape[0]):
                V[k, r, c] += w * mode_V[first + i, r, c]
