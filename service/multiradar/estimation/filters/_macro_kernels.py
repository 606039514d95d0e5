"""Compiled macro-filter of Blom: aircraft by themselves, biases by plots that are stacked.

The second variant of the report's section 1.4. The aircraft half is that of the separated filters
(biases as known). For the half of the biases the plots of one aircraft by m′ radars are read as one
stacked measurement, and the place of the aircraft, common to all of them, is eliminated: that is
the approximation C_χ P_χς = H with H = −F_χ⁻¹ F_ς P_ςς, in information form. Taken literally (one
summed innovation instead of the stacked one) the printed sums diverge.

Plots of turning radars are not simultaneous. The latest plot of each radar in an epoch is carried
to the mean time of these plots with the estimated velocity v̂ of the aircraft, whose error δv ~
N(0, P_v) is common to them too: it adds H_j P_v H_jᵀ Δ_j Δ_l to the noise of plots j and l, which
is the same as to eliminate it with the place. Of simultaneous plots Δ = 0, and nothing is added.

Symbols beside those of `_kernels`: r_j = z_j − h_j without biases, Δ_j = time of plot j less the
mean time, u = (δx, δv) = errors of place and velocity at the mean time, B_j = (H_j, Δ_j H_j) = how
they enter, M = Σ B_jᵀ W_j⁻¹ B_j + diag(0, P_v⁻¹), C = Σ B_jᵀ W_j⁻¹ J_j. Eliminating u leaves
Y += Σ J_jᵀ W_j⁻¹ J_j − Cᵀ M⁻¹ C, y += Σ J_jᵀ W_j⁻¹ r_j − Cᵀ M⁻¹ Σ B_jᵀ W_j⁻¹ r_j.

References
----------
IMM UrO RAN report (2016), section 1.4, the macro-filter. The stacked form, and that of plots at
several times, are the project's own.
"""

from math import sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

from multiradar.estimation.filters._joint_kernels import note_taken
from multiradar.estimation.filters._kernels import (
    BIASES_KNOWN,
    NO_ROOM,
    NO_ROOM_SLOT,
    READOUT_COUNT,
    REFUSALS_MAX,
    REFUSED,
    RESTARTED,
    SINGULAR,
    STARTED,
    UNASSOCIATED,
    UNSUPPORTED,
    UPDATED,
    acceleration_density,
    choose_height,
    manoeuvre_factor,
    read_out,
    start_aircraft,
)
from multiradar.estimation.filters._separated_kernels import correct_separated
from multiradar.estimation.filters.arrays import (
    RECENT_HEIGHT,
    RECENT_KIND,
    RECENT_TIME,
    RECENT_WEIGHT,
    RECENT_Z0,
    RECENT_Z1,
    Aircraft,
    Model,
    Result,
    Rows,
    Work,
)
from multiradar.estimation.measurement._kernels import (
    KIND_BEARING,
    KIND_FLAT_PLACE,
    KIND_FLAT_POLAR,
    KIND_RADAR,
    bias_column,
    measures_azimuth,
    predict_measurement,
)
from multiradar.estimation.motion._kernels import predict_motion
from multiradar.geodesy._kernels import wrap_angle

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Number of this method, beside those of `_step_kernels`.
MACRO = 11


@njit(cache=True, nogil=True, error_model="numpy")
def macro_step(
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    want_readout: bool,
) -> None:
    """Take rows in the given order; what they say about biases waits for `stack_plots`.

    Same arguments as `_step_kernels.step`.
    """
    none = np.empty((0, 0))
    nothing = np.empty(0)
    for p in work.partitions:
        for i in range(work.bounds[p], work.bounds[p + 1]):
            row = work.order[i]
            k = rows.slot[row]
            kind = rows.kind[row]
            if k < 0:
                result.outcome[row] = NO_ROOM if k == NO_ROOM_SLOT else UNASSOCIATED
                continue
            if kind < KIND_RADAR or kind == KIND_BEARING or kind > KIND_FLAT_PLACE:
                result.outcome[row] = UNSUPPORTED
                continue
            outcome = take_row(row, k, kind, rows, model, aircraft, none, nothing)
            result.outcome[row] = outcome
            if outcome in (UPDATED, STARTED, RESTARTED):
                note_taken(row, k, rows, model, aircraft)
                if want_readout:
                    out = result.readout[row]
                    read_out(
                        aircraft.mean[k], aircraft.covariance[k], aircraft.sensitivity[k],
                        model.bias, model.factor, out,
                    )  # fmt: skip
                    out[READOUT_COUNT - 2] = aircraft.height[k]
                    out[READOUT_COUNT - 1] = aircraft.updates[k]
            elif outcome in (REFUSED, SINGULAR):
                aircraft.refusals[k] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def take_row(
    row: int,
    k: int,
    kind: int,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    none: Floats,
    nothing: Floats,
) -> int:
    """Start an aircraft at a row, or move it on and correct it; keep the row for the biases."""
    s = rows.sensor[row]
    z0, z1, time = rows.z[row, 0], rows.z[row, 1], rows.time[row]
    a, P, V = aircraft.mean[k], aircraft.covariance[k], aircraft.sensitivity[k]
    H = np.empty((2, 2))
    W = np.empty(3)
    height, variance = choose_height(rows.height[row], aircraft.height[k], model.options)
    if kind >= KIND_FLAT_POLAR:
        variance = 0.0  # On a flat plane no height enters the range.
    weight = 1.0
    fresh = np.isnan(aircraft.time[k])
    if fresh or aircraft.refusals[k] >= model.options[REFUSALS_MAX]:
        outcome = start_aircraft(
            BIASES_KNOWN, kind, z0, z1, height, variance, model.plane, model.sites[s],
            model.noises[s], model.starts[s], model.starts[s + 1], model.parameters, model.bias,
            model.bias_covariance, model.options, a, P, V, H, W,
        )  # fmt: skip
        if outcome != STARTED:
            return outcome
        aircraft.surprise[k] = 1.0
        aircraft.updates[k] = 0
        aircraft.place[k] = model.places[s]
        aircraft.recent[k, :, RECENT_TIME] = np.nan
        outcome = STARTED if fresh else RESTARTED
    else:
        interval = time - aircraft.time[k]
        if not 0.0 <= interval < np.inf:
            return REFUSED  # Time goes on, as in `_step_kernels.take_rows`.
        factor = manoeuvre_factor(aircraft.surprise[k], model.options)
        density = acceleration_density(a[2], a[3], factor, model.options)
        predict_motion(a, P, V, interval, density)
        aircraft.time[k] = time
        # A plot that counts less for the aircraft counts as much less for the biases.
        outcome, excess = correct_separated(
            False, kind, z0, z1, height, variance, k, s, False, model.plane, model.sites,
            model.noises, model.starts, model.parameters, model.bias, model.bias_covariance,
            model.options, aircraft.mean, aircraft.covariance, aircraft.surprise, none, nothing,
            none, 0,
        )  # fmt: skip
        if outcome != UPDATED:
            return outcome
        weight = 1.0 / excess
    if variance == 0.0:
        recent = aircraft.recent[k, s]
        recent[RECENT_TIME] = time
        recent[RECENT_Z0] = z0
        recent[RECENT_Z1] = z1
        recent[RECENT_HEIGHT] = height
        recent[RECENT_KIND] = kind
        recent[RECENT_WEIGHT] = weight
    return outcome


