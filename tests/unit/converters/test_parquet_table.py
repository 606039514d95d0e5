"""Tables written as they arrive: their rows, and the error of what produces them."""

from collections.abc import Iterator
from pathlib import Path

import polars as pl
import pytest

from multiradar_converters.parquet_table import write_frames

SCHEMA = pl.Schema({"number": pl.Int64})


def frames(*sizes: int, error: Exception | None = None) -> Iterator[pl.DataFrame]:
    begin = 0
    for size in sizes:
        yield pl.DataFrame({"number": range(begin, begin + size)}, schema=SCHEMA)
        begin += size
    if error is not None:
        raise error


@pytest.mark.parametrize("sizes", [(), (3,), (3, 2)])
def test_a_table_has_the_rows_of_its_frames(tmp_path: Path, sizes: tuple[int, ...]) -> None:
    path = tmp_path / "table.parquet"
    assert write_frames(path, frames(*sizes), SCHEMA) == sum(sizes)
    written = pl.read_parquet(path)
    assert written.schema == SCHEMA
    assert written["number"].to_list() == list(range(sum(sizes)))


@pytest.mark.parametrize("sizes", [(), (3,)])
def test_an_error_of_the_frames_is_the_one_that_is_raised(
    tmp_path: Path, sizes: tuple[int, ...]
) -> None:
    error = ValueError("a broken dump")
    with pytest.raises(ValueError, match="a broken dump") as raised:
        write_frames(tmp_path / "table.parquet", frames(*sizes, error=error), SCHEMA)
    assert raised.value is error
