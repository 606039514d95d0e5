"""Backups are complete, consistent and verified; what is damaged or cut off is named."""

import json
import shutil
import sqlite3
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

from multiradar.errors import ConfigurationError, DamageError, InputError, JournalError
from multiradar.storage import backup as backups
from multiradar.storage import full_disk
from multiradar.storage.backup import (
    MANIFEST,
    Backup,
    copy_backup,
    read_backup,
    verify_backup,
    write_backup,
)
from multiradar.storage.output_folder import new_folder
from multiradar.storage.snapshots import SnapshotFolder
from multiradar.storage.sqlite import sqlite_file
from multiradar.storage.sqlite.sqlite_file import file_size, open_database
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from support.inputs.journal_entries import entry
from unit.storage.test_verification import (
    ENTRIES,
    FINGERPRINT,
    _add_snapshot,
    _flip,
    _tamper,
    _tip,
    _writing,
    _written,
)

EXTRA = {"sensors.toml": b"# none\n"}


def _backup(path: Path, out: Path) -> Backup:
    with new_folder(out) as folder:
        return write_backup(path, folder, EXTRA, time_s=5.0, version="1.2.3")


def _state(folder: Path) -> Path:
    path = folder / "state" / "journal.sqlite"
    journal = _written(path)
    _add_snapshot(path, journal, 30)
    journal.close()
    return path


def _content(path: Path) -> list[object]:
    journal = SqliteJournal(path, FINGERPRINT)
    try:
        return [
            *journal.read(0), *journal.quarantined(0, 1000), journal.counts(), journal.skipped(),
            journal.find("key 11"),
        ]  # fmt: skip
    finally:
        journal.close()


def test_a_restored_journal_has_the_content_of_the_first(tmp_path: Path) -> None:
    path, out, state = _state(tmp_path), tmp_path / "backup", tmp_path / "restored"
    made = _backup(path, out)
    assert made == read_backup(out)
    assert (made.entries, made.fingerprint, made.time_s) == (ENTRIES, FINGERPRINT, 5.0)
    assert made.snapshot == "000000000030.snapshot"
    assert verify_backup(out).damage == ()
    with new_folder(state) as folder:
        copy_backup(out, folder)
    assert (state / "sensors.toml").read_bytes() == EXTRA["sensors.toml"]
    assert not (state / MANIFEST).exists()
    (snapshot,) = SnapshotFolder(state / "journal.sqlite").files()
    assert SnapshotFolder(state / "journal.sqlite").read(snapshot).position.sequence == 30
    assert _content(state / "journal.sqlite") == _content(path)
    # The backup is as it was.
    assert verify_backup(out).damage == ()


@pytest.mark.slow
def test_backups_beside_a_service_have_all_that_was_acknowledged(tmp_path: Path) -> None:
    path = tmp_path / "state" / "journal.sqlite"
    journal = _written(path)
    number = 0
    with _writing(journal, path) as state:
        while state.written < ENTRIES + 600:
            acknowledged = state.written
            out = tmp_path / f"backup-{number}"
            made = _backup(path, out)
            assert made.entries >= acknowledged
            assert verify_backup(out).entries == made.entries
            number += 1
    journal.close()
    expected = _content(path)
    assert _content(out / "journal.sqlite")[: made.entries] == expected[: made.entries]


def test_two_backups_at_once_are_both_complete(tmp_path: Path) -> None:
    path = _state(tmp_path)
    outs = [tmp_path / name for name in ("one", "two")]
    threads = [threading.Thread(target=_backup, args=(path, out)) for out in outs]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [verify_backup(out).damage for out in outs] == [(), ()]


def test_a_killed_service_is_backed_up_with_its_log(tmp_path: Path) -> None:
    running = tmp_path / "running" / "journal.sqlite"
    journal = _written(running)
    killed = tmp_path / "killed" / "journal.sqlite"
    shutil.copytree(running.parent, killed.parent)
    journal.close()
    assert _backup(killed, tmp_path / "backup").entries == ENTRIES
    assert _content(tmp_path / "backup" / "journal.sqlite") == _content(running)


