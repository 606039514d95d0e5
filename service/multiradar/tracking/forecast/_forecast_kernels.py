"""Compiled forecast of one aircraft by its modes of motion.

References
----------
Blom, H. A. P., Bar-Shalom, Y., "The interacting multiple model algorithm for systems with
Markovian switching coefficients", IEEE Transactions on Automatic Control 33 (1988), 780-783: mixing
and motion, step after step without measurements. The project's own: the modes, and passages over
any interval.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.imm._mode_kernels import (
    combine_modes,
    mix_modes,
    move_modes,
    transition_modes,
)
from multiradar.estimation.filters.imm._mode_scratch_kernels import (
    SCRATCH_ROWS,
    load_modes,
    prepare_scratch,
    store_modes,
)
from multiradar_compiled.kernels import in_loop, kernel, loop
from multiradar_compiled.lane_kernels import LANES, load_row, store_row

Floats = NDArray[np.float64]


@kernel
def forecast_modes(
    ahead: Floats, step: float, modes: Floats, probabilities: Floats, means: Floats,
    covariances: Floats, out_means: Floats, out_covariances: Floats,
) -> None:  # fmt: skip
    """Fill the rows of ``out_means`` and ``out_covariances`` with the states at ascending times.

    The biases are part of the covariances. The modes, whose state is changed, go on from step to
    step, on a grid that does not depend on the times asked for, and from the last step to each of
    these times aside.
    """
    room = np.empty((SCRATCH_ROWS, LANES))
    prepare_scratch(modes, room)
    go_on(
        ahead, step, modes, probabilities, means, covariances, probabilities.copy(), means.copy(),
        covariances.copy(), room, out_means, out_covariances,
    )  # fmt: skip


@loop
def go_on(
    ahead: Floats, step: float, modes: Floats, probabilities: Floats, means: Floats,
    covariances: Floats, there_probabilities: Floats, there_means: Floats,
    there_covariances: Floats, room: Floats, out_means: Floats, out_covariances: Floats,
) -> None:  # fmt: skip
    """Do as `forecast_modes`; the way from the last step is in ``there…``."""
    count = modes.shape[0]
    now = 0.0
    for i in range(ahead.shape[0]):
        while now + step <= ahead[i]:
            move_on(step, modes, probabilities, means, covariances, room)
            now += step
        for j in range(count):
            there_probabilities[0, j] = probabilities[0, j]
            for r in range(4):
                there_means[j, r] = means[j, r]
            for m in range(10):
                there_covariances[j, m] = covariances[j, m]
        if ahead[i] > now:
            move_on(
                ahead[i] - now, modes, there_probabilities, there_means, there_covariances, room
            )
        chances = load_row(there_probabilities, 0, 0, count)
        a, P = load_modes(0, count, there_means, there_covariances)
        combine_modes(i, chances, a, a, P, out_means, out_covariances)


@in_loop
def move_on(
    dt: float, modes: Floats, probabilities: Floats, means: Floats, covariances: Floats,
    room: Floats,
) -> None:  # fmt: skip
    """Let the modes pass into each other, mix and move: the filter's way between two plots."""
    count = modes.shape[0]
    a, P = load_modes(0, count, means, covariances)
    before, passed = transition_modes(0, count, dt, modes, probabilities, room)
    a, x, P = mix_modes(before, a, a, P, room)
    a, x, P = move_modes(dt, 0.0, a, x, P, room)
    store_row(probabilities, 0, 0, count, passed)
    store_modes(0, count, a, P, means, covariances)
