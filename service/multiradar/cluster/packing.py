"""States of aircraft as rows of 64-bit words, to be sent and compared."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Aircraft

Integers = NDArray[np.int64]
Words = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Packing:
    """Where each column of a state is in its row of words.

    Attributes
    ----------
    columns : tuple of (int, tuple of int, str)
        Of each array of `Aircraft`: its rows for each aircraft, the shape of a row, its type.
    """

    columns: tuple[tuple[int, tuple[int, ...], str], ...]

    @classmethod
    def of(cls, aircraft: Aircraft) -> "Packing":
        """Return the packing of arrays of aircraft."""
        slots = len(aircraft.time)
        return cls(tuple((len(one) // slots, one.shape[1:], str(one.dtype)) for one in aircraft))

    @property
    def width(self) -> int:
        """Words of a state."""
        return sum(rows * int(np.prod(shape)) for rows, shape, _ in self.columns)

    def empty(self, slots: int) -> Aircraft:
        """Return arrays for aircraft whose states are unpacked before they are used."""
        return Aircraft(*(np.zeros((slots * n, *shape), kind) for n, shape, kind in self.columns))

    def pack(self, aircraft: Aircraft, slots: Integers) -> Words:
        """Return the states of slots.

        Parameters
        ----------
        aircraft : Aircraft
            The arrays.
        slots : (n,) int64
            Which aircraft.

        Returns
        -------
        (n, w) int64
            A row for each.
        """
        words = np.empty((len(slots), self.width), np.int64)
        first = 0
        for column in _columns(aircraft):
            last = first + column.shape[1]
            words[:, first:last] = column[slots]
            first = last
        return words

    def unpack(self, words: Words, aircraft: Aircraft, slots: Integers) -> None:
        """Set the states of slots, in place.

        Parameters
        ----------
        words : (n, w) int64
            As `pack` returns.
        aircraft : Aircraft
            The arrays.
        slots : (n,) int64
            Which aircraft.
        """
        first = 0
        for column in _columns(aircraft):
            last = first + column.shape[1]
            column[slots] = words[:, first:last]
            first = last


def copied(aircraft: Aircraft, into: Aircraft) -> Aircraft:
    """Return larger arrays with the states of smaller ones."""
    for new, old in zip(into, aircraft, strict=True):
        new[: len(old)] = old
    return into


# Views of the arrays that have columns, with one row of words for each aircraft.
def _columns(aircraft: Aircraft) -> list[NDArray[Any]]:
    slots = len(aircraft.time)
    return [one.reshape(slots, -1).view(np.int64) for one in aircraft if one.size]
