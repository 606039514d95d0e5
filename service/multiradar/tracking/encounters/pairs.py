"""Pairs of tracks that are expected to come near each other."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.encounters._search_kernels import (
    COUNTS,
    KEPT,
    LEFT_OUT,
    LOOKED_AT,
    find_pairs,
)

#: Most pairs that are told of.
PAIRS_MAX = 50_000
#: Most pairs that are looked at, those of each piece of the horizon counted anew.
LOOKS_MAX = 20_000_000


class Paths(NamedTuple):
    """Where tracks are expected to be, at times that are the same for all.

    Attributes
    ----------
    times_s : (k,) float64
        Times from now, s, ascending from 0, at least two.
    means : (n, k, 4) float64
        East and north on the plane, m, and their rates, m/s.
    now : (n, 10) float64
        Upper triangles of their covariances now, row by row.
    walks : (n, k, 6) float64
        Upper triangles of the covariances of the mean velocities since now, see `walks_of`: the
        usual one, and that of the share `_relative_kernels.RARE_SHARE` that strays farther.
    points : (n,) int64
        So many of the times are good; a track with fewer than two is in no pair.
    heights : (n, CLIMB_COUNT) float64
        Heights now with their rates and covariance, as in `tracking.climbs`; NaN where unknown.
    shared : (n, 4, c) float64
        What a standard deviation of each of the biases, taken for independent, does to the state
        now; part of `now`. No columns where tracks are taken for independent.
    """

    times_s: NDArray[np.float64]
    means: NDArray[np.float64]
    now: NDArray[np.float64]
    walks: NDArray[np.float64]
    points: NDArray[np.int64]
    heights: NDArray[np.float64]
    shared: NDArray[np.float64]


def walks_of(
    times_s: NDArray[np.float64], now: NDArray[np.float64], spreads: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return what the covariances of forecast positions say of the mean velocities since now.

    Parameters
    ----------
    times_s : (k,) ndarray
        Times from now, s, ascending from 0.
    now : (n, 10) ndarray
        Upper triangles of the covariances of the states now.
    spreads : (n, k, 3) ndarray
        Upper triangles of the covariances of the positions at the times, m².

    Returns
    -------
    (n, k, 3) ndarray
        V with spread = A + t (C + Cᵀ) + t² V, (m/s)²; at time 0 that of the velocity.

    Notes
    -----
    A forecast of any kind gives positions with covariances; no more is asked of it.
    """
    walks = np.empty_like(spreads)
    # Of (A, C; Cᵀ, U): what is common of position and velocity, and U.
    common = np.stack([2.0 * now[:, 2], now[:, 3] + now[:, 5], 2.0 * now[:, 6]], axis=-1)
    walks[:, 0] = now[:, [7, 8, 9]]
    later = times_s[1:, None]
    grown = spreads[:, 1:] - now[:, None, [0, 1, 4]] - later * common[:, None]
    walks[:, 1:] = grown / later**2
    return walks


class Pairs(NamedTuple):
    """Pairs of tracks.

    Attributes
    ----------
    tracks : (m, 2) int64
        Places of the tracks among the paths, the smaller one first, in the order of the pairs.
    looked_at : int
        Pairs that were looked at, those of each piece of the horizon counted anew.
    left_out : int
        So many more were not, or found no room; 0 means that no pair is missing.
    """

    tracks: NDArray[np.int64]
    looked_at: int
    left_out: int


def near_pairs(
    paths: Paths, distance_m: float, *, pairs_max: int = PAIRS_MAX, looks_max: int = LOOKS_MAX
) -> Pairs:
    """Return the tracks whose expected positions come within a distance on the plane.

    Parameters
    ----------
    paths : Paths
        The tracks.
    distance_m : float
        The distance, m.
    pairs_max, looks_max : int
        Most pairs that are kept, and looked at. What is left out is what comes latest.

    Returns
    -------
    Pairs
        The pairs.

    Notes
    -----
    The cost grows with the number of tracks while their density does not: each looks at those in
    its own cell and the eight around, cells being as wide as the distance and the way of an
    aircraft between two times of the paths.
    """
    kept = np.empty((min(pairs_max, len(paths.means) ** 2), 2), np.int64)
    counts = np.zeros(COUNTS, np.int64)
    find_pairs(paths.times_s, paths.means, paths.points, distance_m, looks_max, kept, counts)
    found = kept[: counts[KEPT]]
    order = np.lexsort((found[:, 1], found[:, 0]))
    return Pairs(found[order], int(counts[LOOKED_AT]), int(counts[LEFT_OUT]))
