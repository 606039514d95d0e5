"""Plots as rows for the restoration kernels."""

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.control_tracks.tracks import MeasurementTrack

Floats = NDArray[np.float64]


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
