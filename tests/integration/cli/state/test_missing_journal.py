"""A start with files that are missing or damaged stops, and says what to do."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from multiradar.errors import InputError, JournalError
from multiradar.storage.backup import journal_configuration
from multiradar.storage.sqlite.growth import growth_of
from multiradar.storage.sqlite.opening import check_acknowledged
from multiradar.storage.sqlite.reading import removed_changes
from multiradar.storage.sqlite.shortening import digests_of, extent_of, marks_of
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.toolbox.operation.backups import archive, backup, entries_of, verify
from multiradar.toolbox.operation.state_health import verified
from support.inputs.journal_entries import entry
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


# The commands, and what other commands read of a journal.
def _entries(state: Path) -> None:
    # Of `convert journal` and `migrate`.
    with entries_of(state) as (_first, _last, entries):
        list(entries)


def _doctor(state: Path) -> None:
    found, (finding, *_) = verified(state / "journal.sqlite", lambda _done, _all: None)
    assert found is None
    raise JournalError(finding.text)


_READERS: list[Callable[[Path], object]] = [
    verify, _entries, _doctor,
    lambda state: archive(state, state.parent / "archive"),
    lambda state: backup(state, state.parent / "backup"),
    *(
        lambda state, read=read: read(state / "journal.sqlite")
        for read in (
            journal_configuration, growth_of, check_acknowledged, removed_changes, extent_of,
            marks_of, lambda path: digests_of(path, [1]),
        )
    ),
]  # fmt: skip


@pytest.fixture(name="killed", scope="module")
def _killed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    running, killed = (tmp_path_factory.mktemp(name) for name in ("running", "killed"))
    journal = SqliteJournal(running / "journal.sqlite", "a" * 64)
    for number in range(20):
        journal.append([entry(number)])
    for end in ("", "-wal", "-tip"):
        shutil.copy(running / f"journal.sqlite{end}", killed)
    journal.close()
    return killed


@pytest.mark.parametrize(
    ("octets", "how"),
    [
        (None, "missing"), (0, "empty"), (1, "not a journal (only 1 of the 100 octets"),
        (15, "not a journal"), (16, "not a journal"), (99, "not a journal (only 99 of the 100 "),
    ],
)  # fmt: skip
@pytest.mark.parametrize("read", _READERS)
def test_reading_a_journal_without_its_header_keeps_its_log(
    read: Callable[[Path], object], octets: int | None, how: str, killed: Path, tmp_path: Path
) -> None:
    """Regression: SQLite deleted the log, with all entries since the last checkpoint."""
    state = tmp_path / "state"
    shutil.copytree(killed, state)
    path = state / "journal.sqlite"
    content = path.read_bytes()
    path.unlink()
    if octets is not None:
        path.write_bytes(content[:octets])
    before = {one.name: one.read_bytes() for one in state.iterdir()}
    with pytest.raises(JournalError) as raised:
        read(state)
    assert f"{path}: {how}" in str(raised.value)
    assert "(journal.sqlite-wal, journal.sqlite-tip); restore all files" in str(raised.value)
    assert {one.name: one.read_bytes() for one in state.iterdir()} == before


def test_an_absent_or_empty_journal_without_other_files_is_named(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    with pytest.raises(InputError, match=r"expected the state of `serve`, was an empty folder"):
        verify(tmp_path)
    assert verified(path, lambda _done, _all: None)[1][0].text.endswith("at the first start")
    path.touch()
    with pytest.raises(JournalError, match=r"journal.sqlite: empty; choose another file"):
        verify(tmp_path)
    assert path.read_bytes() == b""
