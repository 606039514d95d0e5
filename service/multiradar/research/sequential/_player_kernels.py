"""Compiled replay of the rows of a scenario through one filter, with a record of its estimates.

References
----------
IMM UrO RAN report (2016), equations (1.16) to (1.18), measurement by measurement; (1.6) for the
random walk of the biases.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import acceleration_density
from multiradar.estimation.filters.arrays import Aircraft, Model, Result, Rows, Work
from multiradar.estimation.filters.separated._macro_kernels import MACRO
from multiradar.estimation.filters.two_stage._two_stage_kernels import component
from multiradar.estimation.motion._kernels import predict_motion
from multiradar.research.sequential._kernels import update_rows, walk
from multiradar.research.sequential.arrays import Record, Store
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]


@kernel
def play_rows(
    method: int,
    start: float,
    walk_s: float,
    times: Floats,
    work: Work,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    result: Result,
    store: Store,
    record: Record,
) -> None:
    """Update with all rows up to each time, with a bias step every ``walk_s``, and record."""
    row = 0
    walks = 0
    for t in range(times.shape[0]):
        while row < rows.time.shape[0] and rows.time[row] <= times[t]:
            last = end_of_epoch(method, rows, row)
            walks = walk_until(rows.time[row], method, start, walk_s, walks, model, aircraft, store)
            update_rows(method, row, last, work, rows, model, aircraft, result, store, False)
            row = last
        walks = walk_until(times[t], method, start, walk_s, walks, model, aircraft, store)
        write_record(t, times[t], model, aircraft, record)


@kernel
def end_of_epoch(method: int, rows: Rows, first: int) -> int:
    """Return the row after the epoch: one row, or all simultaneous rows of an aircraft."""
    last = first + 1
    if method != MACRO:
        return last
    while (
        last < rows.time.shape[0]
        and rows.time[last] == rows.time[first]
        and rows.slot[last] == rows.slot[first]
    ):
        last += 1
    return last


@kernel
def walk_until(
    time: float,
    method: int,
    start: float,
    walk_s: float,
    walks: int,
    model: Model,
    aircraft: Aircraft,
    store: Store,
) -> int:
    """Advance the random walk of the biases by the elapsed intervals; return their total number."""
    # An interval that has elapsed within rounding has elapsed.
    due = int(np.floor((time - start) / walk_s + 1e-9))
    if due > walks:
        walk(method, (due - walks) * walk_s, model, aircraft, store)
        return due
    return walks


@kernel
def write_record(t: int, time: float, model: Model, aircraft: Aircraft, record: Record) -> None:
    """Record every aircraft, predicted to the time and including biases, and the biases."""
    n = model.bias.shape[0]
    record.bias[t] = model.bias
    record.bias_covariance[t] = model.bias_covariance
    for k in range(aircraft.time.shape[0]):
        if np.isnan(aircraft.time[k]):
            record.mean[t, k] = np.nan
            record.covariance[t, k] = np.nan
            continue
        a = aircraft.mean[k].copy()
        P = aircraft.covariance[k].copy()
        V = aircraft.sensitivity[k].copy()
        v0, v1 = a[2], a[3]
        if V.shape[1] > 0:
            # As in a step: at the estimate, not at zero bias.
            v0 = component(aircraft.mean, aircraft.sensitivity, model.bias, k, 2)
            v1 = component(aircraft.mean, aircraft.sensitivity, model.bias, k, 3)
        density = acceleration_density(v0, v1, 1.0, model.options)
        predict_motion(a, P, V, time - aircraft.time[k], density)
        m = 0
        for i in range(4):
            for j in range(i, 4):
                x = P[m]
                m += 1
                for c in range(V.shape[1]):
                    for d in range(n):
                        x += V[i, c] * model.bias_covariance[c, d] * V[j, d]
                record.covariance[t, k, i, j] = x
                record.covariance[t, k, j, i] = x
            x = a[i]
            for c in range(V.shape[1]):
                x += V[i, c] * model.bias[c]
            record.mean[t, k, i] = x
