"""A table that is read by time gives the rows that a filter of the whole file gives."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest
from polars.testing import assert_frame_equal

from multiradar.errors import InputError, MissingColumnError
from multiradar.storage import time_table
from multiradar.storage.time_table import TimeTable

BLOCK = 64


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time_table, "ROW_GROUP_ROWS", BLOCK)


def written(path: Path, time_s: np.ndarray) -> pl.DataFrame:
    frame = pl.DataFrame({"time_s": time_s, "number": np.arange(len(time_s))})
    frame.write_parquet(path, row_group_size=BLOCK)
    return frame


@pytest.mark.parametrize("order", ["sorted", "nearly", "by-track", "random"])
def test_spans_are_those_of_the_whole_file(tmp_path: Path, order: str) -> None:
    generator = np.random.default_rng(5)
    # In steps of 0.5 s, so that many rows have the same time.
    time_s = np.sort(generator.integers(0, 2000, 1000) * 0.5)
    if order == "nearly":
        time_s = time_s[np.argsort(time_s + generator.uniform(0, 3, 1000), kind="stable")]
    elif order == "by-track":
        time_s = np.concatenate([time_s[track::20] for track in range(20)])
    elif order == "random":
        time_s = generator.permutation(time_s)
    frame = written(tmp_path / "table.parquet", time_s)
    table = TimeTable(tmp_path / "table.parquet", ["time_s", "number"], folder=tmp_path)
    assert table.span_s == (time_s.min(), time_s.max())
    for after_s, until_s in [
        (-np.inf, np.inf),
        (10.0, 10.5),
        (99.5, 300.0),
        (-5.0, 0.0),
        (2e3, 3e3),
    ]:
        chosen = (pl.col("time_s") > after_s) & (pl.col("time_s") <= until_s)
        wanted = frame.filter(chosen).sort("time_s", maintain_order=True)
        assert_frame_equal(table.between(after_s, until_s), wanted)


def test_few_blocks_are_in_memory(tmp_path: Path) -> None:
    written(tmp_path / "table.parquet", np.arange(1000.0))
    table = TimeTable(tmp_path / "table.parquet", ["time_s"], folder=tmp_path)
    for start_s in range(0, 990, 7):
        assert len(table.between(start_s, start_s + 5.0)) == 5
    assert len(table._blocks) == time_table.BLOCKS_MAX


def test_rows_without_a_time_are_left_out(tmp_path: Path) -> None:
    written(tmp_path / "table.parquet", np.array([np.nan, 3.0, 1.0, np.inf, 2.0]))
    table = TimeTable(tmp_path / "table.parquet", ["time_s", "number"], folder=tmp_path)
    assert table.between(-np.inf, np.inf)["number"].to_list() == [2, 4, 1]


def test_a_column_that_may_be_absent_is_null(tmp_path: Path) -> None:
    written(tmp_path / "table.parquet", np.arange(3.0))
    more = {"callsign": pl.String()}
    table = TimeTable(tmp_path / "table.parquet", ["time_s", "callsign"], more, folder=tmp_path)
    assert table.between(0.0, 5.0)["callsign"].to_list() == [None, None]


def test_errors_name_the_file(tmp_path: Path) -> None:
    path = tmp_path / "table.parquet"
    written(path, np.empty(0))
    with pytest.raises(InputError, match=r"table\.parquet: no rows"):
        TimeTable(path, ["time_s"], folder=tmp_path)
    with pytest.raises(MissingColumnError, match="range_m"):
        TimeTable(path, ["time_s", "range_m"], folder=tmp_path)
    path.write_bytes(b"PAR1 and no more")
    with pytest.raises(InputError, match=r"table\.parquet: cannot be read as Parquet"):
        TimeTable(path, ["time_s"], folder=tmp_path)
