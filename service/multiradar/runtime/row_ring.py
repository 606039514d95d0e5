"""The last rows of a table, in a ring of fixed size; and what a snapshot needs of such rings."""

from collections.abc import Mapping
from itertools import zip_longest
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import StateError
from multiradar.storage.snapshots import joined_rows

#: Of a full history this fraction is copied at once, because the next rows overwrite it.
_AT_RISK = 16


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


class Cut(NamedTuple):
    """The rows first…end of a table, of which the first were copied."""

    log: RowLog
    first: int
    copied: NDArray[Any]
    end: int

    @classmethod
    def of(cls, log: RowLog, first: int) -> "Cut":
        """Return the rows from a number on; those that the next rows may overwrite are copied."""
        at_risk = log.appended - log.capacity + _block(log)
        copied = log.rows(first, min(max(at_risk, first), log.appended))
        return cls(log, first, copied, log.appended)

    @property
    def blocks(self) -> list[tuple[int, int]]:
        """The first row and the end of parts of what is not yet copied, oldest first."""
        step = _block(self.log)
        begins = range(self.first + len(self.copied), self.end, step)
        return [(begin, min(begin + step, self.end)) for begin in begins]


def rows_of_cuts(cuts: Mapping[str, Cut]) -> dict[str, NDArray[Any]]:
    """Return all rows of each table, copied while other rows are appended.

    Blocks of all tables are copied in turns, the oldest rows first: they are overwritten first.

    Raises
    ------
    StateError
        If rows were overwritten meanwhile.
    """
    parts = {name: [cut.copied] for name, cut in cuts.items()}
    for blocks in zip_longest(*(cut.blocks for cut in cuts.values())):
        for (name, cut), block in zip(cuts.items(), blocks, strict=True):
            if block is not None:
                parts[name].append(cut.log.rows(*block))
    return {name: joined_rows(copied) for name, copied in parts.items()}


def _block(log: RowLog) -> int:
    return max(log.capacity // _AT_RISK, 1)


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
        store(self._rows, self._claimed - len(kept), kept)
        self._appended = self._claimed

    def rows(self, first: int, end: int) -> NDArray[Any]:
        """Return a copy of the rows first…end; see `RowLog.rows`."""
        begin, count = first % len(self._rows), end - first
        beyond = max(begin + count - len(self._rows), 0)
        octets = _records(self._rows)
        found = np.concatenate([octets[begin : begin + count], octets[:beyond]])
        if first < self.oldest:
            raise StateError(f"row {first} of {self._appended} is no longer retained")
        return found.view(self._rows.dtype)

    def last(self, count: int) -> NDArray[Any]:
        """Return a copy of the last rows, at most so many."""
        first = max(self._appended - min(count, len(self._rows)), 0)
        return self.rows(first, self._appended)

    def refill(self, first: int, rows: NDArray[Any]) -> None:
        """Replace the content; see `RowLog.refill`."""
        self._appended = self._claimed = first
        self.append(rows.astype(self._rows.dtype, casting="equiv", copy=False))


def store(ring: NDArray[Any], first: int, values: NDArray[Any]) -> None:
    """Write values to their places in a ring, which holds them all.

    Parameters
    ----------
    ring : (capacity, ...) ndarray
        Written to.
    first : int
        Number of the first value.
    values : (n, ...) ndarray
        At most as many as the capacity.
    """
    if values.dtype == ring.dtype:
        ring, values = _records(ring), _records(values)
    begin = first % len(ring)
    until_end = min(len(values), len(ring) - begin)
    ring[begin : begin + until_end] = values[:until_end]
    ring[: len(values) - until_end] = values[until_end:]


def _records(rows: NDArray[Any]) -> NDArray[Any]:
    # Records of several fields as octets: numpy copies them five times as fast.
    return rows.view(f"V{rows.dtype.itemsize}") if rows.dtype.names else rows
