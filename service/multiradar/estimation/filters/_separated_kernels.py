"""Compiled filters that drop the cross-covariances: Blom's separated filters, and CI.

Symbols beside those of `_kernels`: N = H P Hᵀ, B = J P_ς Jᵀ, ν = innovation without biases, γ =
weight of covariance intersection, R = its bound, kept where the others keep P.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    BIASES_AS_NOISE,
    BIASES_KNOWN,
    CONE,
    CONE_RATIO,
    DOWNWEIGHT_NIS,
    PREDICTED,
    REFUSE_NIS,
    REFUSED,
    SINGULAR,
    UPDATED,
    begin_row,
    covariance_times_transposed,
    finish_row,
    gain_times_update,
    note_surprise,
    squared_norm,
)
from multiradar.estimation.filters.arrays import Aircraft, Model, Result, Rows, Work
from multiradar.estimation.measurement._kernels import (
    KIND_RADAR,
    bias_column,
    bias_spread,
    predict_measurement,
)
from multiradar.geodesy._kernels import wrap_angle

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Golden sections of the weight of covariance intersection; the last bracket is 2 % wide.
GAMMA_ITERATIONS = 14
# The trace to be minimised adds m² and (m/s)²: a velocity counts as the way of ten seconds.
SCALE_TIME_SQUARED_S2 = 100.0
# Columns of a logged contribution: ν0 ν1 N00 N01 N11 W0 W1 range range-rate azimuth-rate.
LOG_COUNT = 10


@njit(cache=True, nogil=True, error_model="numpy")
def scaled_trace(
    gamma: float,
    trace: float,
    m: tuple[float, float, float],
    n: tuple[float, float, float],
    b: tuple[float, float, float],
    w: tuple[float, float],
) -> float:
    """Return tr T R̂(γ) of (1.45); trace = tr T R, m = C R T R Cᵀ, n = C R Cᵀ, b = the other."""
    g = 1.0 + gamma
    h = 1.0 + 1.0 / gamma
    s00 = g * n[0] + h * b[0] + w[0]
    s01 = g * n[1] + h * b[1]
    s11 = g * n[2] + h * b[2] + w[1]
    det = s00 * s11 - s01 * s01
    return g * (trace - g * (m[0] * s11 - 2.0 * m[1] * s01 + m[2] * s00) / det)


@njit(cache=True, nogil=True, error_model="numpy")
def best_gamma(
    trace: float,
    m: tuple[float, float, float],
    n: tuple[float, float, float],
    b: tuple[float, float, float],
    w: tuple[float, float],
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
def step_blom(
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    want_readout: bool,
) -> None:
    """Take the rows in the given order by Blom's separated filters (report, (1.34)-(1.38))."""
    H = np.empty((2, 2))
    W = np.empty(2)
    G = np.empty((4, 2))
    K = np.empty((4, 2))
    for p in work.partitions:
        for i in range(work.bounds[p], work.bounds[p + 1]):
            row = work.order[i]
            outcome, height, variance = begin_row(row, rows, model, aircraft, BIASES_KNOWN, H, W)
            if outcome == PREDICTED:
                outcome, e0, e1 = compare(
                    row, height, variance, rows, model, aircraft, result, H, W, G
                )
                if outcome == UPDATED:
                    k = rows.slot[row]
                    n00, n01, n11 = result.log[row, 2], result.log[row, 3], result.log[row, 4]
                    add_known_information(row, p, rows, model, result)
                    gain_times_update(
                        aircraft.mean[k], aircraft.covariance[k], G, K,
                        n00 + W[0], n01, n11 + W[1], e0, e1,
                    )  # fmt: skip
            finish_row(row, outcome, rows, model, aircraft, result, want_readout)


@njit(cache=True, nogil=True, error_model="numpy")
def step_intersection(
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    want_readout: bool,
) -> None:
    """Take the rows in the given order by covariance intersection (report, (1.43)-(1.45)).

    The half of the biases is logged; `multiradar.estimation.bias` folds it at the end of the epoch.
    """
    H = np.empty((2, 2))
    W = np.empty(2)
    G = np.empty((4, 2))
    K = np.empty((4, 2))
    for p in work.partitions:
        for i in range(work.bounds[p], work.bounds[p + 1]):
            row = work.order[i]
            result.log[row, 5] = 0.0
            outcome, height, variance = begin_row(row, rows, model, aircraft, BIASES_AS_NOISE, H, W)
            if outcome == PREDICTED:
                outcome, e0, e1 = compare(
                    row, height, variance, rows, model, aircraft, result, H, W, G
                )
                if outcome == UPDATED:
                    intersect(row, e0, e1, rows, model, aircraft, result, W, G, K)
            finish_row(row, outcome, rows, model, aircraft, result, want_readout)


