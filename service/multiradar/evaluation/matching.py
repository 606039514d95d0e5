"""The best assignment of tracks to aircraft, at many instants at once.

Pairs within the cut-off are found with one tree for all instants. A track and an aircraft that have
only each other are matched at once. The rest forms small groups, each assigned optimally.
"""

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from multiradar.evaluation.trajectories import Floats, Indices

#: The third axis of the tree keeps instants apart by so many radii.
_APART = 4.0


def near_pairs(
    first_m: Floats,
    first_instant: Indices,
    second_m: Floats,
    second_instant: Indices,
    radius_m: float,
) -> tuple[Indices, Indices, Floats]:
    """Return all pairs of the same instant within a radius.

    Parameters
    ----------
    first_m, second_m : (n, 2), (k, 2) float64
        Positions.
    first_instant, second_instant : (n,), (k,) int64
        Number of the instant of each.
    radius_m : float
        Largest distance, m.

    Returns
    -------
    first, second : (q,) int64
        Row of each partner.
    distance_m : (q,) float64
        Distance, below the radius.
    """
    none = np.zeros(0, np.int64)
    if not len(first_m) or not len(second_m):
        return none, none, np.zeros(0)
    trees = [
        cKDTree(np.column_stack([position, instant * (_APART * radius_m)]))
        for position, instant in ((first_m, first_instant), (second_m, second_instant))
    ]
    found = trees[0].sparse_distance_matrix(trees[1], radius_m, output_type="ndarray")
    first, second = found["i"].astype(np.int64), found["j"].astype(np.int64)
    # The time axis is large: distances are recomputed from the positions for precision.
    distance = np.hypot(*(first_m[first] - second_m[second]).T)
    order = np.lexsort((second, first))
    order = order[distance[order] < radius_m]
    return first[order], second[order], distance[order]


def best_pairs(
    first: Indices, second: Indices, distance_m: Floats, cutoff_m: float, order: float
) -> Indices:
    """Return the pairs of the optimal assignment.

    Parameters
    ----------
    first, second : (q,) int64
        Partners of the possible pairs.
    distance_m : (q,) float64
        Distance between them, m.
    cutoff_m : float
        Pairs farther apart are excluded, m.
    order : float
        Exponent p of the distance in the minimised sum.

    Returns
    -------
    (r,) int64
        Selected pairs; no partner is in two of them. They minimise the sum of min(d, c)ᵖ, which is
        the assignment of OSPA and of GOSPA with α = 2.
    """
    candidates = np.flatnonzero(distance_m < cutoff_m)
    first, second = first[candidates], second[candidates]
    if not len(first):
        return candidates
    _, first = np.unique(first, return_inverse=True)
    _, second = np.unique(second, return_inverse=True)
    alone = (np.bincount(first)[first] == 1) & (np.bincount(second)[second] == 1)
    selected = [candidates[alone]]
    rest = np.flatnonzero(~alone)
    for group in _groups(first[rest], second[rest]):
        pairs = rest[group]
        costs = (distance_m[candidates[pairs]] / cutoff_m) ** order
        selected.append(candidates[pairs[_assigned(first[pairs], second[pairs], costs)]])
    return np.sort(np.concatenate(selected))


# Groups of pairs that compete, directly or through others, as lists of their rows.
def _groups(first: Indices, second: Indices) -> list[Indices]:
    if not len(first):
        return []
    size = int(first.max()) + 1
    links = coo_array(
        (np.ones(len(first), np.int8), (first, second + size)),
        shape=(size + int(second.max()) + 1,) * 2,
    )
    _, label = connected_components(links, directed=False)
    order = np.argsort(label[first], kind="stable")
    ends = np.flatnonzero(np.diff(label[first][order])) + 1
    return np.split(order, ends)


def _assigned(first: Indices, second: Indices, costs: Floats) -> Indices:
    rows, row = np.unique(first, return_inverse=True)
    columns, column = np.unique(second, return_inverse=True)
    matrix = np.ones((len(rows), len(columns)))
    matrix[row, column] = costs
    pair = np.full(matrix.shape, -1)
    pair[row, column] = np.arange(len(costs))
    chosen: Indices = pair[linear_sum_assignment(matrix)]
    return chosen[chosen >= 0]
