"""Compiled loops of the live pipeline; callers validate the arguments."""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import kernel


@kernel
def follow(
    previous: NDArray[np.int64],
    time_s: NDArray[np.float64],
    newest: int,
    oldest: int,
    since_s: float,
    found: NDArray[np.int64],
    forward: bool,
) -> int:
    """Follow the links from a row back; return how many row numbers were written to `found`.

    Row numbers count from the first row ever written. A row is stored at its number modulo the
    length of `previous`; numbers below `oldest` are overwritten. With `forward` the walk continues
    to the oldest row and `found` is a ring of the last rows, else it stops when `found` is full.
    """
    capacity = len(previous)
    size = len(found)
    count = 0
    row = newest
    while row >= oldest and time_s[row % capacity] >= since_s:
        found[count % size] = row
        count += 1
        if count == size and not forward:
            break
        link = previous[row % capacity]
        # A link points to an older row; any other value was overwritten during the read.
        if link >= row:
            break
        row = link
    return count
