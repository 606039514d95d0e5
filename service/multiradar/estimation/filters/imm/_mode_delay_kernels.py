"""Compiled effect of the delay of a transponder on interacting modes.

The delay is common to all modes of an aircraft, and so is the change of its estimate: each mode has
its own D, the last column of its V. A measurement updates the modes as without delays, with the
innovations at the published biases; `correct_modes_with_delay` does the rest, so that the update
without delays costs nothing more.

Symbols as in `_delay_kernels` and `_imm_kernels`.

References
----------
The project's own.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._delay_kernels import (
    add_delay_columns,
    correct_delay,
    inform_with_delay,
    measures_delay,
    shift_with_delay,
)
from multiradar.estimation.filters._kernels import (
    ALL_BLOCKS,
    INNOVATION_BIASES,
    INNOVATION_COVARIANCE,
)
from multiradar.estimation.filters.arrays import Aircraft, BiasSums, Model
from multiradar.estimation.filters.imm._mode_column_kernels import combine_columns
from multiradar.estimation.filters.imm._mode_kernels import combine_modes
from multiradar.estimation.filters.imm._mode_scratch_kernels import (
    GAIN,
    POSTERIOR,
    ModeScratch,
    evaluate_modes,
    get_row,
    load_modes,
)
from multiradar.estimation.filters.imm._slow_state_kernels import add_slow_spread
from multiradar_compiled.kernels import inner_loop

Floats = NDArray[np.float64]

# Scratch of a measurement: j V_d ς̂, by which its innovation at bias zero is larger; u; κ, ρ, κ ν,
# which are 0, 1 and 0 where it does not inform about the delay.
SHIFT = 0
OWN = 1
KAPPA = 3
RHO = 5
CHANGE = 6
DELAY_SCRATCH = 7


@inner_loop
def add_delay_to_modes(
    k: int, count: int, kind: int, s: int, model: Model, delay: Floats, U: Floats,
    mine: ModeScratch,
) -> None:  # fmt: skip
    """Add the effect of the delay of aircraft k to U of a measurement, of each mode and of all."""
    scratch, last = mine.delay, U.shape[1] - 1
    for i in range(DELAY_SCRATCH):
        scratch[i] = 1.0 if i == RHO else 0.0
    if measures_delay(kind, s, model):
        scratch[SHIFT] = add_delay_columns(k, delay, model.bias, U)
        for j in range(count):
            add_delay_columns(k, delay, model.bias, mine.by_mode[j])
    scratch[OWN] = U[0, last]
    scratch[OWN + 1] = U[1, last]


@inner_loop
def inform_of_modes(
    k: int, i00: float, i01: float, i11: float, nu0: float, nu1: float, delay: Floats,
    sums: BiasSums, scratch: Floats,
) -> None:  # fmt: skip
    """Add the information of a measurement about ς, and update the delay of aircraft k."""
    nu0 += scratch[SHIFT]
    gain = inform_with_delay(i00, i01, i11, nu0, nu1, sums)
    correct_delay(k, gain, nu0, nu1, sums.U, delay)
    scratch[KAPPA] = gain[0]
    scratch[KAPPA + 1] = gain[1]
    scratch[RHO] = gain[2]
    scratch[CHANGE] = gain[0] * nu0 + gain[1] * nu1


@inner_loop
def correct_modes_with_delay(
    k: int, count: int, updated: bool, aircraft: Aircraft, bias_row: Floats, sums: BiasSums,
    mine: ModeScratch, innovation: Floats,
) -> None:  # fmt: skip
    """Complete the update of the modes of aircraft k by a measurement, and of their mixture.

    a += K j V_d ς̂ + D κ ν, V −= D κ U and D ← ρ D. Without an update only the recorded
    ``innovation`` is changed: the delay is an error of the aircraft, not of a sensor.
    """
    scratch, rows, mode_V = mine.delay, mine.rows, aircraft.mode_sensitivity
    u0, u1 = scratch[OWN], scratch[OWN + 1]
    own = (u0 * u0, u0 * u1, u1 * u1)
    for i in range(3):
        innovation[INNOVATION_COVARIANCE + i] += own[i]
        innovation[INNOVATION_BIASES + i] -= own[i]
    if not updated:
        return
    last = mode_V.shape[2] - 1
    for j in range(count):
        row = k * count + j
        for i in range(4):
            aircraft.mode_mean[row, i] += (
                rows[GAIN + 2 * i, j] * scratch[SHIFT] + mode_V[row, i, last] * scratch[CHANGE]
            )
        gain = (scratch[KAPPA], scratch[KAPPA + 1], scratch[RHO])
        shift_with_delay(mode_V[row], gain, sums.U)
    a, P = load_modes(k, count, aircraft.mode_mean, aircraft.mode_covariance)
    x = evaluate_modes(k, count, a, bias_row, mode_V, rows, ALL_BLOCKS)
    combine_modes(k, get_row(rows, POSTERIOR), a, x, P, aircraft.mean, aircraft.covariance)
    combine_columns(k, count, rows, mode_V, aircraft.sensitivity, ALL_BLOCKS)
    if not np.isnan(aircraft.slow[k, 0]):
        add_slow_spread(k, count, rows, aircraft)