def test_a_damaged_state_gives_no_backup_and_names_the_entry(tmp_path: Path) -> None:
    path, out = _state(tmp_path), tmp_path / "backup"
    _tamper(path, "UPDATE entry SET source = 'x' WHERE sequence = 12")
    with pytest.raises(DamageError, match=r"state/journal\.sqlite: entry 12 of the journal is dam"):
        _backup(path, out)
    assert sorted(tmp_path.iterdir()) == [path.parent]


def test_a_damaged_snapshot_is_replaced_by_the_one_before(tmp_path: Path) -> None:
    path = _state(tmp_path)
    journal = SqliteJournal(path, FINGERPRINT)
    _flip(_add_snapshot(path, journal, 38), 300)
    journal.close()
    assert _backup(path, tmp_path / "backup").snapshot == "000000000030.snapshot"
    for file in SnapshotFolder(path).files():
        file.unlink()
    assert _backup(path, tmp_path / "without").snapshot is None


def test_a_journal_without_its_end_gives_no_backup(tmp_path: Path) -> None:
    path = _state(tmp_path)
    longer = tmp_path / "longer" / "journal.sqlite"
    _written(longer, 60).close()
    shutil.copy(_tip(longer), _tip(path))
    with pytest.raises(JournalError, match="60 entries were acknowledged, but it contains only 40"):
        _backup(path, tmp_path / "backup")
    assert not (tmp_path / "backup").exists()


def test_a_disk_without_room_for_the_copy_is_named_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = _state(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=1000))
    with pytest.raises(InputError, match=r"a backup needs \d+ MB, but the disk has only 0 MB left"):
        _backup(path, tmp_path / "backup")
    assert sorted(tmp_path.iterdir()) == [path.parent]


