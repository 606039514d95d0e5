"""The compiled loop over measurements of the filter of interacting modes.

References
----------
Blom, H. A. P., Bar-Shalom, Y., "The interacting multiple model algorithm for systems with
Markovian switching coefficients", IEEE Transactions on Automatic Control 33 (1988), 780-783;
the two-stage form of each mode, and the loop itself, are the project's own.
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
    ACCELERATION_DENSITY,
    ALL_BLOCKS,
    BIASES_KEPT,
    DENSE_MAX,
    MANOEUVRE_FACTOR_MAX,
    MODES_NIS_DENSITY,
    MODES_NIS_FLOOR,
    NONE,
    REJECTED,
    RESTARTED,
    STARTED,
    UPDATED,
    blocks_in_use,
    excess_factor,
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
from multiradar.estimation.filters._step_kernels import ROWS_AHEAD, copy_sums, fetch_row
from multiradar.estimation.filters.arrays import (
    SLOW_COUNT,
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
    update_rate,
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
from multiradar.estimation.filters.imm._column_list_kernels import (
    NOT_LISTED,
    blocks_between,
    fetch_columns,
    fetch_information,
    list_columns,
    read_out_columns,
)
from multiradar.estimation.filters.imm._imm_kernels import correct_modes
from multiradar.estimation.filters.imm._mode_column_kernels import combine_columns
from multiradar.estimation.filters.imm._mode_delay_kernels import (
    DELAY_SCRATCH,
    correct_modes_with_delay,
)
from multiradar.estimation.filters.imm._mode_kernels import (
    combine_modes,
    initialise_modes,
    read_modes,
)
from multiradar.estimation.filters.imm._mode_prediction_kernels import predict_modes
from multiradar.estimation.filters.imm._mode_scratch_kernels import (
    SCRATCH_ROWS,
    ModeScratch,
    SlowScratch,
    blocks_of_modes,
    evaluate_modes,
    load_modes,
    prepare_scratch,
    store_modes,
)
from multiradar.estimation.filters.imm._reported_motion_kernels import has_motion, use_motion
from multiradar.estimation.filters.imm._slow_state_kernels import add_slow_spread
from multiradar.estimation.filters.two_stage._time_offset_kernels import (
    has_time_offset,
    update_offset_velocity,
)
from multiradar.estimation.filters.two_stage._two_stage_kernels import component, correct_two_stage
from multiradar.estimation.measurement._kernels import is_bearing
from multiradar.estimation.measurement.kinds import KIND_BEARING
from multiradar.estimation.measurement.reported_motion import CLIMB
from multiradar.estimation.motion._kernels import move_aircraft
from multiradar_compiled.kernels import fetch_ahead, in_loop, inner_loop, kernel
from multiradar_compiled.lane_kernels import LANES, load_row

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Number of this method, beside those of `_step_kernels`.
IMM = 12

# Number of rows by which the aircraft of a row is prefetched: one fills half of the L1 cache.
AIRCRAFT_AHEAD = 1
# The same of the first mode, which shows on which of many biases an aircraft depends.
MODE_AHEAD = 2


@kernel
def imm_step(
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    want_readout: bool,
) -> None:
    """Process rows in the given order; same arguments as `_step_kernels.step`."""
    n, count = model.bias.shape[0], model.modes.shape[0]
    scratch = np.empty((SCRATCH_ROWS, LANES))
    prepare_scratch(model.modes, scratch)
    sums = BiasSums(np.empty((n, n)), np.empty(n), np.empty((2, n)), np.empty((2, n)))
    slow = SlowScratch(
        np.empty((count, 2, SLOW_COUNT)), np.empty((2, SLOW_COUNT)), np.empty((2, SLOW_COUNT)),
        np.empty((4, LANES)), np.empty((2 * SLOW_COUNT, SLOW_COUNT)),
    )  # fmt: skip
    process_rows(
        work, rows, model, aircraft, result, want_readout, model.factor.T.copy(),
        model.bias.reshape(1, n), np.empty((2, 2)), np.empty(3), sums,
        np.empty(HEIGHT_ESTIMATE_COUNT),
        ModeScratch(
            np.empty((count, 2, n)), scratch, slow, np.empty(DELAY_SCRATCH), np.empty(n, np.int64)
        ),
    )  # fmt: skip


@inner_loop
def process_rows(
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    want_readout: bool,
    factor: Floats,
    bias_row: Floats,
    H: Floats,
    W: Floats,
    sums: BiasSums,
    height_estimate: Floats,
    mine: ModeScratch,
) -> None:
    """Do as `imm_step`, with given scratch arrays: see `_step_kernels.process_rows`."""
    noises, bias, options, modes = model.noises, model.bias, model.options, model.modes
    starts = model.starts
    means, covariances, sensitivities = aircraft.mean, aircraft.covariance, aircraft.sensitivity
    times, heights, fading_nis = aircraft.time, aircraft.height, aircraft.fading_nis
    vertical, on_ground = aircraft.vertical, aircraft.on_ground
    rejections, updates, updated = aircraft.rejections, aircraft.updates, aircraft.updated
    measured_from, site_numbers, velocities = (
        aircraft.measured_from,
        model.site_numbers,
        aircraft.velocity,
    )
    mode_means, mode_covariances = aircraft.mode_mean, aircraft.mode_covariance
    mode_V, probabilities = aircraft.mode_sensitivity, aircraft.mode_probability
    outcomes, readouts, innovations = result.outcome, result.readout, result.innovation
    count, Y, y = modes.shape[0], sums.Y, sums.y
    scratch, slow, reporting = mine.rows, aircraft.slow, rows.motion.shape[0] > 0
    timed, many = has_time_offset(model.parameters), y.shape[0] > DENSE_MAX
    ahead, blocks_ahead = NONE, ALL_BLOCKS
    for p in work.partitions:
        if many:
            sums = BiasSums(result.information[p], result.vector[p], sums.U, sums.R)
        else:
            copy_sums(result.information[p], result.vector[p], Y, y)
        for i in range(work.bounds[p], work.bounds[p + 1]):
            if i + ROWS_AHEAD < work.bounds[p + 1]:
                fetch_row(
                    work.order[i + ROWS_AHEAD], rows.slot, rows.time, rows.sensor, rows.z, outcomes
                )
            row = work.order[i]
            k = rows.slot[row]
            known, blocks_known = ahead, blocks_ahead
            ahead = NONE
            if many and i + MODE_AHEAD < work.bounds[p + 1]:
                fetch_first_mode(rows.slot[work.order[i + MODE_AHEAD]], count, mode_V)
            if i + AIRCRAFT_AHEAD < work.bounds[p + 1]:
                following = rows.slot[work.order[i + AIRCRAFT_AHEAD]]
                if following >= 0:
                    fetch_modes(
                        following, count, mode_means, mode_covariances, mode_V, probabilities
                    )
                    fetch_whole(
                        following, means, covariances, sensitivities, times, heights, vertical
                    )
                    fetch_ahead(slow, following, 0)
                if many and following >= 0 and following != k:
                    # Of this aircraft, the blocks may change now.
                    ahead = following
                    blocks_ahead = fetch_columns(following, count, mode_V, sensitivities)
            kind = rows.kind[row]
            innovations[row, 0] = np.nan
            outcome = check_row(k, kind, True)
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
            action = outcome
            blocks, found, listed = ALL_BLOCKS, False, NOT_LISTED
            if outcome in (STARTED, RESTARTED):
                sight = Sight(kind, z0, z1, height, variance)
                started = start_aircraft(
                    BIASES_KEPT, sight, q, model, means[k], covariances[k], sensitivities[k], H, W
                )
                if started == STARTED:
                    record_start(k, site_numbers[s], fading_nis, updates, measured_from, velocities)
                    probabilities[k, 0] = np.nan
                    initialise_height_sensitivity(check, kind, z0, k, q, noises, H, vertical)
                    if aircraft.delay.shape[1] > 0:
                        initialise_with_delay(k, kind, q, H, model, aircraft)
                else:
                    outcome = started
            elif outcome == UPDATED:
                # As in `_step_kernels.process_rows`.
                informs = measured_from[k] != site_numbers[s] and height_informs(
                    check, used, first, k, q, heights, vertical, noises
                )
                if timed and np.isnan(velocities[k, 0]):
                    informs = False
                if np.isnan(probabilities[k, 0]) and not grounded:
                    initialise_modes(
                        k, count, means, covariances, sensitivities, mode_means, mode_covariances,
                        mode_V, probabilities,
                    )  # fmt: skip
                    slow[k, 0], known = np.nan, NONE
                if np.isnan(heights[k]):
                    estimate_height(
                        check, kind, z0, z1, dt, options[ACCELERATION_DENSITY], k, q, model, means,
                        covariances, sensitivities, vertical, height_estimate,
                    )  # fmt: skip
                    change = first_height_change(check, k, heights, vertical)
                    shift_with_height(change, k, k, vertical, means)
                    for j in range(count):
                        shift_with_height(change, k, k * count + j, vertical, mode_means)
                sight = Sight(used, first, z1, height, variance)
                if grounded:
                    # One mode; those of flight begin in its state at take-off.
                    probabilities[k, 0] = np.nan
                    density = ground_density(manoeuvre_factor(fading_nis[k], options))
                    move_aircraft(means, covariances, sensitivities, k, dt, density)
                    times[k] = time
                    v0 = component(means, sensitivities, bias, k, 2)
                    v1 = component(means, sensitivities, bias, k, 3)
                    informs = informs and not stands(
                        grounded, v0, v1, covariances[k, 7] + covariances[k, 9]
                    )
                    outcome = correct_two_stage(
                        sight, k, q, informs, model, aircraft, sums, innovations, row
                    )
                else:
                    a, P = load_modes(k, count, mode_means, mode_covariances)
                    blocks, found = ALL_BLOCKS, True
                    if aircraft.delay.shape[1] == 0 and many:
                        if known != k:
                            blocks_known = blocks_of_modes(k, count, mode_V, 0, 0)
                        blocks = blocks_known | blocks_between(starts[q], starts[q + 1])
                        listed = list_columns(
                            k, count, mode_V, blocks, starts[q], starts[q + 1], mine.columns
                        )
                        if informs:
                            fetch_information(sums.Y, mine.columns, listed)
                    x = evaluate_modes(k, count, a, bias_row, mode_V, scratch, blocks)
                    if dt > 0.0:
                        # Innovations that no mode explains indicate a manoeuvre outside the models.
                        more = options[MODES_NIS_DENSITY] * (
                            excess_factor(
                                fading_nis[k], options[MODES_NIS_FLOOR],
                                options[MANOEUVRE_FACTOR_MAX],
                            ) - 1.0
                        )  # fmt: skip
                        predicted, a, x, P = predict_modes(
                            k,
                            dt,
                            more,
                            modes,
                            a,
                            x,
                            P,
                            probabilities,
                            scratch,
                            mode_V,
                            slow,
                            aircraft.slow_sensitivity,
                            blocks,
                        )
                    else:
                        predicted = load_row(probabilities, k, 0, count)
                    times[k] = time
                    outcome, posterior, a, x, P = correct_modes(
                        sight, k, q, informs, model, aircraft, a, x, P, predicted, sums, mine,
                        innovations, row, (blocks, listed),
                    )  # fmt: skip
                    if outcome == UPDATED or dt > 0.0:
                        store_modes(k, count, a, P, mode_means, mode_covariances)
                        combine_modes(k, posterior, a, x, P, means, covariances)
                        combine_columns(k, count, scratch, mode_V, sensitivities, blocks)
                        if not np.isnan(slow[k, 0]):
                            add_slow_spread(k, count, scratch, aircraft)
                    if aircraft.delay.shape[1] > 0:
                        correct_modes_with_delay(
                            k, count, outcome == UPDATED, aircraft, bias_row, sums, mine,
                            innovations[row],
                        )  # fmt: skip
                    if outcome == UPDATED and reporting and has_motion(rows.motion, row):
                        use_motion(k, row, time, rows.motion, model, aircraft, bias_row, sums, mine)
                if timed and outcome == UPDATED and not is_bearing(kind):
                    sight = Sight(kind, z0, z1, height, variance)
                    update_offset_velocity(sight, k, q, site_numbers[s], model, aircraft, H, W)
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
                if reporting and not grounded:
                    update_rate(rows.motion[row, CLIMB], k, heights, vertical)
                if unknown and action == UPDATED:
                    store_height_estimate(height_estimate, k, vertical)
                    shift_with_height(height_estimate[0], k, k, vertical, means)
                    for j in range(count):
                        shift_with_height(
                            height_estimate[0], k, k * count + j, vertical, mode_means
                        )
            elif action == UPDATED:
                coast_height(dt, k, heights, vertical, options)
            if accepted and want_readout:
                if listed != NOT_LISTED:
                    read_out_columns(
                        means[k], covariances[k], sensitivities[k], bias, factor, mine.columns,
                        listed, readouts[row],
                    )  # fmt: skip
                else:
                    if not found:
                        blocks = blocks_in_use(sensitivities[k])
                    read_out(
                        means[k], covariances[k], sensitivities[k], blocks, bias, factor,
                        readouts[row],
                    )  # fmt: skip
                finish_readout(row, k, heights, vertical, updates, on_ground, options, readouts)
                read_modes(row, k, count, modes, probabilities, readouts)
        if not many:
            copy_sums(Y, y, result.information[p], result.vector[p])


@in_loop
def fetch_modes(
    k: int, count: int, mode_means: Floats, mode_covariances: Floats, mode_V: Floats,
    probabilities: Floats,
) -> None:  # fmt: skip
    """Prefetch the modes of an aircraft."""
    fetch_ahead(probabilities, k, 0)
    for line in range((count * 4 + 7) // 8):
        fetch_ahead(mode_means, k * count, line)
    for line in range((count * 10 + 7) // 8):
        fetch_ahead(mode_covariances, k * count, line)
    if mode_V.shape[2] <= DENSE_MAX:
        for line in range((count * 4 * mode_V.shape[2] + 7) // 8):
            fetch_ahead(mode_V, k * count, line)


@in_loop
def fetch_first_mode(k: int, count: int, mode_V: Floats) -> None:
    """Prefetch the sensitivities of the first mode of an aircraft."""
    for line in range((4 * mode_V.shape[2] + 7) // 8 if k >= 0 else 0):
        fetch_ahead(mode_V, k * count, line)


@in_loop
def fetch_whole(
    k: int, means: Floats, covariances: Floats, V: Floats, times: Floats, heights: Floats,
    vertical: Floats,
) -> None:  # fmt: skip
    """Prefetch the combined state of an aircraft."""
    fetch_ahead(means, k, 0)
    fetch_ahead(covariances, k, 0)
    fetch_ahead(covariances, k, 1)
    fetch_ahead(times, k, 0)
    fetch_ahead(heights, k, 0)
    fetch_ahead(vertical, k, 0)
    if V.shape[2] <= DENSE_MAX:
        for line in range((4 * V.shape[2] + 7) // 8):
            fetch_ahead(V, k, line)
