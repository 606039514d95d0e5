"""Compiled search for duplicate records."""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import loop

Words = NDArray[np.int64]
Numbers = NDArray[np.float64]
Flags = NDArray[np.bool_]


#: Associativity: retained records per value of the low bits of the key.
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
    """Mark duplicate records, and retain all records.

    Parameters
    ----------
    keys : int64[n]
        Equal for equal records.
    time_s : float64[n]
        Time of reception, s.
    window_s : float64[n]
        Maximum time difference of duplicates, s.
    known_keys, known_s : int64[m], float64[m]
        Retained records: `WAYS` entries per value of the low bits; updated. The key of a free entry
        is 0. m / WAYS is a power of two.
    again : bool[n]
        Filled: whether each is a duplicate. If all entries are in use, the oldest is replaced.
    """
    mask = len(known_keys) // WAYS - 1
    for k in range(len(keys)):
        key = keys[k] if keys[k] != 0 else 1
        first = (key & mask) * WAYS
        place = first
        again[k] = False
        for way in range(first, first + WAYS):
            if known_keys[way] == key:
                place = way
                again[k] = abs(time_s[k] - known_s[way]) <= window_s[k]
                break
            free = known_keys[way] == 0
            if known_keys[place] != 0 and (free or known_s[way] < known_s[place]):
                place = way
        known_keys[place] = key
        known_s[place] = time_s[k]
