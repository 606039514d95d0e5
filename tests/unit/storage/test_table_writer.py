"""A table that grows piece by piece has the same bytes whatever the pieces."""

import hashlib
from collections.abc import Sequence
from pathlib import Path

import polars as pl
import pytest

from multiradar.storage import table_writer
from multiradar.storage.table_writer import TableWriter

SCHEMA = pl.Schema({"number": pl.Int64(), "name": pl.String()})


def _rows(count: int) -> pl.DataFrame:
    return pl.DataFrame(
        {"number": range(count), "name": [None if n % 5 == 0 else f"n{n}" for n in range(count)]},
        schema=SCHEMA,
    )


def _write(path: Path, rows: pl.DataFrame, sizes: Sequence[int]) -> str:
    writer = TableWriter(path, SCHEMA)
    start = 0
    turn = 0
    while start < len(rows):
        size = sizes[turn % len(sizes)]
        writer.append(rows.slice(start, size))
        start += size
        turn += 1
    writer.finish()
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_the_bytes_do_not_depend_on_the_pieces(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(table_writer, "ROW_GROUP_ROWS", 100)
    monkeypatch.setattr(table_writer, "_PIECES_MAX", 4)
    rows = _rows(1234)
    sizes = [[1], [7], [1000], [1234], [100], [99, 1, 350]]
    hashes = {_write(tmp_path / f"{n}.parquet", rows, one) for n, one in enumerate(sizes)}
    assert len(hashes) == 1
    assert pl.read_parquet(tmp_path / "0.parquet").equals(rows)


def test_nothing_appended_makes_a_table_without_rows(tmp_path: Path) -> None:
    writer = TableWriter(tmp_path / "t.parquet", SCHEMA)
    writer.append(_rows(0))
    writer.finish()
    table = pl.read_parquet(tmp_path / "t.parquet")
    assert table.schema == SCHEMA
    assert table.is_empty()


def test_nothing_but_the_table_is_left(tmp_path: Path) -> None:
    _write(tmp_path / "t.parquet", _rows(10), [3])
    assert [path.name for path in tmp_path.iterdir()] == ["t.parquet"]


def test_an_unfinished_table_is_not_there(tmp_path: Path) -> None:
    writer = TableWriter(tmp_path / "t.parquet", SCHEMA)
    writer.append(_rows(10))
    assert not (tmp_path / "t.parquet").exists()
