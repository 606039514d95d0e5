"""Parts of the filter of interacting modes by themselves, on the arrays of one aircraft."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import ALL_BLOCKS
from multiradar.estimation.filters.imm._mode_column_kernels import combine_columns, move_columns
from multiradar.estimation.filters.imm._mode_kernels import (
    combine_modes,
    mix_modes,
    move_modes,
    transition_modes,
)
from multiradar.estimation.filters.imm._mode_scratch_kernels import (
    COURSE,
    POSTERIOR,
    evaluate_modes,
    load_modes,
    set_row,
    store_modes,
)
from multiradar_compiled.kernels import loop
from multiradar_compiled.lane_kernels import every_lane, load_row, store_row

Floats = NDArray[np.float64]


@loop
def pass_and_mix(
    interval: float, table: Floats, bias: Floats, probabilities: Floats, means: Floats,
    covariances: Floats, sensitivities: Floats, room: Floats, passed: Floats,
) -> None:  # fmt: skip
    """Let the modes pass into each other and mix them, in place; they do not move."""
    count = table.shape[0]
    a, P = load_modes(0, count, means, covariances)
    x = evaluate_modes(0, count, a, bias, sensitivities, room, ALL_BLOCKS)
    before, after = transition_modes(0, count, interval, table, probabilities, room)
    a, x, P = mix_modes(before, a, x, P, room)
    store_modes(0, count, a, P, means, covariances)
    store_row(passed, 0, 0, count, after)
    for row in range(4):
        set_row(room, COURSE + row, every_lane(1.0 if row == 2 else 0.0))
    move_columns(0, count, probabilities, room, sensitivities, ALL_BLOCKS)


@loop
def move_alone(
    interval: float, more: float, means: Floats, covariances: Floats, sensitivities: Floats,
    bias: Floats, room: Floats, count: int, expected: Floats,
) -> None:  # fmt: skip
    """Move modes on that do not pass into each other, in place; and x."""
    a, P = load_modes(0, count, means, covariances)
    x = evaluate_modes(0, count, a, bias, sensitivities, room, ALL_BLOCKS)
    a, x, P = move_modes(interval, more, a, x, P, room)
    store_modes(0, count, a, P, means, covariances)
    for r in range(4):
        store_row(expected, r, 0, count, x[r])


@loop
def join(
    bias: Floats, probabilities: Floats, means: Floats, covariances: Floats, sensitivities: Floats,
    room: Floats, mean: Floats, covariance: Floats, sensitivity: Floats,
) -> None:  # fmt: skip
    """Set mean, covariance and sensitivity to those of all modes together."""
    count = means.shape[0]
    a, P = load_modes(0, count, means, covariances)
    x = evaluate_modes(0, count, a, bias, sensitivities, room, ALL_BLOCKS)
    chances = load_row(probabilities, 0, 0, count)
    set_row(room, POSTERIOR, chances)
    combine_modes(0, chances, a, x, P, mean, covariance)
    combine_columns(0, count, room, sensitivities, sensitivity, ALL_BLOCKS)
