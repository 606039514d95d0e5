"""Clutter density of a radar by range, learnt from unconfirmed tracks."""

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar.state import Fields
from multiradar.tracking.association._clutter_kernels import RINGS, fill_log_clutters

Floats = NDArray[np.float64]

#: Time constant of the counts, s.
MEMORY_S = 60.0
#: Weight of the default density, in scans.
PRIOR_SCANS = 2.0


class ClutterMap:
    """Densities of false plots by sensor and range ring, a function of the plots so far.

    Parameters
    ----------
    periods_s : (m,) ndarray
        Scan periods of the sensors, s.
    usual_density : float
        Default density, 1/m² per scan.

    Attributes
    ----------
    counts : (m, RINGS) ndarray
        First plots of tracks that were not confirmed, fading.
    log_densities : (m, RINGS) ndarray
        Logarithm of the density on the ground, 1/m² per scan.
    log_usual : float
        Logarithm of the default density.
    """

    STATE: ClassVar[Fields] = {
        "_faded_s": float | None,
        "_seconds": float,
        "counts": np.ndarray,
        "log_densities": np.ndarray,
    }

    def __init__(self, periods_s: Floats, usual_density: float) -> None:
        self._periods_s = periods_s
        self._usual = usual_density
        self._faded_s: float | None = None
        self._seconds = 0.0
        self.log_usual = math.log(usual_density)
        self.counts = np.zeros((len(periods_s), RINGS))
        self.log_densities = np.full((len(periods_s), RINGS), self.log_usual)

    def fade(self, time_s: float) -> None:
        """Fade the counts to a time, and update the densities.

        Parameters
        ----------
        time_s : float
            Data time, never decreasing.
        """
        passed_s = 0.0 if self._faded_s is None else time_s - self._faded_s
        self._faded_s = time_s
        left = math.exp(-passed_s / MEMORY_S)
        self.counts *= left
        # The limit of continuous counting is MEMORY_S.
        self._seconds = self._seconds * left + MEMORY_S * (1.0 - left)
        fill_log_clutters(
            self.counts, self._seconds / self._periods_s, self._usual, PRIOR_SCANS,
            self.log_densities,
        )  # fmt: skip
