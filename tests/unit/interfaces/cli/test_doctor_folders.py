"""`doctor` sees what the service needs besides the journal: its snapshots and its history."""

import os
import shutil
from pathlib import Path
from typing import NamedTuple

import pytest

from multiradar.errors import InputError
from multiradar.runtime.recorded.history_files import HistoryFolder, HistoryState
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.snapshots import Position
from multiradar.storage.sqlite.shortening import digests_of, remove_until
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.toolbox.operation import history_health
from multiradar.toolbox.operation.findings import Finding, Level
from multiradar.toolbox.operation.history_health import check_history
from multiradar.toolbox.operation.state_health import check_disk, verified
from support.inputs.journal_entries import entry

_MIB, _GIB = 1 << 20, 1 << 30


class _Disk(NamedTuple):
    total: int
    used: int
    free: int


@pytest.fixture(name="journal")
def _journal(tmp_path: Path) -> Path:
    """A journal of 10 entries."""
    path = tmp_path / "state" / "journal.sqlite"
    journal = SqliteJournal(path, "fingerprint")
    journal.append([entry(number) for number in range(10)])
    journal.close()
    return path


def _history(path: Path, sequence: int, digest: str) -> Path:
    folder = HistoryFolder(path, dict)
    folder.write({}, HistoryState(0, sequence, digest, {"tracks": 1}))
    folder.close()
    return path


def _snapshots(journal: Path, *why_none: str) -> Finding:
    _, findings = verified(journal, lambda _done, _total: None, no_snapshots=why_none)
    return next(one for one in findings if one.check == "snapshots")


def _deny(monkeypatch: pytest.MonkeyPatch, denied: Path) -> None:
    real = os.access

    def access(path: Path, mode: int) -> bool:
        return Path(path) != denied and real(path, mode)

    monkeypatch.setattr(os, "access", access)


def _on_disk(monkeypatch: pytest.MonkeyPatch, free: int, *, is_own: bool) -> None:
    disk = _Disk(1000 * _MIB, 1000 * _MIB - free, free)
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: disk)
    monkeypatch.setattr(history_health, "_on_one_disk", lambda _one, _other: not is_own)


@pytest.mark.parametrize("is_file", [False, True])
def test_a_snapshot_folder_that_cannot_be_written_is_named(
    journal: Path, monkeypatch: pytest.MonkeyPatch, is_file: bool
) -> None:
    folder = journal.with_name("journal.sqlite-snapshots")
    assert "stop the service with SIGTERM" in _snapshots(journal).advice
    if is_file:
        folder.write_text("a file")
    else:
        folder.mkdir()
        _deny(monkeypatch, folder)
    found = _snapshots(journal)
    reason = "is a file, not a folder" if is_file else "not writable by this user"
    assert (found.level, found.text) == (
        Level.WARNING, f"{folder}: {reason}: no snapshot can be written",
    )  # fmt: skip
    assert "SIGTERM" not in found.advice
    assert ("move this file" if is_file else "user of the service") in found.advice
    disabled = _snapshots(journal, "the interval is 0")
    assert (disabled.level, "the interval is 0" in disabled.text) == (Level.OK, True)


def test_a_history_belongs_to_this_journal(journal: Path, tmp_path: Path) -> None:
    digest = digests_of(journal, [7])[7].hex()
    own = check_history(_history(tmp_path / "own", 7, digest), journal, RuntimeLimits())
    assert own.level is Level.OK, own
    assert "covers entries up to 7" in own.text
    empty = check_history(_history(tmp_path / "empty", 0, ""), journal, RuntimeLimits())
    assert empty.level is Level.OK, empty
    for sequence, text in ((6, "belongs to another journal"), (11, "but the journal ends with")):
        folder = _history(tmp_path / f"{sequence}", sequence, digest)
        found = check_history(folder, journal, RuntimeLimits())
        assert (found.level, text in found.text) == (Level.ERROR, True), found
        assert "choose" in found.advice
        absent = check_history(folder, tmp_path / "none" / "journal.sqlite", RuntimeLimits())
        assert absent.level is Level.ERROR, absent


def test_a_history_that_does_not_exist_yet_is_made_by_the_service(
    journal: Path, tmp_path: Path
) -> None:
    found = check_history(tmp_path / "history", journal, RuntimeLimits())
    assert (found.level, "created at the first start" in found.text) == (Level.OK, True)
    assert not (tmp_path / "history").exists()
    without = check_history(tmp_path / "absent" / "history", journal, RuntimeLimits())
    assert (without.level, without.text) == (Level.ERROR, f"{tmp_path / 'absent'}: no such folder")


def test_a_folder_that_is_no_history_or_not_writable_is_an_error(
    journal: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path / "other"
    other.mkdir()
    (other / "file").write_text("")
    with pytest.raises(InputError, match="not the history of a service"):
        check_history(other, journal, RuntimeLimits())
    assert _checked(other / "file", journal).text.endswith("is a file, not a folder")
    digest = digests_of(journal, [7])[7].hex()
    own = _history(tmp_path / "own", 7, digest)
    _deny(monkeypatch, own)
    assert _checked(own, journal).text == f"{own}: not writable by this user"


def _checked(folder: Path, journal: Path) -> Finding:
    found = check_history(folder, journal, RuntimeLimits())
    assert (found.level, bool(found.advice)) == (Level.ERROR, True)
    return found


def test_a_history_that_ends_before_the_shortened_journal_is_an_error(
    journal: Path, tmp_path: Path
) -> None:
    found = digests_of(journal, [3, 4, 7])
    ends = {one: _history(tmp_path / f"{one}", one, found[one].hex()) for one in (3, 4)}
    remove_until(journal, Position(4, found[4]))
    early = _checked(ends[3], journal)
    assert early.text.endswith(
        "the history covers entries up to 3, but the journal now starts with entry 5"
    )
    assert check_history(ends[4], journal, RuntimeLimits()).level is Level.OK


@pytest.mark.parametrize(
    ("free_mib", "is_own", "level"),
    [
        (300, True, Level.OK),
        (300, False, Level.OK),
        # The disk of the journal has a check of its own.
        (40, False, Level.OK),
        (40, True, Level.WARNING),
        (39, False, Level.ERROR),
        (39, True, Level.ERROR),
    ],
)
def test_the_free_space_is_compared_with_the_limits_of_the_service(
    journal: Path, monkeypatch: pytest.MonkeyPatch, free_mib: int, is_own: bool, level: Level
) -> None:
    folder = _history(journal.parent / "history", 7, digests_of(journal, [7])[7].hex())
    _on_disk(monkeypatch, free_mib * _MIB, is_own=is_own)
    found = check_history(folder, journal, RuntimeLimits(disk_free_bytes_min=10 * _MIB))
    assert found.level is level, found
    assert f"{free_mib} MiB free, {100 - free_mib / 10:.0f}% used" in found.text
    assert ("at least 40 MiB must be free" in found.text) is (level is Level.ERROR)


def test_less_than_a_gibibyte_is_in_mebibytes(
    journal: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for free, text in ((50 * _MIB, "50 MiB free"), (3 * _GIB // 2, "1.5 GiB free")):
        monkeypatch.setattr(shutil, "disk_usage", lambda _path, free=free: _Disk(_GIB, 0, free))
        assert check_disk(journal, RuntimeLimits(), None).text.startswith(text)
