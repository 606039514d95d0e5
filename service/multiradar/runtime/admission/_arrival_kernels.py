"""Compiled count of how far behind the data time measurements arrive."""

import numpy as np
from numpy.typing import NDArray

from multiradar.runtime.admission._admission_kernels import EXCESS, FUTURE
from multiradar_compiled.kernels import kernel


@kernel
def count_delays(
    time_s: NDArray[np.float64],
    sensor: NDArray[np.int32],
    code: NDArray[np.int8],
    clock_s: NDArray[np.float64],
    per_s: float,
    delays: NDArray[np.int64],
    counts: NDArray[np.int64],
) -> None:
    """Add rows to the delays (sensors, steps) and to the counts (sensors, codes), in place.

    ``clock_s`` is the data clock before each row, NaN where it was not set.
    """
    steps = delays.shape[1]
    for row in range(len(time_s)):
        s, time = sensor[row], time_s[row]
        counts[s, code[row]] += 1
        if code[row] == FUTURE or code[row] == EXCESS:
            continue
        before_s = clock_s[row]
        behind = max(before_s - time, 0.0) if before_s == before_s else 0.0
        delays[s, int(min(behind * per_s, steps - 1.0))] += 1
