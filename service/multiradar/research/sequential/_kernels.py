"""Compiled sequential form: one measurement per epoch, applied to the biases at once.

Symbols: ς̂, P = estimate and covariance of the biases; Y = P⁻¹ in units of the prior's sigmas; R =
upper triangular with R Rᵀ = Y, F = R⁻¹, so that P = Fᵀ F; Q = covariance of a walk, G =
P (P + Q)⁻¹.

References
----------
IMM UrO RAN report (2016), equations (1.25) and (1.32) for ς; Friedland, B., "Treatment of bias in
recursive filtering", IEEE TAC 14 (1969), 359-367, in information form.
"""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.bias._kernels import fold_biases
from multiradar.estimation.filters._step_kernels import INTERSECTION, TWO_STAGE, step
from multiradar.estimation.filters.arrays import Aircraft, Model, Result, Rows, Work
from multiradar.estimation.filters.joint._joint_kernels import JOINT, joint_step
from multiradar.estimation.filters.separated._macro_kernels import MACRO, stack_plots
from multiradar.estimation.filters.two_stage._two_stage_kernels import apply_bias_drift
from multiradar.research.sequential.arrays import Store
from multiradar_compiled.kernels import inlined_kernel, kernel

Floats = NDArray[np.float64]


@inlined_kernel
def update_rows(
    method: int,
    first: int,
    last: int,
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    store: Store,
    want_readout: bool,
) -> None:
    """Update with the rows first…last − 1 as one epoch, and apply their information to the biases.

    Several rows are of one aircraft, at one time and by different sensors.
    ``work.order`` counts 0, 1, 2, …; its bounds are set here.
    """
    work.bounds[0] = first
    work.bounds[1] = last
    if method == JOINT:
        joint_step(work, rows, model, aircraft, result, want_readout)
        return
    step(method, work, rows, model, aircraft, result, want_readout)
    if method == MACRO:
        stack_plots(rows.slot[first], model, aircraft, result.information[0], result.vector[0])
    if method == INTERSECTION:
        fold_biases(
            result.log[first:last], rows.sensor[first:last], model.starts,
            1.0 / (store.scale * store.scale), model.bias, model.bias_covariance,
        )  # fmt: skip
        result.log[first:last] = 0.0
        return
    fold_sums(model, store, result.information[0], result.vector[0])


@kernel
def fold_sums(model: Model, store: Store, information: Floats, vector: Floats) -> None:
    """Y += I, ς̂ += P (vector − I ς̂); I (information, upper triangle) and vector are set to zero."""
    n = model.bias.shape[0]
    informative = False
    for c in range(n):
        for d in range(c, n):
            if information[c, d] != 0.0:
                informative = True
                store.information[c, d] += information[c, d] * store.scale[c] * store.scale[d]
    if not informative:
        return
    for c in range(n):
        for d in range(n):
            vector[c] -= information[min(c, d), max(c, d)] * model.bias[d]
    invert_information(model, store)
    for c in range(n):
        for d in range(n):
            model.bias[c] += model.bias_covariance[c, d] * vector[d]
    information[:] = 0.0
    vector[:] = 0.0


@kernel
def invert_information(model: Model, store: Store) -> None:
    """P and its factor F from Y, by R Rᵀ = Y from the last row upwards and F = R⁻¹."""
    Y, F, P = store.information, model.factor, model.bias_covariance
    n = Y.shape[0]
    R = np.zeros((n, n))
    for j in range(n - 1, -1, -1):
        for i in range(j, -1, -1):
            x = Y[i, j]
            for k in range(j + 1, n):
                x -= R[i, k] * R[j, k]
            R[i, j] = sqrt(x) if i == j else x / R[j, j]
    for j in range(n):
        F[j, j] = 1.0 / R[j, j]
        for i in range(j - 1, -1, -1):
            x = 0.0
            for k in range(i + 1, j + 1):
                x -= R[i, k] * F[k, j]
            F[i, j] = x / R[i, i]
    for j in range(n):
        for i in range(j, n):
            F[j, i] *= store.scale[i]
    for c in range(n):
        for d in range(c, n):
            x = 0.0
            for k in range(c + 1):
                x += F[k, c] * F[k, d]
            P[c, d] = x
            P[d, c] = x


@kernel
def inform(model: Model, store: Store) -> None:
    """Y and F from P: after P was changed by anything but measurement information."""
    P, Y, F = model.bias_covariance, store.information, model.factor
    n = Y.shape[0]
    L = np.zeros((n, n))
    M = np.zeros((n, n))
    for j in range(n):
        for i in range(j, n):
            x = P[i, j] / (store.scale[i] * store.scale[j])
            for k in range(j):
                x -= L[i, k] * L[j, k]
            L[i, j] = sqrt(x) if i == j else x / L[j, j]
    for j in range(n):
        M[j, j] = 1.0 / L[j, j]
        for i in range(j + 1, n):
            x = 0.0
            for k in range(j, i):
                x -= L[i, k] * M[k, j]
            M[i, j] = x / L[i, i]
    for c in range(n):
        for d in range(c, n):
            x = 0.0
            for k in range(d, n):
                x += M[k, c] * M[k, d]
            Y[c, d] = x
            Y[d, c] = x
            F[c, d] = L[d, c] * store.scale[d]


@kernel
def walk(method: int, duration: float, model: Model, aircraft: Aircraft, store: Store) -> None:
    """P ← P + Q; re-anchor aircraft of the two-stage filter, which depend on the biases.

    (I − G) = Q (P + Q)⁻¹ needs no difference of nearly equal matrices.
    """
    n = model.bias.shape[0]
    P = model.bias_covariance
    if not store.drift.any():
        return
    for c in range(n):
        P[c, c] += store.drift[c] * store.drift[c] * duration
    inform(model, store)
    if method != TWO_STAGE:
        return
    G = np.empty((n, n))
    spread = np.empty((n, n))
    complement = np.zeros(n)
    for c in range(n):
        q = store.drift[c] * store.drift[c] * duration
        for d in range(n):
            y = store.information[min(c, d), max(c, d)] / (store.scale[c] * store.scale[d])
            G[c, d] = -q * y
            complement[c] += q * y * model.bias[d]
        G[c, c] += 1.0
    for c in range(n):
        for d in range(n):
            spread[c, d] = G[c, d] * store.drift[d] * store.drift[d] * duration
    started = np.flatnonzero(~np.isnan(aircraft.time))
    apply_bias_drift(started, aircraft, complement, G, spread)