def test_the_rows_of_the_snapshot_need_room_as_well(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = _state(tmp_path)
    (rows,) = SnapshotFolder(path).path.glob("*.rows")
    made = _backup(path, tmp_path / "backup")
    copied = sum(one.octets for name, one in made.files.items() if name not in EXTRA)
    tip = file_size(_tip(path))
    monkeypatch.setattr(
        shutil, "disk_usage", lambda _: SimpleNamespace(free=copied - tip - rows.stat().st_size)
    )
    with pytest.raises(InputError, match=r"a backup needs \d+ MB"):
        _backup(path, tmp_path / "other")


@pytest.mark.parametrize("entries", [60, ENTRIES])
def test_a_snapshot_that_the_journal_does_not_continue_is_not_copied(
    tmp_path: Path, entries: int
) -> None:
    """After `accept` or a restored backup it is past the end, or of other entries."""
    path, out = _state(tmp_path), tmp_path / "backup"
    other = _written(tmp_path / "other" / "journal.sqlite", entries, size=901)
    _add_snapshot(path, other, entries - 1)
    other.close()
    assert _backup(path, out).snapshot == "000000000030.snapshot"
    assert verify_backup(out).damage == ()
    assert verify_backup(out).snapshots == 1


def test_a_disk_that_fills_up_meanwhile_keeps_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, out = _state(tmp_path), tmp_path / "backup"

    def on_small_disk(file: Path, mode: str) -> sqlite3.Connection:
        connection = open_database(file, mode)
        if mode == "rwc":
            connection.execute("PRAGMA max_page_count=5")
        return connection

    monkeypatch.setattr(sqlite_file, "open_database", on_small_disk)
    monkeypatch.setattr(full_disk, "_lacks_space", lambda _: True)
    with pytest.raises(InputError, match=r"backup: cannot write: No space left .* was kept"):
        _backup(path, out)
    assert sorted(tmp_path.iterdir()) == [path.parent]


@pytest.mark.parametrize(("version", "advice"), [(1, "migrate it"), (4, "use the multiradar")])
def test_a_journal_of_another_format_says_what_reads_it(
    tmp_path: Path, version: int, advice: str
) -> None:
    path = _state(tmp_path)
    _tamper(path, f"UPDATE header SET format_version = {version}")
    with pytest.raises(ConfigurationError, match=f"of format 2, was {version}; {advice}"):
        _backup(path, tmp_path / "backup")


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


@pytest.mark.parametrize("name", ["journal.sqlite", "journal.sqlite-tip", "sensors.toml", "*.rows"])
def test_every_damaged_file_of_a_backup_is_named(tmp_path: Path, name: str) -> None:
    out = tmp_path / "backup"
    _backup(_state(tmp_path), out)
    (file,) = out.rglob(name)
    content = file.read_bytes()
    _flip(file, len(content) // 2)
    assert f"{file}: damaged: the SHA-256 does not match" in verify_backup(out).damage[0]
    file.write_bytes(content[:-5])
    damage = verify_backup(out).damage[0]
    assert f"{file}: expected {len(content)} octets, was {len(content) - 5}" in damage
    file.unlink()
    assert f"{file}: No such file" in verify_backup(out).damage[0]
    file.write_bytes(content)
    assert verify_backup(out).damage == ()


def test_a_damaged_entry_of_a_backup_is_named_beside_its_file(tmp_path: Path) -> None:
    out = tmp_path / "backup"
    _backup(_state(tmp_path), out)
    _tamper(out / "journal.sqlite", "UPDATE entry SET source = 'x' WHERE sequence = 12")
    damage = verify_backup(out).damage
    assert any("entry 12 of the journal is damaged" in one for one in damage)


def test_the_list_of_a_backup_is_checked_itself(tmp_path: Path) -> None:
    out = tmp_path / "backup"
    _backup(_state(tmp_path), out)
    manifest = out / MANIFEST
    text = manifest.read_text()
    other = text.replace('"entries": 40', '"entries": 41')
    for content in (other, text[:-30], "[]", "{}", "", "[" * 5000):
        manifest.write_text(content)
        with pytest.raises(InputError, match=r"backup\.json: damaged"):
            read_backup(out)
    manifest.write_text(text.replace('"format": 1', '"format": 2'))
    with pytest.raises(InputError, match="expected a backup of format 1, was 2"):
        read_backup(out)
    manifest.unlink()
    with pytest.raises(InputError, match="expected the output of `backup`, was the state of"):
        read_backup(out)


def test_no_file_is_written_outside_of_the_restored_folder(tmp_path: Path) -> None:
    out = tmp_path / "backup"
    made = _backup(_state(tmp_path), out)
    files = {**made.files, "../outside": made.files["sensors.toml"]}
    wrong = Backup(**{name: getattr(made, name) for name in made.__slots__} | {"files": files})
    (out / MANIFEST).write_text(backups._text(wrong))
    assert "../outside" in json.loads((out / MANIFEST).read_text())["files"]
    with pytest.raises(InputError, match="leads outside the backup folder"):
        read_backup(out)


def test_a_copy_of_a_backup_that_differs_is_not_used(tmp_path: Path) -> None:
    out, state = tmp_path / "backup", tmp_path / "restored"
    _backup(_state(tmp_path), out)
    _flip(out / "sensors.toml", 1)
    with pytest.raises(DamageError, match=r"sensors\.toml"), new_folder(state) as folder:
        copy_backup(out, folder)
    assert not state.exists()


def test_a_restored_journal_continues(tmp_path: Path) -> None:
    out, state = tmp_path / "backup", tmp_path / "restored"
    _backup(_state(tmp_path), out)
    with new_folder(state) as folder:
        copy_backup(out, folder)
    journal = SqliteJournal(state / "journal.sqlite", FINGERPRINT)
    assert journal.append([entry(ENTRIES)]) == [ENTRIES + 1]
    journal.close()


def test_a_snapshot_removed_while_it_is_measured_has_no_octets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # It was there when the folder was listed.
    monkeypatch.setattr(Path, "exists", lambda _path: True)
    assert file_size(tmp_path / "000000000145.snapshot") == 0
