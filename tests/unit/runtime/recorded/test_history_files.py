"""The files of a history: whole or absent, by time, and up to where they were written."""

import errno
from collections.abc import Mapping, Sequence
from pathlib import Path

import polars as pl
import pytest

from multiradar.errors import RequestError
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.memory.set_backs import TrackStep
from multiradar.runtime.offline.offline_job import BIASES_FILE, TRACKS_FILE
from multiradar.runtime.recorded import history_files, history_reader
from multiradar.runtime.recorded.history_files import (
    STATE_FILE,
    HistoryFolder,
    HistoryState,
    hours_of,
    read_state,
)
from multiradar.runtime.recorded.history_reader import HistoryReader
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.recording import MEASUREMENTS_FILE
from multiradar.storage.sqlite.sqlite_file import sync
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.measurements.measurement import TIME_MAX_S
from multiradar_schemas.products.bias import BIAS_SCHEMA
from support.scenarios.live_scene import sensors

TABLE = sensors()
BESIDE = {"report.json": b'{"settings": {"coast_after_s": 20}}', "sensors.toml": b"sensor = []"}


def biases(times_s: Sequence[float]) -> dict[str, pl.DataFrame]:
    """Return rows of one sensor in the order of arrival."""
    rows = pl.DataFrame({"time_s": times_s}).with_columns(
        sensor_id=pl.lit(TABLE.ids[0]), parameter=pl.lit("range_offset_m")
    )
    missing = [pl.lit(None, BIAS_SCHEMA[one]).alias(one) for one in BIAS_SCHEMA if one not in rows]
    return {BIASES_FILE: rows.with_columns(missing).select(BIAS_SCHEMA.names()).cast(BIAS_SCHEMA)}


@pytest.mark.parametrize("failing", ["report.json", "sensors.toml"])
def test_a_full_disk_leaves_no_part_of_a_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: str
) -> None:
    """An hour whose report was cut short had no past pictures, for ever."""
    folder, write = HistoryFolder(tmp_path / "history", lambda: BESIDE), Path.write_bytes

    def full(path: Path, content: bytes) -> int:
        if path.name.endswith(failing):
            write(path, content[:5])
            raise OSError(errno.EDQUOT, "Disk quota exceeded")
        return write(path, content)

    def beside() -> Mapping[str, bytes]:
        (hour,) = hours_of(folder.path)
        return {name: (hour.path / name).read_bytes() for name in BESIDE}

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="quota"):
        folder.write(biases([500.0]), HistoryState())
    monkeypatch.setattr(Path, "write_bytes", write)
    folder.write(biases([500.0]), HistoryState())
    assert beside() == BESIDE
    # Of an earlier version that was killed.
    (hours_of(folder.path)[0].path / failing).write_bytes(b"")
    folder.write(biases([600.0]), HistoryState())
    assert beside() == BESIDE
    assert not [one for one in folder.path.rglob(".*") if one.is_file()]
    folder.close()


def test_pages_across_a_step_back_have_every_row_by_time(tmp_path: Path) -> None:
    """Rows were answered by part, so that a page skipped those of the next part before its end."""
    folder = HistoryFolder(tmp_path / "history", dict)
    folder.write(biases([3500.0, 3700.0, 500.0, 600.0, 700.0, 800.0, 900.0]), HistoryState())
    folder.write(biases([450.0, 550.0, 650.0, 750.0, 850.0]), HistoryState())
    known = Knowledge(TABLE, TrackingSettings(), RuntimeLimits())
    reader = HistoryReader(folder.path, known, lambda: None, lambda: None)

    def page(since_s: float, limit: int, *, last: bool = False) -> list[float]:
        rows = reader.rows("biases", TABLE.ids[0], since_s, TIME_MAX_S, limit, last=last)
        found: list[float] = rows["time_s"].to_list()
        return found

    every = [*range(450, 901, 50), 3500.0, 3700.0]
    assert page(-TIME_MAX_S, 100) == every
    for limit in (1, 4, 10, 11):
        assert page(-TIME_MAX_S, limit) == every[:limit]
        assert page(620.0, limit) == [one for one in every if one >= 620.0][:limit]
        assert page(-TIME_MAX_S, limit, last=True) == every[-limit:]
    folder.close()


@pytest.mark.parametrize("harm", ["cut", "zeros", "unreadable"])
def test_a_damaged_part_is_an_error_of_the_service_without_its_path(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, harm: str
) -> None:
    folder = HistoryFolder(tmp_path / "history", dict)
    times_s = [500.0 + (37.7 * number) % 900.0 for number in range(2000)]
    folder.write(biases(times_s), HistoryState())
    (path,) = (folder.path / "1970-01-01T00" / BIASES_FILE).iterdir()
    content = path.read_bytes()
    if harm == "unreadable":
        path.unlink()
        path.symlink_to(path.name)
    else:
        path.write_bytes(content[:50] if harm == "cut" else bytes(4000) + content[4000:])
    known = Knowledge(TABLE, TrackingSettings(), RuntimeLimits())
    reader = HistoryReader(folder.path, known, lambda: None, lambda: None)
    for _ in range(2):
        with pytest.raises(RequestError) as found:
            reader.rows("biases", TABLE.ids[0], 0.0, 3600.0, 10)
        assert (found.value.status, found.value.code) == (503, "HISTORY_FAILED")
        assert str(found.value) == "the history cannot be read; see the log of the service"
    # The other queries of a page need not fill the log.
    (logged,) = (one.getMessage() for one in caplog.records)
    assert str(path) in logged
    folder.close()


