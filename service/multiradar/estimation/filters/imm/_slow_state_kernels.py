"""Compiled slow states of one aircraft: what its reports of its motion have in common over time.

A report of the velocity through the air is that over ground less the wind, turned by the magnetic
variation. These errors last for minutes, so they are states, not noise: w = wind east and north,
κ + iδ = relative error of the airspeed (temperature) and magnetic variation, g = error of reported
ground velocities, τ = age of the reports. Each aircraft has its own, β; they are biases in the
sense of Friedland, private to the aircraft, with the same form as those of radars: D = derivative
of the state of a mode by β, so D and P of the modes are processed by the same kernels as V and P.
Unlike a, which holds at bias zero, the means hold at the current estimate of β: wherever that
changes, so do the means.

    air:     u = v − w − (κ u + δ u⊥) − τ a
    ground:  u = v + g − τ a

with u = reported velocity, u⊥ = (u_n, −u_e), u turned clockwise, and a = acceleration of the mode
across the velocity. As a complex factor 1 + κ + iδ is any rotation and any scale, this is exact
for a large variation.

β keeps its covariance B instead of an information matrix, as only one aircraft informs about it.
Its drift changes no past state: D ← D G, P ← P + D G Q Dᵀ, with G = B (B + Q)⁻¹. In cruise the
airspeed and the track are held: a change of the wind along the track changes the ground speed, one
across it the heading. So the drift leaves v − d dᵀ w unchanged, with d = direction of v.

References
----------
Friedland, B., "Treatment of bias in recursive filtering", IEEE TAC 14 (1969), 359-367. Slow states
of interacting modes are the project's own.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import ALL_BLOCKS
from multiradar.estimation.filters.arrays import REPORTED_COUNT, SLOW_COUNT, Aircraft
from multiradar.estimation.filters.imm._mode_column_kernels import correct_columns
from multiradar.estimation.filters.imm._mode_scratch_kernels import (
    POSTERIOR,
    PREDICTED,
    SLOPE,
    SlowScratch,
    State,
)
from multiradar.estimation.filters.two_stage._information_kernels import spread_of_biases
from multiradar.estimation.filters.two_stage._two_stage_kernels import apply_bias_drift_to_state
from multiradar_compiled.kernels import in_both, inner_loop
from multiradar_compiled.lane_kernels import LANES, load_row

Floats = NDArray[np.float64]
Triple = tuple[float, float, float]

# Slow states: wind east and north, m/s; κ and δ times `NOMINAL_SPEED_MPS`, so that all have the
# unit m/s; error of reported ground velocities east and north, m/s; τ times
# `NOMINAL_ACCELERATION_MPS2`.
WIND = 0
SCALE = 2
VARIATION = 3
GROUND = 4
AGE = 6
NOMINAL_SPEED_MPS = 200.0
NOMINAL_ACCELERATION_MPS2 = 5.0
# Registers are written once or twice a second: half a second in the mean.
AGE_MPS = 0.5 * NOMINAL_ACCELERATION_MPS2
# Prior sigmas: jet streams, 20 K, 6°, inertial navigation, 0.3 s.
WIND_SIGMA_MPS = 25.0
SCALE_SIGMA_MPS = 6.0
VARIATION_SIGMA_MPS = 20.0
GROUND_SIGMA_MPS = 1.5
AGE_SIGMA_MPS = 0.3 * NOMINAL_ACCELERATION_MPS2
# Random walks, (m/s)²/s: of the wind along a level flight and with the square of the vertical rate
# (shear of 5 m/s per km), of κ with the height, of δ (a compass errs with the heading), of g.
WIND_DRIFT = 0.02
WIND_DRIFT_BY_CLIMB = 0.0025
SCALE_DRIFT = 0.001
VARIATION_DRIFT = 0.0005
GROUND_DRIFT = 0.003
AGE_DRIFT = 0.001
# Slowest velocity with a direction, m/s.
SLOWEST_MPS = 20.0
# Longest interval of drift, s.
DRIFT_MAX_S = 300.0

# Columns of `Aircraft.reported`: time of the last drift, s; consecutive rejected headings; what was
# used last: heading, airspeed, track angle, ground speed, and the times of these four, s; the last
# acceleration across the velocity.
DRIFTED_AT = 0
REJECTED_COUNT = 1
LAST = 2
LAST_AT = 6
LAST_LATERAL = 10


@inner_loop
def initialise_slow_states(k: int, count: int, time: float, aircraft: Aircraft) -> None:
    """Set the slow states of aircraft k to their prior."""
    slow, B, D = aircraft.slow, aircraft.slow_covariance, aircraft.slow_sensitivity
    for c in range(SLOW_COUNT):
        slow[k, c] = AGE_MPS if c == AGE else 0.0
        for d in range(SLOW_COUNT):
            B[k, c, d] = 0.0
        sigma = WIND_SIGMA_MPS
        if c == SCALE:
            sigma = SCALE_SIGMA_MPS
        elif c == VARIATION:
            sigma = VARIATION_SIGMA_MPS
        elif c == AGE:
            sigma = AGE_SIGMA_MPS
        elif c >= GROUND:
            sigma = GROUND_SIGMA_MPS
        B[k, c, c] = sigma * sigma
    for row in range(k * count, (k + 1) * count):
        for i in range(4):
            for c in range(SLOW_COUNT):
                D[row, i, c] = 0.0
    aircraft.reported[k, DRIFTED_AT] = time
    aircraft.reported[k, REJECTED_COUNT] = 0.0
    for i in range(LAST, REPORTED_COUNT):
        aircraft.reported[k, i] = np.nan


@inner_loop
def drift_slow_states(
    k: int, count: int, time: float, climb: float, aircraft: Aircraft, slow: SlowScratch
) -> None:
    """Let the slow states of aircraft k drift since the last report; the modes are adjusted."""
    B, at = aircraft.slow_covariance, aircraft.reported
    dt = min(max(time - at[k, DRIFTED_AT], 0.0), DRIFT_MAX_S)
    at[k, DRIFTED_AT] = time
    if not dt > 0.0:
        return
    n = SLOW_COUNT
    wind = WIND_DRIFT
    if not np.isnan(climb):
        wind += WIND_DRIFT_BY_CLIMB * climb * climb
    R, square = slow.U, slow.square
    for c in range(n):
        rate = wind
        if c == SCALE:
            rate = SCALE_DRIFT
        elif c == VARIATION:
            rate = VARIATION_DRIFT
        elif c == AGE:
            rate = AGE_DRIFT
        elif c >= GROUND:
            rate = GROUND_DRIFT
        R[0, c] = rate * dt
        R[1, c] = 0.0
        for d in range(n):
            square[c, d] = B[k, c, d]
        square[c, c] += R[0, c]
    invert(square)
    # G = I − Q (B + Q)⁻¹ in the second matrix, G Q in the first.
    for c in range(n):
        for d in range(n):
            square[n + c, d] = -R[0, c] * square[c, d]
        square[n + c, c] += 1.0
    for c in range(n):
        for d in range(n):
            square[c, d] = square[n + c, d] * R[0, d]
    v0, v1 = aircraft.mean[k, 2], aircraft.mean[k, 3]
    part = 1.0 / max(v0 * v0 + v1 * v1, SLOWEST_MPS * SLOWEST_MPS)
    for row in range(k * count, (k + 1) * count):
        # v − d dᵀ w does not change with the wind.
        add_along(-part, v0, v1, aircraft.slow_sensitivity[row])
        apply_bias_drift_to_state(
            aircraft.mode_mean[row], aircraft.mode_covariance[row],
            aircraft.slow_sensitivity[row], R[1], square[n:], square[:n], slow.shift,
        )  # fmt: skip
        add_along(part, v0, v1, aircraft.slow_sensitivity[row])
    for c in range(n):
        B[k, c, c] += R[0, c]


@inner_loop
def add_along(part: float, v0: float, v1: float, D: Floats) -> None:
    """Add a part of v vᵀ to the derivative of the velocity by the wind."""
    D[2, WIND] += part * v0 * v0
    D[2, WIND + 1] += part * v0 * v1
    D[3, WIND] += part * v1 * v0
    D[3, WIND + 1] += part * v1 * v1


@inner_loop
def invert(square: Floats) -> None:
    """Invert the first `SLOW_COUNT` rows, a positive definite matrix, in place (Gauss-Jordan)."""
    for p in range(SLOW_COUNT):
        pivot = 1.0 / square[p, p]
        square[p, p] = 1.0
        for c in range(SLOW_COUNT):
            square[p, c] *= pivot
        for r in range(SLOW_COUNT):
            if r != p:
                factor = square[r, p]
                square[r, p] = 0.0
                for c in range(SLOW_COUNT):
                    square[r, c] -= factor * square[p, c]


@inner_loop
def slow_spread(
    k: int, count: int, scratch: Floats, aircraft: Aircraft, slow: SlowScratch
) -> Triple:
    """Return U B Uᵀ of a measured position, with U = H D of the modes and their mean."""
    D = aircraft.slow_sensitivity
    for c in range(SLOW_COUNT):
        mean0, mean1 = 0.0, 0.0
        for j in range(count):
            row = k * count + j
            u0 = scratch[SLOPE, j] * D[row, 0, c] + scratch[SLOPE + 1, j] * D[row, 1, c]
            u1 = scratch[SLOPE + 2, j] * D[row, 0, c] + scratch[SLOPE + 3, j] * D[row, 1, c]
            slow.by_mode[j, 0, c] = u0
            slow.by_mode[j, 1, c] = u1
            mean0 += scratch[PREDICTED, j] * u0
            mean1 += scratch[PREDICTED, j] * u1
        slow.U[0, c] = mean0
        slow.U[1, c] = mean1
    return spread_of_biases(slow.U, aircraft.slow_covariance[k], slow.R)


@inner_loop
def correct_slow_states(
    k: int, count: int, r: tuple[float, float], S: Triple, scratch: Floats, aircraft: Aircraft,
    slow: SlowScratch,
) -> None:  # fmt: skip
    """Update the slow states by a measurement that has updated the modes.

    r and S are the moments of the mixture, S with the uncertainty of all biases; U is that of the
    measurement, K is in the scratch array. D ← D − K U, β ← β + B Uᵀ S⁻¹ r, B ← B − B Uᵀ S⁻¹ U B;
    ``slow.shift`` is the change of each mode, D times that of β.
    """
    B, D, U, R = aircraft.slow_covariance, aircraft.slow_sensitivity, slow.U, slow.R
    correct_columns(k, count, scratch, D, slow.by_mode, ALL_BLOCKS)
    n = SLOW_COUNT
    scale = 1.0 / (S[0] * S[2] - S[1] * S[1])
    i00, i01, i11 = S[2] * scale, -S[1] * scale, S[0] * scale
    for c in range(n):
        f0, f1 = 0.0, 0.0
        for d in range(n):
            f0 += B[k, c, d] * U[0, d]
            f1 += B[k, c, d] * U[1, d]
        R[0, c] = f0
        R[1, c] = f1
    for i in range(4):
        for j in range(LANES):
            slow.shift[i, j] = 0.0
    for c in range(n):
        k0 = R[0, c] * i00 + R[1, c] * i01
        k1 = R[0, c] * i01 + R[1, c] * i11
        change = k0 * r[0] + k1 * r[1]
        aircraft.slow[k, c] += change
        for j in range(count):
            for i in range(4):
                slow.shift[i, j] += D[k * count + j, i, c] * change
        for d in range(c, n):
            x = B[k, c, d] - (k0 * R[0, d] + k1 * R[1, d])
            if d == c:
                x = max(x, 1e-12)
            B[k, c, d] = x
            B[k, d, c] = x


@in_both
def with_shift(x: State, shift: Floats) -> State:
    """Return the state of each mode, changed by D Δβ."""
    return (
        x[0] + load_row(shift, 0, 0, LANES),
        x[1] + load_row(shift, 1, 0, LANES),
        x[2] + load_row(shift, 2, 0, LANES),
        x[3] + load_row(shift, 3, 0, LANES),
    )


@inner_loop
def add_slow_spread(k: int, count: int, scratch: Floats, aircraft: Aircraft) -> None:
    """Add Σ μ D B Dᵀ to the covariance of aircraft k, the mixture of its modes."""
    for j in range(count):
        add_spread(
            scratch[POSTERIOR, j], aircraft.slow_sensitivity[k * count + j],
            aircraft.slow_covariance[k], aircraft.covariance[k],
        )  # fmt: skip


@inner_loop
def absorb_slow_states(k: int, count: int, aircraft: Aircraft) -> None:
    """Discard the slow states of aircraft k: their uncertainty becomes one of the modes."""
    if aircraft.slow.shape[1] == 0 or np.isnan(aircraft.slow[k, 0]):
        return
    for row in range(k * count, (k + 1) * count):
        add_spread(
            1.0, aircraft.slow_sensitivity[row], aircraft.slow_covariance[k],
            aircraft.mode_covariance[row],
        )  # fmt: skip
    aircraft.slow[k, 0] = np.nan


@inner_loop
def add_spread(share: float, D: Floats, B: Floats, upper: Floats) -> None:
    """Add a share of D B Dᵀ to a covariance, an upper triangle."""
    m = 0
    for i in range(4):
        for j in range(i, 4):
            total = 0.0
            for c in range(SLOW_COUNT):
                part = 0.0
                for d in range(SLOW_COUNT):
                    part += B[c, d] * D[j, d]
                total += D[i, c] * part
            upper[m] += share * total
            m += 1
