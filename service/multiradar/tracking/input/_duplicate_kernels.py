"""Compiled search for duplicate plots of one radar.

Rows are indexed by cells of azimuth and range in a hash table with chaining, the newest first.

References
----------
The project's own: an antenna detects an aircraft once per scan, and no radar resolves two plots
that are closer than the resolution of its messages.
"""

from math import pi

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import NONE
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

FULL_CIRCLE_RAD = 2.0 * pi
# Maximum difference of one plot received by two networks: steps of 1/128 NM (14.5 m) and of
# 360°/4096 (0.088°), the coarsest of ASTERIX category 001, rounded in opposite directions; 100 ft
# of height.
RANGE_APART_M = 30.0
AZIMUTH_APART_RAD = pi / 1800.0
HEIGHT_APART_M = 40.0
# Cells, much larger than these; the number in azimuth is a power of two.
RANGE_CELL_M = 1000.0
AZIMUTH_CELLS = 256


@kernel
def find_twins(
    first: int,
    times: Floats,
    sensors: Integers,
    kinds: Integers,
    ranges: Floats,
    azimuths: Floats,
    heights: Floats,
    identities: Integers,
    spans: Floats,
    heads: Integers,
    following: Integers,
    twins: Integers,
) -> int:
    """Fill ``twins`` with the duplicate row, `NONE` for none; return the number of duplicates.

    Rows before ``first`` are of the previous release; rows are in order of time. ``identities`` has
    columns for code, address and number, negative where unknown. ``spans`` (s) are the times within
    which a sensor detects an aircraft once, 0 where unknown.
    """
    mask = heads.shape[0] - 1
    longest = spans.max()
    found = 0
    for i in range(times.shape[0]):
        twins[i] = NONE
        s = sensors[i]
        if kinds[i] != KIND_RADAR or not spans[s] > 0.0:
            continue
        if i >= first:
            # Usually the first cell is also the last.
            first_a = azimuth_cell_of(azimuths[i] - AZIMUTH_APART_RAD)
            last_a = azimuth_cell_of(azimuths[i] + AZIMUTH_APART_RAD)
            first_r = range_cell_of(ranges[i] - RANGE_APART_M)
            last_r = range_cell_of(ranges[i] + RANGE_APART_M)
            for ca in range(first_a, last_a + 1):
                for cr in range(first_r, last_r + 1):
                    j = heads[bucket_of(s, ca, cr, mask)]
                    while j != NONE and times[i] - times[j] <= longest:
                        # The earliest row is kept.
                        older = twins[i] == NONE or j < twins[i]
                        if (
                            older
                            and times[i] - times[j] <= spans[s]
                            and are_one(i, j, sensors, ranges, azimuths, heights, identities)
                        ):
                            twins[i] = j
                        j = following[j]
        if twins[i] != NONE:
            found += 1
            continue
        bucket = bucket_of(s, azimuth_cell_of(azimuths[i]), range_cell_of(ranges[i]), mask)
        following[i] = heads[bucket]
        heads[bucket] = i
    return found


@kernel
def azimuth_cell_of(azimuth: float) -> int:
    """Return the cell of an azimuth; whole revolutions are removed by `bucket_of`."""
    return int(np.floor(azimuth * (AZIMUTH_CELLS / FULL_CIRCLE_RAD)))


@kernel
def range_cell_of(metres: float) -> int:
    """Return the cell of a range."""
    return int(np.floor(metres * (1.0 / RANGE_CELL_M)))


@kernel
def bucket_of(sensor: int, azimuth_cell: int, range_cell: int, mask: int) -> int:
    """Return the bucket of a cell (multiplicative hashing, Knuth)."""
    turned = azimuth_cell & (AZIMUTH_CELLS - 1)
    key = (sensor * AZIMUTH_CELLS + turned) * 4096 + range_cell
    return ((key * 2654435761) >> 8) & mask


@kernel
def are_one(
    i: int,
    j: int,
    sensors: Integers,
    ranges: Floats,
    azimuths: Floats,
    heights: Floats,
    identities: Integers,
) -> bool:
    """Return whether two rows of one scan are one plot, up to rounding."""
    aside = abs(azimuths[i] - azimuths[j])
    aside = min(aside, FULL_CIRCLE_RAD - aside)
    same = (
        sensors[i] == sensors[j]
        and abs(ranges[i] - ranges[j]) <= RANGE_APART_M
        and aside <= AZIMUTH_APART_RAD
        and not abs(heights[i] - heights[j]) > HEIGHT_APART_M  # False for NaN.
    )
    for c in range(identities.shape[1]):
        one, other = identities[i, c], identities[j, c]
        same = same and not (one >= 0 and other >= 0 and one != other)
    return same
