"""Sampling of track states, for the calibration of forecasts."""

import math
from enum import Enum

import numpy as np
from numpy.typing import NDArray

#: Minimum data time between two samples, s: they are taken at ends of epochs.
SAMPLE_EVERY_S = 8.0
#: Maximum number of tracks of a sample used for calibration: a bound of time and memory.
SAMPLE_TRACKS_MAX = 8


class Sampling(Enum):
    """Which confirmed tracks updated since the previous sample are in a sample."""

    NONE = "none"
    DRAWN = "drawn"
    ALL = "all"


# Odd multipliers that scatter neighbouring identifiers (splitmix64).
_SCATTER = np.uint64(0x9E3779B97F4A7C15)
_MIX = np.uint64(0xBF58476D1CE4E5B9)


def is_due(epoch: int, epoch_s: float) -> bool:
    """Return whether a sample is taken at the end of an epoch.

    Parameters
    ----------
    epoch : int
        Number of the epoch.
    epoch_s : float
        Length of epochs, s.

    Returns
    -------
    bool
        Whether it contains a multiple of `SAMPLE_EVERY_S`, its end included.
    """
    begin_s, end_s = epoch * epoch_s, (epoch + 1) * epoch_s
    return math.floor(end_s / SAMPLE_EVERY_S) > math.floor(begin_s / SAMPLE_EVERY_S)


def drawn(
    track_id: NDArray[np.int64], epoch: int, most: int = SAMPLE_TRACKS_MAX
) -> NDArray[np.intp]:
    """Select tracks for calibration: pseudo-random by epoch, the same in every run.

    Parameters
    ----------
    track_id : (n,) int64
        Tracks, in any order.
    epoch : int
        Number of the epoch.
    most : int
        Maximum number, at least 1.

    Returns
    -------
    (m,) int
        Indices of the selected tracks, by ascending identifier. A selection from them contains them
        all.
    """
    # Epochs before time 0 are negative.
    start = np.int64(epoch).astype(np.uint64)
    with np.errstate(over="ignore"):
        # Each step is invertible: no two tracks have the same key.
        number = (track_id.astype(np.uint64) + start) * _SCATTER
        number = (number ^ (number >> np.uint64(30)) ^ start) * _MIX
    few = np.arange(len(number))
    if len(number) > most:
        few = np.argpartition(number, most)[:most]
    return few[np.argsort(track_id[few])]
