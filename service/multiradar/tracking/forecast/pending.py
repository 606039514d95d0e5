"""Pending forecasts: those whose time is not reached yet."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class PendingForecasts(NamedTuple):
    """Forecasts to be compared with later positions: one row for each track, time and horizon.

    Attributes
    ----------
    track_id : (n,) int64
        The track.
    due_s : (n,) float64
        Data time for which it was made.
    horizon : (n,) int64
        Index of the horizon.
    mean : (n, j, 2) float64
        Predicted position by each of j motion models, m.
    covariance : (n, j, 2, 2) float64
        Its covariance, m².
    before : (n, 3) float64
        Time and position of the last update before `due_s`, s and m.
    """

    track_id: Integers
    due_s: Floats
    horizon: Integers
    mean: Floats
    covariance: Floats
    before: Floats

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.due_s)

    @classmethod
    def none(cls, motions: int) -> "PendingForecasts":
        """Return no forecasts, by `motions` motion models."""
        whole, real = np.empty(0, np.int64), np.empty(0)
        means, covariances = np.empty((0, motions, 2)), np.empty((0, motions, 2, 2))
        return cls(whole, real, whole, means, covariances, np.empty((0, 3)))

    def at(self, rows: NDArray[np.bool_] | NDArray[np.intp] | slice) -> "PendingForecasts":
        """Return some of the rows."""
        columns: Any = (column[rows] for column in self)
        return PendingForecasts(*columns)

    def followed_by(self, others: "PendingForecasts") -> "PendingForecasts":
        """Return these rows, then the others."""
        columns: Any = (np.concatenate(pair) for pair in zip(self, others, strict=True))
        return PendingForecasts(*columns)
