"""Pairs of tracks that are predicted to come close to each other."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.encounters._search_kernels import (
    COMPARED,
    COUNTS,
    KEPT,
    LEFT_OUT,
    find_pairs,
)

#: Maximum number of reported pairs.
PAIRS_MAX = 50_000
#: Maximum number of comparisons, counted per piece of the horizon.
COMPARISONS_MAX = 20_000_000


class Paths(NamedTuple):
    """Predicted paths of tracks, at common times.

    Attributes
    ----------
    times_s : (k,) float64
        Times from now, s, ascending from 0, at least two.
    means : (n, k, 4) float64
        East and north on the plane, m, and their rates, m/s.
    now : (n, 10) float64
        Upper triangles of their covariances now, row by row.
    velocity_spreads : (n, k, 6) float64
        Upper triangles of the covariances of the mean velocities since now, see
        `velocity_spreads_of`: the usual one, and that of the fraction
        `_relative_kernels.RARE_SHARE` with larger errors.
    points : (n,) int64
        Number of valid times; a track with fewer than two is in no pair.
    heights : (n, CLIMB_COUNT) float64
        Heights now with rates and covariance, as in `encounters.climbs`; NaN where unknown.
    shared : (n, 4, c) float64
        Effect of one standard deviation of each bias, biases taken as independent, on the state
        now; part of `now`. No columns where tracks are independent.
    """

    times_s: NDArray[np.float64]
    means: NDArray[np.float64]
    now: NDArray[np.float64]
    velocity_spreads: NDArray[np.float64]
    points: NDArray[np.int64]
    heights: NDArray[np.float64]
    shared: NDArray[np.float64]


def velocity_spreads_of(
    times_s: NDArray[np.float64], now: NDArray[np.float64], spreads: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the covariances of the mean velocities since now from those of forecast positions.

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
    This only needs positions with covariances, and works for any kind of forecast.
    """
    velocity_spreads = np.empty_like(spreads)
    # Of (A, C; Cᵀ, U): cross-covariance of position and velocity, and U.
    common = np.stack([2.0 * now[:, 2], now[:, 3] + now[:, 5], 2.0 * now[:, 6]], axis=-1)
    velocity_spreads[:, 0] = now[:, [7, 8, 9]]
    later = times_s[1:, None]
    grown = spreads[:, 1:] - now[:, None, [0, 1, 4]] - later * common[:, None]
    velocity_spreads[:, 1:] = grown / later**2
    return velocity_spreads


class Pairs(NamedTuple):
    """Pairs of tracks.

    Attributes
    ----------
    tracks : (m, 2) int64
        Indices of the tracks in the paths, the smaller one first, sorted.
    compared : int
        Number of comparisons, counted per piece of the horizon.
    left_out : int
        Number of pairs not compared or not stored; 0 if no pair is missing.
    """

    tracks: NDArray[np.int64]
    compared: int
    left_out: int


def near_pairs(
    paths: Paths,
    distance_m: float,
    *,
    pairs_max: int = PAIRS_MAX,
    comparisons_max: int = COMPARISONS_MAX,
) -> Pairs:
    """Return the tracks whose predicted positions come within a distance on the plane.

    Parameters
    ----------
    paths : Paths
        The tracks.
    distance_m : float
        The distance, m.
    pairs_max, comparisons_max : int
        Maximum numbers of pairs and of comparisons. The latest ones are left out.

    Returns
    -------
    Pairs
        The pairs.

    Notes
    -----
    The cost is linear in the number of tracks at constant density: each is compared with those in
    its own cell and the eight around. Cells are as wide as the distance plus the path of an
    aircraft between two times.
    """
    kept = np.empty((min(pairs_max, len(paths.means) ** 2), 2), np.int64)
    counts = np.zeros(COUNTS, np.int64)
    find_pairs(paths.times_s, paths.means, paths.points, distance_m, comparisons_max, kept, counts)
    found = kept[: counts[KEPT]]
    order = np.lexsort((found[:, 1], found[:, 0]))
    return Pairs(found[order], int(counts[COMPARED]), int(counts[LEFT_OUT]))
