"""Numbering of sensors and aircraft found while reading."""

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.errors import LayoutError
from multiradar_converters.vid import _kernels

_BITS_FIRST = 10


class Numbering:
    """Numbers distinct keys in order of first appearance.

    Parameters
    ----------
    what : str
        Name of the numbered things, for the error.
    count_max : int
        Maximum number of keys.
    """

    def __init__(self, what: str, count_max: int) -> None:
        self._what = what
        self._count_max = count_max
        self._bits = _BITS_FIRST
        self._known = 0
        self._keys = np.full(1 << self._bits, -1, dtype=np.int64)
        self._numbers = np.zeros(1 << self._bits, dtype=np.int64)

    def number(self, keys: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the number of each key.

        Raises
        ------
        LayoutError
            There are more keys than the maximum.
        """
        numbers = np.empty(len(keys), dtype=np.int64)
        done = 0
        while done < len(keys):
            # At most half full, so that searches are short.
            limit = 1 << (self._bits - 1)
            count, self._known = _kernels.intern(
                keys[done:], self._bits, self._keys, self._numbers, self._known, limit,
                numbers[done:],
            )  # fmt: skip
            done += count
            if self._known > self._count_max:
                msg = f"expected at most {self._count_max} {self._what}, found more"
                raise LayoutError(msg)
            if done < len(keys):
                self._grow()
        return numbers

    def keys(self) -> NDArray[np.int64]:
        """Return the keys in the order of their numbers."""
        taken = self._keys >= 0
        out = np.empty(self._known, dtype=np.int64)
        out[self._numbers[taken]] = self._keys[taken]
        return out

    def __len__(self) -> int:
        return self._known

    def _grow(self) -> None:
        keys = self.keys()
        self._bits += 1
        self._keys = np.full(1 << self._bits, -1, dtype=np.int64)
        self._numbers = np.zeros(1 << self._bits, dtype=np.int64)
        out = np.empty(len(keys), dtype=np.int64)
        _kernels.intern(keys, self._bits, self._keys, self._numbers, 0, len(keys) + 1, out)
