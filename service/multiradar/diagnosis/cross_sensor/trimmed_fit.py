"""Least squares without outliers, of several models of the same differences.

Every model is a choice of columns. The normal matrix of all columns is computed once, in blocks: a
product of whole columns would wait for the threads of the linear algebra library, 100 ms at a time
where other processes use the cores.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from multiradar.diagnosis.plots import Booleans, Floats, Integers

#: Differences beyond this multiple of their median are excluded; number of rounds.
_TRIM, _ROUNDS = 4.0, 6
#: Relative size of what decides where the differences do not determine a column.
_RIDGE = 1e-6
#: Rows of a block: products of blocks are computed by the calling thread.
_BLOCK = 128


@dataclass(frozen=True, slots=True)
class TrimmedFit:
    """Solution of a model.

    Attributes
    ----------
    chosen : (p,) int64
        The columns.
    solution : (p,) float64
        Factors of the columns.
    inverse : (p, p) float64
        Inverse of the normal matrix.
    left : (k, 2) float64
        Differences that the model leaves, east and north, m.
    residual_m : (k,) float64
        Their lengths.
    used : (k,) bool
        Which of them were used.
    scale : float
        Median of these lengths, m, at least 1.
    """

    chosen: Integers
    solution: Floats
    inverse: Floats
    left: Floats
    residual_m: Floats
    used: Booleans
    scale: float

    @property
    def sigma(self) -> Floats:
        """Standard deviations of the solution where the differences are independent."""
        return np.asarray(self.scale * np.sqrt(np.diag(self.inverse)))


class Equations:
    """Differences of positions, and columns that explain them.

    Parameters
    ----------
    apart_m : (k, 2) float64
        Differences east and north, m.
    columns : (k, 2, n) float64
        Effect of each column on them, of one size.
    proceed : callable, optional
        Called before each fit; what it raises ends the fits.
    """

    def __init__(
        self, apart_m: Floats, columns: Floats, proceed: Callable[[], None] = lambda: None
    ) -> None:
        self._apart_m, self._columns, self._proceed = apart_m, columns, proceed
        # Each column in one piece: a fit reads a few of them, many times.
        self._by_column = np.ascontiguousarray(columns.transpose(2, 0, 1))
        self._normal, self._right = self._sums(np.ones(len(apart_m), np.bool_))

    def fit(self, chosen: Sequence[int]) -> TrimmedFit:
        """Fit some of the columns."""
        self._proceed()
        some, count = np.array(chosen, np.int64), len(chosen)
        effects = self._by_column[some]
        kept = used = np.ones(len(self._apart_m), np.bool_)
        for _ in range(_ROUNDS):
            used = kept
            normal, right = self._sums_of(used)
            normal = normal[np.ix_(some, some)]
            normal += _RIDGE * np.eye(count) * max(float(np.trace(normal)), 1.0) / count
            factors = np.asarray(np.linalg.solve(normal, right[some]), np.float64)
            left = self._apart_m - np.einsum("jki,j->ki", effects, factors)
            residual_m = np.hypot(left[:, 0], left[:, 1])
            scale = max(_median(residual_m), 1.0)
            kept = residual_m <= _TRIM * scale
            if np.array_equal(kept, used):
                break
        inverse = np.asarray(np.linalg.inv(normal), np.float64)
        return TrimmedFit(some, factors, inverse, left, residual_m, used, scale)

    def clustered(self, fit: TrimmedFit, last: int, cluster: Integers) -> Floats:
        """Return the covariance of the last factors of a fit, with errors common to clusters.

        Parameters
        ----------
        fit : TrimmedFit
            The fit.
        last : int
            How many of its factors.
        cluster : (k,) int64
            The cluster of each difference.

        Returns
        -------
        (last, last) float64
            Liang and Zeger, *Longitudinal data analysis using generalized linear models*,
            Biometrika 73, 1986.
        """
        weights = np.zeros((self._columns.shape[2], last))
        weights[fit.chosen] = fit.inverse[:, -last:]
        pulls = ((self._columns[fit.used] @ weights) * fit.left[fit.used][:, :, None]).sum(axis=1)
        names, place = np.unique(cluster[fit.used], return_inverse=True)
        sums = np.stack([np.bincount(place, one, len(names)) for one in pulls.T], axis=1)
        return np.asarray(sums.T @ sums * len(names) / max(len(names) - len(fit.chosen), 1))

    # Normal matrix and right side of the used rows: usually all but a few.
    def _sums_of(self, used: Booleans) -> tuple[Floats, Floats]:
        count = np.count_nonzero(used)
        if count == len(used):
            return self._normal, self._right
        if 2 * count < len(used):
            return self._sums(used)
        normal, right = self._sums(~used)
        return self._normal - normal, self._right - right

    def _sums(self, rows: Booleans) -> tuple[Floats, Floats]:
        count = self._columns.shape[2]
        one = np.concatenate([self._columns[rows], self._apart_m[rows][:, :, None]], axis=2)
        one = one.reshape(-1, count + 1)
        blocks = np.zeros((-(-len(one) // _BLOCK), _BLOCK, count + 1))
        blocks.reshape(-1, count + 1)[: len(one)] = one
        sums = (blocks.transpose(0, 2, 1) @ blocks).sum(axis=0)
        return sums[:count, :count], sums[:count, count]


# np.median takes twice as long for a few hundred numbers: it checks for NaN and axes.
def _median(values: Floats) -> float:
    if not len(values):
        return float("nan")
    half = len(values) // 2
    ranked = np.partition(values, (half - 1, half) if half else 0)
    return float(ranked[half] if len(values) % 2 else 0.5 * (ranked[half - 1] + ranked[half]))


def with_usual_offsets(fits: Mapping[int, TrimmedFit], radars: int, more: float) -> list[int]:
    """Return the fits with the smallest offsets of the radars, the smallest first.

    Another site of one radar resembles one of its neighbour with large offsets of several radars.

    Parameters
    ----------
    fits : mapping of TrimmedFit
        Their first columns are the offsets of range, azimuth and time of each radar.
    radars : int
        Number of radars.
    more : float
        Largest difference of the sum of squares of range and azimuth offsets from the least one.
    """
    offsets = {one: fit.solution[: 3 * radars].reshape(-1, 3)[:, :2] for one, fit in fits.items()}
    squares = {one: float(np.sum(found**2)) for one, found in offsets.items()}
    most = min(squares.values()) + more
    return sorted((one for one in squares if squares[one] <= most), key=lambda one: squares[one])
