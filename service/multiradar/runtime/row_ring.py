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
        # Rows below `_claimed` − capacity may be overwritten at any moment.
        self._claimed = 0

    @property
    def appended(self) -> int:
        """Rows appended so far."""
        return self._appended

    @property
    def capacity(self) -> int:
        """Rows retained at most."""
        return len(self._rows)

    @property
    def oldest(self) -> int:
        """Number of the oldest row that is retained."""
        return max(self._claimed - len(self._rows), 0)

    def append(self, rows: NDArray[Any]) -> None:
        """Add rows, in order."""
        kept = rows[-len(self._rows) :]
        self._claimed = self._appended + len(rows)
        self._rows[np.arange(self._claimed - len(kept), self._claimed) % len(self._rows)] = kept
        self._appended = self._claimed

    def rows(self, first: int, end: int) -> NDArray[Any]:
        """Return a copy of the rows first…end; see `RowLog.rows`."""
        begin, count = first % len(self._rows), end - first
        beyond = max(begin + count - len(self._rows), 0)
        found = np.concatenate([self._rows[begin : begin + count], self._rows[:beyond]])
        if first < self.oldest:
            raise StateError(f"row {first} of {self._appended} is no longer retained")
        return found

    def last(self, count: int) -> NDArray[Any]:
        """Return a copy of the last rows, at most so many."""
        first = max(self._appended - min(count, len(self._rows)), 0)
        return self.rows(first, self._appended)

    def refill(self, first: int, rows: NDArray[Any]) -> None:
        """Replace the content; see `RowLog.refill`."""
        self._appended = self._claimed = first
        self.append(rows.astype(self._rows.dtype, casting="equiv"))