@njit(cache=True, nogil=True, error_model="numpy")
def stack_all(
    slots: Integers, model: Model, aircraft: Aircraft, information: Floats, vector: Floats
) -> None:
    """Stack the plots of all aircraft, each into the sums of its partition."""
    for k in slots:
        p = k % information.shape[0]
        stack_plots(k, model, aircraft, information[p], vector[p])


@njit(cache=True, nogil=True, error_model="numpy")
def stack_plots(k: int, model: Model, aircraft: Aircraft, Y: Floats, y: Floats) -> None:
    """Add to Y (upper triangle) and y what the kept plots of an aircraft say; forget them.

    All plots are linearised where the aircraft is estimated to have been: a shift that is common
    to them is eliminated with the place. Plots from one place alone say nothing: between two of
    them the line of sight turns a little, which biases make up for by a velocity a little off.
    """
    recent = aircraft.recent[k]
    several, middle = middle_time(recent, model.places)
    P = aircraft.covariance[k]
    det = P[7] * P[9] - P[8] * P[8]
    if not several or not det > 0.0:
        recent[:, RECENT_TIME] = np.nan
        return
    c = model.bias.shape[0]
    M = np.zeros((4, 4))
    M[2, 2] = P[9] / det
    M[3, 2] = -P[8] / det
    M[3, 3] = P[7] / det
    # Columns: those of the biases, and one for the vector.
    C = np.zeros((4, c + 1))
    for s in range(recent.shape[0]):
        if not np.isnan(recent[s, RECENT_TIME]):
            add_plot(s, recent[s], middle, aircraft.mean[k], aircraft.time[k], model, M, C, Y, y)
            recent[s, RECENT_TIME] = np.nan
    # M = L Lᵀ; C ← L⁻¹ C.
    for i in range(4):
        for j in range(i + 1):
            x = M[i, j]
            for d in range(j):
                x -= M[i, d] * M[j, d]
            M[i, j] = x / M[j, j] if j < i else sqrt(x)
        for m in range(c + 1):
            x = C[i, m]
            for d in range(i):
                x -= M[i, d] * C[d, m]
            C[i, m] = x / M[i, i]
    for m in range(c):
        for i in range(4):
            y[m] -= C[i, m] * C[i, c]
            for d in range(m, c):
                Y[m, d] -= C[i, m] * C[i, d]


@njit(cache=True, nogil=True, error_model="numpy")
def middle_time(recent: Floats, places: Integers) -> tuple[bool, float]:
    """Return whether plots of several places were kept, and the mean of the times of all."""
    count = 0
    place = 0
    several = False
    first = 0.0
    later = 0.0
    for s in range(recent.shape[0]):
        time = recent[s, RECENT_TIME]
        if np.isnan(time):
            continue
        if count == 0:
            first = time
            place = places[s]
        several = several or places[s] != place
        count += 1
        # Differences, so that the mean of equal times is that very time.
        later += time - first
    return several, first + later / max(count, 1)


@njit(cache=True, nogil=True, error_model="numpy")
def add_plot(
    s: int,
    plot: Floats,
    middle: float,
    mean: Floats,
    time: float,
    model: Model,
    M: Floats,
    C: Floats,
    Y: Floats,
    y: Floats,
) -> None:
    """Add one plot to M (lower triangle), to C, and to the sums of Jᵀ W⁻¹ J and Jᵀ W⁻¹ r."""
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
    scale = plot[RECENT_WEIGHT] / (W[0] * W[2] - W[1] * W[1])
    i00, i01, i11 = W[2] * scale, -W[1] * scale, W[0] * scale
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
        y[m] += j0 * t0 + j1 * t1
        for d in range(m, model.starts[s + 1]):
            k0, k1 = bias_column(kind, model.parameters[d], site, p0, p1, rate0, rate1)
            Y[m, d] += u0 * k0 + u1 * k1
