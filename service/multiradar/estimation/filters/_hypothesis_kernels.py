"""Compiled mixing of the states of an aircraft under its association hypotheses.

Each plot that may belong to an aircraft, and the case of none, updates a copy of it. The state of
the aircraft is then the Gaussian with the moments of all copies, weighted by the probabilities of
the hypotheses.

Symbols: β = probabilities, a, V, P = conditional mean, sensitivity to the biases and covariance,
x = a + V ς̂ = estimate at the published biases. ā = Σ β a and V̄ = Σ β V stay affine in the biases,
P̄ = Σ β (P + (x − x̄) (x − x̄)ᵀ).

References
----------
Bar-Shalom, Y., Fortmann, T. E., "Tracking and Data Association" (1988), section 6.4: the moments
for one motion model. Their two-stage form, and that of interacting modes, are the project's own.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    NONE,
    RESTARTED,
    blocks_in_use,
    choose_height,
    read_out,
)
from multiradar.estimation.filters._row_kernels import finish_readout
from multiradar.estimation.filters.arrays import Aircraft, Model, Result, Rows
from multiradar.estimation.filters.imm._mode_kernels import read_modes
from multiradar.estimation.filters.imm._slow_state_kernels import add_spread
from multiradar.estimation.filters.two_stage._two_stage_kernels import component
from multiradar.estimation.measurement._kernels import expected_measurement
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@kernel
def copy_aircraft(slots: Integers, bounds: Integers, aircraft: Aircraft, copies: Aircraft) -> None:
    """Fill ``copies`` from ``bounds[e]`` to ``bounds[e + 1]`` with the aircraft ``slots[e]``."""
    modes = aircraft.mode_probability.shape[1]
    for e in range(len(slots)):
        k = slots[e]
        for h in range(bounds[e], bounds[e + 1]):
            copies.mean[h] = aircraft.mean[k]
            copies.covariance[h] = aircraft.covariance[k]
            copies.sensitivity[h] = aircraft.sensitivity[k]
            copies.fading_nis[h] = aircraft.fading_nis[k]
            copies.velocity[h] = aircraft.velocity[k]
            copy_bookkeeping(aircraft, k, copies, h)
            copies.mode_probability[h] = aircraft.mode_probability[k]
            for j in range(modes):
                to, of = h * modes + j, k * modes + j
                copies.mode_mean[to] = aircraft.mode_mean[of]
                copies.mode_covariance[to] = aircraft.mode_covariance[of]
                copies.mode_sensitivity[to] = aircraft.mode_sensitivity[of]
            copy_slow_states(k, h, aircraft, copies)


@kernel
def copy_slow_states(k: int, h: int, aircraft: Aircraft, copies: Aircraft) -> None:
    """Let a copy absorb the slow states of an aircraft: they are not mixed."""
    modes = aircraft.mode_probability.shape[1]
    if modes and not np.isnan(aircraft.slow[k, 0]):
        for j in range(modes):
            add_spread(
                1.0, aircraft.slow_sensitivity[k * modes + j], aircraft.slow_covariance[k],
                copies.mode_covariance[h * modes + j],
            )  # fmt: skip
    if modes:
        copies.slow[h, 0] = np.nan


@kernel
def copy_bookkeeping(one: Aircraft, k: int, other: Aircraft, h: int) -> None:
    """Copy the bookkeeping of an aircraft."""
    other.rejections[h] = one.rejections[k]
    other.updates[h] = one.updates[k]
    other.updated[h] = one.updated[k]
    other.measured_from[h] = one.measured_from[k]
    other.on_ground[h] = one.on_ground[k]
    copy_height(one, k, other, h)


@kernel
def copy_height(one: Aircraft, k: int, other: Aircraft, h: int) -> None:
    """Copy the time of the state and the height."""
    other.time[h] = one.time[k]
    other.height[h] = one.height[k]
    other.vertical[h] = one.vertical[k]


@kernel
def refer_plots(
    slots: Integers, bounds: Integers, aircraft: Aircraft, model: Model, times: Floats,
    copied: Rows,
) -> None:  # fmt: skip
    """Reduce the plots of each aircraft from their own ``times`` to the common time of ``copied``.

    They lie within one window, so a displacement at the estimated velocity is accurate enough.
    """
    for e in range(len(slots)):
        k = slots[e]
        v0 = component(aircraft.mean, aircraft.sensitivity, model.bias, k, 2)
        v1 = component(aircraft.mean, aircraft.sensitivity, model.bias, k, 3)
        for h in range(bounds[e], bounds[e + 1]):
            late = copied.time[h] - times[h]
            if late == 0.0:
                continue
            ahead = times[h] - aircraft.time[k]
            x0 = component(aircraft.mean, aircraft.sensitivity, model.bias, k, 0) + ahead * v0
            x1 = component(aircraft.mean, aircraft.sensitivity, model.bias, k, 1) + ahead * v1
            s = copied.seen[h]
            height, variance = choose_height(copied.height[h], aircraft.height[k], model.options)
            _, _, _, H, _ = expected_measurement(
                copied.kind[h], model.plane, model.sites[s], model.noises[s], x0, x1, height,
                variance,
            )  # fmt: skip
            copied.z[h, 0] += late * (H[0] * v0 + H[1] * v1)
            copied.z[h, 1] += late * (H[2] * v0 + H[3] * v1)


@kernel
def mix_hypotheses(
    slots: Integers, owners: Integers, unseen: Integers, bounds: Integers, beta: Floats,
    copies: Aircraft, bias: Floats, aircraft: Aircraft,
) -> None:  # fmt: skip
    """Set each aircraft ``slots[e]`` to the mixture of its copies.

    The aircraft takes the bookkeeping of the copy ``owners[e]``. Where that is `NONE` it keeps its
    own, and only time and height come from ``unseen[e]``, the copy without a plot if there is one.
    """
    modes = aircraft.mode_probability.shape[1]
    shares = np.empty(len(beta))
    for e in range(len(slots)):
        k, first, last = slots[e], bounds[e], bounds[e + 1]
        rows = np.arange(first, last)
        mix_states(
            rows, beta[first:last], copies.mean, copies.covariance, copies.sensitivity, bias,
            aircraft.mean[k], aircraft.covariance[k], aircraft.sensitivity[k],
        )  # fmt: skip
        aircraft.fading_nis[k] = 0.0
        aircraft.velocity[k] = 0.0
        aircraft.mode_probability[k] = 0.0
        for h in rows:
            aircraft.fading_nis[k] += beta[h] * copies.fading_nis[h]
            aircraft.velocity[k] += beta[h] * copies.velocity[h]
            aircraft.mode_probability[k] += beta[h] * copies.mode_probability[h]
        # NaN before the second plot: all modes are then in the single state.
        known = modes if modes and not np.isnan(aircraft.mode_probability[k, 0]) else 0
        for j in range(known):
            for h in rows:
                shares[h] = (
                    beta[h] * copies.mode_probability[h, j] / aircraft.mode_probability[k, j]
                )
            mix_states(
                rows * modes + j, shares[first:last], copies.mode_mean, copies.mode_covariance,
                copies.mode_sensitivity, bias, aircraft.mode_mean[k * modes + j],
                aircraft.mode_covariance[k * modes + j], aircraft.mode_sensitivity[k * modes + j],
            )  # fmt: skip
        if modes:
            # The copies have absorbed them.
            aircraft.slow[k, 0] = np.nan
        if owners[e] == NONE:
            copy_height(copies, unseen[e], aircraft, k)
        else:
            copy_bookkeeping(copies, owners[e], aircraft, k)


@kernel
def mix_states(
    rows: Integers, beta: Floats, means: Floats, covariances: Floats, V: Floats, bias: Floats,
    mean: Floats, covariance: Floats, sensitivity: Floats,
) -> None:  # fmt: skip
    """Set mean, covariance and sensitivity to those of the mixture of rows with probabilities β."""
    x = np.empty((len(rows), 4))
    middle = np.zeros(4)
    mean[:] = 0.0
    covariance[:] = 0.0
    sensitivity[:] = 0.0
    for i in range(len(rows)):
        row = rows[i]
        for r in range(4):
            x[i, r] = component(means, V, bias, row, r)
            middle[r] += beta[i] * x[i, r]
        mean += beta[i] * means[row]
        sensitivity += beta[i] * V[row]
    for i in range(len(rows)):
        m = 0
        for r in range(4):
            for c in range(r, 4):
                spread = (x[i, r] - middle[r]) * (x[i, c] - middle[c])
                covariance[m] += beta[i] * (covariances[rows[i], m] + spread)
                m += 1


@kernel
def read_mixed(
    slots: Integers, plots: Integers, aircraft: Aircraft, model: Model, result: Result
) -> None:
    """Write the readout of aircraft ``slots[e]`` after row ``plots[e]``, if that was accepted."""
    count = aircraft.mode_probability.shape[1]
    factor = model.factor.T.copy()
    for e in range(len(slots)):
        k, row = slots[e], plots[e]
        if row == NONE or result.outcome[row] > RESTARTED:
            continue
        read_out(
            aircraft.mean[k], aircraft.covariance[k], aircraft.sensitivity[k],
            blocks_in_use(aircraft.sensitivity[k]), model.bias, factor, result.readout[row],
        )  # fmt: skip
        finish_readout(
            row, k, aircraft.height, aircraft.vertical, aircraft.updates, aircraft.on_ground,
            model.options, result.readout,
        )  # fmt: skip
        if count:
            read_modes(row, k, count, model.modes, aircraft.mode_probability, result.readout)
