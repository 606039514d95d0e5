"""Distinct values of long arrays with few of them.

`numpy.unique` hashes the values first, or sorts their places if those are wanted: both take
several times as long as a sort of the values alone.
"""

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]


def distinct(values: Integers) -> Integers:
    """Return the distinct values, ascending.

    Parameters
    ----------
    values : int64[n]
        The values.

    Returns
    -------
    int64[k]
        The distinct ones.
    """
    ordered = np.sort(values, kind="stable")
    keep = np.ones(len(ordered), dtype=np.bool_)
    keep[1:] = ordered[1:] != ordered[:-1]
    return ordered[keep]


def distinct_places(values: Integers) -> tuple[Integers, Integers]:
    """Return the distinct values, ascending, and the place of each value among them.

    Parameters
    ----------
    values : int64[n]
        The values.

    Returns
    -------
    int64[k], int64[n]
        The distinct values, and the index of each value.
    """
    found = distinct(values)
    return found, np.searchsorted(found, values)
