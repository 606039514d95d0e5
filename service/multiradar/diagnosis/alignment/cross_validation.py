"""Residuals of pairs of aircraft that were withheld from the fit."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.diagnosis.alignment.fit import Alignment, Problem, fit
from multiradar.diagnosis.alignment.pairs import Side
from multiradar.diagnosis.plots import NORMAL_SPREAD, Floats, Integers

#: Aircraft below which there are no folds.
AIRCRAFT_MIN = 2


@dataclass(frozen=True, slots=True)
class CrossValidation:
    """Residuals of all pairs: position by the first sensor minus that by the second.

    Attributes
    ----------
    fold : (n,) int64
        Fold of each pair.
    before, after, best : (n, 2) float64
        East and north, m: without biases; with the biases fitted to the other folds; with those
        fitted to all pairs, which no offsets of other aircraft can surpass but by chance.
    """

    fold: Integers
    before: Floats
    after: Floats
    best: Floats


def folds_of(aircraft: Integers, count: int) -> Integers:
    """Return a fold for each pair, the same for all pairs of an aircraft.

    Parameters
    ----------
    aircraft : (n,) int64
        Aircraft of each pair.
    count : int
        Number of folds, at least 2.

    Returns
    -------
    (n,) int64
        0 to count − 1; aircraft with many pairs are spread evenly.
    """
    distinct, place, pairs = np.unique(aircraft, return_inverse=True, return_counts=True)
    order = np.lexsort((distinct, -pairs))
    fold = np.empty(len(distinct), np.int64)
    fold[order] = np.arange(len(distinct)) % count
    return fold[place]


def cross_validate(problem: Problem, whole: Alignment, count: int) -> CrossValidation:
    """Fit without the aircraft of each fold, and return the residuals of those.

    Parameters
    ----------
    problem : Problem
        The pairs.
    whole : Alignment
        Fit of all pairs.
    count : int
        Number of folds; fewer with fewer aircraft.
    """
    aircraft = len(np.unique(problem.pairs.aircraft))
    fold = folds_of(problem.pairs.aircraft, max(min(count, aircraft), 1))
    before = problem.residuals(np.zeros_like(whole.estimate))
    after = before.copy()
    for one in np.unique(fold).tolist() if aircraft >= AIRCRAFT_MIN else []:
        held = fold == one
        after[held] = problem.residuals(fit(problem, ~held).estimate)[held]
    return CrossValidation(fold, before, after, problem.residuals(whole.estimate))


@dataclass(frozen=True, slots=True)
class Distances:
    """Lengths of residuals, m; NaN without any."""

    median_m: float
    rms_m: float
    percentile_90_m: float


def distances(residual: Floats) -> Distances:
    """Return the lengths of residuals (n, 2)."""
    if not len(residual):
        return Distances(np.nan, np.nan, np.nan)
    length = np.hypot(residual[:, 0], residual[:, 1])
    return Distances(
        float(np.median(length)),
        float(np.sqrt(np.mean(length**2))),
        float(np.quantile(length, 0.9)),
    )


@dataclass(frozen=True, slots=True)
class SideResiduals:
    """Plots of one radar against those of others.

    Attributes
    ----------
    rows : (k,) int64
        The pairs.
    side : Side
        Its plots.
    sign : (k,) float64
        1 where it is the first sensor, else −1.
    """

    rows: NDArray[np.intp]
    side: Side
    sign: Floats

    def polar(self, residual: Floats) -> tuple[Floats, Floats]:
        """Return residuals (n, 2) of all pairs as this radar's range, m, and azimuth, rad."""
        own = residual[self.rows] * self.sign[:, None]
        along = np.einsum("ki,ki->k", own, self.side.along)
        across = np.einsum("ki,ki->k", own, self.side.across)
        ranges = along * self.side.ground_m / np.maximum(self.side.range_m, 1.0)
        return ranges, across / np.maximum(self.side.ground_m, 1.0)


def side_of(problem: Problem, sensor: int) -> SideResiduals:
    """Return the plots of a radar in all its pairs."""
    pairs = problem.pairs
    first = np.flatnonzero(pairs.first_sensor == sensor)
    second = np.flatnonzero(pairs.second_sensor == sensor)
    rows = np.concatenate([first, second])
    parts = pairs.first.select(first), pairs.second.select(second)
    names = Side.__slots__
    side = Side(**{name: np.concatenate([getattr(one, name) for one in parts]) for name in names})
    sign = np.concatenate([np.ones(len(first)), -np.ones(len(second))])
    return SideResiduals(rows, side, sign)


def middle_and_spread(values: Floats) -> tuple[float, float]:
    """Return the median, and the standard deviation by the median absolute deviation."""
    if not len(values):
        return np.nan, np.nan
    middle = float(np.median(values))
    return middle, float(NORMAL_SPREAD * np.median(np.abs(values - middle)))
