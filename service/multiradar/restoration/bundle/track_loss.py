"""Track loss of a bundle, decided by the likelihood of the plots."""

from math import log
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks._arc_kernels import count_outliers, misfit

Floats = NDArray[np.float64]

#: Minimum number of outliers of the best track, including the newest plot, for a test: fewer do not
#: determine a new track.
_OUTLIERS_MIN = 3
#: Consecutive inliers that end a search for the first outlier.
_INLIERS_IN_A_ROW = 2
#: A track without an inlier for this time, s, is lost.
_REFUTED_S = 30.0
#: Logarithm of the prior probability of track loss per plot.
_LOSS_PRIOR = log(1e-4)


class LossTest(NamedTuple):
    """The best track, and the plots of its window.

    Attributes
    ----------
    track : (TRACK_COUNT,) float64
        The track.
    anchor_s : float
        Start time of the track, s.
    plots : (n, PLOT_COUNT) float64
        Plots, columns as in `_layout`.
    first, last : int
        The window is the rows first … last − 1.
    """

    track: Floats
    anchor_s: float
    plots: Floats
    first: int
    last: int

    def outliers(self, first: int, last: int) -> int:
        """Return the number of outliers of the track among some rows.

        Parameters
        ----------
        first, last : int
            Rows first … last − 1.

        Returns
        -------
        int
            Number of outliers.
        """
        return int(count_outliers(self.track, self.anchor_s, self.plots, first, last))


def lost_since(best: LossTest) -> int:
    """Return the plot from which the best track may be lost.

    Parameters
    ----------
    best : LossTest
        The best track.

    Returns
    -------
    int
        Row of the first plot after its last two consecutive inliers; `last` if the newest plot is
        an inlier, or if outliers are too few.
    """
    row, inliers, outliers = best.last, 0, 0
    while row > best.first and inliers < _INLIERS_IN_A_ROW:
        row -= 1
        outlier = best.outliers(row, row + 1)
        if not outlier and row == best.last - 1:
            return best.last
        outliers += outlier
        inliers = 0 if outlier else inliers + 1
    return row + inliers if outliers >= _OUTLIERS_MIN else best.last


def is_likelier(new: Floats, best: LossTest, since: int, *, refuted: bool) -> bool:
    """Return whether a new track is likelier than wrong plots.

    Parameters
    ----------
    new : (TRACK_COUNT,) ndarray
        The best track that starts with the plot of row `since`; its weight is the probability of
        the plots from there on, integrated over position, velocity and accelerations.
    best : LossTest
        The present best track.
    since : int
        Row of its first outlier.
    refuted : bool
        Whether the present track is lost regardless of the weight of the new one.

    Returns
    -------
    bool
        Whether it is likelier, and at most half of the plots are its outliers.
    """
    plots, last = best.plots, best.last
    outliers = count_outliers(new, float(plots[since, layout.TIME]), plots, since, last)
    gained = float(new[layout.WEIGHT]) + misfit(best.track, best.anchor_s, plots, since, last)
    return bool((refuted or gained + _LOSS_PRIOR > 0.0) and 2 * outliers <= last - since)


def fits_none(best: LossTest) -> bool:
    """Return whether all plots of the last 30 s, at least three, are outliers of a track.

    Parameters
    ----------
    best : LossTest
        The best track.

    Returns
    -------
    bool
        Whether the track is refuted.
    """
    times = best.plots[best.first : best.last, layout.TIME]
    oldest = best.first + int(np.searchsorted(times, times[-1] - _REFUTED_S))
    oldest = max(best.first, min(oldest, best.last - _OUTLIERS_MIN))
    return best.outliers(oldest, best.last) == best.last - oldest
