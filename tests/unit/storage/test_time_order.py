"""A recording out of order is put in order: every row once, ties as they were, bounded pieces."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from multiradar.storage import recording as recording_module
from multiradar.storage import time_order
from multiradar.storage.recording import Recording
from multiradar.storage.time_order import disorder_s, in_time_order
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA


def _recording(folder: Path, times: list[float]) -> Recording:
    path = folder / "measurements.parquet"
    pl.DataFrame(
        {"time_s": times, "sensor_id": ["1-1"] * len(times), "kind": ["radar"] * len(times)},
        schema_overrides={"time_s": pl.Float64},
    ).with_columns(
        pl.lit(None, dtype).alias(name)
        for name, dtype in MEASUREMENT_SCHEMA.items()
        if name not in ("time_s", "sensor_id", "kind")
    ).write_parquet(path)
    return Recording(path)


def _sorted(folder: Path, recording: Recording) -> pl.DataFrame:
    runs = folder / "runs"
    runs.mkdir()
    return pl.concat(in_time_order(recording, runs).blocks())


@pytest.mark.parametrize(
    ("times", "apart_s"),
    [
        ([1.0, 2.0, 2.0, 3.0], 0.0),
        ([5.0, 9.0, 1.0, 7.0], 8.0),
        ([5.0, float("nan"), 4.0, float("inf"), 6.0], 1.0),
        ([float("nan")], 0.0),
    ],
)
def test_disorder_is_the_maximum_lag_behind_an_earlier_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, times: list[float], apart_s: float
) -> None:
    monkeypatch.setattr(recording_module, "BLOCK_ROWS", 2)
    assert disorder_s(_recording(tmp_path, times)) == apart_s


@pytest.mark.parametrize(("run_rows", "sample_rows"), [(64, 8), (200, 64), (100_000, 8192)])
def test_rows_come_in_order_of_time_whatever_the_size_of_the_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run_rows: int, sample_rows: int
) -> None:
    for module in (recording_module, time_order):
        monkeypatch.setattr(module, "BLOCK_ROWS", 32)
    monkeypatch.setattr(time_order, "RUN_ROWS", run_rows)
    monkeypatch.setattr(time_order, "SAMPLE_ROWS", sample_rows)
    # Few different times, so that most rows have equals.
    times = np.random.default_rng(7).integers(0, 60, 1000).astype(float)
    recording = _recording(tmp_path, times.tolist())
    rows = _sorted(tmp_path, recording)
    expected = np.argsort(times, kind="stable")
    assert rows["index"].to_list() == expected.tolist()
    assert rows["time_s"].to_list() == times[expected].tolist()
    assert list(rows.columns) == [*MEASUREMENT_SCHEMA, "index"]


@pytest.mark.slow
def test_pieces_of_a_long_recording_are_bounded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (recording_module, time_order):
        monkeypatch.setattr(module, "BLOCK_ROWS", 100)
    monkeypatch.setattr(time_order, "RUN_ROWS", 1000)
    monkeypatch.setattr(time_order, "SAMPLE_ROWS", 50)
    times = np.random.default_rng(7).permutation(10_000).astype(float)
    recording = _recording(tmp_path, times.tolist())
    runs = list(time_order._write_runs(recording, tmp_path, -np.inf))
    assert len(runs) == 10
    lengths = [len(piece) for piece in time_order._merged(runs)]
    assert sum(lengths) == 10_000
    assert max(lengths) <= 2 * 50 * 10


def test_rows_without_a_time_and_the_few_of_a_wrong_clock_come_last_as_they_were(
    tmp_path: Path,
) -> None:
    times = [9000.0, float("nan"), 8999.0, 5.0, 8998.0, 1e300, 8997.0, 8996.0, 9001.0]
    rows = _sorted(tmp_path, _recording(tmp_path, times))
    assert rows["index"].to_list() == [7, 6, 4, 2, 0, 8, 1, 3, 5]


def test_sorting_changes_the_content_hash(tmp_path: Path) -> None:
    recording = _recording(tmp_path, [2.0, 1.0])
    runs = tmp_path / "runs"
    runs.mkdir()
    ordered = in_time_order(recording, runs)
    assert (recording.sorted, ordered.sorted) == (False, True)
    assert ordered.path == recording.path
    assert ordered.content_sha256() != recording.content_sha256()
