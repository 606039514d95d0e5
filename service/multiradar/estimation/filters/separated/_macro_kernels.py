"""Compiled macro-filter of Blom: single aircraft, biases by stacked plots.

The second variant of the report's section 1.4. The aircraft part is that of the separated filters
(biases as known). For the biases, the plots of one aircraft by m′ radars form one stacked
measurement, and the position of the aircraft, common to all of them, is eliminated: this is the
approximation C_χ P_χς = H with H = −F_χ⁻¹ F_ς P_ςς, in information form. Taken literally (one
summed innovation instead of the stacked one) the sums of the report diverge.

Plots of rotating radars are not simultaneous. The latest plot of each radar in an epoch is
extrapolated to the mean time of these plots with the estimated velocity v̂ of the aircraft, whose
error δv ~ N(0, P_v) is common to them too: it adds H_j P_v H_jᵀ Δ_j Δ_l to the noise of plots j and
l, which is equivalent to eliminating it with the position. For simultaneous plots Δ = 0.

Symbols beside those of `_kernels`: r_j = z_j − h_j without biases, Δ_j = time of plot j minus the
mean time, u = (δx, δv) = errors of position and velocity at the mean time, B_j = (H_j, Δ_j H_j) =
derivative of the measurement by u, M = Σ B_jᵀ W_j⁻¹ B_j + diag(0, P_v⁻¹), C = Σ B_jᵀ W_j⁻¹ J_j.
Eliminating u leaves Y += Σ J_jᵀ W_j⁻¹ J_j − Cᵀ M⁻¹ C and
y += Σ J_jᵀ W_j⁻¹ r_j − Cᵀ M⁻¹ Σ B_jᵀ W_j⁻¹ r_j.

References
----------
IMM UrO RAN report (2016), section 1.4, the macro-filter. The stacked form, and that of plots at
several times, are the project's own.
"""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    SINGULAR_RATIO,
    inverse,
    singular,
)
from multiradar.estimation.filters.arrays import (
    RECENT_EXCESS,
    RECENT_HEIGHT,
    RECENT_KIND,
    RECENT_TIME,
    RECENT_Z0,
    RECENT_Z1,
    Aircraft,
    Model,
    partition_of,
)
from multiradar.estimation.measurement._kernels import (
    bias_column,
    measures_azimuth,
    predict_measurement,
)
from multiradar.estimation.measurement.kinds import KIND_POSITION
from multiradar.geodesy._kernels import wrap_angle
from multiradar_compiled.kernels import in_loop, kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Number of this method, beside those of `_step_kernels`.
MACRO = 11


@in_loop
def store_plot(
    recents: Floats,
    k: int,
    s: int,
    kind: int,
    z0: float,
    z1: float,
    time: float,
    height: float,
    excess: float,
    noises: Floats,
) -> None:
    """Store a plot of aircraft k until `stack_plots`, replacing the last one of its sensor.

    ``excess`` is the factor of its noise in the update of the aircraft, used for the biases too.
    Plots without noise are not stored: they would have infinite information.
    """
    if kind == KIND_POSITION:
        has_noise = noises[s, 2] > 0.0
    else:
        has_noise = noises[s, 0] > 0.0 and noises[s, 1] > 0.0
    if has_noise:
        recents[k, s, RECENT_TIME] = time
        recents[k, s, RECENT_Z0] = z0
        recents[k, s, RECENT_Z1] = z1
        recents[k, s, RECENT_HEIGHT] = height
        recents[k, s, RECENT_KIND] = kind
        recents[k, s, RECENT_EXCESS] = excess


@in_loop
def clear_plots(recents: Floats, k: int) -> None:
    """Clear the stored plots of aircraft k."""
    for s in range(recents.shape[1]):
        recents[k, s, RECENT_TIME] = np.nan


@kernel
def stack_all(
    slots: Integers, model: Model, aircraft: Aircraft, information: Floats, vector: Floats
) -> None:
    """Stack the plots of all aircraft, each into the sums of its partition."""
    for k in slots:
        p = partition_of(k, information.shape[0])
        stack_plots(k, model, aircraft, information[p], vector[p])


