"""The last rows of a table, in a ring of fixed size; and what a snapshot needs of such rings."""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import StateError


class RowLog(Protocol):
    """Rows that are only ever appended; the last ones are retained.

    A snapshot does not carry them: it refers to files to which each snapshot adds the new rows.
    """

    @property
    def appended(self) -> int:
        """Rows appended so far."""
        ...

    @property
    def capacity(self) -> int:
        """Rows retained at most."""
        ...

    def rows(self, first: int, end: int) -> NDArray[Any]:
        """Return a copy of the rows first…end, counted from 0.

        Raises
        ------
        StateError
            If the first of them are not retained any more.
        """
        ...

    def refill(self, first: int, rows: NDArray[Any]) -> None:
        """Replace the content: these are all retained rows, counted from `first`."""
        ...


class RowRing:
    """The last rows; one thread appends, any thread reads.

    Parameters
    ----------
    rows_max : int
        Rows retained; the oldest are overwritten first.
    row_type : dtype
        Of the rows.
    """

    def __init__(self, rows_max: int, row_type: "np.dtype[Any]") -> None:
        self._rows = np.empty(rows_max, row_type)
        self._appended = 0

    @property
    def appended(self) -> int:
        """Rows appended so far."""
        return self._appended

    @property
    def capacity(self) -> int:
        """Rows retained at most."""
        return len(self._rows)

    def append(self, rows: NDArray[Any]) -> None:
        """Add rows, in order."""
        kept = rows[-len(self._rows) :]
        end = self._appended + len(rows)
        self._rows[np.arange(end - len(kept), end) % len(self._rows)] = kept
        self._appended = end

    def rows(self, first: int, end: int) -> NDArray[Any]:
        """Return a copy of the rows first…end; see `RowLog.rows`."""
        found = ring_rows(self._rows, first, end)
        require_retained(first, self)
        return found

    def last(self, count: int) -> NDArray[Any]:
        """Return a copy of the last rows, at most so many."""
        first = max(self._appended - min(count, len(self._rows)), 0)
        return self.rows(first, self._appended)

    def refill(self, first: int, rows: NDArray[Any]) -> None:
        """Replace the content; see `RowLog.refill`."""
        self._appended = first
        self.append(rows.astype(self._rows.dtype, casting="equiv"))


def ring_rows(ring: NDArray[Any], first: int, end: int) -> NDArray[Any]:
    """Return a copy of the rows first…end of a ring, whether or not they are still there."""
    begin, count = first % len(ring), end - first
    parts = ring[begin : begin + count], ring[: max(begin + count - len(ring), 0)]
    return np.concatenate(parts)


def require_retained(first: int, log: RowLog) -> None:
    """Raise StateError if rows from a number on are not all retained any more."""
    if first < log.appended - log.capacity:
        raise StateError(f"row {first} is no longer retained, of {log.appended}")