def test_tracks_of_a_damaged_part_are_not_taken_for_none(tmp_path: Path) -> None:
    """The picture of that time was that of the memory: empty."""
    folder = HistoryFolder(tmp_path / "history", dict)
    folder.write(written([500.0], [1]), HistoryState())
    (path,) = (folder.path / "1970-01-01T00" / TRACKS_FILE).iterdir()
    path.write_bytes(path.read_bytes()[:-9])
    known = Knowledge(TABLE, TrackingSettings(), RuntimeLimits())
    reader = HistoryReader(folder.path, known, lambda: None, lambda: None)
    with pytest.raises(RequestError, match="the history cannot be read"):
        reader.at(500.0)
    folder.close()


@pytest.mark.parametrize("last", [False, True])
def test_a_part_that_was_just_removed_has_no_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, last: bool
) -> None:
    folder = HistoryFolder(tmp_path / "history", dict)
    for start_s in (100.0, 200.0, 300.0):
        folder.write(biases([start_s]), HistoryState())
    known = Knowledge(TABLE, TrackingSettings(), RuntimeLimits())
    reader = HistoryReader(folder.path, known, lambda: None, lambda: None)
    first, *_ = sorted((folder.path / "1970-01-01T00" / BIASES_FILE).iterdir())
    monkeypatch.setattr(history_reader, "check_deadline", lambda: first.unlink(missing_ok=True))
    rows = reader.rows("biases", TABLE.ids[0], 0.0, 3600.0, 10, last=last)
    assert rows["time_s"].to_list() == [200.0, 300.0]
    folder.close()


def test_a_history_begins_after_a_kill_at_its_first_octets(tmp_path: Path) -> None:
    folder = tmp_path / "history"
    folder.mkdir()
    (folder / f".{STATE_FILE}").write_text('{"form', encoding="utf-8")
    HistoryFolder(folder, dict).close()
    assert [one.name for one in folder.iterdir()] == [STATE_FILE]


def test_parts_of_a_write_whose_state_was_not_synced_are_removed_after_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a kill between the two the rows were lost: the state said that they are there."""
    path = tmp_path / "history"
    folder = HistoryFolder(path, dict)
    folder.write(biases([100.0]), HistoryState())

    def failing(synced: Path) -> None:
        if synced == path and read_state(path).write == 2:
            raise OSError(errno.EIO, "Input/output error")
        sync(synced)

    with monkeypatch.context() as patch:
        patch.setattr(history_files, "sync", failing)
        with pytest.raises(OSError, match="Input/output"):
            folder.write(biases([200.0]), HistoryState())
    assert (folder.state.write, read_state(path).write) == (1, 2)
    unlink, states = Path.unlink, list[int]()

    def observed(removed: Path) -> None:
        states.append(read_state(path).write)
        unlink(removed)

    monkeypatch.setattr(Path, "unlink", observed)
    folder.write(biases([200.0]), HistoryState())
    assert states == [1]
    assert read_state(path).write == 2
    folder.close()


def test_parts_of_a_write_whose_state_did_not_fit_are_removed_from_the_full_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = HistoryFolder(tmp_path / "history", dict)
    folder.write(biases([100.0]), HistoryState())

    def full(*_: object, **__: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    table = folder.path / "1970-01-01T00" / BIASES_FILE
    monkeypatch.setattr(Path, "write_text", full)
    for left in (2, 1):
        with pytest.raises(OSError, match="No space left"):
            folder.write(biases([200.0]), HistoryState())
        assert len(list(table.iterdir())) == left
    folder.close()


def written(times_s: Sequence[float], track_ids: Sequence[int]) -> dict[str, pl.DataFrame]:
    """Return tracks and measurements in the order of arrival."""
    measured = pl.DataFrame({"time_s": [one + 10.0 for one in times_s]})
    tracks = pl.DataFrame({"time_s": times_s, "track_id": track_ids})
    return {TRACKS_FILE: tracks, MEASUREMENTS_FILE: measured}


def test_a_history_is_written_up_to_its_last_row_also_when_it_is_opened_again(
    tmp_path: Path,
) -> None:
    """After a step back it was then the greatest time of the last write, from before the step."""
    path = tmp_path / "history"

    def reached(tables: dict[str, pl.DataFrame], *steps: TrackStep) -> float | None:
        folder = HistoryFolder(path, dict)
        folder.write(tables, HistoryState(steps=steps))
        found = folder.written_s
        folder.close()
        again = HistoryFolder(path, dict)
        assert (again.written_s, again.state.steps) == (found, folder.state.steps)
        again.close()
        return found

    assert reached({}) is None
    assert reached(written([880.0, 900.0], [1, 1])) == 900.0
    assert reached(biases([930.0])) == 900.0
    # The step is known, but not yet a row after it.
    assert reached(biases([940.0]), (1, 400.0)) == 400.0
    assert reached(written([910.0, 920.0], [1, 1]), (1, 400.0)) == 400.0
    assert reached(written([925.0, 405.0, 510.0], [1, 2, 2])) == 510.0
    assert reached(written([520.0], [2]), (2, 450.0)) == 450.0
