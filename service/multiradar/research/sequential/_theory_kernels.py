"""Compiled covariance analysis: the true error covariance of a filter, for any gains.

The filter is run along the true trajectories without noise, so that it is linearised at the truth.
Its gain K at each epoch is measured by its response to a small innovation in each component of the
measurement, and propagated over the stacked state (1.8) by (1.26). The filter's covariances enter
through that gain only.

Symbols: Σ = true covariance of the stacked state, aircraft first; C = (H, J) of (1.10), W = its
noise, M = Σ Cᵀ, S = C M + W, B = M − K S/2, with which (1.26) is Σ − K Bᵀ − B Kᵀ; F = contribution
of the error at an earlier time to the present error.

References
----------
IMM UrO RAN report (2016), equations (1.25) and (1.26). Measuring the gain by the filter's response
is the project's own.
"""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import choose_height
from multiradar.estimation.filters.arrays import Aircraft, Model, Result, Rows, Work
from multiradar.estimation.filters.joint._joint_kernels import JOINT
from multiradar.estimation.measurement._kernels import bias_column, predict_measurement
from multiradar.research.sequential._kernels import update_rows
from multiradar.research.sequential._player_kernels import end_of_epoch, walk_until, write_record
from multiradar.research.sequential.arrays import (
    Epoch,
    Saved,
    Store,
    TheoryRecord,
    TheoryScratch,
    Truth,
)
from multiradar_compiled.kernels import inlined_kernel, kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Test innovations, in sigmas of the noise: small enough not to move the linearisation within an
# epoch of several plots, large enough for nine digits of the gain.
PROBE = 1e-2


@kernel
def propagate(
    method: int,
    start: float,
    walk_s: float,
    times: Floats,
    truth: Truth,
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    store: Store,
    scratch: TheoryScratch,
    covariance: Floats,
    written: TheoryRecord,
) -> None:
    """Propagate Σ (``covariance``, in place) over all rows; write it at each of the times."""
    density, drift = truth.density, truth.drift
    twin, saved, epoch = scratch
    found, carried = written.covariance, written.transition
    row = 0
    walks = 0
    path = np.eye(covariance.shape[0])
    for t in range(times.shape[0]):
        while row < rows.time.shape[0] and rows.time[row] <= times[t]:
            last = end_of_epoch(method, rows, row)
            walks = walk_both(
                rows.time[row], method, start, walk_s, walks, model, aircraft, store, drift,
                covariance,
            )  # fmt: skip
            k = rows.slot[row]
            interval = rows.time[row] - aircraft.time[k]
            move_truth(covariance, 4 * k, interval, density)
            move_rows(path, 4 * k, interval)
            set_to_truth(truth.states[row], interval, aircraft.mean[k])
            linearise(row, last, truth.states[row], rows, model, aircraft.height[k], epoch)
            probe(method, row, last, work, rows, model, aircraft, result, store, twin, saved, epoch)
            correct(covariance, k, rows.sensor[row:last], model, epoch)
            correct_path(path, k, rows.sensor[row:last], model, epoch)
            row = last
        walks = walk_both(
            times[t], method, start, walk_s, walks, model, aircraft, store, drift, covariance
        )
        write_record(t, times[t], model, aircraft, written.reported)
        found[t] = covariance
        carried[t] = path
        path[:] = np.eye(path.shape[0])
        for k in range(aircraft.time.shape[0]):
            ahead = times[t] - aircraft.time[k]
            move_truth(found[t], 4 * k, ahead, density)
            move_rows(carried[t], 4 * k, ahead)
            move_rows(path, 4 * k, -ahead)


@kernel
def walk_both(
    time: float,
    method: int,
    start: float,
    walk_s: float,
    walks: int,
    model: Model,
    aircraft: Aircraft,
    store: Store,
    drift: Floats,
    covariance: Floats,
) -> int:
    """Advance the bias walks of filter and truth; return the number of elapsed intervals."""
    due = walk_until(time, method, start, walk_s, walks, model, aircraft, store)
    duration = (due - walks) * walk_s
    first = covariance.shape[0] - drift.shape[0]
    for c in range(drift.shape[0]):
        covariance[first + c, first + c] += drift[c] * drift[c] * duration  # (1.25)
    return due


