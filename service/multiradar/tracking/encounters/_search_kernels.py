"""Compiled search for pairs of tracks that are predicted to come close to each other.

The horizon is divided at the points of the forecasts. In each piece a track is in a circle around
the middle of its path, with half the path as radius (reach). Tracks are sorted into square cells by
their middles, and each is compared with the earlier ones in its own cell and the eight around. With
cells as wide as the distance plus two reaches no close pair is missed. A pair is reported once,
whatever the number of pieces.

Symbols: D = distance threshold; i, j = tracks, k = piece of the horizon.

References
----------
The project's own; cells are those of J. L. Bentley, D. F. Stanat, E. H. Williams, "The complexity
of finding fixed-radius near neighbors", Information Processing Letters 6 (1977), 209-212.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import NONE
from multiradar.tracking.encounters._path_kernels import nearest_part
from multiradar_compiled.kernels import in_loop, inner_loop, kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Speed above which a track is compared with all others, m/s: cells sized for it would contain all
#: tracks.
FAST_MPS = 400.0
#: Positions in the counts: pairs found; pairs compared in one piece; pairs left out.
KEPT, COMPARED, LEFT_OUT = 0, 1, 2
COUNTS = 3
#: Columns of the middle of a path, and half of its length.
MIDDLE_EAST, MIDDLE_NORTH, REACH = 0, 1, 2
# Odd multipliers without a pattern, so that neighbouring cells rarely share a bucket.
_MIX_EAST, _MIX_NORTH = 0x9E3779B1, 0x85EBCA6B


@kernel
def find_pairs(
    t: Floats, means: Floats, points: Integers, distance: float, comparisons_max: int,
    pairs: Integers, counts: Integers,
) -> None:  # fmt: skip
    """Fill ``pairs`` (p, 2) with the tracks that come within ``distance``, and ``counts``.

    The first track of a pair has the smaller number. Pieces are processed in order until
    ``comparisons_max`` pairs were compared or ``pairs`` is full; the remaining ones are counted.
    """
    n = means.shape[0]
    buckets = 64
    while buckets < 2 * n:
        buckets *= 2
    table = 64
    while table < 2 * pairs.shape[0]:
        table *= 2
    middles = np.empty((n, 3))
    cells = np.empty((n, 2), np.int64)
    following = np.empty(n, np.int64)
    heads = np.empty(buckets, np.int64)
    held = np.empty(buckets, np.int64)
    known_pairs = np.full(table, NONE, np.int64)
    search(
        t, means, points, distance, comparisons_max, pairs, counts, middles, cells, following,
        heads, held, known_pairs,
    )  # fmt: skip


@inner_loop
def search(
    t: Floats, means: Floats, points: Integers, distance: float, comparisons_max: int,
    pairs: Integers, counts: Integers, middles: Floats, cells: Integers, following: Integers,
    heads: Integers, held: Integers, known_pairs: Integers,
) -> None:  # fmt: skip
    """As `find_pairs`."""
    n = means.shape[0]
    for k in range(t.shape[0] - 1):
        dt = t[k + 1] - t[k]
        reach_max = 0.5 * FAST_MPS * dt
        wide = distance + 2.0 * reach_max
        for b in range(heads.shape[0]):
            heads[b] = NONE
            held[b] = 0
        for i in range(n):
            if points[i] >= k + 2:
                bound_path(i, k, dt, means, middles)
        for i in range(n):
            if points[i] >= k + 2:
                if middles[i, REACH] > reach_max:
                    compare_with_all(
                        i, k, dt, means, points, distance, reach_max, comparisons_max, middles,
                        pairs, counts, known_pairs,
                    )  # fmt: skip
                else:
                    cells[i, 0] = int(np.floor(middles[i, MIDDLE_EAST] / wide))
                    cells[i, 1] = int(np.floor(middles[i, MIDDLE_NORTH] / wide))
                    compare_nearby(
                        i, k, dt, means, distance, comparisons_max, middles, cells, following,
                        heads, held, pairs, counts, known_pairs,
                    )  # fmt: skip


@in_loop
def bound_path(i: int, k: int, dt: float, means: Floats, middles: Floats) -> None:
    """Set the middle of the path of track i in piece k, and its reach.

    The path lies within the hull of its Bézier points.
    """
    a, b = means[i, k], means[i, k + 1]
    reach = 0.0
    for axis in range(2):
        middles[i, axis] = 0.5 * (a[axis] + b[axis]) + 0.125 * dt * (a[axis + 2] - b[axis + 2])
    for corner in range(4):
        square = 0.0
        for axis in range(2):
            at = a[axis] if corner < 2 else b[axis]
            if corner == 1:
                at += dt * a[axis + 2] / 3.0
            elif corner == 2:
                at -= dt * b[axis + 2] / 3.0
            square += (at - middles[i, axis]) * (at - middles[i, axis])
        reach = max(reach, square)
    middles[i, REACH] = np.sqrt(reach)


@in_loop
def compare_nearby(
    i: int, k: int, dt: float, means: Floats, distance: float, comparisons_max: int,
    middles: Floats, cells: Integers, following: Integers, heads: Integers, held: Integers,
    pairs: Integers, counts: Integers, known_pairs: Integers,
) -> None:  # fmt: skip
    """Compare track i with those in the cells around it, and add it to its own cell."""
    mask = heads.shape[0] - 1
    for step in range(9):
        east, north = cells[i, 0] + step // 3 - 1, cells[i, 1] + step % 3 - 1
        bucket = (east * _MIX_EAST + north * _MIX_NORTH) & mask
        if counts[COMPARED] + held[bucket] > comparisons_max:
            counts[LEFT_OUT] += held[bucket]
        else:
            j = heads[bucket]
            while j != NONE:
                # Cells may share a bucket.
                if cells[j, 0] == east and cells[j, 1] == north:
                    compare(j, i, k, dt, means, distance, middles, pairs, counts, known_pairs)
                j = following[j]
    own = (cells[i, 0] * _MIX_EAST + cells[i, 1] * _MIX_NORTH) & mask
    following[i] = heads[own]
    heads[own] = i
    held[own] += 1


@in_loop
def compare_with_all(
    i: int, k: int, dt: float, means: Floats, points: Integers, distance: float, reach_max: float,
    comparisons_max: int, middles: Floats, pairs: Integers, counts: Integers, known_pairs: Integers,
) -> None:  # fmt: skip
    """Compare a fast track with all others, with fast ones of smaller number only."""
    n = means.shape[0]
    if counts[COMPARED] + n > comparisons_max:
        counts[LEFT_OUT] += n - 1
    else:
        for j in range(n):
            both_fast = middles[j, REACH] > reach_max
            if points[j] >= k + 2 and (j < i or (j > i and not both_fast)):
                compare(
                    min(i, j),
                    max(i, j),
                    k,
                    dt,
                    means,
                    distance,
                    middles,
                    pairs,
                    counts,
                    known_pairs,
                )


@in_loop
def compare(
    i: int, j: int, k: int, dt: float, means: Floats, distance: float, middles: Floats,
    pairs: Integers, counts: Integers, known_pairs: Integers,
) -> None:  # fmt: skip
    """Add the pair of tracks i and j if they come close in piece k."""
    counts[COMPARED] += 1
    reach = distance + middles[i, REACH] + middles[j, REACH]
    east = middles[j, MIDDLE_EAST] - middles[i, MIDDLE_EAST]
    north = middles[j, MIDDLE_NORTH] - middles[i, MIDDLE_NORTH]
    if east * east + north * north <= reach * reach:
        a0, a1, b0, b1 = means[i, k], means[i, k + 1], means[j, k], means[j, k + 1]
        x0, y0, x1, y1 = b0[0] - a0[0], b0[1] - a0[1], b1[0] - a1[0], b1[1] - a1[1]
        square = min(x0 * x0 + y0 * y0, x1 * x1 + y1 * y1)
        # The interior is searched only if both ends are beyond the distance.
        if square > distance * distance:
            _, square = nearest_part(
                dt, x0, y0, x1, y1, b0[2] - a0[2], b0[3] - a0[3], b1[2] - a1[2], b1[3] - a1[3]
            )
        if square <= distance * distance:
            keep(i, j, pairs, counts, known_pairs)


@in_loop
def keep(i: int, j: int, pairs: Integers, counts: Integers, known_pairs: Integers) -> None:
    """Add a pair unless it is known, or the table is full."""
    mask = known_pairs.shape[0] - 1
    bucket = (i * _MIX_EAST ^ j * _MIX_NORTH) & mask
    known = False
    while known_pairs[bucket] != NONE and not known:
        row = known_pairs[bucket]
        known = pairs[row, 0] == i and pairs[row, 1] == j
        bucket = (bucket + 1) & mask
    if not known:
        row = counts[KEPT]
        if row < pairs.shape[0]:
            pairs[row, 0] = i
            pairs[row, 1] = j
            known_pairs[bucket] = row
            counts[KEPT] = row + 1
        else:
            counts[LEFT_OUT] += 1
