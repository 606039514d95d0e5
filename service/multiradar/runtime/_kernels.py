"""Compiled loops of the live pipeline; callers validate the arguments.

Symbols of `admit`: ``clock`` = state floats [data clock, floor, first and last time of a run],
``run`` = state integers [rows in the run, its first sensor, several sensors in it, first sensor
ever accepted, several sensors accepted].
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import kernel

ACCEPTED = 0
LATE = 1
FUTURE = 2

CLOCK, FLOOR, RUN_FIRST, RUN_LAST = range(4)
RUN_COUNT, RUN_SENSOR, RUN_SEVERAL, SEEN_SENSOR, SEEN_SEVERAL = range(5)


@kernel
def admit(
    time_s: NDArray[np.float64],
    sensor: NDArray[np.int32],
    horizon_s: float,
    jump_s: float,
    agree_rows: int,
    alone_s: float,
    clock: NDArray[np.float64],
    run: NDArray[np.int64],
    code: NDArray[np.int8],
) -> None:
    """Classify row by row, in place; see `multiradar.runtime.admission.admission`."""
    for row in range(len(time_s)):
        time = time_s[row]
        if time > clock[CLOCK] + jump_s:
            # A run continues while each row is within `jump_s` of the one before.
            if run[RUN_COUNT] == 0 or abs(time - clock[RUN_LAST]) > jump_s:
                run[RUN_COUNT] = 0
                clock[RUN_FIRST] = time
                run[RUN_SENSOR] = sensor[row]
                run[RUN_SEVERAL] = 0
            run[RUN_COUNT] += 1
            clock[RUN_LAST] = time
            if sensor[row] != run[RUN_SENSOR]:
                run[RUN_SEVERAL] = 1
            plausible = (
                run[RUN_SEVERAL] == 1
                or (run[SEEN_SEVERAL] == 0 and sensor[row] == run[SEEN_SENSOR])
                or time - clock[RUN_FIRST] >= alone_s
            )
            if run[RUN_COUNT] < agree_rows or not plausible:
                code[row] = FUTURE
                continue
        elif time < clock[CLOCK] - horizon_s or time < clock[FLOOR]:
            code[row] = LATE
            run[RUN_COUNT] = 0
            continue
        run[RUN_COUNT] = 0
        code[row] = ACCEPTED
        # A data clock that was never set is NaN, which no time is greater than.
        if not time <= clock[CLOCK]:
            clock[CLOCK] = time
        if run[SEEN_SENSOR] < 0:
            run[SEEN_SENSOR] = sensor[row]
        elif sensor[row] != run[SEEN_SENSOR]:
            run[SEEN_SEVERAL] = 1


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
