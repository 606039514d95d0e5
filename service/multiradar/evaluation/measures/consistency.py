"""Covariance consistency of tracks: normalised estimation errors squared (NEES)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammaincinv

from multiradar.evaluation.trajectories import Floats, Indices

#: Probability of the regions and bands.
BAND = 0.95
#: Bin width for one update of each aircraft, s: long enough for every radar to scan.
BIN_S = 10.0
#: Dimensions of a horizontal position or velocity.
DIMENSIONS = 2


@dataclass(frozen=True, slots=True, eq=False)
class Consistency:
    """NEES figures.

    Attributes
    ----------
    samples : int
        Number of errors.
    mean : float
        Mean per dimension: 1 where covariances are correct, above 1 where they are too small.
    inside : float
        Fraction of errors inside their own 95 % region.
    time_s, mean_by_time, low, high : (b,) float64
        Middle of each time bin, mean per dimension over the aircraft in it, and its 95 % band.
    inside_by_time : float
        Fraction of the bins whose mean is within the band.
    """

    samples: int
    mean: float
    inside: float
    time_s: Floats
    mean_by_time: Floats
    low: Floats
    high: Floats
    inside_by_time: float


def consistency(
    error: Floats, sigma: Floats, aircraft: Indices, time_s: Floats
) -> Consistency | None:
    """Compare errors with their reported covariances.

    Parameters
    ----------
    error : (n,) float64
        Length of the error vector; NaN where unknown.
    sigma : (n,) float64
        Square root of the trace of the reported covariance, in the same unit.
    aircraft : (n,) int64
        Aircraft of each error.
    time_s : (n,) float64
        Time of each error.

    Returns
    -------
    Consistency or None
        None without samples.

    Notes
    -----
    Tracks report the trace of a covariance, not the matrix: 2 |e|² / trace stands for eᵀ P⁻¹ e. It
    has the same mean when the covariance is correct, and a chi-square distribution when the error
    is isotropic. Successive errors of one aircraft are correlated; therefore the band is that of
    one error of each aircraft in a bin.

    References
    ----------
    Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
    Navigation", Wiley 2001, section 5.4.2, equations (5.4.2-4) and (5.4.2-6).
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        squared = DIMENSIONS * (error / sigma) ** 2
    known = np.flatnonzero(np.isfinite(squared))
    if not len(known):
        return None
    squared, aircraft, time_s = squared[known], aircraft[known], time_s[known]
    number = np.floor((time_s - time_s.min()) / BIN_S).astype(np.int64)
    order = np.lexsort((time_s, aircraft, number))
    last = np.append(
        (np.diff(aircraft[order]) != 0) | (np.diff(number[order]) != 0), np.ones(1, np.bool_)
    )
    chosen = order[last]
    count = np.bincount(number[chosen])
    full = np.flatnonzero(count)
    total = np.bincount(number[chosen], squared[chosen])[full]
    freedom = DIMENSIONS * count[full]
    low, high = (_quantile(0.5 + half, freedom) for half in (-BAND / 2.0, BAND / 2.0))
    return Consistency(
        samples=len(known),
        mean=float(squared.mean() / DIMENSIONS),
        inside=float(np.mean(squared <= _quantile(BAND, DIMENSIONS))),
        time_s=time_s.min() + (full + 0.5) * BIN_S,
        mean_by_time=total / freedom,
        low=low / freedom,
        high=high / freedom,
        inside_by_time=float(np.mean((total >= low) & (total <= high))),
    )


# Of the chi-square distribution: what `scipy.stats` computes, whose import takes half a second.
def _quantile(probability: float, freedom: ArrayLike) -> Floats:
    return np.asarray(2.0 * gammaincinv(0.5 * np.asarray(freedom), probability))
