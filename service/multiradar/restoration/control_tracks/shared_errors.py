"""Errors that plots share: more plots do not make them smaller.

The bias of a radar moves all its plots alike, and those of several radars are mostly known against
each other only. A bundle weighs its plots as if all errors were their own; what they share is
added to what it says.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import CovarianceError
from multiradar.estimation.array_checks import finite_array
from multiradar.restoration.control_tracks import _layout as layout

Floats = NDArray[np.float64]

#: A place rests on the plots around it, that many seconds before and after it, s.
AROUND_S = 15.0
# Rounding of a covariance, in parts of its trace.
_ROUNDING = 1e-9


def require_part(shared_m2: ArrayLike, covariance_m2: Floats) -> Floats:
    """Return the shared part of a covariance if it may be one.

    Parameters
    ----------
    shared_m2 : (2, 2) array_like
        The part.
    covariance_m2 : (2, 2) ndarray
        The whole.

    Returns
    -------
    (2, 2) ndarray
        The part.

    Raises
    ------
    ShapeError
        If it is not two by two finite numbers.
    CovarianceError
        If it, or what is left of the whole, has a negative variance in some direction.
    """
    shared = finite_array(shared_m2, "covariance of shared errors", (2, 2))
    least = -_ROUNDING * float(np.trace(covariance_m2))
    for name, matrix in (("they", shared), ("the others", covariance_m2 - shared)):
        variance = float(np.linalg.eigvalsh(matrix)[0])
        if variance < least:
            raise CovarianceError(
                f"covariance of shared errors: expected a part of that of the plot, was one by "
                f"which {name} have a variance of {variance:.3g} m²"
            )
    return shared


def shared_at(plots: Floats, time_s: Floats) -> Floats:
    """Return the covariance of errors that plots share, at many times.

    Parameters
    ----------
    plots : (n, PLOT_COUNT) ndarray
        Of the window, at least one.
    time_s : (k,) ndarray
        Times, s.

    Returns
    -------
    (k, 2, 2) ndarray
        East and north, m².

    References
    ----------
    The project's own: with weights that sum to one the covariance of a mean of errors is not above
    the mean of their covariances, however they go together. Weights are those of the information
    of the plots, less with the time between.
    """
    shared = plots[:, layout.SHARED : layout.SHARED + layout.SHARED_COUNT]
    if not shared.any():
        return np.zeros((len(time_s), 2, 2))
    apart_s = np.abs(time_s[:, None] - plots[:, layout.TIME])
    # Far from all plots the nearest ones count.
    apart_s -= apart_s.min(axis=1, keepdims=True)
    information = plots[:, layout.EAST_EAST] + plots[:, layout.NORTH_NORTH]
    weight = information * np.exp(-apart_s / AROUND_S)
    mean = weight @ shared / weight.sum(axis=1, keepdims=True)
    return np.asarray(mean[:, [0, 1, 1, 2]].reshape(-1, 2, 2))
