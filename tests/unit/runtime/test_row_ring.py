"""Rows are copied for a snapshot while others are appended."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import StateError
from multiradar.runtime.row_ring import Cut, RowRing, rows_of_cuts

CAPACITY = 1600


class _Busy(RowRing):
    """To all tables rows are appended while one is read."""

    def __init__(self, share: float, tables: "list[_Busy]") -> None:
        super().__init__(CAPACITY, np.dtype(np.int64))
        self._share, self._tables = share, tables
        tables.append(self)
        self.add(CAPACITY)

    def add(self, count: int) -> None:
        self.append(np.arange(self.appended, self.appended + count))

    def rows(self, first: int, end: int) -> NDArray[Any]:
        for table in self._tables:
            table.add(int(self._share * (end - first)))
        return super().rows(first, end)


def _cuts(share: float) -> dict[str, Cut]:
    tables: list[_Busy] = []
    cuts = {name: Cut.of(_Busy(0.0, tables), 0) for name in ("updates", "plots")}
    for table in tables:
        table._share = share
    return cuts


def test_all_rows_are_copied_although_the_oldest_are_overwritten_meanwhile() -> None:
    cuts = _cuts(0.4)
    for rows in rows_of_cuts(cuts).values():
        np.testing.assert_array_equal(rows, np.arange(CAPACITY))
    # While they were copied, more rows came than a copy of one table after the other survives.
    assert all(cut.log.appended > 1.5 * CAPACITY for cut in cuts.values())


def test_rows_that_come_faster_than_they_are_copied_are_an_error() -> None:
    with pytest.raises(StateError, match="no longer retained"):
        rows_of_cuts(_cuts(0.7))


@pytest.mark.parametrize("kind", ["i8", [("track_id", "i8"), ("time_s", "f8"), ("note", "S3")]])
@pytest.mark.parametrize("first", [0, 3, 7, 700])
def test_rows_are_read_as_they_were_written_round_the_end(kind: Any, first: int) -> None:
    ring, kept = RowRing(8, np.dtype(kind)), np.arange(first, first + 8)
    given = kept.astype(np.dtype(kind)) if kind == "i8" else np.empty(8, np.dtype(kind))
    for place, number in enumerate(kept if kind != "i8" else ()):
        given[place] = (number, number / 4.0, f"{number % 100}")
    ring.refill(first, given[:5])
    ring.append(given[5:])
    np.testing.assert_array_equal(ring.rows(first, first + 8), given)
    assert ring.last(3).tolist() == given[-3:].tolist()


def test_rows_of_an_older_type_are_converted() -> None:
    ring = RowRing(8, np.dtype([("time_s", "f8"), ("number", "i8")]))
    rows = np.array([(1.5, 2), (2.5, 3)], [("time_s", ">f8"), ("number", ">i8")])
    ring.refill(0, rows)
    assert ring.rows(0, 2).tolist() == [(1.5, 2), (2.5, 3)]
