"""Compiled search for the pairs of tracks that are expected to come near each other.

The horizon is cut where the points of the forecasts are. In each piece a track is at the middle of
its way, give or take half of it, its reach; tracks are sorted into square cells by their middles,
and each looks at those that were put into its own cell and the eight around before it. With cells
as wide as the distance and two reaches, nobody near is elsewhere. A pair is kept once however many
pieces it is near in.

Symbols: D = distance below which a pair is kept; i, j = tracks, k = piece of the horizon.

References
----------
The project's own; cells are those of J. L. Bentley, D. F. Stanat, E. H. Williams, "The complexity
of finding fixed-radius near neighbors", Information Processing Letters 6 (1977), 209-212.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.encounters._path_kernels import nearest_part
from multiradar_compiled.kernels import in_loop, kernel, loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Way of a track in one piece beyond which it is compared with all others, m/s: cells as wide as
#: the way of one that flies off would be everybody's.
FAST_MPS = 400.0
#: Rows of what is counted: pairs kept; pairs in one piece looked at; and left out.
KEPT, LOOKED_AT, LEFT_OUT = 0, 1, 2
COUNTS = 3
#: Columns of the middle of a way, and half of its length.
MIDDLE_EAST, MIDDLE_NORTH, REACH = 0, 1, 2
# Odd numbers without a pattern, so that neighbouring cells share no bucket by rule.
_MIX_EAST, _MIX_NORTH = 0x9E3779B1, 0x85EBCA6B
_NONE = -1


@kernel
def find_pairs(
    t: Floats, means: Floats, points: Integers, distance: float, looks_max: int, pairs: Integers,
    counts: Integers,
) -> None:  # fmt: skip
    """Fill ``pairs`` (p, 2) with the tracks that come within ``distance``, ``counts`` with counts.

    The first of a pair is the one of the smaller number. Pieces are gone through in their order
    until ``looks_max`` pairs were looked at or ``pairs`` is full; what then is not looked at or
    not kept is counted.
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
    places = np.full(table, _NONE, np.int64)
    search(
        t, means, points, distance, looks_max, pairs, counts, middles, cells, following, heads,
        held, places,
    )  # fmt: skip


@loop
def search(
    t: Floats, means: Floats, points: Integers, distance: float, looks_max: int, pairs: Integers,
    counts: Integers, middles: Floats, cells: Integers, following: Integers, heads: Integers,
    held: Integers, places: Integers,
) -> None:  # fmt: skip
    """Do as `find_pairs`."""
    n = means.shape[0]
    for k in range(t.shape[0] - 1):
        dt = t[k + 1] - t[k]
        reach_max = 0.5 * FAST_MPS * dt
        wide = distance + 2.0 * reach_max
        for b in range(heads.shape[0]):
            heads[b] = _NONE
            held[b] = 0
        for i in range(n):
            if points[i] >= k + 2:
                measure_way(i, k, dt, means, middles)
        for i in range(n):
            if points[i] >= k + 2:
                if middles[i, REACH] > reach_max:
                    look_at_all(
                        i, k, dt, means, points, distance, reach_max, looks_max, middles, pairs,
                        counts, places,
                    )  # fmt: skip
                else:
                    cells[i, 0] = int(np.floor(middles[i, MIDDLE_EAST] / wide))
                    cells[i, 1] = int(np.floor(middles[i, MIDDLE_NORTH] / wide))
                    look_around(
                        i, k, dt, means, distance, looks_max, middles, cells, following, heads,
                        held, pairs, counts, places,
                    )  # fmt: skip


@in_loop
def measure_way(i: int, k: int, dt: float, means: Floats, middles: Floats) -> None:
    """Note the middle of the way of track i in piece k, and how far from it the track may be.

    The way lies within the hull of its Bézier points.
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
def look_around(
    i: int, k: int, dt: float, means: Floats, distance: float, looks_max: int, middles: Floats,
    cells: Integers, following: Integers, heads: Integers, held: Integers, pairs: Integers,
    counts: Integers, places: Integers,
) -> None:  # fmt: skip
    """Compare track i with those in the cells around it, and put it into its own."""
    mask = heads.shape[0] - 1
    for step in range(9):
        east, north = cells[i, 0] + step // 3 - 1, cells[i, 1] + step % 3 - 1
        bucket = (east * _MIX_EAST + north * _MIX_NORTH) & mask
        if counts[LOOKED_AT] + held[bucket] > looks_max:
            counts[LEFT_OUT] += held[bucket]
        else:
            j = heads[bucket]
            while j != _NONE:
                # Another cell may share the bucket.
                if cells[j, 0] == east and cells[j, 1] == north:
                    compare(j, i, k, dt, means, distance, middles, pairs, counts, places)
                j = following[j]
    own = (cells[i, 0] * _MIX_EAST + cells[i, 1] * _MIX_NORTH) & mask
    following[i] = heads[own]
    heads[own] = i
    held[own] += 1


@in_loop
def look_at_all(
    i: int, k: int, dt: float, means: Floats, points: Integers, distance: float, reach_max: float,
    looks_max: int, middles: Floats, pairs: Integers, counts: Integers, places: Integers,
) -> None:  # fmt: skip
    """Compare a fast track with all others, with fast ones of smaller number only."""
    n = means.shape[0]
    if counts[LOOKED_AT] + n > looks_max:
        counts[LEFT_OUT] += n - 1
    else:
        for j in range(n):
            both_fast = middles[j, REACH] > reach_max
            if points[j] >= k + 2 and (j < i or (j > i and not both_fast)):
                compare(
                    min(i, j), max(i, j), k, dt, means, distance, middles, pairs, counts, places
                )


@in_loop
def compare(
    i: int, j: int, k: int, dt: float, means: Floats, distance: float, middles: Floats,
    pairs: Integers, counts: Integers, places: Integers,
) -> None:  # fmt: skip
    """Keep the pair of tracks i and j if they come near in piece k."""
    counts[LOOKED_AT] += 1
    reach = distance + middles[i, REACH] + middles[j, REACH]
    east = middles[j, MIDDLE_EAST] - middles[i, MIDDLE_EAST]
    north = middles[j, MIDDLE_NORTH] - middles[i, MIDDLE_NORTH]
    if east * east + north * north <= reach * reach:
        a0, a1, b0, b1 = means[i, k], means[i, k + 1], means[j, k], means[j, k + 1]
        x0, y0, x1, y1 = b0[0] - a0[0], b0[1] - a0[1], b1[0] - a1[0], b1[1] - a1[1]
        square = min(x0 * x0 + y0 * y0, x1 * x1 + y1 * y1)
        # Near at an end of the piece is near; only between is there to search.
        if square > distance * distance:
            _, square = nearest_part(
                dt, x0, y0, x1, y1, b0[2] - a0[2], b0[3] - a0[3], b1[2] - a1[2], b1[3] - a1[3]
            )
        if square <= distance * distance:
            keep(i, j, pairs, counts, places)


@in_loop
def keep(i: int, j: int, pairs: Integers, counts: Integers, places: Integers) -> None:
    """Add a pair unless it is there already, or there is no room."""
    mask = places.shape[0] - 1
    place = (i * _MIX_EAST ^ j * _MIX_NORTH) & mask
    known = False
    while places[place] != _NONE and not known:
        row = places[place]
        known = pairs[row, 0] == i and pairs[row, 1] == j
        place = (place + 1) & mask
    if not known:
        row = counts[KEPT]
        if row < pairs.shape[0]:
            pairs[row, 0] = i
            pairs[row, 1] = j
            places[place] = row
            counts[KEPT] = row + 1
        else:
            counts[LEFT_OUT] += 1
