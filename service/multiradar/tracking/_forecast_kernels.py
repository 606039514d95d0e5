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

from multiradar.estimation.filters._mode_kernels import (
    estimate_modes,
    join_modes,
    mix_modes,
    move_mode,
    pass_modes,
)
from multiradar.kernels import in_loop, loop

Floats = NDArray[np.float64]


@loop
def forecast_modes(
    ahead: Floats, step: float, modes: Floats, probabilities: Floats, means: Floats,
    covariances: Floats, V: Floats, there_probabilities: Floats, there_means: Floats,
    there_covariances: Floats, bias: Floats, X: Floats, A: Floats, S: Floats, B: Floats, T: Floats,
    Z: Floats, C: Floats, shares: Floats, out_means: Floats, out_covariances: Floats, out_V: Floats,
) -> None:  # fmt: skip
    """Fill the rows of ``out_means`` and ``out_covariances`` with the states at ascending times.

    The modes go on from step to step, on a grid that does not depend on the times asked for, and
    from the last step to each of these times aside, in ``there…``. V, T and ``bias`` have no
    columns: the biases are part of the covariances. The others are room, as in `_imm_step_kernels`.
    """
    count = modes.shape[0]
    now = 0.0
    for i in range(ahead.shape[0]):
        while now + step <= ahead[i]:
            move_on(
                step, count, modes, probabilities, means, covariances, V, bias, X, A, S, B, T, Z, C,
                shares,
            )  # fmt: skip
            now += step
        for j in range(count):
            there_probabilities[0, j] = probabilities[0, j]
            for r in range(4):
                there_means[j, r] = means[j, r]
            for m in range(10):
                there_covariances[j, m] = covariances[j, m]
        if ahead[i] > now:
            move_on(
                ahead[i] - now, count, modes, there_probabilities, there_means, there_covariances,
                V, bias, X, A, S, B, T, Z, C, shares,
            )  # fmt: skip
        estimate_modes(0, count, bias, there_means, V, X)
        join_modes(
            0, count, there_probabilities, out_means[i : i + 1], out_covariances[i : i + 1], out_V,
            there_means, there_covariances, V, X, S, Z,
        )  # fmt: skip


@in_loop
def move_on(
    dt: float, count: int, modes: Floats, probabilities: Floats, means: Floats, covariances: Floats,
    V: Floats, bias: Floats, X: Floats, A: Floats, S: Floats, B: Floats, T: Floats, Z: Floats,
    C: Floats, shares: Floats,
) -> None:  # fmt: skip
    """Let the modes pass into each other, mix and move: the filter's way between two plots."""
    estimate_modes(0, count, bias, means, V, X)
    pass_modes(0, count, dt, modes, probabilities, C, shares)
    mix_modes(0, count, probabilities, shares, means, covariances, V, X, A, S, B, T, Z)
    for j in range(count):
        probabilities[0, j] = C[j]
        move_mode(j, j, dt, modes, 0.0, means, covariances, V, X, A, B, T, Z)
