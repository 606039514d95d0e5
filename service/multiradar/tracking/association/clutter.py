"""How many plots of a radar are of no aircraft, by range: learnt from what became of tracks."""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.association._clutter_kernels import RINGS, fill_log_clutters

Floats = NDArray[np.float64]

#: What was counted counts less by a factor e after so long, s.
MEMORY_S = 60.0
#: The usual density counts as much as so many turns of counting.
PRIOR_TURNS = 2.0


class ClutterMap:
    """Densities of false plots by sensor and ring, a function of the plots so far.

    Parameters
    ----------
    periods_s : (m,) ndarray
        Turns of the sensors, s.
    usual_density : float
        Density before anything is known, 1/m² a turn.

    Attributes
    ----------
    counts : (m, RINGS) ndarray
        First plots of tracks that were not confirmed; fading.
    log_densities : (m, RINGS) ndarray
        Logarithm of the density on the ground, 1/m² a turn.
    log_usual : float
        That of the usual density.
    """

    def __init__(self, periods_s: Floats, usual_density: float) -> None:
        self._periods_s = periods_s
        self._usual = usual_density
        self._faded_s: float | None = None
        self._seconds = 0.0
        self.log_usual = math.log(usual_density)
        self.counts = np.zeros((len(periods_s), RINGS))
        self.log_densities = np.full((len(periods_s), RINGS), self.log_usual)

    def fade(self, time_s: float) -> None:
        """Let what was counted fade until a time, and set the densities.

        Parameters
        ----------
        time_s : float
            Data time, never going back.
        """
        passed_s = 0.0 if self._faded_s is None else time_s - self._faded_s
        self._faded_s = time_s
        left = math.exp(-passed_s / MEMORY_S)
        self.counts *= left
        # Of a count that went on for ever, MEMORY_S would be left.
        self._seconds = self._seconds * left + MEMORY_S * (1.0 - left)
        fill_log_clutters(
            self.counts, self._seconds / self._periods_s, self._usual, PRIOR_TURNS,
            self.log_densities,
        )  # fmt: skip
