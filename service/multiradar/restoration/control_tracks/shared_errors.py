"""Errors common to plots, which more plots do not reduce.

The bias of a radar displaces all its plots alike, and biases of several radars are mostly known
only relative to each other. A bundle weights its plots as if their errors were independent; the
covariance of common errors is added to its estimates.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import CovarianceError
from multiradar.estimation.array_checks import finite_array
from multiradar.restoration.control_tracks import _layout as layout

Floats = NDArray[np.float64]

#: Time constant of the weights of plots around a position, s.
AROUND_S = 15.0
#: Tolerance of a covariance against rounding, relative to its trace.
ROUNDING = 1e-9


def require_part(shared_m2: ArrayLike, covariance_m2: Floats) -> Floats:
    """Return the common part of a covariance if it is valid.

    Parameters
    ----------
    shared_m2 : (2, 2) array_like
        The common part.
    covariance_m2 : (2, 2) ndarray
        The whole covariance.

    Returns
    -------
    (2, 2) ndarray
        The common part.

    Raises
    ------
    ShapeError
        If it is not a finite 2 × 2 matrix.
    CovarianceError
        If it, or the remainder of the whole covariance, has a negative variance in a direction.
    """
    shared = finite_array(shared_m2, "covariance of shared errors", (2, 2))
    least = -ROUNDING * float(np.trace(covariance_m2))
    for name, matrix in (("the shared part", shared), ("the remainder", covariance_m2 - shared)):
        variance = float(np.linalg.eigvalsh(matrix)[0])
        if variance < least:
            raise CovarianceError(
                "covariance of shared errors: expected at most the covariance of the plot, but "
                f"{name} has a variance of {variance:.3g} m²"
            )
    return shared


def shared_at(plots: Floats, time_s: Floats) -> Floats:
    """Return the covariance of common errors of plots, at many times.

    Parameters
    ----------
    plots : (n, PLOT_COUNT) ndarray
        Plots of the window, at least one.
    time_s : (k,) ndarray
        Times, s.

    Returns
    -------
    (k, 2, 2) ndarray
        East and north, m².

    References
    ----------
    The project's own: with weights of sum one, the covariance of a mean of errors is at most the
    mean of their covariances, for any correlation. Weights are the information of the plots,
    decreasing with the time difference.
    """
    shared = plots[:, layout.SHARED : layout.SHARED + layout.SHARED_COUNT]
    if not shared.any():
        return np.zeros((len(time_s), 2, 2))
    apart_s = np.abs(time_s[:, None] - plots[:, layout.TIME])
    # Far from all plots the nearest ones are used.
    apart_s -= apart_s.min(axis=1, keepdims=True)
    information = plots[:, layout.EAST_EAST] + plots[:, layout.NORTH_NORTH]
    weight = information * np.exp(-apart_s / AROUND_S)
    mean = weight @ shared / weight.sum(axis=1, keepdims=True)
    return np.asarray(mean[:, [0, 1, 1, 2]].reshape(-1, 2, 2))
