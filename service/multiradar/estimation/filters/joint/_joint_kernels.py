"""Compiled joint Kalman filter over all aircraft and all biases: exact, and one row at a time.

The whole state is stacked as (1.8), biases first: ξ = (ς, χ_0, χ_1, …) with χ_k at `Aircraft.mean`
and ς at `Model.bias`. `Aircraft.joint` is its covariance, of which the upper triangle of the rows
and columns in use is valid; its bias block is read from `Model.bias_covariance` at the start of a
step and written there at its end, so that drift of the biases changes the model alone.

Symbols beside those of `_kernels`: C = (J, H) of (1.10), G = P̄ Cᵀ, S = Λ of (1.29), F = G L⁻ᵀ with
L Lᵀ = S, so that P̂ = P̄ − F Fᵀ is (1.31), and symmetric, with one triangle of it.

References
----------
IMM UrO RAN report (2016), equations (1.8) and (1.28) to (1.33). Initiation within the stacked state
is the project's own.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._ground_kernels import (
    ground_density,
    height_of_row,
    record_ground,
    settle_ground,
    stands,
)
from multiradar.estimation.filters._kernels import (
    ALL_BLOCKS,
    BIASES_KEPT,
    CONE,
    CONE_RATIO,
    DOWNWEIGHT_NIS,
    NO_ROOM,
    REJECT_NIS,
    REJECTED,
    RESTARTED,
    SINGULAR,
    STARTED,
    UPDATED,
    acceleration_density,
    gated,
    manoeuvre_factor,
    read_out,
    record_innovation,
    singular,
    squared_norm,
    updated_fading_nis,
)
from multiradar.estimation.filters._row_kernels import (
    check_row,
    choose_action,
    finish_readout,
    is_patient,
    record_outcome,
    record_start,
)
from multiradar.estimation.filters._start_kernels import start_aircraft
from multiradar.estimation.filters.arrays import Aircraft, Model, Result, Rows, Sight, Work
from multiradar.estimation.filters.height._height_kernels import (
    HeightCheck,
    check_height,
    coast_height,
    height_informs,
    update_height,
)
from multiradar.estimation.filters.height._unknown_height_kernels import (
    HEIGHT_ESTIMATE_COUNT,
    estimate_height,
    first_height_change,
    initialise_height_sensitivity,
    shift_with_height,
    store_height_estimate,
)
from multiradar.estimation.filters.joint._joint_matrix_kernels import (
    active_runs,
    add_spread_of_bias,
    copy_block,
    correct_all,
    correct_one,
    move,
    spread_of_position,
)
from multiradar.estimation.measurement._kernels import (
    bias_column,
    measures_azimuth,
    predict_measurement,
)
from multiradar.geodesy._kernels import wrap_angle
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Number of this method, beside those of `_step_kernels`.
JOINT = 10


@kernel
def joint_step(
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    want_readout: bool,
) -> None:
    """Process rows in the given order; each updates the biases of the model.

    Same arguments as `_step_kernels.step`. Rows must be in canonical order over all partitions, so
    there should be only one partition.
    """
    P, bias, c = aircraft.joint, model.bias, model.bias.shape[0]
    P[:c, :c] = model.bias_covariance
    capacity = (P.shape[0] - c) // 4
    runs = np.empty((capacity + 1, 2), np.int64)
    scratch = np.empty((6, P.shape[0]))
    V = np.empty((4, c))
    count = active_runs(aircraft.time, c, capacity, runs)
    for p in work.partitions:
        for i in range(work.bounds[p], work.bounds[p + 1]):
            row = work.order[i]
            k = rows.slot[row]
            result.innovation[row, 0] = np.nan
            outcome = check_row(k, rows.kind[row], False)
            if k >= capacity:
                outcome = NO_ROOM
            action = REJECTED
            patient = False
            if outcome == UPDATED:
                patient = is_patient(
                    rows.kind[row], model.site_numbers[rows.sensor[row]], rows.time[row], k,
                    aircraft.measured_from, aircraft.updated,
                )  # fmt: skip
                action = choose_action(
                    rows.kind[row], rows.z[row, 0], rows.z[row, 1], rows.time[row],
                    aircraft.time[k], aircraft.rejections[k],
                    patient, model.options,
                )  # fmt: skip
                outcome = action
            result.outcome[row] = outcome
            if action == REJECTED:
                continue
            dt = rows.time[row] - aircraft.time[k]
            site_height = model.noises[rows.sensor[row], 3]
            grounded = settle_ground(
                rows.ground[row], rows.height[row], site_height, action, k, aircraft.on_ground,
                aircraft.mean, aircraft.covariance, aircraft.height, aircraft.vertical,
            )  # fmt: skip
            source, measured = height_of_row(
                grounded, rows.kind[row], rows.height[row], site_height
            )  # fmt: skip
            check = check_height(
                action, source, measured, rows.sensor[row], rows.time[row], dt, k,
                aircraft.height, aircraft.vertical, model.options,
            )  # fmt: skip
            outcome = process_row(
                row, k, action, check, grounded, rows, model, aircraft, runs, count, scratch, V,
                result.innovation,
            )  # fmt: skip
            result.outcome[row] = outcome
            accepted = record_outcome(
                outcome, k, patient, rows.time[row], model.site_numbers[rows.sensor[row]],
                aircraft.time, aircraft.rejections, aircraft.updates, aircraft.updated,
                aircraft.measured_from,
            )  # fmt: skip
            if not accepted and action == UPDATED:
                coast_height(dt, k, aircraft.height, aircraft.vertical, model.options)
            if accepted:
                record_ground(
                    grounded, rows.ground[row], rows.height[row], k, aircraft.on_ground,
                    aircraft.vertical,
                )  # fmt: skip
            if outcome == STARTED:
                count = active_runs(aircraft.time, c, capacity, runs)
            if accepted and want_readout:
                copy_block(P, c + 4 * k, aircraft.covariance[k])
                read_out(
                    aircraft.mean[k], aircraft.covariance[k], aircraft.sensitivity[k], ALL_BLOCKS,
                    bias, model.factor, result.readout[row],
                )  # fmt: skip
                finish_readout(
                    row, k, aircraft.height, aircraft.vertical, aircraft.updates,
                    aircraft.on_ground, model.options, result.readout,
                )  # fmt: skip
    for j in range(c):
        for d in range(j, c):
            model.bias_covariance[j, d] = P[j, d]
            model.bias_covariance[d, j] = P[j, d]
    for k in range(capacity):
        if not np.isnan(aircraft.time[k]):
            copy_block(P, c + 4 * k, aircraft.covariance[k])


@kernel
def insert_aircraft(aircraft: Aircraft, biases: int, k: int) -> None:
    """Insert an aircraft whose mean and covariance were set from outside, uncorrelated."""
    P = aircraft.joint
    first = biases + 4 * k
    if P.shape[0] < first + 4:
        return
    P[first : first + 4, :] = 0.0
    P[:, first : first + 4] = 0.0
    m = 0
    for i in range(4):
        for j in range(i, 4):
            P[first + i, first + j] = aircraft.covariance[k, m]
            m += 1


@kernel
def process_row(
    row: int,
    k: int,
    action: int,
    check: HeightCheck,
    grounded: bool,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    runs: Integers,
    count: int,
    scratch: Floats,
    V: Floats,
    innovations: Floats,
) -> int:
    """Apply the action of a row: initiate the aircraft, or predict it and update everything."""
    kind, s, q = rows.kind[row], rows.sensor[row], rows.seen[row]
    height, variance = check[1], check[2]
    heights, vertical = aircraft.height, aircraft.vertical
    source, measured = height_of_row(grounded, kind, rows.height[row], model.noises[s, 3])
    dt = rows.time[row] - aircraft.time[k]
    if action in (STARTED, RESTARTED):
        outcome = start_jointly(row, k, check, rows, model, aircraft, runs, count, V)
        if outcome != STARTED:
            return outcome
        update_height(
            check, source, measured, s, rows.time[row], dt, k, heights, vertical, model.options
        )  # fmt: skip
        return action
    if action != UPDATED:
        return action
    unknown = np.isnan(heights[k])
    height_estimate = np.empty(HEIGHT_ESTIMATE_COUNT)
    factor = manoeuvre_factor(aircraft.fading_nis[k], model.options)
    density = acceleration_density(
        aircraft.mean[k, 2], aircraft.mean[k, 3], factor, model.options
    )  # fmt: skip
    if grounded:
        density = ground_density(factor)
    first = model.bias.shape[0] + 4 * k
    if unknown:
        copy_block(aircraft.joint, first, aircraft.covariance[k])
        estimate_height(
            check, kind, rows.z[row, 0], rows.z[row, 1], dt, density[0], k, q, model,
            aircraft.mean, aircraft.covariance, aircraft.sensitivity, vertical, height_estimate,
        )  # fmt: skip
        change = first_height_change(check, k, heights, vertical)
        shift_with_height(change, k, k, vertical, aircraft.mean)
    move(
        aircraft.joint, aircraft.mean[k], aircraft.covariance[k], aircraft.sensitivity[k], first,
        dt, density, runs, count,
    )  # fmt: skip
    aircraft.time[k] = rows.time[row]
    # As in `_step_kernels.process_rows`: not with an unknown height, or measured from one site.
    informs = aircraft.measured_from[k] != model.site_numbers[s] and height_informs(
        check, kind, rows.z[row, 0], k, q, heights, vertical, model.noises
    )
    spread = aircraft.joint[first + 2, first + 2] + aircraft.joint[first + 3, first + 3]
    if stands(grounded, aircraft.mean[k, 2], aircraft.mean[k, 3], spread):
        informs = False
    outcome = correct_joint(
        row, k, kind, height, variance, informs, rows, model, aircraft, runs, count, scratch,
        innovations,
    )  # fmt: skip
    if outcome == UPDATED:
        update_height(
            check, source, measured, s, rows.time[row], dt, k, heights, vertical, model.options
        )  # fmt: skip
        if unknown:
            store_height_estimate(height_estimate, k, vertical)
            shift_with_height(height_estimate[0], k, k, vertical, aircraft.mean)
    return outcome


@kernel
def start_jointly(
    row: int,
    k: int,
    check: HeightCheck,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    runs: Integers,
    count: int,
    V: Floats,
) -> int:
    """Initiate an aircraft at a plot: χ = a + V ς, so its covariance with the rest is V P_ς,· ."""
    s = rows.sensor[row]
    bias, P = model.bias, aircraft.joint
    c = bias.shape[0]
    a = np.empty(4)
    upper = np.empty(10)
    H = np.empty((2, 2))
    W = np.empty(3)
    sight = Sight(rows.kind[row], rows.z[row, 0], rows.z[row, 1], check[1], check[2])
    outcome = start_aircraft(BIASES_KEPT, sight, rows.seen[row], model, a, upper, V, H, W)
    if outcome != STARTED:
        return outcome
    first = c + 4 * k
    for r in range(count):
        for x in range(runs[r, 0], runs[r, 1]):
            if first <= x < first + 4:
                continue
            for i in range(4):
                total = 0.0
                for j in range(model.starts[s], model.starts[s + 1]):
                    total += V[i, j] * P[min(j, x), max(j, x)]
                P[min(first + i, x), max(first + i, x)] = total
    m = 0
    for i in range(4):
        for j in range(i, 4):
            total = upper[m]
            for d in range(model.starts[s], model.starts[s + 1]):
                total += P[d, first + i] * V[j, d]
            P[first + i, first + j] = total
            m += 1
    for i in range(4):
        aircraft.mean[k, i] = a[i]
        for d in range(model.starts[s], model.starts[s + 1]):
            aircraft.mean[k, i] += V[i, d] * bias[d]
    record_start(
        k,
        model.site_numbers[s],
        aircraft.fading_nis,
        aircraft.updates,
        aircraft.measured_from,
        aircraft.velocity,
    )
    initialise_height_sensitivity(
        check, rows.kind[row], rows.z[row, 0], k, s, model.noises, H, aircraft.vertical
    )
    return STARTED


@kernel
def correct_joint(
    row: int,
    k: int,
    kind: int,
    height: float,
    variance: float,
    informs: bool,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    runs: Integers,
    count: int,
    scratch: Floats,
    innovations: Floats,
) -> int:
    """Update everything by a measurement of one aircraft; return the outcome."""
    s = rows.seen[row]
    mean, bias, options = aircraft.mean, model.bias, model.options
    c = bias.shape[0]
    first = c + 4 * k
    H = np.empty((2, 2))
    W = np.empty(3)
    p0, p1, ground = predict_measurement(
        kind, model.plane, model.sites[s], model.noises[s], mean[k, 0], mean[k, 1], height,
        variance, H, W,
    )  # fmt: skip
    if ground < options[CONE_RATIO] * (height - model.noises[s, 3]):
        return CONE
    e0 = rows.z[row, 0] - p0
    e1 = rows.z[row, 1] - p1
    if measures_azimuth(kind):
        e1 = wrap_angle(e1)
    G = scratch[:2]
    J = scratch[4:]
    rate0 = H[0, 0] * mean[k, 2] + H[0, 1] * mean[k, 3]
    rate1 = H[1, 0] * mean[k, 2] + H[1, 1] * mean[k, 3]
    spread_of_position(aircraft.joint, first, H, runs, count, G)
    for j in range(model.starts[s], model.starts[s + 1]):
        J[0, j], J[1, j] = bias_column(
            kind, model.parameters[j], model.sites[s], p0, p1, rate0, rate1
        )
        e0 -= J[0, j] * bias[j]
        e1 -= J[1, j] * bias[j]
        add_spread_of_bias(aircraft.joint, j, J[0, j], J[1, j], runs, count, G)
    n00 = H[0, 0] * G[0, first] + H[0, 1] * G[0, first + 1]
    n01 = H[0, 0] * G[1, first] + H[0, 1] * G[1, first + 1]
    n11 = H[1, 0] * G[1, first] + H[1, 1] * G[1, first + 1]
    for j in range(model.starts[s], model.starts[s + 1]):
        n00 += J[0, j] * G[0, j]
        n01 += J[0, j] * G[1, j]
        n11 += J[1, j] * G[1, j]
    nis = squared_norm(n00 + W[0], n01 + W[1], n11 + W[2], e0, e1)
    b00, b01, b11 = own_spread(aircraft.joint, model.starts[s], model.starts[s + 1], J)
    record_innovation(
        row, e0, e1, max(n00 - b00, 0.0) + W[0], n01 - b01 + W[1], max(n11 - b11, 0.0) + W[2],
        b00, b01, b11, innovations,
    )  # fmt: skip
    outcome = gated(nis, options[REJECT_NIS])
    if outcome != UPDATED:
        return outcome
    weight = max(1.0, nis / options[DOWNWEIGHT_NIS])
    for m in range(3):
        W[m] *= weight
    s00, s01, s11 = n00 + W[0], n01 + W[1], n11 + W[2]
    if singular(s00, s01, s11):
        return SINGULAR
    if informs:
        correct_all(aircraft, bias, G, scratch[2:4], s00, s01, s11, e0, e1, runs, count)
    elif not correct_one(aircraft, k, c, H, W, G, s00, s01, s11, e0, e1, runs, count):
        return SINGULAR
    aircraft.fading_nis[k] = updated_fading_nis(aircraft.fading_nis[k], nis, options)
    return UPDATED


@kernel
def own_spread(P: Floats, first: int, last: int, J: Floats) -> tuple[float, float, float]:
    """Return J P_ς Jᵀ of the biases of one sensor: 00, 01, 11; upper triangle of P."""
    b00, b01, b11 = 0.0, 0.0, 0.0
    for c in range(first, last):
        for d in range(first, last):
            p = P[min(c, d), max(c, d)]
            b00 += J[0, c] * p * J[0, d]
            b01 += J[0, c] * p * J[1, d]
            b11 += J[1, c] * p * J[1, d]
    return b00, b01, b11
