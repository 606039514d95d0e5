"""Compiled correction of interacting modes, each with the two-stage form.

Symbols beside those of `_kernels`, `_two_stage_kernels` and `_mode_kernels`: r = innovation at the
published biases, L = likelihood of a mode. What a plot says of the biases is that of one Gaussian
with the moments of the mixture: U = Σ c U_j, ν = Σ c ν_j, S = Σ c (S_j + (r_j − r) (r_j − r)ᵀ), so
that a plot by which the modes differ says less.

References
----------
Blom, H. A. P., Bar-Shalom, Y., "The interacting multiple model algorithm for systems with
Markovian switching coefficients", IEEE Transactions on Automatic Control 33 (1988), 780-783: the
probabilities. The project's own: what interacting modes say of shared biases.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    CONE,
    CONE_RATIO,
    DOWNWEIGHT_NIS,
    EXPECTED_NIS,
    REFUSE_NIS,
    SINGULAR,
    UPDATED,
    Gain,
    correct_state,
    covariance_times_transposed,
    gain_of,
    gated,
    note_innovation,
    position_part,
    singular,
    squared_norm,
    surprise_after,
)
from multiradar.estimation.filters._mode_kernels import PROBABILITY_MIN
from multiradar.estimation.filters._two_stage_kernels import spread_of_biases
from multiradar.estimation.measurement._kernels import (
    Slope,
    bias_column,
    measures_azimuth,
    seen_from,
)
from multiradar.estimation.motion._kernels import load_covariance
from multiradar.geodesy._kernels import wrap_angle
from multiradar.kernels import in_loop
from multiradar.lane_kernels import LANES, load_lanes, store_lanes

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Mixture = tuple[float, float, float, float, float]

# Columns of what is seen from a mode: r, ν, H, N = H P Hᵀ, W, ground range.
SEEN_R = 0
SEEN_NU = 2
SEEN_H = 4
SEEN_N = 8
SEEN_W = 11
SEEN_GROUND = 14
SEEN_COUNT = 15


@in_loop
def correct_modes(
    kind: int, z0: float, z1: float, height: float, height_variance: float, k: int, s: int,
    informs: bool, count: int, plane: Floats, sites: Floats, noises: Floats, starts: Integers,
    parameters: Integers, bias: Floats, bias_covariance: Floats, options: Floats,
    mode_means: Floats, mode_covariances: Floats, mode_V: Floats, probabilities: Floats,
    surprises: Floats, X: Floats, C: Floats, seen: Floats, U: Floats, Y: Floats, y: Floats,
    U0: Floats, U1: Floats, R0: Floats, R1: Floats, innovations: Floats, row: int,
) -> int:  # fmt: skip
    """Correct the modes of aircraft k, moved to the time of a measurement by sensor s.

    Returns what became of the measurement. ``informs`` says whether it may speak about the biases.
    """
    n = bias.shape[0]
    for j in range(count):
        look(
            kind, z0, z1, height, height_variance, k * count + j, j, s, plane, sites, noises,
            starts, parameters, bias, mode_means, mode_covariances, mode_V, X, seen, U,
        )  # fmt: skip
    for c in range(n):
        U0[c] = C[0] * U[0, 0, c]
    for c in range(n):
        U1[c] = C[0] * U[0, 1, c]
    for j in range(1, count):
        p = C[j]
        for c in range(n):
            U0[c] += p * U[j, 0, c]
        for c in range(n):
            U1[c] += p * U[j, 1, c]
    ground = 0.0
    for j in range(count):
        ground += C[j] * seen[j, SEEN_GROUND]
    b00, b01, b11 = spread_of_biases(U0, U1, bias_covariance, R0, R1)
    r0, r1, s00, s01, s11 = joined(count, C, seen, 1.0)
    note_innovation(row, r0, r1, s00, s01, s11, b00, b01, b11, innovations)
    nis = squared_norm(s00, s01, s11, r0, r1)
    weight = 1.0
    # The gates are written so that NaN fails them.
    harmless = min(EXPECTED_NIS, min(options[DOWNWEIGHT_NIS], options[REFUSE_NIS]))
    if not nis <= harmless and nis < np.inf:
        nis = squared_norm(s00 + b00, s01 + b01, s11 + b11, r0, r1)
        if nis < np.inf:
            weight = max(1.0, nis / options[DOWNWEIGHT_NIS])
    outcome = gated(nis, options[REFUSE_NIS])
    if ground < options[CONE_RATIO] * (height - noises[s, 3]):
        outcome = CONE
    if outcome == UPDATED and any_singular(count, weight, b00, b01, b11, seen):
        outcome = SINGULAR
    if outcome == UPDATED:
        surprises[k] = surprise_after(surprises[k], nis, options)
        r0, r1, s00, s01, s11 = joined(count, C, seen, weight)
        if informs:
            inform(count, C, seen, s00, s01, s11, U0, U1, R0, R1, Y, y)
        weigh(k, count, weight, b00, b01, b11, C, seen, probabilities)
        for j in range(count):
            correct_mode(k * count + j, j, weight, mode_means, mode_covariances, mode_V, X, seen, U)
    return outcome


@in_loop
def look(
    kind: int, z0: float, z1: float, height: float, height_variance: float, row: int, j: int,
    s: int, plane: Floats, sites: Floats, noises: Floats, starts: Integers, parameters: Integers,
    bias: Floats, mode_means: Floats, mode_covariances: Floats, mode_V: Floats, X: Floats,
    seen: Floats, U: Floats,
) -> None:  # fmt: skip
    """Fill row j of ``seen`` and of U with what mode j expects of a measurement."""
    n = bias.shape[0]
    x0, x1 = X[j, 0], X[j, 1]
    p0, p1, ground, h, w = seen_from(
        kind, plane, sites[s], noises[s], x0, x1, height, height_variance
    )
    e0 = z0 - p0
    e1 = z1 - p1
    if measures_azimuth(kind):
        e1 = wrap_angle(e1)
    d0 = x0 - mode_means[row, 0]
    d1 = x1 - mode_means[row, 1]
    seen[j, SEEN_NU] = e0 + h[0] * d0 + h[1] * d1
    seen[j, SEEN_NU + 1] = e1 + h[2] * d0 + h[3] * d1
    whole = n - n % LANES
    for c in range(0, whole, LANES):
        look_at_columns(c, LANES, row, j, h, mode_V, U)
    if whole < n:
        look_at_columns(whole, n - whole, row, j, h, mode_V, U)
    for c in range(starts[s], starts[s + 1]):
        j0, j1 = bias_column(kind, parameters[c], sites[s], p0, p1, 0.0, 0.0)
        U[j, 0, c] += j0
        U[j, 1, c] += j1
        e0 -= j0 * bias[c]
        e1 -= j1 * bias[c]
    P = load_covariance(mode_covariances, row)
    n00, n01, n11 = position_part(h, covariance_times_transposed(P, h))
    seen[j, SEEN_R] = e0
    seen[j, SEEN_R + 1] = e1
    seen[j, SEEN_H] = h[0]
    seen[j, SEEN_H + 1] = h[1]
    seen[j, SEEN_H + 2] = h[2]
    seen[j, SEEN_H + 3] = h[3]
    seen[j, SEEN_N] = n00
    seen[j, SEEN_N + 1] = n01
    seen[j, SEEN_N + 2] = n11
    seen[j, SEEN_W] = w[0]
    seen[j, SEEN_W + 1] = w[1]
    seen[j, SEEN_W + 2] = w[2]
    seen[j, SEEN_GROUND] = ground


@in_loop
def look_at_columns(
    c: int, lanes: int, row: int, j: int, h: Slope, mode_V: Floats, U: Floats
) -> None:
    """Set row j of U, columns from c on, to H V."""
    v0 = load_lanes(mode_V, row, 0, c, lanes)
    v1 = load_lanes(mode_V, row, 1, c, lanes)
    store_lanes(U, j, 0, c, lanes, h[0] * v0 + h[1] * v1)
    store_lanes(U, j, 1, c, lanes, h[2] * v0 + h[3] * v1)


@in_loop
def any_singular(
    count: int, weight: float, b00: float, b01: float, b11: float, seen: Floats
) -> bool:
    """Return whether S of any mode is singular, with or without the spread of the biases."""
    found = False
    for j in range(count):
        s00 = seen[j, SEEN_N] + weight * seen[j, SEEN_W]
        s01 = seen[j, SEEN_N + 1] + weight * seen[j, SEEN_W + 1]
        s11 = seen[j, SEEN_N + 2] + weight * seen[j, SEEN_W + 2]
        found = found or singular(s00, s01, s11) or singular(s00 + b00, s01 + b01, s11 + b11)
    return found


@in_loop
def joined(count: int, C: Floats, seen: Floats, weight: float) -> Mixture:
    """Return r and S of the mixture: r₀, r₁, S₀₀, S₀₁, S₁₁; the noise counts ``weight`` times."""
    r0 = 0.0
    r1 = 0.0
    for j in range(count):
        r0 += C[j] * seen[j, SEEN_R]
        r1 += C[j] * seen[j, SEEN_R + 1]
    s00, s01, s11 = 0.0, 0.0, 0.0
    for j in range(count):
        d0 = seen[j, SEEN_R] - r0
        d1 = seen[j, SEEN_R + 1] - r1
        s00 += C[j] * (seen[j, SEEN_N] + weight * seen[j, SEEN_W] + d0 * d0)
        s01 += C[j] * (seen[j, SEEN_N + 1] + weight * seen[j, SEEN_W + 1] + d0 * d1)
        s11 += C[j] * (seen[j, SEEN_N + 2] + weight * seen[j, SEEN_W + 2] + d1 * d1)
    return r0, r1, s00, s01, s11


@in_loop
def inform(
    count: int, C: Floats, seen: Floats, s00: float, s01: float, s11: float, U0: Floats,
    U1: Floats, R0: Floats, R1: Floats, Y: Floats, y: Floats,
) -> None:  # fmt: skip
    """Add what the mixture says of the biases: y += Uᵀ S⁻¹ ν, Y += Uᵀ S⁻¹ U."""
    n = y.shape[0]
    nu0 = 0.0
    nu1 = 0.0
    for j in range(count):
        nu0 += C[j] * seen[j, SEEN_NU]
        nu1 += C[j] * seen[j, SEEN_NU + 1]
    scale = 1.0 / (s00 * s11 - s01 * s01)
    i00, i01, i11 = s11 * scale, -s01 * scale, s00 * scale
    for c in range(n):
        R0[c] = i00 * U0[c] + i01 * U1[c]
    for c in range(n):
        R1[c] = i01 * U0[c] + i11 * U1[c]
    for c in range(n):
        y[c] += R0[c] * nu0 + R1[c] * nu1
    for c in range(n):
        r0 = R0[c]
        r1 = R1[c]
        for d in range(n):
            Y[c, d] += r0 * U0[d] + r1 * U1[d]


@in_loop
def weigh(
    k: int, count: int, weight: float, b00: float, b01: float, b11: float, C: Floats, seen: Floats,
    probabilities: Floats,
) -> None:  # fmt: skip
    """Set μ to c L, of sum one; S of L has the spread of the biases in it."""
    best = -np.inf
    for j in range(count):
        s00 = seen[j, SEEN_N] + weight * seen[j, SEEN_W] + b00
        s01 = seen[j, SEEN_N + 1] + weight * seen[j, SEEN_W + 1] + b01
        s11 = seen[j, SEEN_N + 2] + weight * seen[j, SEEN_W + 2] + b11
        r0, r1 = seen[j, SEEN_R], seen[j, SEEN_R + 1]
        det = s00 * s11 - s01 * s01
        norm = (s11 * r0 * r0 - 2.0 * s01 * r0 * r1 + s00 * r1 * r1) / det
        probabilities[k, j] = -0.5 * (norm + math.log(det))
        best = max(best, probabilities[k, j])
    total = 0.0
    for j in range(count):
        p = C[j] * math.exp(probabilities[k, j] - best) + PROBABILITY_MIN
        probabilities[k, j] = p
        total += p
    for j in range(count):
        probabilities[k, j] /= total


@in_loop
def correct_mode(
    row: int, j: int, weight: float, mode_means: Floats, mode_covariances: Floats, mode_V: Floats,
    X: Floats, seen: Floats, U: Floats,
) -> None:  # fmt: skip
    """Correct a, P, V and x of one mode: x = a + V ς̂ moves by K r."""
    n = U.shape[2]
    s00 = seen[j, SEEN_N] + weight * seen[j, SEEN_W]
    s01 = seen[j, SEEN_N + 1] + weight * seen[j, SEEN_W + 1]
    s11 = seen[j, SEEN_N + 2] + weight * seen[j, SEEN_W + 2]
    scale = 1.0 / (s00 * s11 - s01 * s01)
    P = load_covariance(mode_covariances, row)
    h = (seen[j, SEEN_H], seen[j, SEEN_H + 1], seen[j, SEEN_H + 2], seen[j, SEEN_H + 3])
    G = covariance_times_transposed(P, h)
    K = gain_of(G, s11 * scale, -s01 * scale, s00 * scale)
    nu0, nu1 = seen[j, SEEN_NU], seen[j, SEEN_NU + 1]
    correct_state(mode_means, mode_covariances, row, P, G, K, nu0, nu1)
    r0, r1 = seen[j, SEEN_R], seen[j, SEEN_R + 1]
    X[j, 0] += K[0] * r0 + K[1] * r1
    X[j, 1] += K[2] * r0 + K[3] * r1
    X[j, 2] += K[4] * r0 + K[5] * r1
    X[j, 3] += K[6] * r0 + K[7] * r1
    whole = n - n % LANES
    for c in range(0, whole, LANES):
        correct_columns(c, LANES, row, j, K, mode_V, U)
    if whole < n:
        correct_columns(whole, n - whole, row, j, K, mode_V, U)


@in_loop
def correct_columns(
    c: int, lanes: int, row: int, j: int, K: Gain, mode_V: Floats, U: Floats
) -> None:
    """Take K U from row of V, columns from c on."""
    u0 = load_lanes(U, j, 0, c, lanes)
    u1 = load_lanes(U, j, 1, c, lanes)
    for r in range(4):
        v = load_lanes(mode_V, row, r, c, lanes)
        store_lanes(mode_V, row, r, c, lanes, v - (K[2 * r] * u0 + K[2 * r + 1] * u1))
