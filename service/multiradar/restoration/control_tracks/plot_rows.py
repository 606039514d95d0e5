"""Plots as rows for the restoration kernels."""

from math import hypot, isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.control_tracks.shared_errors import ROUNDING, require_part
from multiradar.restoration.control_tracks.tracks import MeasurementTrack, measurement_track

Floats = NDArray[np.float64]

#: Squared correlations up to which a covariance is valid beyond doubt.
_SQUARED_CORRELATION_MAX = 0.999


def plot_rows(plots: MeasurementTrack, settings: BundleSettings) -> Floats:
    """Return plots as rows.

    Parameters
    ----------
    plots : MeasurementTrack
        Plots of one aircraft.
    settings : BundleSettings
        Parameters of outliers.

    Returns
    -------
    (n, PLOT_COUNT) ndarray
        Columns as in `_layout`.

    References
    ----------
    IMM UrO RAN report (2016), section 2.2.4: outliers. Their density is the project's own.
    """
    noise = plots.covariance_m2
    determinant = noise[:, 0, 0] * noise[:, 1, 1] - noise[:, 0, 1] ** 2
    rows = np.zeros((len(plots), layout.PLOT_COUNT))
    rows[:, layout.TIME] = plots.time_s
    rows[:, layout.PLOT_EAST : layout.PLOT_NORTH + 1] = plots.position_m
    rows[:, layout.EAST_EAST] = noise[:, 1, 1] / determinant
    rows[:, layout.EAST_NORTH] = -noise[:, 0, 1] / determinant
    rows[:, layout.NORTH_NORTH] = noise[:, 0, 0] / determinant
    rows[:, layout.FLOOR] = settings.floor(determinant)
    return rows


def plot_row(
    time_s: float, position_m: ArrayLike, covariance_m2: ArrayLike, shared_m2: ArrayLike | None,
    settings: BundleSettings,
) -> Floats:  # fmt: skip
    """Return one plot as a row, with its arguments checked.

    Parameters
    ----------
    time_s, position_m, covariance_m2, shared_m2
        As for `Bundle.push`.
    settings : BundleSettings
        Parameters of outliers.

    Returns
    -------
    (PLOT_COUNT,) ndarray
        As of `plot_rows`, with the common part of the covariance.

    Raises
    ------
    ShapeError
        If a shape does not match, or a number is not finite.
    CovarianceError
        If a covariance is not valid.
    """
    position, covariance = np.asarray(position_m), np.asarray(covariance_m2)
    shared = np.zeros((2, 2)) if shared_m2 is None else np.asarray(shared_m2)
    if not _is_valid(time_s, position, covariance, shared):
        plot = measurement_track([time_s], position[None], covariance[None], [0])
        (time_s,), (position,), (covariance,) = plot.time_s, plot.position_m, plot.covariance_m2
        shared = require_part(shared, covariance)
    (east_east, east_north), (_, north_north) = covariance.tolist()
    determinant = east_east * north_north - east_north * east_north
    row = np.empty(layout.PLOT_COUNT)
    row[:] = (
        time_s, *position.tolist(), north_north / determinant, -east_north / determinant,
        east_east / determinant, settings.floor(determinant),
        *shared[0].tolist(), shared[1, 1],
    )  # fmt: skip
    return row


# Whether a plot is valid beyond doubt: a tenth of the time of the checks that say what is wrong.
def _is_valid(time_s: float, position: Floats, covariance: Floats, shared: Floats) -> bool:
    arrays = position, covariance, shared
    if not isinstance(time_s, float) or any(one.dtype != np.float64 for one in arrays):
        return False
    if position.shape != (2,) or covariance.shape != (2, 2) or shared.shape != (2, 2):
        return False
    a, b, lower, c = covariance.ravel().tolist()
    s, _, t, u = common = shared.ravel().tolist()
    if not all(map(isfinite, (time_s, *position.tolist(), a, b, lower, c, *common))):
        return False
    least = -0.5 * ROUNDING * (a + c)
    return (
        b == lower
        and a > 0.0
        and c > 0.0
        and b * b < _SQUARED_CORRELATION_MAX * a * c
        and _least_variance(s, t, u) > least
        and _least_variance(a - s, b - t, c - u) > least
    )


# The smaller eigenvalue of [[a, b], [b, c]].
def _least_variance(a: float, b: float, c: float) -> float:
    return 0.5 * (a + c) - hypot(0.5 * (a - c), b)
