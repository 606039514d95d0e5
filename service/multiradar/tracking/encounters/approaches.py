"""Closest point of approach (CPA) of pairs of tracks, and conflict probability."""

from math import sqrt
from statistics import NormalDist
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.height._height_kernels import CLIMB_DENSITY
from multiradar.tracking.encounters import _approach_kernels as kernels
from multiradar.tracking.encounters._conflict_kernels import (
    CLIMB_NOISE,
    HEIGHT,
    WITHIN,
    WITHIN_BOTH,
    find_bounds,
    find_probabilities,
)
from multiradar.tracking.encounters.climbs import CLIMB_KIND, later_variance
from multiradar.tracking.encounters.pairs import Paths

#: Points over which probabilities are averaged: accurate to 0.01 always, and to 0.002 usually.
POINTS = 1024
#: Quantiles of the reported interval of the minimum distance.
LOW, HIGH = 0.025, 0.975

Floats = NDArray[np.float64]


class Approaches(NamedTuple):
    """Closest approaches, one row per pair; times are from now, distances in true metres.

    Attributes
    ----------
    time_s : (m,) float64
        Time at which the predicted positions are closest, within the horizon; 0 for tracks that fly
        together.
    time_sigma_s : (m,) float64
        Its standard deviation; NaN at either end of the horizon, and where it exceeds the horizon.
    distance_m, sigma_m : (m,) float64
        Distance of the predicted positions then, and the standard deviation of the signed distance:
        near zero the distance itself is not Gaussian.
    distance_now_m : (m,) float64
        Distance now.
    together : (m,) bool
        Whether the two are close now and their relative velocity does not differ significantly from
        zero.
    first, second : (m, 2) float64
        Predicted positions then, east and north on the plane.
    chords : (m, CHORD_COUNT) float64
        Relative motion used for probabilities.
    """

    time_s: Floats
    time_sigma_s: Floats
    distance_m: Floats
    sigma_m: Floats
    distance_now_m: Floats
    together: NDArray[np.bool_]
    first: Floats
    second: Floats
    chords: Floats

    def select(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> "Approaches":
        """Return the selected rows."""
        columns: dict[str, Any] = {name: column[rows] for name, column in self._asdict().items()}
        return Approaches(**columns)


def closest_approaches(
    paths: Paths, tracks: NDArray[np.int64], matrices: Floats, distance_m: float
) -> Approaches:
    """Return times and distances of the closest approaches of pairs of tracks.

    Parameters
    ----------
    paths : Paths
        The tracks.
    tracks : (m, 2) int64
        The pairs, as indices of the paths.
    matrices : (m, 2, 2) float64
        True metres per metre on the plane, where they meet.
    distance_m : float
        Maximum distance of tracks that fly together, m.

    Returns
    -------
    Approaches
        One row for each pair.
    """
    found = np.empty((len(tracks), kernels.FOUND_COUNT))
    chords = np.empty((len(tracks), kernels.CHORD_COUNT))
    kernels.find_approaches(
        paths.times_s, paths.means, paths.now, paths.velocity_spreads, paths.points, paths.shared,
        tracks, np.array(matrices, np.float64, order="C").reshape(-1, 4), distance_m, found,
        chords,
    )  # fmt: skip
    return Approaches(
        time_s=found[:, kernels.TIME],
        time_sigma_s=found[:, kernels.TIME_SIGMA],
        distance_m=found[:, kernels.DISTANCE],
        sigma_m=found[:, kernels.SIGMA],
        distance_now_m=found[:, kernels.DISTANCE_NOW],
        together=found[:, kernels.TOGETHER] != 0.0,
        first=found[:, kernels.FIRST_EAST : kernels.FIRST_NORTH + 1],
        second=found[:, kernels.SECOND_EAST : kernels.SECOND_NORTH + 1],
        chords=chords,
    )


def heights_between(paths: Paths, tracks: NDArray[np.int64]) -> Floats:
    """Return the height of the second of each pair above the first.

    Parameters
    ----------
    paths : Paths
        The tracks.
    tracks : (m, 2) int64
        The pairs.

    Returns
    -------
    (m, 6) float64
        Height now, m, its rate, their covariance (three columns), and the density of its
        acceleration, m²/s³. NaN where either height is unknown, or one is a pressure altitude and
        the other may be geometric: they may differ by hundreds of metres.
    """
    first, second = paths.heights[tracks[:, 0]], paths.heights[tracks[:, 1]]
    between = np.empty((len(tracks), CLIMB_NOISE + 1))
    between[:, :2] = second[:, :2] - first[:, :2]
    between[:, 2:CLIMB_NOISE] = first[:, 2:CLIMB_KIND] + second[:, 2:CLIMB_KIND]
    between[:, CLIMB_NOISE] = 2.0 * CLIMB_DENSITY
    alike = first[:, CLIMB_KIND] == second[:, CLIMB_KIND]
    between[~alike | np.isnan(between[:, HEIGHT])] = np.nan
    return between


def height_at(between: Floats, time_s: Floats) -> tuple[Floats, Floats]:
    """Return the height difference of pairs at a time.

    Parameters
    ----------
    between : (m, 6) float64
        As `heights_between`.
    time_s : (m,) float64
        Times from now, s.

    Returns
    -------
    height_m, sigma_m : (m,) float64
        The height of the second above the first, and its standard deviation.
    """
    height, rate, density = between[:, HEIGHT], between[:, HEIGHT + 1], between[:, CLIMB_NOISE]
    spread = later_variance(between[:, 2:CLIMB_NOISE], density, time_s)
    return height + time_s * rate, np.sqrt(np.maximum(spread, 0.0))


def least_heights(approaches: Approaches, between: Floats, distance_m: float) -> Floats:
    """Return the predicted vertical distance of pairs while they are within a distance.

    Parameters
    ----------
    approaches : Approaches
        The pairs.
    between : (m, 6) float64
        As `heights_between`.
    distance_m : float
        The distance, m.

    Returns
    -------
    (m,) float64
        Not negative, m; at the closest approach for pairs that do not come within the distance, NaN
        where a height is unknown.
    """
    chords = approaches.chords
    speed = np.hypot(chords[:, kernels.CHORD_W], chords[:, kernels.CHORD_W + 1])
    half = np.sqrt(np.maximum(distance_m**2 - approaches.distance_m**2, 0.0))
    end = chords[:, kernels.CHORD_END]
    with np.errstate(divide="ignore", invalid="ignore"):
        lasts = np.where(half > 0.0, half / speed, 0.0)
    first = between[:, 0] + between[:, 1] * np.maximum(approaches.time_s - lasts, 0.0)
    last = between[:, 0] + between[:, 1] * np.minimum(approaches.time_s + lasts, end)
    return np.where(first * last < 0.0, 0.0, np.minimum(abs(first), abs(last)))


def conflict_probabilities(
    approaches: Approaches, between: Floats, distance_m: float, separation_m: float | None
) -> tuple[Floats, Floats]:
    """Return the conflict probabilities of pairs within the horizon.

    Parameters
    ----------
    approaches : Approaches
        The pairs.
    between : (m, 6) float64
        As `heights_between`.
    distance_m : float
        The distance, m.
    separation_m : float or None
        Vertical separation, m.

    Returns
    -------
    within, both : (m,) float64
        Probability that the minimum distance is below `distance_m`, and that the two are then also
        within `separation_m` vertically, NaN where that or a height is unknown.

    Notes
    -----
    The motion is straight along the chord to the predicted closest approach, with the covariance of
    the forecast position there. For that motion the result is accurate to 0.01.
    """
    found = np.empty((len(approaches.chords), 2))
    separation = np.nan if separation_m is None else separation_m
    chords = np.ascontiguousarray(approaches.chords)
    find_probabilities(
        chords, np.ascontiguousarray(between), _POINTS, distance_m, separation, found
    )
    return found[:, WITHIN], found[:, WITHIN_BOTH]


def bounds(approaches: Approaches) -> tuple[Floats, Floats]:
    """Return the 95 % interval of the minimum distance.

    Parameters
    ----------
    approaches : Approaches
        The pairs.

    Returns
    -------
    low_m, high_m : (m,) float64
        Quantiles of 2.5 and 97.5 %; or from 0 if that interval is shorter: it then contains a
        collision.

    Notes
    -----
    As for `conflict_probabilities`.
    """
    found = np.empty((len(approaches.chords), 2))
    find_bounds(np.ascontiguousarray(approaches.chords), _POINTS, LOW, HIGH, found)
    return found[:, 0], found[:, 1]


def _lattice() -> Floats:
    # Even in the first variable; the others follow irrational steps (additive recurrence). The two
    # most important ones use powers of the root of x³ = x + 1, which fill a square evenly.
    plastic = 1.32471795724474602596
    steps = np.array([plastic**-1.0, plastic**-2.0, sqrt(2.0), sqrt(3.0)])
    numbers = np.arange(POINTS) + 0.5
    even = np.column_stack([numbers / POINTS, np.mod(0.5 + np.outer(numbers, steps), 1.0)])
    quantile = NormalDist().inv_cdf
    drawn = np.array([[quantile(part) for part in row] for row in even.tolist()])
    # Every fourth point has a rare error of the first track, four of every sixteen of the second
    # one; points of a variant are contiguous.
    number = np.arange(POINTS)
    variant = (number % 4 == 0) + 2 * (number // 4 % 4 == 0)
    return drawn[np.argsort(variant, kind="stable")]


_POINTS = _lattice()