@kernel
def move_truth(covariance: Floats, first: int, dt: float, density: float) -> None:
    """Σ ← A Σ Aᵀ + B V Bᵀ (1.25) for the aircraft with rows from ``first``."""
    if not dt > 0.0:
        return
    for i in range(2):
        covariance[first + i] += dt * covariance[first + i + 2]
    for i in range(2):
        covariance[:, first + i] += dt * covariance[:, first + i + 2]
    for i in range(2):
        covariance[first + i, first + i] += density * dt**3 / 3.0
        covariance[first + i, first + i + 2] += density * dt**2 / 2.0
        covariance[first + i + 2, first + i] += density * dt**2 / 2.0
        covariance[first + i + 2, first + i + 2] += density * dt


@kernel
def move_rows(path: Floats, first: int, dt: float) -> None:
    """F ← A F for the aircraft with rows from ``first``."""
    for i in range(2):
        path[first + i] += dt * path[first + i + 2]


@kernel
def set_to_truth(truth: Floats, dt: float, mean: Floats) -> None:
    """Set the filter's state so that its prediction is the truth."""
    mean[0] = truth[0] - dt * truth[2]
    mean[1] = truth[1] - dt * truth[3]
    mean[2] = truth[2]
    mean[3] = truth[3]


@kernel
def linearise(
    first: int,
    last: int,
    truth: Floats,
    rows: Rows,
    model: Model,
    last_height: float,
    epoch: Epoch,
) -> None:
    """Linearise each row of the epoch at the truth: its value, H, J and W."""
    for r in range(last - first):
        row = first + r
        s = rows.sensor[row]
        height, variance = choose_height(rows.height[row], last_height, model.options)
        H = epoch.by_position[r]
        W = epoch.noise[r]
        p0, p1, _ = predict_measurement(
            rows.kind[row], model.plane, model.sites[s], model.noises[s], truth[0], truth[1],
            height, variance, H, W,
        )  # fmt: skip
        epoch.value[r, 0] = p0
        epoch.value[r, 1] = p1
        epoch.probe[r, 0] = PROBE * sqrt(W[0])
        epoch.probe[r, 1] = PROBE * sqrt(W[2])
        rate0 = H[0, 0] * truth[2] + H[0, 1] * truth[3]
        rate1 = H[1, 0] * truth[2] + H[1, 1] * truth[3]
        for c in range(model.starts[s], model.starts[s + 1]):
            epoch.by_bias[r, 0, c], epoch.by_bias[r, 1, c] = bias_column(
                rows.kind[row], model.parameters[c], model.sites[s], p0, p1, rate0, rate1
            )


