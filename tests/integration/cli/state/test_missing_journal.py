"""A start with files that are missing or damaged stops, and says what to do."""

from pathlib import Path

import pytest

from multiradar.errors import InputError
from multiradar.toolbox.operation.backups import backup
from support.processes.served import SENSORS
from support.scenarios.recorded_scene import command


def test_snapshots_without_their_journal_stop_the_start(tmp_path: Path) -> None:
    sensors, state = tmp_path / "sensors.toml", tmp_path / "state"
    sensors.write_text(SENSORS)
    snapshots = state / "journal.sqlite-snapshots"
    snapshots.mkdir(parents=True)
    (snapshots / "000000000012.snapshot").write_bytes(b"of an earlier start")
    for _ in range(2):
        done = command("serve", "--port", 0, "--no-zenoh", "--state", state, "--sensors", sensors)
        assert done.returncode == 1
        assert f"{state}/journal.sqlite: missing or empty, although other files" in done.stderr
        assert "(journal.sqlite-snapshots); restore all files journal.sqlite*" in done.stderr


def test_a_damaged_file_is_named_with_what_to_do(tmp_path: Path) -> None:
    sensors, state = tmp_path / "sensors.toml", tmp_path / "state"
    sensors.write_text(SENSORS)
    state.mkdir()
    tip = state / "journal.sqlite-tip"
    tip.write_bytes(b"12 no tip")
    done = command("serve", "--port", 0, "--no-zenoh", "--state", state, "--sensors", sensors)
    assert done.returncode == 1
    assert done.stderr == (
        f"multiradar: {tip}: damaged; copy the state and check it with `multiradar verify`, or "
        "restore a backup\n"
    )
    assert tip.read_bytes() == b"12 no tip"


def test_a_folder_that_is_no_state_is_named_before_the_sensors_file(tmp_path: Path) -> None:
    """Regression: a missing sensors.toml was named."""
    with pytest.raises(InputError, match=r"other/journal.sqlite"):
        backup(tmp_path / "other", tmp_path / "out")
    assert not (tmp_path / "out").exists()
