"""Compiled assignment of the plots of one scan to tracks: at most one plot per track.

Symbols: C = cost matrix (rows: plots; columns: tracks, then one column for each plot left without a
track), u, v = dual prices of rows and columns, p = row assigned to each column.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import NONE
from multiradar.tracking.association.track_grid import Candidates, TrackGrid
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# A component with more plots is assigned greedily: the time of the exact algorithm grows with the
# third power of its size, and so many linked plots cannot be resolved anyway.
EXACT_ROWS_MAX = 200


@kernel
def least_cost(C: Floats, chosen: Integers) -> None:
    """Choose a different column for each row so that the total cost is least.

    ``C`` has no more rows than columns. Shortest augmenting paths (Jonker and Volgenant, Computing
    38 (1987) 325-340), row by row.
    """
    rows, columns = C.shape
    u = np.zeros(rows + 1)
    v = np.zeros(columns + 1)
    p = np.zeros(columns + 1, np.int64)
    previous = np.zeros(columns + 1, np.int64)
    shortest = np.empty(columns + 1)
    done = np.empty(columns + 1, np.bool_)
    for row in range(1, rows + 1):
        p[0] = row
        here = 0
        shortest[:] = np.inf
        done[:] = False
        while True:
            done[here] = True
            row_here = p[here]
            least = np.inf
            following = 0
            for column in range(1, columns + 1):
                if done[column]:
                    continue
                reduced = C[row_here - 1, column - 1] - u[row_here] - v[column]
                if reduced < shortest[column]:
                    shortest[column] = reduced
                    previous[column] = here
                if shortest[column] < least:
                    least = shortest[column]
                    following = column
            for column in range(columns + 1):
                if done[column]:
                    u[p[column]] += least
                    v[column] -= least
                else:
                    shortest[column] -= least
            here = following
            if p[here] == 0:
                break
        while here != 0:
            before = previous[here]
            p[here] = p[before]
            here = before
    for column in range(1, columns + 1):
        if p[column] > 0:
            chosen[p[column] - 1] = column - 1


@kernel
def root_of(parents: Integers, one: int) -> int:
    """Return the root of the component of a plot."""
    while parents[one] != one:
        parents[one] = parents[parents[one]]
        one = parents[one]
    return one


@kernel
def assign_scan(plots: Integers, candidates: Candidates, grid: TrackGrid, chosen: Integers) -> None:
    """Assign the plots of one scan: the total score is the greatest possible.

    ``plots`` are rows of ``candidates``; ``chosen`` receives the index of the assigned candidate,
    −1 for none.
    """
    n = plots.shape[0]
    parents = np.arange(n)
    for i in range(n):
        row = plots[i]
        chosen[row] = NONE
        for c in range(candidates.number[row]):
            k = candidates.slot[row, c]
            if grid.owner[k] == NONE:
                grid.owner[k] = i
            else:
                a, b = root_of(parents, grid.owner[k]), root_of(parents, i)
                parents[max(a, b)] = min(a, b)
    heads = np.full(n, NONE, np.int64)
    following = np.full(n, NONE, np.int64)
    for i in range(n - 1, -1, -1):
        root = root_of(parents, i)
        following[i] = heads[root]
        heads[root] = i
    for i in range(n):
        first = heads[i]
        if first == NONE:
            continue
        if following[first] == NONE:
            if candidates.number[plots[first]] > 0:
                chosen[plots[first]] = 0
            continue
        assign_component(first, following, plots, candidates, grid, chosen)
    for i in range(n):
        for c in range(candidates.number[plots[i]]):
            grid.owner[candidates.slot[plots[i], c]] = NONE


@kernel
def assign_component(
    first: int,
    following: Integers,
    plots: Integers,
    candidates: Candidates,
    grid: TrackGrid,
    chosen: Integers,
) -> None:
    """Assign the plots of a component, linked by ``following`` from the first on."""
    rows = 0
    columns = 0
    i = first
    while i != NONE:
        row = plots[i]
        for c in range(candidates.number[row]):
            k = candidates.slot[row, c]
            if grid.local[k] == NONE:
                grid.local[k] = columns
                columns += 1
        rows += 1
        i = following[i]
    if rows > EXACT_ROWS_MAX:
        assign_greedily(first, following, plots, candidates, grid, chosen)
    else:
        C = np.full((rows, columns + rows), np.inf)
        C[:, columns:] = 0.0
        # A track that is no candidate costs more than leaving all plots without a track.
        C[:, :columns] = 1e9
        i = first
        at = 0
        while i != NONE:
            row = plots[i]
            for c in range(candidates.number[row]):
                C[at, grid.local[candidates.slot[row, c]]] = -candidates.score[row, c]
            at += 1
            i = following[i]
        columns_of = np.empty(rows, np.int64)
        least_cost(C, columns_of)
        i = first
        at = 0
        while i != NONE:
            row = plots[i]
            for c in range(candidates.number[row]):
                if grid.local[candidates.slot[row, c]] == columns_of[at]:
                    chosen[row] = c
            at += 1
            i = following[i]
    i = first
    while i != NONE:
        for c in range(candidates.number[plots[i]]):
            grid.local[candidates.slot[plots[i], c]] = NONE
        i = following[i]


@kernel
def assign_greedily(
    first: int,
    following: Integers,
    plots: Integers,
    candidates: Candidates,
    grid: TrackGrid,
    chosen: Integers,
) -> None:
    """Assign plots one after another, each to the likeliest free track."""
    i = first
    while i != NONE:
        row = plots[i]
        for c in range(candidates.number[row]):
            k = candidates.slot[row, c]
            if grid.local[k] >= 0:
                grid.local[k] = -2
                chosen[row] = c
                break
        i = following[i]
