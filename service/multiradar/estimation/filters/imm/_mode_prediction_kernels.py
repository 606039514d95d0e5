"""Compiled prediction of interacting modes over any interval.

Mixing assumes that an aircraft changes its mode at the start of an interval only. Between plots a
few seconds apart that is harmless. Over a gap, as left by missed scans at far range, it allows for
two flights only: the manoeuvre lasts for the whole gap, or none occurs. Both predictions are
narrow, and an aircraft that turned for a part of the gap is far from both. So a longer interval is
divided into equal steps of at most `STEP_MAX_S`, each with transition, mixing and motion. With n
steps of length h the transition matrix Π(nh) = Π(h)ⁿ is the same (the rates are constant), and so
is the noise of each mode; but the moments of each mode then include the flights that changed their
mode at 0, h, 2h, …: the sum over these times approximates the integral over the time of a change,
with an error of the order of h times the rate.

Measured with one radar of 12 s and probability of detection 0.5, 200 to 420 km away
(`python -m validation.motion.check_gaps`): the figures of steps of 4 s are those of steps of 8 s,
within 1 %.

References
----------
Blom, H. A. P., Bar-Shalom, Y., "The interacting multiple model algorithm for systems with
Markovian switching coefficients", IEEE Transactions on Automatic Control 33 (1988), 780-783:
equations (3) to (8), one step. The division of intervals is the project's own.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import ALL_BLOCKS
from multiradar.estimation.filters.imm._mode_column_kernels import move_columns
from multiradar.estimation.filters.imm._mode_kernels import (
    mix_modes,
    move_modes,
    transition_modes,
)
from multiradar.estimation.filters.imm._mode_scratch_kernels import Covariances, State
from multiradar_compiled.kernels import in_loop
from multiradar_compiled.lane_kernels import Lanes, store_row

Floats = NDArray[np.float64]

# Longest step, s: a fifth of the mean duration of straight flight. Radars of 4 to 6 s, and several
# radars together, have one step.
STEP_MAX_S = 8.0
# After as many steps the probabilities hardly change; a longer interval has longer steps.
STEPS_MAX = 64


@in_loop
def predict_modes(
    k: int, dt: float, more: float, modes: Floats, a: State, x: State, P: Covariances,
    probabilities: Floats, scratch: Floats, mode_V: Floats, slow: Floats, slow_D: Floats,
    blocks: int,
) -> tuple[Lanes, State, State, Covariances]:  # fmt: skip
    """Return c, a, x and P after dt, and predict V, D and the probabilities of aircraft k in place.

    ``more`` is as in `move_modes`, ``blocks`` are those of `blocks_of_modes`.
    """
    count = modes.shape[0]
    steps = min(int(dt / STEP_MAX_S) + 1, STEPS_MAX)
    step = dt / steps
    for _ in range(steps):
        before, predicted = transition_modes(k, count, step, modes, probabilities, scratch)
        a, x, P = mix_modes(before, a, x, P, scratch)
        a, x, P = move_modes(step, more, a, x, P, scratch)
        move_columns(k, count, probabilities, scratch, mode_V, blocks)
        if not np.isnan(slow[k, 0]):
            move_columns(k, count, probabilities, scratch, slow_D, ALL_BLOCKS)
        store_row(probabilities, k, 0, count, predicted)
    return predicted, a, x, P