@njit(cache=True, nogil=True, error_model="numpy")
def compare(
    row: int,
    height: float,
    height_variance: float,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    H: Floats,
    W: Floats,
    G: Floats,
) -> tuple[int, float, float]:
    """Log the innovation of a row and gate it; return the outcome and e, and fill W and G."""
    k = rows.slot[row]
    s = rows.sensor[row]
    kind = rows.kind[row]
    options = model.options
    a, P, log = aircraft.mean[k], aircraft.covariance[k], result.log[row]
    p0, p1, ground = predict_measurement(
        kind, model.plane, model.sites[s], model.noises[s], a[0], a[1], height, height_variance,
        H, W,
    )  # fmt: skip
    if kind == KIND_RADAR and ground < options[CONE_RATIO] * (height - model.noises[s, 3]):
        return CONE, 0.0, 0.0
    nu0 = rows.z[row, 0] - p0
    nu1 = rows.z[row, 1] - p1
    if kind == KIND_RADAR:
        nu1 = wrap_angle(nu1)
    r_rate = H[0, 0] * a[2] + H[0, 1] * a[3]
    az_rate = H[1, 0] * a[2] + H[1, 1] * a[3]
    e0 = nu0
    e1 = nu1
    first, last = model.starts[s], model.starts[s + 1]
    for c in range(first, last):
        j0, j1 = bias_column(model.parameters[c], p0, r_rate, az_rate)
        e0 -= j0 * model.bias[c]
        e1 -= j1 * model.bias[c]
    covariance_times_transposed(P, H, G)
    n00 = H[0, 0] * G[0, 0] + H[0, 1] * G[1, 0]
    n01 = H[0, 0] * G[0, 1] + H[0, 1] * G[1, 1]
    n11 = H[1, 0] * G[0, 1] + H[1, 1] * G[1, 1]
    b00, b01, b11 = bias_spread(
        first, last, model.parameters, model.bias_covariance, p0, r_rate, az_rate
    )
    # The gate is written so that NaN fails it.
    nis = squared_norm(n00 + b00 + W[0], n01 + b01, n11 + b11 + W[1], e0, e1)
    note_surprise(k, nis, aircraft, options)
    if not nis <= options[REFUSE_NIS]:
        return REFUSED if np.isfinite(nis) else SINGULAR, 0.0, 0.0
    if nis > options[DOWNWEIGHT_NIS]:
        W[0] *= nis / options[DOWNWEIGHT_NIS]
        W[1] *= nis / options[DOWNWEIGHT_NIS]
    log[0], log[1], log[2], log[3], log[4] = nu0, nu1, n00, n01, n11
    log[5], log[6], log[7], log[8], log[9] = W[0], W[1], p0, r_rate, az_rate
    return UPDATED, e0, e1


@njit(cache=True, nogil=True, error_model="numpy")
def add_known_information(
    row: int, partition: int, rows: Rows, model: Model, result: Result
) -> None:
    """Sum (1.37), (1.38) in information form: Y += Jᵀ W⁻¹ J, y += Jᵀ W⁻¹ ν, aircraft as known."""
    s = rows.sensor[row]
    log = result.log[row]
    last = model.starts[s + 1]
    for c in range(model.starts[s], last):
        j0, j1 = bias_column(model.parameters[c], log[7], log[8], log[9])
        result.vector[partition, c] += j0 * log[0] / log[5] + j1 * log[1] / log[6]
        for d in range(c, last):
            k0, k1 = bias_column(model.parameters[d], log[7], log[8], log[9])
            result.information[partition, c, d] += j0 * k0 / log[5] + j1 * k1 / log[6]


@njit(cache=True, nogil=True, error_model="numpy")
def intersect(
    row: int,
    e0: float,
    e1: float,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    W: Floats,
    G: Floats,
    K: Floats,
) -> None:
    """Correct the aircraft by (1.45) with the γ of the least scaled trace."""
    k = rows.slot[row]
    s = rows.sensor[row]
    a, P, log = aircraft.mean[k], aircraft.covariance[k], result.log[row]
    n = (log[2], log[3], log[4])
    b = bias_spread(
        model.starts[s], model.starts[s + 1], model.parameters, model.bias_covariance,
        log[7], log[8], log[9],
    )  # fmt: skip
    if b[0] + b[2] == 0.0:
        gain_times_update(a, P, G, K, n[0] + W[0], n[1], n[2] + W[1], e0, e1)
        return
    t = SCALE_TIME_SQUARED_S2
    trace = P[0] + P[4] + t * (P[7] + P[9])
    m = (
        G[0, 0] ** 2 + G[1, 0] ** 2 + t * (G[2, 0] ** 2 + G[3, 0] ** 2),
        G[0, 0] * G[0, 1] + G[1, 0] * G[1, 1] + t * (G[2, 0] * G[2, 1] + G[3, 0] * G[3, 1]),
        G[0, 1] ** 2 + G[1, 1] ** 2 + t * (G[2, 1] ** 2 + G[3, 1] ** 2),
    )
    gamma = best_gamma(trace, m, n, b, (W[0], W[1]))
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
        a, P, G, K,
        g * n[0] + h * b[0] + W[0], g * n[1] + h * b[1], g * n[2] + h * b[2] + W[1], e0, e1,
    )  # fmt: skip
