"""Compiled search for records that came before."""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import loop

Words = NDArray[np.int64]
Numbers = NDArray[np.float64]
Flags = NDArray[np.bool_]


#: Records that are remembered of those that share the low bits of their keys.
WAYS = 8


@loop
def find_copies(
    keys: Words,
    time_s: Numbers,
    window_s: Numbers,
    known_keys: Words,
    known_s: Numbers,
    again: Flags,
) -> None:
    """Tell which records came before, and remember all of them.

    Parameters
    ----------
    keys : int64[n]
        Equal for equal records.
    time_s : float64[n]
        When each came, s.
    window_s : float64[n]
        A record repeats one that came at most so long before or after, s.
    known_keys, known_s : int64[m], float64[m]
        What is remembered: `WAYS` places for each value of the low bits; changed. m / WAYS is a
        power of two.
    again : bool[n]
        Filled: whether each repeats one. Where there are too many, the oldest is forgotten.
    """
    mask = len(known_keys) // WAYS - 1
    for k in range(len(keys)):
        first = (keys[k] & mask) * WAYS
        place = first
        again[k] = False
        for way in range(first, first + WAYS):
            if known_keys[way] == keys[k] and known_s[way] > -np.inf:
                place = way
                again[k] = abs(time_s[k] - known_s[way]) <= window_s[k]
                break
            if known_s[way] < known_s[place]:
                place = way
        known_keys[place] = keys[k]
        known_s[place] = time_s[k]