@inlined_kernel
def probe(
    method: int,
    first: int,
    last: int,
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    store: Store,
    twin: Aircraft,
    saved: Saved,
    epoch: Epoch,
) -> None:
    """Fill K with the filter's response to each component; leave it as after no innovation."""
    k = rows.slot[first]
    copy_aircraft(method, k, aircraft, twin)
    saved.bias_covariance[:] = model.bias_covariance
    saved.factor[:] = model.factor
    saved.information[:] = store.information
    for r in range(last - first):
        rows.z[first + r] = epoch.value[r]
    size = 2 * (last - first)
    for q in range(size + 1):
        if q < size:
            rows.z[first + q // 2, q % 2] += epoch.probe[q // 2, q % 2]
        update_rows(method, first, last, work, rows, model, aircraft, result, store, False)
        if q < size:
            innovation = epoch.probe[q // 2, q % 2]
            read_gain(method, k, q, innovation, rows.time[first], model, aircraft, twin, epoch.gain)
            rows.z[first + q // 2, q % 2] = epoch.value[q // 2, q % 2]
            copy_aircraft(method, k, twin, aircraft)
            model.bias_covariance[:] = saved.bias_covariance
            model.factor[:] = saved.factor
            store.information[:] = saved.information
        model.bias[:] = 0.0


@kernel
def copy_aircraft(method: int, k: int, source: Aircraft, target: Aircraft) -> None:
    """Copy the arrays that an epoch of aircraft k may change."""
    if method == JOINT:
        target.mean[:] = source.mean
        target.covariance[:] = source.covariance
        target.joint[:] = source.joint
    else:
        target.mean[k] = source.mean[k]
        target.covariance[k] = source.covariance[k]
        target.sensitivity[k] = source.sensitivity[k]
    target.time[k] = source.time[k]
    target.height[k] = source.height[k]
    target.vertical[k] = source.vertical[k]
    target.rejections[k] = source.rejections[k]
    target.updates[k] = source.updates[k]
    target.updated[k] = source.updated[k]
    target.measured_from[k] = source.measured_from[k]
    target.fading_nis[k] = source.fading_nis[k]
    target.velocity[k] = source.velocity[k]


@kernel
def read_gain(
    method: int,
    k: int,
    q: int,
    innovation: float,
    time: float,
    model: Model,
    aircraft: Aircraft,
    twin: Aircraft,
    K: Floats,
) -> None:
    """Column q of K (row q here): change of the estimates beyond the prediction, per unit."""
    n = model.bias.shape[0]
    first = K.shape[1] - n
    dt = time - twin.time[k]
    for o in range(aircraft.time.shape[0]):
        for i in range(4):
            x = 0.0
            if o == k:
                x = aircraft.mean[k, i] - twin.mean[k, i]
                if i < 2:
                    x -= dt * twin.mean[k, i + 2]
            elif method == JOINT:
                x = aircraft.mean[o, i] - twin.mean[o, i]
            for c in range(aircraft.sensitivity.shape[2]):
                x += aircraft.sensitivity[o, i, c] * model.bias[c]
            K[q, 4 * o + i] = x / innovation
    for c in range(n):
        K[q, first + c] = model.bias[c] / innovation


@kernel
def correct(covariance: Floats, k: int, sensors: Integers, model: Model, epoch: Epoch) -> None:
    """Σ ← (I − K C) Σ (I − K C)ᵀ + K W Kᵀ, (1.26)."""
    size = 2 * sensors.shape[0]
    count = covariance.shape[0]
    biases = count - model.bias.shape[0]
    K, M, B = epoch.gain, epoch.spread, epoch.half
    for q in range(size):
        s = sensors[q // 2]
        h = epoch.by_position[q // 2, q % 2]
        for x in range(count):
            M[q, x] = h[0] * covariance[4 * k, x] + h[1] * covariance[4 * k + 1, x]
        for c in range(model.starts[s], model.starts[s + 1]):
            j = epoch.by_bias[q // 2, q % 2, c]
            for x in range(count):
                M[q, x] += j * covariance[biases + c, x]
    for q in range(size):
        for x in range(count):
            B[q, x] = M[q, x]
        for p in range(size):
            s = sensors[p // 2]
            h = epoch.by_position[p // 2, p % 2]
            spread = h[0] * M[q, 4 * k] + h[1] * M[q, 4 * k + 1]
            for c in range(model.starts[s], model.starts[s + 1]):
                spread += epoch.by_bias[p // 2, p % 2, c] * M[q, biases + c]
            if p // 2 == q // 2:
                spread += epoch.noise[p // 2, p % 2 + q % 2]
            for x in range(count):
                B[q, x] -= 0.5 * spread * K[p, x]
    for y in range(count):
        moved = False
        for q in range(size):
            moved = moved or K[q, y] != 0.0
        if not moved:
            continue
        # Row y of K Bᵀ, which B Kᵀ has as its column: the sum stays symmetric to the last bit.
        for x in range(count):
            total = 0.0
            for q in range(size):
                total += K[q, y] * B[q, x]
            covariance[y, x] -= total
            covariance[x, y] -= total


@kernel
def correct_path(path: Floats, k: int, sensors: Integers, model: Model, epoch: Epoch) -> None:
    """F ← (I − K C) F, after `correct` in the same epoch."""
    size = 2 * sensors.shape[0]
    count = path.shape[0]
    biases = count - model.bias.shape[0]
    K, M = epoch.gain, epoch.spread
    for q in range(size):
        s = sensors[q // 2]
        h = epoch.by_position[q // 2, q % 2]
        for x in range(count):
            M[q, x] = h[0] * path[4 * k, x] + h[1] * path[4 * k + 1, x]
        for c in range(model.starts[s], model.starts[s + 1]):
            j = epoch.by_bias[q // 2, q % 2, c]
            for x in range(count):
                M[q, x] += j * path[biases + c, x]
    for y in range(count):
        for q in range(size):
            gain = K[q, y]
            if gain != 0.0:
                for x in range(count):
                    path[y, x] -= gain * M[q, x]
