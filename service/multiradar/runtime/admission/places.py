"""Where the measurements that were handed to the engine came from, as long as they wait in it."""

from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class _Part(NamedTuple):
    # Consecutive measurements: number of the first, how many, what they came in, and the place of
    # each there (None: counted from 0).
    first: int
    length: int
    origin: int
    rows: NDArray[np.int64] | None


class Places:
    """Remembers the origin of measurements that the engine may still speak of.

    The engine numbers measurements in the order in which they are handed to it, from 0.
    """

    def __init__(self) -> None:
        self._next = 0
        self._parts: list[_Part] = []

    def add(self, origin: int, count: int, rows: NDArray[np.int64] | None = None) -> None:
        """Note the next measurements.

        Parameters
        ----------
        origin : int
            What they came in.
        count : int
            How many they are.
        rows : (count,) int64, optional
            Place of each there; by default they are counted from 0.
        """
        if count:
            self._parts.append(_Part(self._next, count, origin, rows))
            self._next += count

    def find(self, numbers: Sequence[int]) -> list[tuple[int, int]]:
        """Return what measurements came in, and their places there."""
        found = []
        for number in numbers:
            part = self._parts[bisect_right(self._parts, number, key=lambda one: one.first) - 1]
            place = number - part.first
            found.append((part.origin, place if part.rows is None else int(part.rows[place])))
        return found

    def forget(self, before: int) -> None:
        """Forget measurements with lower numbers, of which the engine has let go."""
        done = bisect_right(self._parts, before, key=lambda one: one.first + one.length)
        del self._parts[:done]
