"""Compiled two-stage filter: many measurements of many aircraft in one call.

Symbols beside those of `_kernels`: J = how the biases of the measuring sensor enter, U = H V + J =
sensitivity of the predicted measurement to all biases, ν = innovation at bias zero, N = H P Hᵀ,
Y, y = information matrix and vector of the biases (upper triangle).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    CONE,
    CONE_RATIO,
    DOWNWEIGHT_NIS,
    EXPECTED_NIS,
    REFUSE_NIS,
    REFUSED,
    SINGULAR,
    UPDATED,
    covariance_times_transposed,
    gain_times_update,
    squared_norm,
    surprise_after,
)
from multiradar.estimation.filters.arrays import Aircraft
from multiradar.estimation.measurement._kernels import (
    bias_column,
    measures_azimuth,
    predict_measurement,
)
from multiradar.geodesy._kernels import wrap_angle

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@njit(cache=True, nogil=True, error_model="numpy")
def correct_two_stage(
    kind: int,
    z0: float,
    z1: float,
    height: float,
    height_variance: float,
    plane: Floats,
    site: Floats,
    noise: Floats,
    first: int,
    last: int,
    parameters: Integers,
    bias: Floats,
    factor: Floats,
    options: Floats,
    surprise: float,
    informs: bool,
    a: Floats,
    P: Floats,
    V: Floats,
    Y: Floats,
    y: Floats,
    H: Floats,
    W: Floats,
    G: Floats,
    K: Floats,
    U: Floats,
) -> tuple[int, float]:
    """Correct an aircraft that was moved to the time of a measurement.

    Returns what became of the measurement, and the surprise with it. ``informs`` says whether it
    may speak about the biases.
    """
    n = bias.shape[0]
    x0, x1, x2, x3 = a[0], a[1], a[2], a[3]
    for c in range(n):
        x0 += V[0, c] * bias[c]
        x1 += V[1, c] * bias[c]
        x2 += V[2, c] * bias[c]
        x3 += V[3, c] * bias[c]
    p0, p1, ground = predict_measurement(
        kind, plane, site, noise, x0, x1, height, height_variance, H, W
    )
    if ground < options[CONE_RATIO] * (height - noise[3]):
        return CONE, surprise
    e0 = z0 - p0
    e1 = z1 - p1
    if measures_azimuth(kind):
        e1 = wrap_angle(e1)
    # ν = z − h(χ̂) + H V ς̂: the innovation at bias zero, linearised at χ̂ = a + V ς̂.
    nu0 = e0 + H[0, 0] * (x0 - a[0]) + H[0, 1] * (x1 - a[1])
    nu1 = e1 + H[1, 0] * (x0 - a[0]) + H[1, 1] * (x1 - a[1])
    for c in range(n):
        U[0, c] = H[0, 0] * V[0, c] + H[0, 1] * V[1, c]
        U[1, c] = H[1, 0] * V[0, c] + H[1, 1] * V[1, c]
    rate0 = H[0, 0] * x2 + H[0, 1] * x3
    rate1 = H[1, 0] * x2 + H[1, 1] * x3
    for c in range(first, last):
        j0, j1 = bias_column(kind, parameters[c], site, p0, p1, rate0, rate1)
        U[0, c] += j0
        U[1, c] += j1
        e0 -= j0 * bias[c]
        e1 -= j1 * bias[c]
    covariance_times_transposed(P, H, G)
    n00 = H[0, 0] * G[0, 0] + H[0, 1] * G[1, 0]
    n01 = H[0, 0] * G[0, 1] + H[0, 1] * G[1, 1]
    n11 = H[1, 0] * G[0, 1] + H[1, 1] * G[1, 1]
    # The gates are written so that NaN fails them.
    nis = squared_norm(n00 + W[0], n01 + W[1], n11 + W[2], e0, e1)
    if not nis <= EXPECTED_NIS:
        # Only now the uncertainty of the biases is worth its cost: it can but lower the figure.
        nis = squared_norm_with_biases(n00 + W[0], n01 + W[1], n11 + W[2], e0, e1, U, factor)
        if not nis <= options[REFUSE_NIS]:
            return REFUSED if np.isfinite(nis) else SINGULAR, surprise
        surprise = surprise_after(surprise, nis, options)
        if nis > options[DOWNWEIGHT_NIS]:
            W *= nis / options[DOWNWEIGHT_NIS]
    else:
        surprise = surprise_after(surprise, nis, options)
    s00, s01, s11 = n00 + W[0], n01 + W[1], n11 + W[2]
    gain_times_update(a, P, G, K, s00, s01, s11, nu0, nu1)
    for i in range(4):
        for c in range(n):
            V[i, c] -= K[i, 0] * U[0, c] + K[i, 1] * U[1, c]
    if informs:
        add_information(s00, s01, s11, nu0, nu1, U, Y, y)
    return UPDATED, surprise


@njit(cache=True, nogil=True, error_model="numpy")
def squared_norm_with_biases(
    s00: float, s01: float, s11: float, e0: float, e1: float, U: Floats, factor: Floats
) -> float:
    """Return eᵀ (S + U P_ς Uᵀ)⁻¹ e."""
    n = U.shape[1]
    for j in range(n):
        w0 = 0.0
        w1 = 0.0
        for c in range(j, n):
            w0 += U[0, c] * factor[j, c]
            w1 += U[1, c] * factor[j, c]
        s00 += w0 * w0
        s01 += w0 * w1
        s11 += w1 * w1
    return squared_norm(s00, s01, s11, e0, e1)


@njit(cache=True, nogil=True, error_model="numpy")
def add_information(
    s00: float,
    s01: float,
    s11: float,
    nu0: float,
    nu1: float,
    U: Floats,
    Y: Floats,
    y: Floats,
) -> None:
    """Y += Uᵀ S⁻¹ U, y += Uᵀ S⁻¹ ν."""
    n = U.shape[1]
    det = s00 * s11 - s01 * s01
    i00 = s11 / det
    i01 = -s01 / det
    i11 = s00 / det
    t0 = i00 * nu0 + i01 * nu1
    t1 = i01 * nu0 + i11 * nu1
    for c in range(n):
        u0 = i00 * U[0, c] + i01 * U[1, c]
        u1 = i01 * U[0, c] + i11 * U[1, c]
        y[c] += U[0, c] * t0 + U[1, c] * t1
        for d in range(c, n):
            Y[c, d] += u0 * U[0, d] + u1 * U[1, d]


@njit(cache=True, nogil=True, error_model="numpy")
def anchor_aircraft(
    used: Integers, aircraft: Aircraft, complement: Floats, G: Floats, spread: Floats
) -> None:
    """Anchor all aircraft anew after a drift: a += V (I − G) ς̂, P += V G Q Vᵀ, V ← V G.

    ``complement`` is (I − G) ς̂, ``spread`` is G Q_ς.
    """
    n = complement.shape[0]
    R = np.empty((4, n))
    for k in used:
        V = aircraft.sensitivity[k]
        P = aircraft.covariance[k]
        for i in range(4):
            x = 0.0
            for c in range(n):
                x += V[i, c] * complement[c]
            aircraft.mean[k, i] += x
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
