"""The compiled loop over measurements of the filter of interacting modes.

References
----------
Blom, H. A. P., Bar-Shalom, Y., "The interacting multiple model algorithm for systems with
Markovian switching coefficients", IEEE Transactions on Automatic Control 33 (1988), 780-783;
the two-stage form of each mode, and the loop itself, are the project's own.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    ACCELERATION_DENSITY,
    BIASES_KEPT,
    MANOEUVRE_FACTOR_MAX,
    MODES_SURPRISE_DENSITY,
    MODES_SURPRISE_FLOOR,
    REFUSED,
    RESTARTED,
    STARTED,
    UPDATED,
    raised,
    read_out,
    start_aircraft,
)
from multiradar.estimation.filters._row_kernels import (
    find_taker,
    find_turn,
    finish_readout,
    is_patient,
    note_outcome,
    note_start,
)
from multiradar.estimation.filters._step_kernels import ROWS_AHEAD, copy_sums, fetch_row
from multiradar.estimation.filters.arrays import Aircraft, Model, Result, Rows, Work
from multiradar.estimation.filters.height._height_kernels import (
    height_informs,
    keep_height,
    look_at_height,
    pass_height,
)
from multiradar.estimation.filters.height._unheard_height_kernels import (
    LEARNT_COUNT,
    begin_by_height,
    keep_learnt,
    learn_height,
    met_height,
    shift_by_height,
    taken_as,
)
from multiradar.estimation.filters.imm._imm_kernels import correct_modes
from multiradar.estimation.filters.imm._mode_column_kernels import join_columns, move_columns
from multiradar.estimation.filters.imm._mode_kernels import (
    join_modes,
    mix_modes,
    move_modes,
    pass_modes,
    read_modes,
    spread_over_modes,
)
from multiradar.estimation.filters.imm._mode_room_kernels import (
    ROOM_ROWS,
    expect_modes,
    load_modes,
    prepare_room,
    store_modes,
)
from multiradar.estimation.measurement._kernels import KIND_BEARING
from multiradar_compiled.kernels import fetch_ahead, in_loop, kernel, loop
from multiradar_compiled.lane_kernels import LANES, load_row, store_row

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Number of this method, beside those of `_step_kernels`.
IMM = 12

# How many rows before its turn the aircraft of a row is fetched from memory: it fills half of the
# cache next to the core by itself.
AIRCRAFT_AHEAD = 1


@kernel
def imm_step(
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    want_readout: bool,
) -> None:
    """Take rows in the given order; same arguments as `_step_kernels.step`."""
    n, count = model.bias.shape[0], model.modes.shape[0]
    room = np.empty((ROOM_ROWS, LANES))
    prepare_room(model.modes, room)
    take_rows(
        work, rows, model, aircraft, result, want_readout, model.factor.T.copy(),
        model.bias.reshape(1, n), np.empty((2, 2)), np.empty(3), np.empty((2, n)), np.empty((2, n)),
        np.empty((n, n)), np.empty(n), np.empty((count, 2, n)), np.empty(LEARNT_COUNT), room,
    )  # fmt: skip


@loop
def take_rows(
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
    U: Floats,
    R: Floats,
    Y: Floats,
    y: Floats,
    mode_U: Floats,
    learnt: Floats,
    room: Floats,
) -> None:
    """Do as `imm_step`, in the room given: see `_step_kernels.take_rows` and `_mode_kernels`."""
    plane, sites, noises, starts = model.plane, model.sites, model.noises, model.starts
    parameters, bias, options = model.parameters, model.bias, model.options
    bias_covariance, modes = model.bias_covariance, model.modes
    means, covariances, sensitivities = aircraft.mean, aircraft.covariance, aircraft.sensitivity
    times, heights, surprises = aircraft.time, aircraft.height, aircraft.surprise
    vertical = aircraft.vertical
    refusals, updates, updated = aircraft.refusals, aircraft.updates, aircraft.updated
    heard, places, velocities = aircraft.place, model.places, aircraft.velocity
    mode_means, mode_covariances = aircraft.mode_mean, aircraft.mode_covariance
    mode_V, probabilities = aircraft.mode_sensitivity, aircraft.mode_probability
    outcomes, readouts, innovations = result.outcome, result.readout, result.innovation
    count = modes.shape[0]
    for p in work.partitions:
        copy_sums(result.information[p], result.vector[p], Y, y)
        for i in range(work.bounds[p], work.bounds[p + 1]):
            if i + ROWS_AHEAD < work.bounds[p + 1]:
                fetch_row(
                    work.order[i + ROWS_AHEAD], rows.slot, rows.time, rows.sensor, rows.z, outcomes
                )
            if i + AIRCRAFT_AHEAD < work.bounds[p + 1]:
                ahead = rows.slot[work.order[i + AIRCRAFT_AHEAD]]
                if ahead >= 0:
                    fetch_modes(ahead, count, mode_means, mode_covariances, mode_V, probabilities)
                    fetch_whole(ahead, means, covariances, sensitivities, times, heights, vertical)
            row = work.order[i]
            k = rows.slot[row]
            kind = rows.kind[row]
            innovations[row, 0] = np.nan
            outcome = find_taker(k, kind, True)
            if outcome != UPDATED:
                outcomes[row] = outcome
                continue
            s, q = rows.sensor[row], rows.seen[row]
            z0, z1, time = rows.z[row, 0], rows.z[row, 1], rows.time[row]
            patient = is_patient(kind, places[s], time, k, heard, updated)
            outcome = find_turn(kind, z0, z1, time, times[k], refusals[k], patient, options)
            if outcome == REFUSED:
                outcomes[row] = outcome
                continue
            measured, dt = rows.height[row], time - times[k]
            look = look_at_height(
                outcome, kind, measured, s, time, dt, k, heights, vertical, options
            )
            height, variance = look[1], look[2]
            used = taken_as(kind, look, heights[k])
            first = 0.0 if used == KIND_BEARING else z0
            turn = outcome
            if outcome in (STARTED, RESTARTED):
                begun = start_aircraft(
                    BIASES_KEPT, kind, z0, z1, height, variance, plane, sites[q], noises[q],
                    starts[q], starts[q + 1], parameters, bias, bias_covariance, options, means[k],
                    covariances[k], sensitivities[k], H, W,
                )  # fmt: skip
                if begun == STARTED:
                    note_start(k, places[s], surprises, updates, heard, velocities)
                    probabilities[k, 0] = np.nan
                    begin_by_height(look, kind, z0, k, q, noises, H, vertical)
                else:
                    outcome = begun
            elif outcome == UPDATED:
                if np.isnan(probabilities[k, 0]):
                    spread_over_modes(
                        k, count, means, covariances, sensitivities, mode_means, mode_covariances,
                        mode_V, probabilities,
                    )  # fmt: skip
                if np.isnan(heights[k]):
                    learn_height(
                        look, kind, z0, z1, dt, options[ACCELERATION_DENSITY], k, q, plane, sites,
                        noises, starts, parameters, bias, bias_covariance, means, covariances,
                        sensitivities, vertical, learnt,
                    )  # fmt: skip
                    met = met_height(look, k, heights, vertical)
                    shift_by_height(met, k, k, vertical, means)
                    for j in range(count):
                        shift_by_height(met, k, k * count + j, vertical, mode_means)
                a, P = load_modes(k, count, mode_means, mode_covariances)
                x = expect_modes(k, count, a, bias_row, mode_V, room)
                if dt > 0.0:
                    before, passed = pass_modes(k, count, dt, modes, probabilities, room)
                    a, x, P = mix_modes(before, a, x, P, room)
                    # What no mode explains is a manoeuvre of a kind that none of them is.
                    more = options[MODES_SURPRISE_DENSITY] * (
                        raised(
                            surprises[k], options[MODES_SURPRISE_FLOOR],
                            options[MANOEUVRE_FACTOR_MAX],
                        ) - 1.0
                    )  # fmt: skip
                    a, x, P = move_modes(dt, more, a, x, P, room)
                    move_columns(k, count, probabilities, room, mode_V)
                    store_row(probabilities, k, 0, count, passed)
                else:
                    passed = load_row(probabilities, k, 0, count)
                times[k] = time
                # As in `_step_kernels.take_rows`.
                informs = heard[k] != places[s] and height_informs(
                    look, used, first, k, q, heights, vertical, noises
                )
                outcome, chances, a, x, P = correct_modes(
                    used, first, z1, height, variance, k, q, informs, count, plane, sites, noises,
                    starts, parameters, bias, bias_covariance, options, a, x, P, mode_V,
                    probabilities, passed, surprises, room, mode_U, U, R, Y, y, innovations, row,
                )  # fmt: skip
                if outcome == UPDATED or dt > 0.0:
                    store_modes(k, count, a, P, mode_means, mode_covariances)
                    join_modes(k, chances, a, x, P, means, covariances)
                    join_columns(k, count, room, mode_V, sensitivities)
            outcomes[row] = outcome
            taken = note_outcome(
                outcome, k, patient, time, places[s], times, refusals, updates, updated, heard
            )
            if taken:
                unheard = np.isnan(heights[k])
                keep_height(look, kind, measured, s, time, dt, k, heights, vertical, options)
                if unheard and turn == UPDATED:
                    keep_learnt(learnt, k, vertical)
                    shift_by_height(learnt[0], k, k, vertical, means)
                    for j in range(count):
                        shift_by_height(learnt[0], k, k * count + j, vertical, mode_means)
            elif turn == UPDATED:
                pass_height(dt, k, heights, vertical, options)
            if taken and want_readout:
                read_out(means[k], covariances[k], sensitivities[k], bias, factor, readouts[row])
                finish_readout(row, k, heights, vertical, updates, options, readouts)
                read_modes(row, k, count, modes, probabilities, readouts)
        copy_sums(Y, y, result.information[p], result.vector[p])


@in_loop
def fetch_modes(
    k: int, count: int, mode_means: Floats, mode_covariances: Floats, mode_V: Floats,
    probabilities: Floats,
) -> None:  # fmt: skip
    """Ask for the modes of an aircraft."""
    fetch_ahead(probabilities, k, 0)
    for line in range((count * 4 + 7) // 8):
        fetch_ahead(mode_means, k * count, line)
    for line in range((count * 10 + 7) // 8):
        fetch_ahead(mode_covariances, k * count, line)
    for line in range((count * 4 * mode_V.shape[2] + 7) // 8):
        fetch_ahead(mode_V, k * count, line)


@in_loop
def fetch_whole(
    k: int, means: Floats, covariances: Floats, V: Floats, times: Floats, heights: Floats,
    vertical: Floats,
) -> None:  # fmt: skip
    """Ask for the state of an aircraft as a whole."""
    fetch_ahead(means, k, 0)
    fetch_ahead(covariances, k, 0)
    fetch_ahead(covariances, k, 1)
    fetch_ahead(times, k, 0)
    fetch_ahead(heights, k, 0)
    fetch_ahead(vertical, k, 0)
    for line in range((4 * V.shape[2] + 7) // 8):
        fetch_ahead(V, k, line)
