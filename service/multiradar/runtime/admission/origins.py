"""Journal entry, or recording, and row of the measurements that the engine still buffers."""

from bisect import bisect_right
from collections.abc import Sequence
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.state import Fields


class _Part(NamedTuple):
    # Consecutive measurements: number of the first, count, their entry, and the row of each in it
    # (None: counted from 0).
    first: int
    length: int
    origin: int
    rows: NDArray[np.int64] | None


class Origins:
    """Retains the origin of the measurements that the engine may still report as duplicates.

    The engine numbers measurements from 0 in the order of arrival.
    """

    STATE: ClassVar[Fields] = {
        "_next": int,
        "_parts": list[_Part],
    }

    def __init__(self) -> None:
        self._next = 0
        self._parts: list[_Part] = []

    def add(self, origin: int, count: int, rows: NDArray[np.int64] | None = None) -> None:
        """Record the origin of the next measurements.

        Parameters
        ----------
        origin : int
            The entry that contains them.
        count : int
            Number of measurements.
        rows : (count,) int64, optional
            Row of each in the entry; counted from 0 by default.
        """
        if count:
            self._parts.append(_Part(self._next, count, origin, rows))
            self._next += count

    def find(self, numbers: Sequence[int]) -> list[tuple[int, int]]:
        """Return the entries of measurements, and their rows in them."""
        found = []
        for number in numbers:
            part = self._parts[bisect_right(self._parts, number, key=lambda one: one.first) - 1]
            row = number - part.first
            found.append((part.origin, row if part.rows is None else int(part.rows[row])))
        return found

    def discard(self, before: int) -> None:
        """Discard measurements with lower numbers, which the engine has processed."""
        done = bisect_right(self._parts, before, key=lambda one: one.first + one.length)
        del self._parts[:done]