@kernel
def stack_plots(k: int, model: Model, aircraft: Aircraft, Y: Floats, y: Floats) -> None:
    """Add the information of the stored plots of an aircraft to Y (upper triangle) and y.

    The plots are cleared. All are linearised at the estimated path of the aircraft: a shift common
    to them is eliminated with the position. Plots from one site alone are not used: the small
    rotation of the line of sight between them could be due to biases or to a different velocity.
    """
    recent = aircraft.recent[k]
    several, middle = middle_time(recent, model.site_numbers)
    P = aircraft.covariance[k]
    if not several or singular(P[7], P[8], P[9]):
        recent[:, RECENT_TIME] = np.nan
        return
    c = model.bias.shape[0]
    M = np.zeros((4, 4))
    M[2, 2], M[3, 2], M[3, 3] = inverse(P[7], P[8], P[9])
    # Columns: those of the biases, and one for the vector; N is added to Y and y.
    C = np.zeros((4, c + 1))
    N = np.zeros((c, c + 1))
    for s in range(recent.shape[0]):
        if not np.isnan(recent[s, RECENT_TIME]):
            add_plot(s, recent[s], middle, aircraft.mean[k], aircraft.time[k], model, M, C, N)
            recent[s, RECENT_TIME] = np.nan
    if not eliminate(M, C):
        return
    for m in range(c):
        for d in range(m, c + 1):
            for i in range(4):
                N[m, d] -= C[i, m] * C[i, d]
    if np.isfinite(N.sum()):
        for m in range(c):
            y[m] += N[m, c]
            for d in range(m, c):
                Y[m, d] += N[m, d]


@kernel
def eliminate(M: Floats, C: Floats) -> bool:
    """C ← L⁻¹ C with L Lᵀ = M, which is overwritten; return whether M is positive definite."""
    for i in range(4):
        whole = M[i, i]
        for j in range(i):
            x = M[i, j]
            for d in range(j):
                x -= M[i, d] * M[j, d]
            M[i, j] = x / M[j, j]
        x = whole
        for d in range(i):
            x -= M[i, d] * M[i, d]
        if not x > SINGULAR_RATIO * whole:  # NaN too
            return False
        M[i, i] = sqrt(x)
        for m in range(C.shape[1]):
            x = C[i, m]
            for d in range(i):
                x -= M[i, d] * C[d, m]
            C[i, m] = x / M[i, i]
    return True


@kernel
def middle_time(recent: Floats, site_numbers: Integers) -> tuple[bool, float]:
    """Return whether plots of several sites were stored, and the mean time of all."""
    count = 0
    site_number = 0
    several = False
    first = 0.0
    later = 0.0
    for s in range(recent.shape[0]):
        time = recent[s, RECENT_TIME]
        if np.isnan(time):
            continue
        if count == 0:
            first = time
            site_number = site_numbers[s]
        several = several or site_numbers[s] != site_number
        count += 1
        # By differences, so that the mean of equal times is exact.
        later += time - first
    return several, first + later / max(count, 1)


@kernel
def add_plot(
    s: int,
    plot: Floats,
    middle: float,
    mean: Floats,
    time: float,
    model: Model,
    M: Floats,
    C: Floats,
    N: Floats,
) -> None:
    """Add one plot to M (lower triangle), to C, and to N = (Jᵀ W⁻¹ J, Jᵀ W⁻¹ r)."""
    H = np.empty((2, 2))
    W = np.empty(3)
    kind = int(plot[RECENT_KIND])
    site = model.sites[s]
    age = time - plot[RECENT_TIME]
    p0, p1, _ = predict_measurement(
        kind, model.plane, site, model.noises[s], mean[0] - age * mean[2], mean[1] - age * mean[3],
        plot[RECENT_HEIGHT], 0.0, H, W,
    )  # fmt: skip
    r0 = plot[RECENT_Z0] - p0
    r1 = plot[RECENT_Z1] - p1
    if measures_azimuth(kind):
        r1 = wrap_angle(r1)
    rate0 = H[0, 0] * mean[2] + H[0, 1] * mean[3]
    rate1 = H[1, 0] * mean[2] + H[1, 1] * mean[3]
    excess = plot[RECENT_EXCESS]
    i00, i01, i11 = inverse(excess * W[0], excess * W[1], excess * W[2])
    t0 = i00 * r0 + i01 * r1
    t1 = i01 * r0 + i11 * r1
    shift = plot[RECENT_TIME] - middle
    B = np.empty((2, 4))
    for i in range(2):
        for j in range(2):
            B[i, j] = H[i, j]
            B[i, j + 2] = shift * H[i, j]
    c = model.bias.shape[0]
    for i in range(4):
        b0 = i00 * B[0, i] + i01 * B[1, i]
        b1 = i01 * B[0, i] + i11 * B[1, i]
        for j in range(i + 1):
            M[i, j] += b0 * B[0, j] + b1 * B[1, j]
        C[i, c] += B[0, i] * t0 + B[1, i] * t1
    for m in range(model.starts[s], model.starts[s + 1]):
        j0, j1 = bias_column(kind, model.parameters[m], site, p0, p1, rate0, rate1)
        u0 = i00 * j0 + i01 * j1
        u1 = i01 * j0 + i11 * j1
        for i in range(4):
            C[i, m] += B[0, i] * u0 + B[1, i] * u1
        N[m, c] += j0 * t0 + j1 * t1
        for d in range(m, model.starts[s + 1]):
            k0, k1 = bias_column(kind, model.parameters[d], site, p0, p1, rate0, rate1)
            N[m, d] += u0 * k0 + u1 * k1
