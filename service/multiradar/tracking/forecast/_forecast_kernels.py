"""Compiled forecast of one aircraft by its motion modes.

References
----------
Blom, H. A. P., Bar-Shalom, Y., "The interacting multiple model algorithm for systems with Markovian
switching coefficients", IEEE Transactions on Automatic Control 33 (1988), 780-783: mixing and
motion without measurements. The project's own: the modes, and transitions over any interval.
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
from multiradar_compiled.kernels import in_loop, inner_loop, kernel
from multiradar_compiled.lane_kernels import LANES, load_row, store_row

Floats = NDArray[np.float64]


@kernel
def forecast_modes(
    ahead: Floats, step: float, modes: Floats, probabilities: Floats, means: Floats,
    covariances: Floats, out_means: Floats, out_covariances: Floats,
) -> None:  # fmt: skip
    """Fill the rows of ``out_means`` and ``out_covariances`` with the states at ascending times.

    The covariances include the biases. The modes, whose arrays are modified, are propagated on a
    fixed grid of steps independent of the requested times, and from the last step to each of these
    times.
    """
    scratch = np.empty((SCRATCH_ROWS, LANES))
    prepare_scratch(modes, scratch)
    propagate_all(
        ahead, step, modes, probabilities, means, covariances, probabilities.copy(), means.copy(),
        covariances.copy(), scratch, out_means, out_covariances,
    )  # fmt: skip


@inner_loop
def propagate_all(
    ahead: Floats, step: float, modes: Floats, probabilities: Floats, means: Floats,
    covariances: Floats, there_probabilities: Floats, there_means: Floats,
    there_covariances: Floats, scratch: Floats, out_means: Floats, out_covariances: Floats,
) -> None:  # fmt: skip
    """As `forecast_modes`; ``there…`` is scratch for the time after the last step."""
    count = modes.shape[0]
    now = 0.0
    for i in range(ahead.shape[0]):
        while now + step <= ahead[i]:
            propagate(step, modes, probabilities, means, covariances, scratch)
            now += step
        for j in range(count):
            there_probabilities[0, j] = probabilities[0, j]
            for r in range(4):
                there_means[j, r] = means[j, r]
            for m in range(10):
                there_covariances[j, m] = covariances[j, m]
        if ahead[i] > now:
            propagate(
                ahead[i] - now, modes, there_probabilities, there_means, there_covariances, scratch
            )
        mode_probabilities = load_row(there_probabilities, 0, 0, count)
        a, P = load_modes(0, count, there_means, there_covariances)
        combine_modes(i, mode_probabilities, a, a, P, out_means, out_covariances)


@in_loop
def propagate(
    dt: float, modes: Floats, probabilities: Floats, means: Floats, covariances: Floats,
    scratch: Floats,
) -> None:  # fmt: skip
    """Apply mode transitions, mixing and motion: the prediction step of the filter."""
    count = modes.shape[0]
    a, P = load_modes(0, count, means, covariances)
    before, passed = transition_modes(0, count, dt, modes, probabilities, scratch)
    a, x, P = mix_modes(before, a, a, P, scratch)
    a, x, P = move_modes(dt, 0.0, a, x, P, scratch)
    store_row(probabilities, 0, 0, count, passed)
    store_modes(0, count, a, P, means, covariances)
