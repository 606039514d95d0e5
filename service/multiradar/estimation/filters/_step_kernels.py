"""The compiled loop over measurements that all filters share."""

import numpy as np
from numba import njit

from multiradar.estimation.filters._kernels import (
    ACCELERATION_DENSITY,
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
    UNSUPPORTED,
    UPDATED,
    choose_height,
    manoeuvre_factor,
    read_out,
    start_aircraft,
)
from multiradar.estimation.filters._separated_kernels import correct_separated
from multiradar.estimation.filters._two_stage_kernels import correct_two_stage
from multiradar.estimation.filters.arrays import Aircraft, Model, Result, Rows, Work
from multiradar.estimation.measurement._kernels import (
    KIND_BEARING,
    KIND_FLAT_PLACE,
    KIND_FLAT_POLAR,
    KIND_RADAR,
)
from multiradar.estimation.motion._kernels import predict_motion

# Methods; they also say how a new aircraft takes the biases (`_kernels.start_aircraft`).
TWO_STAGE = 0
BLOM = 1
INTERSECTION = 2


@njit(cache=True, nogil=True, error_model="numpy")
def step(
    method: int,
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    want_readout: bool,
) -> None:
    """Take rows in the given order: move the aircraft on, correct it, note what became of the row.

    The arrays are taken out of their bundles here, once: handing a bundle to a function for each
    row would cost more than the row.
    """
    plane, sites, noises, starts = model.plane, model.sites, model.noises, model.starts
    parameters, bias, factor, options = model.parameters, model.bias, model.factor, model.options
    bias_covariance = model.bias_covariance
    means, covariances, sensitivities = aircraft.mean, aircraft.covariance, aircraft.sensitivity
    times, heights, surprises = aircraft.time, aircraft.height, aircraft.surprise
    refusals, updates, updated = aircraft.refusals, aircraft.updates, aircraft.updated
    heard, places = aircraft.place, model.places
    outcomes, readouts, logs = result.outcome, result.readout, result.log
    H = np.empty((2, 2))
    W = np.empty(3)
    G = np.empty((4, 2))
    K = np.empty((4, 2))
    U = np.empty((2, bias.shape[0]))
    for p in work.partitions:
        Y = result.information[p]
        y = result.vector[p]
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
            site, noise, first, last = sites[s], noises[s], starts[s], starts[s + 1]
            z0, z1, time = rows.z[row, 0], rows.z[row, 1], rows.time[row]
            a, P, V = means[k], covariances[k], sensitivities[k]
            height, variance = choose_height(rows.height[row], heights[k], options)
            if kind >= KIND_FLAT_POLAR:
                variance = 0.0  # On a flat plane no height enters the range.
            fresh = np.isnan(times[k])
            if fresh or refusals[k] >= options[REFUSALS_MAX]:
                outcome = start_aircraft(
                    method, kind, z0, z1, height, variance, plane, site, noise, first, last,
                    parameters, bias, bias_covariance, options, a, P, V, H, W,
                )  # fmt: skip
                if outcome == STARTED:
                    surprises[k] = 1.0
                    updates[k] = 0
                    heard[k] = places[s]
                    outcome = STARTED if fresh else RESTARTED
            else:
                density = options[ACCELERATION_DENSITY] * manoeuvre_factor(surprises[k], options)
                predict_motion(a, P, V, time - times[k], density)
                times[k] = time
                # A plot speaks about the biases when its height is known (an unknown one is wrong
                # by the same amount plot after plot) and the aircraft was measured from elsewhere
                # too (from one place alone, linearising anew at every plot makes biases seem to be
                # seen that cannot be told from motion).
                informs = variance == 0.0 and heard[k] != places[s]
                if method == TWO_STAGE:
                    outcome, surprises[k] = correct_two_stage(
                        kind, z0, z1, height, variance, plane, site, noise, first, last,
                        parameters, bias, factor, options, surprises[k], informs, a, P, V,
                        Y, y, H, W, G, K, U,
                    )  # fmt: skip
                else:
                    outcome, surprises[k] = correct_separated(
                        method == INTERSECTION, kind, z0, z1, height, variance, plane, site, noise,
                        first, last, parameters, bias, bias_covariance, options, surprises[k],
                        informs, a, P, Y, y, logs[row], H, W, G, K,
                    )  # fmt: skip
            outcomes[row] = outcome
            if outcome in (UPDATED, STARTED, RESTARTED):
                refusals[k] = 0
                updates[k] += 1
                times[k] = time
                updated[k] = time
                if heard[k] != places[s]:
                    heard[k] = SEVERAL
                if not np.isnan(rows.height[row]):
                    heights[k] = rows.height[row]
                if want_readout:
                    read_out(a, P, V, bias, factor, readouts[row])
                    readouts[row, READOUT_COUNT - 2] = heights[k]
                    readouts[row, READOUT_COUNT - 1] = updates[k]
            elif outcome in (REFUSED, SINGULAR):
                refusals[k] += 1
