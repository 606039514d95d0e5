"""Compiled two-stage filter: many measurements of many aircraft in one call.

Symbols beside those of `_kernels`: J = derivative by the biases of the sensor, U = H V + J =
sensitivity of the predicted measurement to all biases, R = S⁻¹ U, ν = innovation at bias zero, N =
H P Hᵀ, Y, y = information matrix and vector of the biases.

Loops run over all columns: loops over a triangle would take longer.

References
----------
Friedland, B., "Treatment of bias in recursive filtering", IEEE TAC 14 (1969), 359-367. Biases
common to many aircraft, and the adjustment after their drift, are the project's own.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._delay_kernels import (
    add_delay_columns,
    apply_drift_to_delay,
    correct_delay,
    drift_of_delay,
    drift_with_delay,
    inform_with_delay,
    measures_delay,
    shift_with_delay,
    spread_of_delay,
)
from multiradar.estimation.filters._kernels import (
    CONE,
    CONE_RATIO,
    DOWNWEIGHT_NIS,
    EXPECTED_NIS,
    REJECT_NIS,
    SINGULAR,
    UPDATED,
    correct_state,
    covariance_times_transposed,
    gain_of,
    gated,
    position_part,
    record_innovation,
    singular,
    squared_norm,
    updated_fading_nis,
)
from multiradar.estimation.filters.arrays import DELAY_SIGMA, Aircraft, BiasSums, Model, Sight
from multiradar.estimation.filters.two_stage._information_kernels import inform, spread_of_biases
from multiradar.estimation.measurement._kernels import (
    PARAMETER_TIME_OFFSET,
    bias_column,
    expected_measurement,
    measures_azimuth,
)
from multiradar.estimation.motion._kernels import load_covariance
from multiradar.geodesy._kernels import wrap_angle
from multiradar_compiled.kernels import fused, in_loop, kernel
from multiradar_compiled.lane_kernels import (
    LANES,
    load_lanes,
    load_row,
    store_lanes,
    store_row,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@in_loop
def correct_two_stage(
    sight: Sight, k: int, s: int, informs: bool, model: Model, aircraft: Aircraft, sums: BiasSums,
    innovations: Floats, row: int,
) -> int:  # fmt: skip
    """Update aircraft k, predicted to the time of a measurement by sensor s; return the outcome.

    With ``informs`` the measurement contributes to the biases. A range is without the delay of the
    transponder at the published biases.
    """
    kind, z0, z1, height, height_variance = sight
    plane, sites, noises, starts = model.plane, model.sites, model.noises, model.starts
    parameters, bias, options = model.parameters, model.bias, model.options
    bias_covariance = model.bias_covariance
    means, covariances, V = aircraft.mean, aircraft.covariance, aircraft.sensitivity
    velocities, fading_nis = aircraft.velocity, aircraft.fading_nis
    Y, y, U, R = sums
    n = bias.shape[0]
    delayed = aircraft.delay.shape[1] > 0
    first, last = starts[s], starts[s + 1]
    site, noise = sites[s], noises[s]
    x0 = component(means, V, bias, k, 0)
    x1 = component(means, V, bias, k, 1)
    p0, p1, ground, h, w = expected_measurement(
        kind, plane, site, noise, x0, x1, height, height_variance
    )
    e0 = z0 - p0
    e1 = z1 - p1
    if measures_azimuth(kind):
        e1 = wrap_angle(e1)
    # ν = z − h(χ̂) + H V ς̂: the innovation at bias zero, linearised at χ̂ = a + V ς̂.
    d0 = x0 - means[k, 0]
    d1 = x1 - means[k, 1]
    nu0 = e0 + h[0] * d0 + h[1] * d1
    nu1 = e1 + h[2] * d0 + h[3] * d1
    for c in range(0, n, LANES):
        lanes = min(LANES, n - c)
        v0, v1 = load_lanes(V, k, 0, c, lanes), load_lanes(V, k, 1, c, lanes)
        store_row(U, 0, c, lanes, h[0] * v0 + h[1] * v1)
        store_row(U, 1, c, lanes, h[2] * v0 + h[3] * v1)
    for c in range(first, last):
        rate0, rate1 = 0.0, 0.0
        # Not the current velocity: see `_time_offset_kernels`. Zero while it is unknown.
        if parameters[c] == PARAMETER_TIME_OFFSET and not np.isnan(velocities[k, 0]):
            rate0 = h[0] * velocities[k, 0] + h[1] * velocities[k, 1]
            rate1 = h[2] * velocities[k, 0] + h[3] * velocities[k, 1]
        j0, j1 = bias_column(kind, parameters[c], site, p0, p1, rate0, rate1)
        U[0, c] += j0
        U[1, c] += j1
        e0 -= j0 * bias[c]
        e1 -= j1 * bias[c]
    o = (0.0, 0.0, 0.0)
    if delayed:
        if measures_delay(kind, s, model):
            nu0 += add_delay_columns(k, aircraft.delay, bias, U)
        o = spread_of_delay(U)
    P = load_covariance(covariances, k)
    G = covariance_times_transposed(P, h)
    n00, n01, n11 = position_part(h, G)
    weight = 1.0
    b00, b01, b11 = np.nan, np.nan, np.nan
    nis = squared_norm(n00 + w[0], n01 + w[1], n11 + w[2], e0, e1)
    # The gates are written so that NaN fails them.
    harmless = min(EXPECTED_NIS, min(options[DOWNWEIGHT_NIS], options[REJECT_NIS]))
    if not nis <= harmless and nis < np.inf:
        # The uncertainty of the biases can only lower NIS, so its cost is spared below the limit.
        b00, b01, b11 = spread_of_biases(U, bias_covariance, R)
        nis = squared_norm(n00 + w[0] + b00, n01 + w[1] + b01, n11 + w[2] + b11, e0, e1)
        if nis < np.inf:
            weight = max(1.0, nis / options[DOWNWEIGHT_NIS])
    # The delay is an error of the aircraft, not of a sensor.
    record_innovation(
        row, e0, e1, n00 + w[0] + o[0], n01 + w[1] + o[1], n11 + w[2] + o[2], b00 - o[0],
        b01 - o[1], b11 - o[2], innovations,
    )  # fmt: skip
    outcome = gated(nis, options[REJECT_NIS])
    if ground < options[CONE_RATIO] * (height - noise[3]):
        outcome = CONE
    s00, s01, s11 = n00 + weight * w[0], n01 + weight * w[1], n11 + weight * w[2]
    if weight > 1.0 and outcome == UPDATED and singular(s00, s01, s11):
        outcome = SINGULAR
    if outcome == UPDATED:
        scale = 1.0 / (s00 * s11 - s01 * s01)
        i00, i01, i11 = s11 * scale, -s01 * scale, s00 * scale
        fading_nis[k] = updated_fading_nis(fading_nis[k], nis, options)
        K = gain_of(G, i00, i01, i11)
        correct_state(means, covariances, k, P, G, K, nu0, nu1)
        for c in range(0, n, LANES):
            lanes = min(LANES, n - c)
            u0, u1 = load_row(U, 0, c, lanes), load_row(U, 1, c, lanes)
            for r in range(4):
                v = load_lanes(V, k, r, c, lanes)
                store_lanes(V, k, r, c, lanes, v - (K[2 * r] * u0 + K[2 * r + 1] * u1))
        if informs and delayed:
            gain = inform_with_delay(i00, i01, i11, nu0, nu1, sums)
            for r in range(4):
                means[k, r] += V[k, r, n - 1] * (gain[0] * nu0 + gain[1] * nu1)
            shift_with_delay(V[k], gain, U)
            correct_delay(k, gain, nu0, nu1, U, aircraft.delay)
        elif informs:
            inform(i00, i01, i11, nu0, nu1, U, R, Y, y)
    return outcome


@in_loop
def component(means: Floats, V: Floats, bias: Floats, k: int, i: int) -> float:
    """Return component i of χ̂ = a + V ς̂ of aircraft k; two sums, so that they overlap."""
    even: float = means[k, i]
    odd = 0.0
    pairs = bias.shape[0] & ~1
    for c in range(0, pairs, 2):
        even = fused(V[k, i, c], bias[c], even)
        odd = fused(V[k, i, c + 1], bias[c + 1], odd)
    if pairs < bias.shape[0]:
        even = fused(V[k, i, pairs], bias[pairs], even)
    return even + odd


@kernel
def apply_bias_drift(
    used: Integers, aircraft: Aircraft, complement: Floats, G: Floats, spread: Floats
) -> None:
    """Adjust all aircraft and their modes after a drift: see `apply_bias_drift_to_state`.

    ``complement`` is (I − G) ς̂, ``spread`` is G Q_ς.
    """
    R = np.empty((4, complement.shape[0]))
    modes = aircraft.mode_probability.shape[1]
    for k in used:
        if aircraft.delay.shape[1] > 0 and aircraft.delay[k, DELAY_SIGMA] > 0.0:
            drift_delay(k, aircraft, complement, G, spread, R)
        apply_bias_drift_to_state(
            aircraft.mean[k], aircraft.covariance[k], aircraft.sensitivity[k], complement, G,
            spread, R,
        )  # fmt: skip
        for row in range(k * modes, (k + 1) * modes):
            apply_bias_drift_to_state(
                aircraft.mode_mean[row], aircraft.mode_covariance[row],
                aircraft.mode_sensitivity[row], complement, G, spread, R,
            )  # fmt: skip


@kernel
def drift_delay(
    k: int, aircraft: Aircraft, complement: Floats, G: Floats, spread: Floats, R: Floats
) -> None:
    """Adjust the delay of aircraft k, and how its states depend on it, before the states."""
    delay, modes = aircraft.delay, aircraft.mode_probability.shape[1]
    sigma = drift_of_delay(k, delay, spread)
    drift_with_delay(k, sigma, delay, spread, aircraft.covariance[k], aircraft.sensitivity[k])
    for row in range(k * modes, (k + 1) * modes):
        drift_with_delay(
            k, sigma, delay, spread, aircraft.mode_covariance[row], aircraft.mode_sensitivity[row]
        )
    apply_drift_to_delay(k, sigma, complement, G, delay, R)


@kernel
def apply_bias_drift_to_state(
    a: Floats, P: Floats, V: Floats, complement: Floats, G: Floats, spread: Floats, R: Floats
) -> None:
    """Set a += V (I − G) ς̂, P += V G Q Vᵀ, V ← V G; R is scratch."""
    n = complement.shape[0]
    for i in range(4):
        x = 0.0
        for c in range(n):
            x += V[i, c] * complement[c]
        a[i] += x
    for i in range(4):
        for c in range(n):
            x = 0.0
            for d in range(n):
                x += V[i, d] * spread[d, c]
            R[i, c] = x
    m = 0
    for i in range(4):
        for j in range(i, 4):
            x = 0.0
            for c in range(n):
                x += 0.5 * (R[i, c] * V[j, c] + R[j, c] * V[i, c])
            P[m] += x
            m += 1
    for i in range(4):
        for c in range(n):
            x = 0.0
            for d in range(n):
                x += V[i, d] * G[d, c]
            R[i, c] = x
    for i in range(4):
        for c in range(n):
            V[i, c] = R[i, c]
