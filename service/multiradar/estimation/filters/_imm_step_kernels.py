"""The compiled loop over measurements of the filter of interacting modes."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from multiradar.estimation.filters._imm_kernels import SEEN_COUNT, correct_modes
from multiradar.estimation.filters._kernels import (
    BIASES_KEPT,
    HEIGHT_MAX,
    INTERVAL_MAX_S,
    NO_ROOM,
    NO_ROOM_SLOT,
    READOUT_COUNT,
    REFUSALS_MAX,
    REFUSED,
    RESTARTED,
    SEVERAL,
    SINGULAR,
    STARTED,
    UNASSOCIATED,
    UNLOCATABLE,
    UNSUPPORTED,
    UPDATED,
    VALUE_MAX,
    choose_height,
    read_out,
    start_aircraft,
)
from multiradar.estimation.filters._mode_kernels import (
    join_modes,
    mix_modes,
    move_mode,
    pass_modes,
    spread_over_modes,
)
from multiradar.estimation.filters._step_kernels import copy_sums
from multiradar.estimation.filters.arrays import Aircraft, Model, Result, Rows, Work
from multiradar.estimation.measurement._kernels import (
    KIND_BEARING,
    KIND_FLAT_PLACE,
    KIND_FLAT_POLAR,
    KIND_RADAR,
)
from multiradar.kernels import loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Number of this method, beside those of `_step_kernels`.
IMM = 12


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
        np.empty((count + 1, 4)), np.empty((count + 1, 4)), np.empty((count, 10)),
        np.empty((count + 1, 4, n)), np.empty((count + 1, 10)), np.empty(count), np.empty((count, 3)),
        np.empty((count, SEEN_COUNT)), np.empty((count, 2, n)),
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
    B: Floats,
    T: Floats,
    S: Floats,
    C: Floats,
    shares: Floats,
    seen: Floats,
    U: Floats,
) -> None:
    """Do as `imm_step`, in the room given: see `_imm_kernels` and `_mode_kernels`."""
    plane, sites, noises, starts = model.plane, model.sites, model.noises, model.starts
    parameters, bias, factor, options = model.parameters, model.bias, model.factor, model.options
    bias_covariance, modes = model.bias_covariance, model.modes
    means, covariances, sensitivities = aircraft.mean, aircraft.covariance, aircraft.sensitivity
    times, heights, surprises = aircraft.time, aircraft.height, aircraft.surprise
    refusals, updates, updated = aircraft.refusals, aircraft.updates, aircraft.updated
    heard, places = aircraft.place, model.places
    mode_means, mode_covariances = aircraft.mode_mean, aircraft.mode_covariance
    mode_V, probabilities = aircraft.mode_sensitivity, aircraft.mode_probability
    outcomes, readouts = result.outcome, result.readout
    count = modes.shape[0]
    for p in work.partitions:
        copy_sums(result.information[p], result.vector[p], Y, y)
        for i in range(work.bounds[p], work.bounds[p + 1]):
            row = work.order[i]
            k = rows.slot[row]
            kind = rows.kind[row]
            if k < 0 or kind < KIND_RADAR or kind == KIND_BEARING or kind > KIND_FLAT_PLACE:
                outcomes[row] = UNSUPPORTED
                if k < 0:
                    outcomes[row] = NO_ROOM if k == NO_ROOM_SLOT else UNASSOCIATED
                continue
            s = rows.sensor[row]
            z0, z1, time = rows.z[row, 0], rows.z[row, 1], rows.time[row]
            fresh = np.isnan(times[k])
            interval = 0.0 if fresh else time - times[k]
            if not (interval >= 0.0 and np.isfinite(time)):
                outcomes[row] = REFUSED
                continue
            height, variance = choose_height(rows.height[row], heights[k], options)
            if kind >= KIND_FLAT_POLAR:
                variance = 0.0  # On a flat plane no height enters the range.
            starting = fresh or refusals[k] >= options[REFUSALS_MAX] or interval > INTERVAL_MAX_S
            if not (abs(z0) < VALUE_MAX and abs(z1) < VALUE_MAX):  # NaN too
                outcome = UNLOCATABLE if starting else SINGULAR
            elif starting:
                outcome = start_aircraft(
                    BIASES_KEPT, kind, z0, z1, height, variance, plane, sites[s], noises[s],
                    starts[s], starts[s + 1], parameters, bias, bias_covariance, options, means[k],
                    covariances[k], sensitivities[k], H, W,
                )  # fmt: skip
                if outcome == STARTED:
                    surprises[k] = 1.0
                    updates[k] = 0
                    heard[k] = places[s]
                    probabilities[k, 0] = np.nan
                    outcome = STARTED if fresh else RESTARTED
            else:
                if np.isnan(probabilities[k, 0]):
                    spread_over_modes(
                        k, count, modes, means, covariances, sensitivities, mode_means,
                        mode_covariances, mode_V, probabilities,
                    )  # fmt: skip
                if interval > 0.0:
                    pass_modes(k, count, interval, modes, probabilities, C, shares)
                    mix_modes(
                        k, count, bias, probabilities, shares, mode_means, mode_covariances,
                        mode_V, X, A, B, T, S,
                    )  # fmt: skip
                    for j in range(count):
                        probabilities[k, j] = C[j]
                        move_mode(
                            k * count + j, j, interval, modes, bias, mode_means, mode_covariances,
                            mode_V, A, B, T,
                        )  # fmt: skip
                else:
                    for j in range(count):
                        C[j] = probabilities[k, j]
                times[k] = time
                informs = variance == 0.0 and heard[k] != places[s]
                outcome = correct_modes(
                    kind, z0, z1, height, variance, k, s, informs, count, plane, sites, noises,
                    starts, parameters, bias, bias_covariance, options, mode_means,
                    mode_covariances, mode_V, probabilities, surprises, C, seen, U, Y, y, U0, U1,
                    R0, R1,
                )  # fmt: skip
                if outcome == UPDATED or interval > 0.0:
                    join_modes(
                        k, count, bias, probabilities, means, covariances, sensitivities,
                        mode_means, mode_covariances, mode_V, X, S,
                    )  # fmt: skip
            outcomes[row] = outcome
            if outcome in (UPDATED, STARTED, RESTARTED):
                refusals[k] = 0
                updates[k] += 1
                times[k] = time
                updated[k] = time
                if heard[k] != places[s]:
                    heard[k] = SEVERAL
                if abs(rows.height[row]) < HEIGHT_MAX:
                    heights[k] = rows.height[row]
                if want_readout:
                    read_out(
                        means[k], covariances[k], sensitivities[k], bias, factor, readouts[row]
                    )
                    readouts[row, READOUT_COUNT - 2] = heights[k]
                    readouts[row, READOUT_COUNT - 1] = updates[k]
            elif outcome in (REFUSED, SINGULAR):
                refusals[k] += 1
        copy_sums(Y, y, result.information[p], result.vector[p])
