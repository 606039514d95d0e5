"""Compiled filters that drop the cross-covariances: Blom's separated filters, and CI.

Symbols beside those of `_kernels`: N = H P Hᵀ, B = J P_ς Jᵀ, ν = innovation without biases, γ =
weight of covariance intersection, R = its bound, kept where the others keep P.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    CONE,
    CONE_RATIO,
    DOWNWEIGHT_NIS,
    LOG_BIASES,
    REFUSE_NIS,
    REFUSED,
    SINGULAR,
    UPDATED,
    covariance_times_transposed,
    gain_times_update,
    squared_norm,
    surprise_after,
)
from multiradar.estimation.measurement._kernels import (
    bias_column,
    bias_spread,
    measures_azimuth,
    predict_measurement,
)
from multiradar.geodesy._kernels import wrap_angle

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Golden sections of the weight of covariance intersection; the last bracket is 2 % wide.
GAMMA_ITERATIONS = 14
# The trace to be minimised adds m² and (m/s)²: a velocity counts as the way of ten seconds.
SCALE_TIME_SQUARED_S2 = 100.0


@njit(cache=True, nogil=True, error_model="numpy")
def scaled_trace(
    gamma: float,
    trace: float,
    m: tuple[float, float, float],
    n: tuple[float, float, float],
    b: tuple[float, float, float],
    w: tuple[float, float, float],
) -> float:
    """Return tr T R̂(γ) of (1.45); trace = tr T R, m = C R T R Cᵀ, n = C R Cᵀ, b = the other."""
    g = 1.0 + gamma
    h = 1.0 + 1.0 / gamma
    s00 = g * n[0] + h * b[0] + w[0]
    s01 = g * n[1] + h * b[1] + w[1]
    s11 = g * n[2] + h * b[2] + w[2]
    det = s00 * s11 - s01 * s01
    return g * (trace - g * (m[0] * s11 - 2.0 * m[1] * s01 + m[2] * s00) / det)


@njit(cache=True, nogil=True, error_model="numpy")
def best_gamma(
    trace: float,
    m: tuple[float, float, float],
    n: tuple[float, float, float],
    b: tuple[float, float, float],
    w: tuple[float, float, float],
) -> float:
    """Return the γ with the least scaled trace, 0 when no γ improves the bound (then K = 0).

    Golden sections of the logarithm; the bracket is that of γ worth trying, 10⁻⁶ to 10².
    """
    low = -13.8
    high = 4.6
    ratio = 0.6180339887498949
    left = high - ratio * (high - low)
    right = low + ratio * (high - low)
    f_left = scaled_trace(np.exp(left), trace, m, n, b, w)
    f_right = scaled_trace(np.exp(right), trace, m, n, b, w)
    for _ in range(GAMMA_ITERATIONS):
        if f_left < f_right:
            high = right
            right = left
            f_right = f_left
            left = high - ratio * (high - low)
            f_left = scaled_trace(np.exp(left), trace, m, n, b, w)
        else:
            low = left
            left = right
            f_left = f_right
            right = low + ratio * (high - low)
            f_right = scaled_trace(np.exp(right), trace, m, n, b, w)
    if f_left < f_right:
        return np.exp(left) if f_left < trace else 0.0
    return np.exp(right) if f_right < trace else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def correct_separated(
    intersects: bool,
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
    bias_covariance: Floats,
    options: Floats,
    surprise: float,
    informs: bool,
    a: Floats,
    P: Floats,
    Y: Floats,
    y: Floats,
    log: Floats,
    H: Floats,
    W: Floats,
    G: Floats,
    K: Floats,
) -> tuple[int, float]:
    """Correct an aircraft that was moved to the time of a measurement, by Blom or by CI.

    Blom takes the biases as known for the aircraft and the aircraft as known for the biases, (1.34)
    to (1.38). CI logs the half of the biases, which is folded at the end of the epoch. Returns what
    became of the measurement, and the surprise with it. ``informs`` says whether it may speak about
    the biases.
    """
    p0, p1, ground = predict_measurement(
        kind, plane, site, noise, a[0], a[1], height, height_variance, H, W
    )
    if ground < options[CONE_RATIO] * (height - noise[3]):
        return CONE, surprise
    nu0 = z0 - p0
    nu1 = z1 - p1
    if measures_azimuth(kind):
        nu1 = wrap_angle(nu1)
    rate0 = H[0, 0] * a[2] + H[0, 1] * a[3]
    rate1 = H[1, 0] * a[2] + H[1, 1] * a[3]
    e0 = nu0
    e1 = nu1
    for c in range(first, last):
        j0, j1 = bias_column(kind, parameters[c], site, p0, p1, rate0, rate1)
        e0 -= j0 * bias[c]
        e1 -= j1 * bias[c]
    covariance_times_transposed(P, H, G)
    n = (
        H[0, 0] * G[0, 0] + H[0, 1] * G[1, 0],
        H[0, 0] * G[0, 1] + H[0, 1] * G[1, 1],
        H[1, 0] * G[0, 1] + H[1, 1] * G[1, 1],
    )
    b = bias_spread(kind, site, first, last, parameters, bias_covariance, p0, p1, rate0, rate1)
    # The gate is written so that NaN fails it.
    nis = squared_norm(n[0] + b[0] + W[0], n[1] + b[1] + W[1], n[2] + b[2] + W[2], e0, e1)
    if not nis <= options[REFUSE_NIS]:
        return REFUSED if np.isfinite(nis) else SINGULAR, surprise
    surprise = surprise_after(surprise, nis, options)
    if nis > options[DOWNWEIGHT_NIS]:
        W *= nis / options[DOWNWEIGHT_NIS]
    if intersects:
        log[0], log[1], log[2], log[3], log[4] = nu0, nu1, n[0], n[1], n[2]
        log[5], log[6], log[7] = W[0], W[1], W[2]
        for c in range(first, last):
            j = LOG_BIASES + 2 * (c - first)
            log[j], log[j + 1] = bias_column(kind, parameters[c], site, p0, p1, rate0, rate1)
        if not informs:
            log[5] = 0.0
        intersect(n, b, e0, e1, a, P, W, G, K)
        return UPDATED, surprise
    # (1.37), (1.38) in information form: Y += Jᵀ W⁻¹ J, y += Jᵀ W⁻¹ ν.
    det = W[0] * W[2] - W[1] * W[1]
    i00, i01, i11 = W[2] / det, -W[1] / det, W[0] / det
    for c in range(first, last if informs else first):
        j0, j1 = bias_column(kind, parameters[c], site, p0, p1, rate0, rate1)
        u0, u1 = i00 * j0 + i01 * j1, i01 * j0 + i11 * j1
        y[c] += u0 * nu0 + u1 * nu1
        for d in range(c, last):
            k0, k1 = bias_column(kind, parameters[d], site, p0, p1, rate0, rate1)
            Y[c, d] += u0 * k0 + u1 * k1
    gain_times_update(a, P, G, K, n[0] + W[0], n[1] + W[1], n[2] + W[2], e0, e1)
    return UPDATED, surprise


@njit(cache=True, nogil=True, error_model="numpy")
def intersect(
    n: tuple[float, float, float],
    b: tuple[float, float, float],
    e0: float,
    e1: float,
    a: Floats,
    P: Floats,
    W: Floats,
    G: Floats,
    K: Floats,
) -> None:
    """Correct an aircraft by (1.45) with the γ of the least scaled trace."""
    if b[0] + b[2] == 0.0:
        gain_times_update(a, P, G, K, n[0] + W[0], n[1] + W[1], n[2] + W[2], e0, e1)
        return
    t = SCALE_TIME_SQUARED_S2
    trace = P[0] + P[4] + t * (P[7] + P[9])
    m = (
        G[0, 0] ** 2 + G[1, 0] ** 2 + t * (G[2, 0] ** 2 + G[3, 0] ** 2),
        G[0, 0] * G[0, 1] + G[1, 0] * G[1, 1] + t * (G[2, 0] * G[2, 1] + G[3, 0] * G[3, 1]),
        G[0, 1] ** 2 + G[1, 1] ** 2 + t * (G[2, 1] ** 2 + G[3, 1] ** 2),
    )
    gamma = best_gamma(trace, m, n, b, (W[0], W[1], W[2]))
    if gamma == 0.0:
        # No weight improves the bound: the aircraft stays as predicted, else the bound would grow.
        return
    g = 1.0 + gamma
    h = 1.0 + 1.0 / gamma
    for i in range(10):
        P[i] *= g
    for i in range(4):
        G[i, 0] *= g
        G[i, 1] *= g
    gain_times_update(
        a,
        P,
        G,
        K,
        g * n[0] + h * b[0] + W[0],
        g * n[1] + h * b[1] + W[1],
        g * n[2] + h * b[2] + W[2],
        e0,
        e1,
    )
