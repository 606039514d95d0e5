"""Whether a bundle has lost its aircraft: by what plots say for it, not by how many they are."""

from math import log
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks._arc_kernels import count_outliers, misfit

Floats = NDArray[np.float64]

#: So many outliers of the best track, the newest plot and those before it, make a doubt: with fewer
#: no other beginning can be told.
_STRANGE_MIN = 3
#: So many plots in a row that the best track knows end the doubt.
_KNOWN_IN_A_ROW = 2
#: A track that knows no plot for so long, s, has lost the aircraft.
_REFUTED_S = 30.0
#: Logarithm of the chance, before any plot speaks, that an aircraft is lost with a plot.
_LOST_BEFORE = log(1e-4)


class LossTest(NamedTuple):
    """The best track, and the plots of its window.

    Attributes
    ----------
    track : (TRACK_COUNT,) float64
        The track.
    anchor_s : float
        Time of its beginning, s.
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
        """Return how many plots of some rows are likelier outliers than plots of the track.

        Parameters
        ----------
        first, last : int
            Rows first … last − 1.

        Returns
        -------
        int
            Their number.
        """
        return int(count_outliers(self.track, self.anchor_s, self.plots, first, last))


def lost_since(best: LossTest) -> int:
    """Return from which plot on the best track may have lost the aircraft.

    Parameters
    ----------
    best : LossTest
        The best track.

    Returns
    -------
    int
        Row of the first plot after the last two in a row that it knows; `last` where it knows the
        newest plot, or where too few are outliers of it.
    """
    row, known, strange = best.last, 0, 0
    while row > best.first and known < _KNOWN_IN_A_ROW:
        row -= 1
        outlier = best.outliers(row, row + 1)
        if not outlier and row == best.last - 1:
            return best.last
        strange += outlier
        known = 0 if outlier else known + 1
    return row + known if strange >= _STRANGE_MIN else best.last


def is_likelier(new: Floats, best: LossTest, since: int, *, refuted: bool) -> bool:
    """Return whether another beginning is likelier than that plots were wrong.

    Parameters
    ----------
    new : (TRACK_COUNT,) ndarray
        The best track that begins with the plot of row `since`; its weight is the probability of
        the plots from there on, whatever place, velocity and accelerations may be.
    best : LossTest
        The best track that there is.
    since : int
        Row of the first plot that it does not know.
    refuted : bool
        Whether it is lost whatever the other is worth.

    Returns
    -------
    bool
        Whether it is, and most plots are none of its outliers.
    """
    plots, last = best.plots, best.last
    strange = count_outliers(new, float(plots[since, layout.TIME]), plots, since, last)
    gained = float(new[layout.WEIGHT]) + misfit(best.track, best.anchor_s, plots, since, last)
    return bool((refuted or gained + _LOST_BEFORE > 0.0) and 2 * strange <= last - since)


def fits_none(best: LossTest) -> bool:
    """Return whether every plot of the last half minute, and of three, is an outlier of a track.

    Parameters
    ----------
    best : LossTest
        The best track.

    Returns
    -------
    bool
        What it says then is no more than a guess.
    """
    times = best.plots[best.first : best.last, layout.TIME]
    oldest = best.first + int(np.searchsorted(times, times[-1] - _REFUTED_S))
    oldest = max(best.first, min(oldest, best.last - _STRANGE_MIN))
    return best.outliers(oldest, best.last) == best.last - oldest
