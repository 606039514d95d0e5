"""The compiled loop over measurements of the filter of interacting modes.

References
----------
Blom, H. A. P., Bar-Shalom, Y., "The interacting multiple model algorithm for systems with
Markovian switching coefficients", IEEE Transactions on Automatic Control 33 (1988), 780-783;
the two-stage form of each mode, and the loop itself, are the project's own.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from multiradar.estimation.filters._height_kernels import (
    height_informs,
    keep_height,
    look_at_height,
    pass_height,
)
from multiradar.estimation.filters._imm_kernels import SEEN_COUNT, correct_modes
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
from multiradar.estimation.filters._mode_kernels import (
    SHARE_COUNT,
    estimate_modes,
    join_modes,
    mix_modes,
    move_mode,
    pass_modes,
    read_modes,
    spread_over_modes,
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
from multiradar.estimation.filters._unheard_height_kernels import (
    LEARNT_COUNT,
    begin_by_height,
    keep_learnt,
    learn_height,
    met_height,
    shift_by_height,
)
from multiradar.estimation.filters.arrays import Aircraft, Model, Result, Rows, Work
from multiradar.kernels import fetch_ahead, in_loop, loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Number of this method, beside those of `_step_kernels`.
IMM = 12

# How many rows before its turn the aircraft of a row is fetched from memory: it fills half of the
# cache next to the core by itself.
AIRCRAFT_AHEAD = 1


@njit(cache=True, nogil=True, error_model="numpy")
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
    take_rows(
        work, rows, model, aircraft, result, want_readout, np.empty((2, 2)), np.empty(3),
        np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty((n, n)), np.empty(n),
        np.empty((count + 1, 4)), np.empty((count + 1, 4)), np.empty((count + 1, 10)),
        np.empty((count, 10)), np.empty((count + 1, 4, n)), np.empty((count + 1, 4)),
        np.empty(count),
        np.empty((count, SHARE_COUNT)), np.empty((count, SEEN_COUNT)), np.empty((count, 2, n)),
        np.empty(LEARNT_COUNT),
    )  # fmt: skip


@loop
def take_rows(
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    want_readout: bool,
    H: Floats,
    W: Floats,
    U0: Floats,
    U1: Floats,
    R0: Floats,
    R1: Floats,
    Y: Floats,
    y: Floats,
    X: Floats,
    A: Floats,
    S: Floats,
    B: Floats,
    T: Floats,
    Z: Floats,
    C: Floats,
    shares: Floats,
    seen: Floats,
    U: Floats,
    learnt: Floats,
) -> None:
    """Do as `imm_step`, in the room given: see `_imm_kernels` and `_mode_kernels`.

    H and W are room for a start, Y and y for the sums of a partition.
    """
    plane, sites, noises, starts = model.plane, model.sites, model.noises, model.starts
    parameters, bias, factor, options = model.parameters, model.bias, model.factor, model.options
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
            outcome = find_taker(k, kind)
            if outcome != UPDATED:
                outcomes[row] = outcome
                continue
            s = rows.sensor[row]
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
            turn = outcome
            if outcome in (STARTED, RESTARTED):
                begun = start_aircraft(
                    BIASES_KEPT, kind, z0, z1, height, variance, plane, sites[s], noises[s],
                    starts[s], starts[s + 1], parameters, bias, bias_covariance, options, means[k],
                    covariances[k], sensitivities[k], H, W,
                )  # fmt: skip
                if begun == STARTED:
                    note_start(k, places[s], surprises, updates, heard, velocities)
                    probabilities[k, 0] = np.nan
                    begin_by_height(look, kind, z0, k, s, noises, H, vertical)
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
                        look, kind, z0, z1, dt, options[ACCELERATION_DENSITY], k, s, plane, sites,
                        noises, starts, parameters, bias, bias_covariance, means, covariances,
                        sensitivities, vertical, learnt,
                    )  # fmt: skip
                    met = met_height(look, k, heights, vertical)
                    shift_by_height(met, k, k, vertical, means)
                    for j in range(count):
                        shift_by_height(met, k, k * count + j, vertical, mode_means)
                estimate_modes(k, count, bias, mode_means, mode_V, X)
                if dt > 0.0:
                    pass_modes(k, count, dt, modes, probabilities, C, shares)
                    mix_modes(
                        k, count, probabilities, shares, mode_means, mode_covariances, mode_V, X,
                        A, S, B, T, Z,
                    )  # fmt: skip
                    # What no mode explains is a manoeuvre of a kind that none of them is.
                    more = options[MODES_SURPRISE_DENSITY] * (
                        raised(
                            surprises[k], options[MODES_SURPRISE_FLOOR],
                            options[MANOEUVRE_FACTOR_MAX],
                        ) - 1.0
                    )  # fmt: skip
                    for j in range(count):
                        probabilities[k, j] = C[j]
                        move_mode(
                            k * count + j, j, dt, modes, more, mode_means,
                            mode_covariances, mode_V, X, A, B, T, Z,
                        )  # fmt: skip
                else:
                    for j in range(count):
                        C[j] = probabilities[k, j]
                times[k] = time
                # As in `_step_kernels.take_rows`.
                informs = heard[k] != places[s] and height_informs(
                    look, kind, z0, k, s, heights, vertical, noises
                )
                outcome = correct_modes(
                    kind, z0, z1, height, variance, k, s, informs, count, plane, sites, noises,
                    starts, parameters, bias, bias_covariance, options, mode_means,
                    mode_covariances, mode_V, probabilities, surprises, X, C, seen, U, Y, y, U0, U1,
                    R0, R1, innovations, row,
                )  # fmt: skip
                if outcome == UPDATED or dt > 0.0:
                    join_modes(
                        k, count, probabilities, means, covariances, sensitivities, mode_means,
                        mode_covariances, mode_V, X, S, Z,
                    )  # fmt: skip
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
