"""The compiled loop over measurements that all filters share.

References
----------
IMM UrO RAN report (2016), equations (1.16) to (1.18), for each aircraft, measurement by
measurement.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._delay_kernels import initialise_with_delay, prepare_delay
from multiradar.estimation.filters._ground_kernels import (
    ground_density,
    height_of_row,
    record_ground,
    settle_ground,
    stands,
)
from multiradar.estimation.filters._kernels import (
    DENSE_MAX,
    REJECTED,
    RESTARTED,
    STARTED,
    UPDATED,
    VELOCITY_FRAME,
    acceleration_density,
    blocks_in_use,
    manoeuvre_factor,
    read_out,
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
from multiradar.estimation.filters.arrays import (
    Aircraft,
    BiasSums,
    Model,
    Result,
    Rows,
    Sight,
    Work,
)
from multiradar.estimation.filters.height._height_kernels import (
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
    used_as,
)
from multiradar.estimation.filters.separated._macro_kernels import MACRO, clear_plots, store_plot
from multiradar.estimation.filters.separated._separated_kernels import correct_separated
from multiradar.estimation.filters.two_stage._time_offset_kernels import (
    has_time_offset,
    update_offset_velocity,
)
from multiradar.estimation.filters.two_stage._two_stage_kernels import component, correct_two_stage
from multiradar.estimation.measurement._kernels import is_bearing
from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_POSITION
from multiradar.estimation.motion._kernels import move_aircraft
from multiradar_compiled.kernels import fetch_ahead, in_loop, inner_loop, kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Methods, beside `MACRO`; they are also the modes of `_kernels.start_aircraft`.
TWO_STAGE = 0
BLOM = 1
INTERSECTION = 2

# Number of rows by which a row, and the aircraft of a row, are prefetched.
ROWS_AHEAD = 12
AIRCRAFT_AHEAD = 3


@kernel
def step(
    method: int,
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    want_readout: bool,
) -> None:
    """Process rows in the given order: predict the aircraft, update it, record the outcome."""
    n = model.bias.shape[0]
    sums = BiasSums(np.empty((n, n)), np.empty(n), np.empty((2, n)), np.empty((2, n)))
    process_rows(
        method, work, rows, model, aircraft, result, want_readout, model.factor.T.copy(),
        np.empty((2, 2)), np.empty(3), sums, np.empty(HEIGHT_ESTIMATE_COUNT),
    )  # fmt: skip


@inner_loop
def process_rows(
    method: int,
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    want_readout: bool,
    factor: Floats,
    H: Floats,
    W: Floats,
    sums: BiasSums,
    height_estimate: Floats,
) -> None:
    """Do as `step`, with given scratch arrays.

    ``factor`` is that of `read_out`. H and W are scratch of an initiation. Inlined functions take
    named tuples at no cost; a call that is not inlined takes the arrays it needs, since passing a
    tuple of them would cost more than the row.
    """
    noises, parameters, bias, options = model.noises, model.parameters, model.bias, model.options
    means, covariances, sensitivities = aircraft.mean, aircraft.covariance, aircraft.sensitivity
    times, heights, fading_nis = aircraft.time, aircraft.height, aircraft.fading_nis
    vertical, on_ground = aircraft.vertical, aircraft.on_ground
    rejections, updates, updated = aircraft.rejections, aircraft.updates, aircraft.updated
    measured_from, site_numbers = aircraft.measured_from, model.site_numbers
    outcomes, readouts, logs = result.outcome, result.readout, result.log
    innovations = result.innovation
    lines = (sensitivities.shape[1] * sensitivities.shape[2] * 8 + 63) // 64
    velocities = aircraft.velocity
    recents = aircraft.recent
    timed = method == TWO_STAGE and has_time_offset(parameters)
    mode = BLOM if method == MACRO else method
    Y, y = sums.Y, sums.y
    many = y.shape[0] > DENSE_MAX
    for p in work.partitions:
        if many:
            sums = BiasSums(result.information[p], result.vector[p], sums.U, sums.R)
        else:
            # In memory of this thread: neighbouring partitions lie in one cache line.
            copy_sums(result.information[p], result.vector[p], Y, y)
        for i in range(work.bounds[p], work.bounds[p + 1]):
            if i + ROWS_AHEAD < work.bounds[p + 1]:
                fetch_row(
                    work.order[i + ROWS_AHEAD], rows.slot, rows.time, rows.sensor, rows.z, outcomes
                )
            if i + AIRCRAFT_AHEAD < work.bounds[p + 1]:
                ahead = rows.slot[work.order[i + AIRCRAFT_AHEAD]]
                if ahead >= 0:
                    fetch_aircraft(
                        ahead, lines, means, covariances, sensitivities, times, heights, fading_nis,
                        rejections, updates, updated, measured_from, vertical,
                    )  # fmt: skip
            row = work.order[i]
            k = rows.slot[row]
            kind = rows.kind[row]
            innovations[row, 0] = np.nan
            outcome = check_row(k, kind, method == TWO_STAGE)
            if outcome != UPDATED:
                outcomes[row] = outcome
                continue
            s, q = rows.sensor[row], rows.seen[row]
            z0, z1, time = rows.z[row, 0], rows.z[row, 1], rows.time[row]
            patient = is_patient(kind, site_numbers[s], time, k, measured_from, updated)
            outcome = choose_action(kind, z0, z1, time, times[k], rejections[k], patient, options)
            if outcome == REJECTED:
                outcomes[row] = outcome
                continue
            if aircraft.delay.shape[1] > 0:
                z0 -= prepare_delay(k, kind, q, outcome, model, aircraft.delay)
            reported, received, dt = rows.ground[row], rows.height[row], time - times[k]
            grounded = settle_ground(
                reported, received, noises[s, 3], outcome, k, on_ground, means, covariances,
                heights, vertical,
            )  # fmt: skip
            source, measured = height_of_row(grounded, kind, received, noises[s, 3])
            check = check_height(
                outcome, source, measured, s, time, dt, k, heights, vertical, options
            )
            height, variance = check[1], check[2]
            used = used_as(kind, check, heights[k])
            first = 0.0 if used == KIND_BEARING else z0
            sure = height_informs(check, used, first, k, q, heights, vertical, noises)
            action = outcome
            excess = 1.0
            if outcome in (STARTED, RESTARTED):
                sight = Sight(kind, z0, z1, height, variance)
                started = start_aircraft(
                    mode, sight, q, model, means[k], covariances[k], sensitivities[k], H, W
                )
                if started == STARTED:
                    record_start(k, site_numbers[s], fading_nis, updates, measured_from, velocities)
                    clear_plots(recents, k)
                    initialise_height_sensitivity(check, kind, z0, k, q, noises, H, vertical)
                    if aircraft.delay.shape[1] > 0:
                        initialise_with_delay(k, kind, q, H, model, aircraft)
                else:
                    outcome = started
            elif outcome == UPDATED:
                v0, v1 = means[k, 2], means[k, 3]
                if method == TWO_STAGE and options[VELOCITY_FRAME] != 0.0:
                    v0 = component(means, sensitivities, bias, k, 2)
                    v1 = component(means, sensitivities, bias, k, 3)
                factor_now = manoeuvre_factor(fading_nis[k], options)
                density = acceleration_density(v0, v1, factor_now, options)
                if grounded:
                    density = ground_density(factor_now)
                if np.isnan(heights[k]):
                    estimate_height(
                        check, kind, z0, z1, dt, density[0], k, q, model, means, covariances,
                        sensitivities, vertical, height_estimate,
                    )  # fmt: skip
                    change = first_height_change(check, k, heights, vertical)
                    shift_with_height(change, k, k, vertical, means)
                move_aircraft(means, covariances, sensitivities, k, dt, density)
                times[k] = time
                # A plot contributes to the biases if its height is known (the error of an unknown
                # height is the same at every plot) and the aircraft was measured from another site
                # too (from one site alone, linearisation at every plot would make biases appear
                # observable that cannot be separated from motion).
                informs = sure and measured_from[k] != site_numbers[s]
                if timed and np.isnan(velocities[k, 0]):
                    informs = False
                if grounded:
                    v0, v1 = means[k, 2], means[k, 3]
                    if method == TWO_STAGE:
                        v0 = component(means, sensitivities, bias, k, 2)
                        v1 = component(means, sensitivities, bias, k, 3)
                    informs = informs and not stands(
                        grounded, v0, v1, covariances[k, 7] + covariances[k, 9]
                    )
                if method == TWO_STAGE:
                    sight = Sight(used, first, z1, height, variance)
                    outcome = correct_two_stage(
                        sight, k, q, informs, model, aircraft, sums, innovations, row
                    )
                    if timed and outcome == UPDATED and not is_bearing(kind):
                        sight = Sight(kind, z0, z1, height, variance)
                        update_offset_velocity(sight, k, q, site_numbers[s], model, aircraft, H, W)
                else:
                    sight = Sight(kind, z0, z1, height, variance)
                    outcome, excess = correct_separated(
                        method == INTERSECTION, sight, k, q, informs and method != MACRO, model,
                        aircraft, sums, logs, row, innovations,
                    )  # fmt: skip
            outcomes[row] = outcome
            accepted = record_outcome(
                outcome,
                k,
                patient,
                time,
                site_numbers[s],
                times,
                rejections,
                updates,
                updated,
                measured_from,
            )
            if accepted:
                unknown = np.isnan(heights[k])
                update_height(check, source, measured, s, time, dt, k, heights, vertical, options)
                record_ground(grounded, reported, received, k, on_ground, vertical)
                if unknown and action == UPDATED:
                    store_height_estimate(height_estimate, k, vertical)
                    shift_with_height(height_estimate[0], k, k, vertical, means)
            elif action == UPDATED:
                coast_height(dt, k, heights, vertical, options)
            if accepted and method == MACRO and sure:
                if kind == KIND_POSITION and noises[s, 2] > 0.0:
                    # Stacked with the noise of the sensor: see `stack_plots`.
                    excess *= noises[q, 2] / noises[s, 2]
                store_plot(recents, k, s, kind, z0, z1, time, height, excess, noises)
            if accepted and want_readout:
                V = sensitivities[k]
                read_out(means[k], covariances[k], V, blocks_in_use(V), bias, factor, readouts[row])
                finish_readout(row, k, heights, vertical, updates, on_ground, options, readouts)
        if not many:
            copy_sums(Y, y, result.information[p], result.vector[p])


@in_loop
def copy_sums(Y: Floats, y: Floats, to_Y: Floats, to_y: Floats) -> None:
    """Copy the information about the biases."""
    for c in range(y.shape[0]):
        to_y[c] = y[c]
        for d in range(y.shape[0]):
            to_Y[c, d] = Y[c, d]


@in_loop
def fetch_row(
    row: int,
    slots: Integers,
    times: Floats,
    sensors: Integers,
    z: Floats,
    outcomes: Integers,
) -> None:
    """Prefetch the first columns of a row, and the line that another thread writes to."""
    fetch_ahead(slots, row, 0)
    fetch_ahead(times, row, 0)
    fetch_ahead(sensors, row, 0)
    fetch_ahead(z, row, 0)
    fetch_ahead(outcomes, row, 0)


@in_loop
def fetch_aircraft(
    k: int,
    lines: int,
    means: Floats,
    covariances: Floats,
    sensitivities: Floats,
    times: Floats,
    heights: Floats,
    fading_nis: Floats,
    rejections: Integers,
    updates: Integers,
    updated: Floats,
    measured_from: Integers,
    vertical: Floats,
) -> None:
    """Prefetch the state of an aircraft."""
    fetch_ahead(means, k, 0)
    fetch_ahead(covariances, k, 0)
    fetch_ahead(covariances, k, 1)
    fetch_ahead(times, k, 0)
    fetch_ahead(heights, k, 0)
    fetch_ahead(fading_nis, k, 0)
    fetch_ahead(rejections, k, 0)
    fetch_ahead(updates, k, 0)
    fetch_ahead(updated, k, 0)
    fetch_ahead(measured_from, k, 0)
    fetch_ahead(vertical, k, 0)
    for line in range(lines):
        fetch_ahead(sensitivities, k, line)
