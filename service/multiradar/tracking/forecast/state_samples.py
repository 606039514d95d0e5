"""When the states of tracks are sampled, and which: forecasts are made from them and judged."""

import math
from enum import Enum

import numpy as np
from numpy.typing import NDArray

#: Data time between two samples at least, s: they are taken where an epoch ends.
SAMPLE_EVERY_S = 8.0
#: Most tracks of a sample that forecasts are judged by: a bound of time and of memory.
SAMPLE_TRACKS_MAX = 8


class Sampling(Enum):
    """Which confirmed tracks, of those updated since the sample before, are in a sample."""

    NONE = "none"
    DRAWN = "drawn"
    ALL = "all"


# Odd numbers that scatter neighbouring identifiers (splitmix64).
_SCATTER = np.uint64(0x9E3779B97F4A7C15)
_MIX = np.uint64(0xBF58476D1CE4E5B9)


def is_due(epoch: int, epoch_s: float) -> bool:
    """Return whether a sample is taken at the end of an epoch.

    Parameters
    ----------
    epoch : int
        Its number.
    epoch_s : float
        Length of epochs, s.

    Returns
    -------
    bool
        Whether a multiple of `SAMPLE_EVERY_S` is in it, its end included.
    """
    begin_s, end_s = epoch * epoch_s, (epoch + 1) * epoch_s
    return math.floor(end_s / SAMPLE_EVERY_S) > math.floor(begin_s / SAMPLE_EVERY_S)


def drawn(
    track_id: NDArray[np.int64], epoch: int, most: int = SAMPLE_TRACKS_MAX
) -> NDArray[np.intp]:
    """Draw the tracks by which forecasts are judged: others each time, the same every run.

    Parameters
    ----------
    track_id : (n,) int64
        Tracks, in any order.
    epoch : int
        Number of the epoch.
    most : int
        How many at most, at least 1.

    Returns
    -------
    (m,) int
        Places of at most so many of them, by ascending identifier. Of those that are
        drawn all are drawn again.
    """
    with np.errstate(over="ignore"):
        # Each step has an inverse, so that no two tracks share a number.
        number = (track_id.astype(np.uint64) + np.uint64(epoch)) * _SCATTER
        number = (number ^ (number >> np.uint64(30)) ^ np.uint64(epoch)) * _MIX
    few = np.arange(len(number))
    if len(number) > most:
        few = np.argpartition(number, most)[:most]
    return few[np.argsort(track_id[few])]
