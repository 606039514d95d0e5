"""Compiled filters that drop the cross-covariances: Blom's separated filters, and CI.

Symbols beside those of `_kernels`: N = H P Hᵀ, B = J P_ς Jᵀ, ν = innovation without biases, γ =
weight of covariance intersection, R = its bound, stored where the others store P.

References
----------
IMM UrO RAN report (2016), equations (1.34) to (1.38), and (1.43) to (1.45).
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    CONE,
    CONE_RATIO,
    DOWNWEIGHT_NIS,
    LOG_BIASES,
    REJECT_NIS,
    SCALE_TIME,
    SINGULAR,
    UPDATED,
    Gain,
    Triple,
    correct_state,
    covariance_times_transposed,
    gain_of,
    gated,
    inverse,
    position_part,
    record_innovation,
    singular,
    squared_norm,
    updated_fading_nis,
)
from multiradar.estimation.filters.arrays import Aircraft, BiasSums, Model, Sight
from multiradar.estimation.filters.separated._intersection_kernels import best_gamma
from multiradar.estimation.measurement._kernels import (
    bias_column,
    bias_spread,
    expected_measurement,
    measures_azimuth,
)
from multiradar.estimation.motion._kernels import Packed, load_covariance
from multiradar.geodesy._kernels import wrap_angle
from multiradar_compiled.kernels import in_loop, kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@in_loop
def correct_separated(
    intersects: bool, sight: Sight, k: int, s: int, informs: bool, model: Model, aircraft: Aircraft,
    sums: BiasSums, logs: Floats, row: int, innovations: Floats,
) -> tuple[int, float]:  # fmt: skip
    """Update aircraft k, predicted to the time of a measurement by sensor s, by Blom or by CI.

    Blom treats the biases as known for the aircraft, and the aircraft as known for the biases,
    (1.34) to (1.38). CI logs the bias part, which updates the biases at the end of the epoch.
    Returns the outcome and the factor of the noise. With ``informs`` the measurement contributes to
    the biases.
    """
    kind, z0, z1, height, height_variance = sight
    plane, sites, noises, starts = model.plane, model.sites, model.noises, model.starts
    parameters, bias, options = model.parameters, model.bias, model.options
    bias_covariance = model.bias_covariance
    means, covariances = aircraft.mean, aircraft.covariance
    fading_nis, Y, y = aircraft.fading_nis, sums.Y, sums.y
    first, last = starts[s], starts[s + 1]
    site, noise = sites[s], noises[s]
    p0, p1, ground, h, w = expected_measurement(
        kind, plane, site, noise, means[k, 0], means[k, 1], height, height_variance
    )
    nu0 = z0 - p0
    nu1 = z1 - p1
    if measures_azimuth(kind):
        nu1 = wrap_angle(nu1)
    rate0 = h[0] * means[k, 2] + h[1] * means[k, 3]
    rate1 = h[2] * means[k, 2] + h[3] * means[k, 3]
    e0 = nu0
    e1 = nu1
    for c in range(first, last):
        j0, j1 = bias_column(kind, parameters[c], site, p0, p1, rate0, rate1)
        e0 -= j0 * bias[c]
        e1 -= j1 * bias[c]
    P = load_covariance(covariances, k)
    G = covariance_times_transposed(P, h)
    n = position_part(h, G)
    b = bias_spread(kind, site, first, last, parameters, bias_covariance, p0, p1, rate0, rate1)
    nis = squared_norm(n[0] + b[0] + w[0], n[1] + b[1] + w[1], n[2] + b[2] + w[2], e0, e1)
    record_innovation(
        row, e0, e1, n[0] + w[0], n[1] + w[1], n[2] + w[2], b[0], b[1], b[2], innovations
    )  # fmt: skip
    outcome = gated(nis, options[REJECT_NIS])
    if ground < options[CONE_RATIO] * (height - noise[3]):
        outcome = CONE
    weight = 1.0
    if outcome == UPDATED:
        weight = max(1.0, nis / options[DOWNWEIGHT_NIS])
    w = (weight * w[0], weight * w[1], weight * w[2])
    s00, s01, s11 = n[0] + w[0], n[1] + w[1], n[2] + w[2]
    if intersects and outcome == UPDATED:
        outcome = intersect(k, n, b, w, P, G, e0, e1, options[SCALE_TIME], means, covariances)
        if outcome == UPDATED and informs:
            log_bias_part(
                kind, site, first, last, parameters, nu0, nu1, n, w, p0, p1, rate0, rate1,
                logs, row,
            )  # fmt: skip
    elif outcome == UPDATED:
        if singular(s00, s01, s11):
            outcome = SINGULAR
        else:
            # (1.37), (1.38) in information form: Y += Jᵀ W⁻¹ J, y += Jᵀ W⁻¹ ν. The inverse is zero
            # for a measurement without noise, whose information would be infinite.
            i00, i01, i11 = inverse(w[0], w[1], w[2])
            for c in range(first, last if informs else first):
                j0, j1 = bias_column(kind, parameters[c], site, p0, p1, rate0, rate1)
                u0, u1 = i00 * j0 + i01 * j1, i01 * j0 + i11 * j1
                y[c] += u0 * nu0 + u1 * nu1
                for d in range(c, last):
                    k0, k1 = bias_column(kind, parameters[d], site, p0, p1, rate0, rate1)
                    Y[c, d] += u0 * k0 + u1 * k1
            scale = 1.0 / (s00 * s11 - s01 * s01)
            K = gain_of(G, s11 * scale, -s01 * scale, s00 * scale)
            correct_state(means, covariances, k, P, G, K, e0, e1)
    if outcome == UPDATED:
        fading_nis[k] = updated_fading_nis(fading_nis[k], nis, options)
    return outcome, weight


@kernel
def log_bias_part(
    kind: int,
    site: Floats,
    first: int,
    last: int,
    parameters: Integers,
    nu0: float,
    nu1: float,
    n: Triple,
    w: Triple,
    p0: float,
    p1: float,
    rate0: float,
    rate1: float,
    logs: Floats,
    row: int,
) -> None:
    """Log the contribution of a measurement to the biases of its sensor: see `LOG_COUNT`."""
    logs[row, 0], logs[row, 1] = nu0, nu1
    logs[row, 2], logs[row, 3], logs[row, 4] = n
    logs[row, 5], logs[row, 6], logs[row, 7] = w
    for c in range(first, last):
        at = LOG_BIASES + 2 * (c - first)
        logs[row, at], logs[row, at + 1] = bias_column(
            kind, parameters[c], site, p0, p1, rate0, rate1
        )


@in_loop
def intersect(
    k: int,
    n: Triple,
    b: Triple,
    w: Triple,
    P: Packed,
    G: Gain,
    e0: float,
    e1: float,
    scale_time: float,
    means: Floats,
    covariances: Floats,
) -> int:
    """Update aircraft k by (1.45) with the γ of the least scaled trace; return the outcome.

    The trace adds m² and (m/s)²: a velocity counts as the distance flown in ``scale_time``, s.
    """
    g = 1.0
    h = 0.0
    if b[0] + b[2] > 0.0:
        t = scale_time * scale_time
        trace = P[0] + P[4] + t * (P[7] + P[9])
        m = (
            G[0] * G[0] + G[2] * G[2] + t * (G[4] * G[4] + G[6] * G[6]),
            G[0] * G[1] + G[2] * G[3] + t * (G[4] * G[5] + G[6] * G[7]),
            G[1] * G[1] + G[3] * G[3] + t * (G[5] * G[5] + G[7] * G[7]),
        )
        gamma = best_gamma(trace, m, n, b, w)
        # If no weight improves the bound, the aircraft stays as predicted.
        g = 0.0
        if gamma > 0.0:
            g = 1.0 + gamma
            h = 1.0 + 1.0 / gamma
    s00 = g * n[0] + h * b[0] + w[0]
    s01 = g * n[1] + h * b[1] + w[1]
    s11 = g * n[2] + h * b[2] + w[2]
    outcome = UPDATED
    if g > 0.0 and singular(s00, s01, s11):
        outcome = SINGULAR
    elif g > 0.0:
        det = s00 * s11 - s01 * s01
        K = gain_of(G, g * s11 / det, -g * s01 / det, g * s00 / det)
        raised = (
            g * P[0], g * P[1], g * P[2], g * P[3], g * P[4], g * P[5], g * P[6], g * P[7],
            g * P[8], g * P[9],
        )  # fmt: skip
        own = (g * G[0], g * G[1], g * G[2], g * G[3], g * G[4], g * G[5], g * G[6], g * G[7])
        correct_state(means, covariances, k, raised, own, K, e0, e1)
    return outcome
