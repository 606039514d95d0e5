"""Sorting and dealing on disk equal sorting and dealing in memory."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from multiradar_converters.vid import spool
from multiradar_converters.vid.records import POINT_WORDS, Records, pack_track, points, times
from multiradar_converters.vid.track_files import TrackFileNames, TrackWriter
from support.inputs import dumps


def scene(order: str, count: int = 5000) -> Records:
    generator = np.random.default_rng(5)
    time = np.round(np.arange(count) * 0.05, 1)
    if order == "nearly sorted":
        time = time[np.argsort(np.arange(count) + generator.uniform(0, 40, count), kind="stable")]
    elif order == "shuffled":
        time = generator.permutation(time)
    elif order == "falling":
        time = time[::-1]
    elif order == "all equal":
        time = np.full(count, 7.0)
    number = np.arange(count, dtype=np.float64)
    aircraft = generator.integers(0, 40, count)
    return points([time, number, number, number], pack_track(aircraft, aircraft % 3))


@pytest.mark.parametrize("order", ["sorted", "nearly sorted", "shuffled", "falling", "all equal"])
@pytest.mark.parametrize("merge_bytes", [1, 24 << 20], ids=["tiny pieces", "large pieces"])
def test_records_come_back_by_time_and_equal_times_keep_their_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, order: str, merge_bytes: int
) -> None:
    monkeypatch.setattr(spool, "_MERGE_BYTES", merge_bytes)
    monkeypatch.setattr(spool, "_PIECE_RECORDS_MIN", 7)
    records = scene(order)
    sorter = spool.TimeSorter(tmp_path / "sorter", POINT_WORDS, run_records=97)
    for begin in range(0, len(records), 61):
        sorter.add(records[begin : begin + 61])
    assert len(sorter) == len(records)
    found = np.concatenate(list(sorter.sorted()))
    assert np.array_equal(found, records[np.argsort(times(records), kind="stable")])
    assert not (tmp_path / "sorter").exists()


def test_nothing_sorted_is_nothing(tmp_path: Path) -> None:
    assert not list(spool.TimeSorter(tmp_path / "sorter", POINT_WORDS).sorted())


@pytest.mark.parametrize("points_max", [1, 150, 1_000_000])
def test_tracks_are_the_same_however_little_fits_in_memory(tmp_path: Path, points_max: int) -> None:
    records = scene("nearly sorted")
    buckets = spool.Buckets(tmp_path / "buckets", 1)
    for begin in range(0, len(records), 700):
        buckets.add(records[begin : begin + 700])
    buckets.close()
    out = tmp_path / "out"
    out.mkdir()
    names = TrackFileNames((26,))
    writer = TrackWriter(out, names, 1, 0.0, points_max=points_max)
    with ThreadPoolExecutor(2) as pool:
        written = writer.write(buckets, pool)
    buckets.remove()
    assert written.points.total() == len(records)
    for aircraft in range(40):
        mine = records[records[:, 4] == pack_track(np.array([aircraft]), aircraft % 3)[0]]
        mine = mine[np.argsort(times(mine), kind="stable")]
        found = dumps.read_new4(out / str(aircraft) / f"{names.stem(aircraft % 3)}.new4")
        assert np.array_equal(np.array(found), mine.view(np.float64)[:, :4])
        _, lines = dumps.read_plt(out / str(aircraft) / f"{names.stem(aircraft % 3)}.plt")
        assert len(lines) == len(mine)
        assert [line[2] for line in lines] == ["1", *["0"] * (len(mine) - 1)]
