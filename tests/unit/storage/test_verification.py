"""Verification names every damaged file and entry, and changes nothing, also beside a service."""

import sqlite3
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from multiradar.errors import ConfigurationError, InputError, JournalError
from multiradar.state import EncodedState
from multiradar.storage.archive import archive_journal
from multiradar.storage.backup import journal_configuration, write_backup
from multiradar.storage.snapshots import Position, Snapshot, SnapshotFolder
from multiradar.storage.sqlite.growth import growth_of
from multiradar.storage.sqlite.shortening import extent_of
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.storage.verification import NAMED_MAX, verify_journal
from support.inputs.journal_entries import entry

FINGERPRINT = "a" * 64
ENTRIES = 40


def _written(path: Path, entries: int = ENTRIES, *, size: int = 900) -> SqliteJournal:
    journal = SqliteJournal(path, FINGERPRINT)
    for number in range(entries):
        journal.append([entry(number, rejects=number % 3, size=size)])
    journal.skip(7, "poison")
    return journal


def _add_snapshot(path: Path, journal: SqliteJournal, sequence: int) -> Path:
    folder = SnapshotFolder(path)
    rows = folder.write_rows("history", 0, np.arange(100.0))
    state = EncodedState({}, [np.arange(10)])
    folder.write(
        Snapshot(
            Position(sequence, journal.digest(sequence)), {}, {"engine": state}, {"history": [rows]}
        )
    )
    return folder.files()[0]


@pytest.fixture(name="path")
def _path(tmp_path: Path) -> Path:
    path = tmp_path / "journal.sqlite"
    journal = _written(path)
    _add_snapshot(path, journal, 30)
    journal.close()
    return path


def _content(path: Path) -> dict[str, bytes]:
    return {one.name: one.read_bytes() for one in path.parent.rglob("*") if one.is_file()}


def _tamper(path: Path, statements: str) -> None:
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.executescript(statements)


def _flip(path: Path, place: int) -> None:
    content = bytearray(path.read_bytes())
    content[place] ^= 4
    path.write_bytes(content)


def test_a_sound_state_is_counted_and_left_as_it_is(path: Path) -> None:
    before = _content(path)
    found = verify_journal(path)
    rejected = sum(number % 3 for number in range(ENTRIES))
    assert (found.entries, found.accepted, found.rejected) == (
        ENTRIES, sum(range(ENTRIES)), rejected,
    )  # fmt: skip
    assert (found.snapshots, found.fingerprint, found.damage) == (1, FINGERPRINT, ())
    assert _content(path) == before


def test_the_progress_ends_with_all_entries(path: Path) -> None:
    seen: list[tuple[int, int]] = []
    verify_journal(path, lambda done, total: seen.append((done, total)))
    assert seen[-1] == (ENTRIES, ENTRIES)


@pytest.mark.parametrize(
    ("statement", "named"),
    [
        ("UPDATE entry SET accepted = 99 WHERE sequence = 12", ["entry 12 of the journal is dam"]),
        ("UPDATE entry SET payload = 'text' WHERE sequence = 3", ["entry 3 of the journal is dam"]),
        # That of an entry, from which the next one is computed.
        ("UPDATE entry SET digest = x'00' WHERE sequence = 5", ["entry 5 of", "entry 6 of"]),
        ("DELETE FROM entry WHERE sequence = 9", ["entry 9 of the journal is missing"]),
        (
            "DELETE FROM entry WHERE sequence BETWEEN 9 AND 11",
            ["entries 9 to 11 of the journal are missing"],
        ),
        ("DELETE FROM entry WHERE sequence > 35", ["entry 36 of the journal is damaged: the entr"]),
        ("UPDATE head SET accepted = 1", ["the counts do not match the entries"]),
        ("UPDATE head SET digest = x'00'", ["entry 40 of the journal is damaged: not the last"]),
        ("UPDATE quarantine SET first = 0 WHERE first = 1", ["rejected rows starting at number 1"]),
        ("UPDATE skipped SET reason = 'other'", ["entry 7 of the journal is damaged: the checks"]),
        # A page of another table in its place.
        (
            "DROP TABLE skipped; CREATE TABLE skipped AS SELECT 7 sequence, NULL reason, 7 digest",
            ["entry 7 of the journal is damaged: the checksum does not match"],
        ),
        ("DELETE FROM head", ["expected one head row in the journal,"]),
        ("DELETE FROM header", ["expected one header row in the journal"]),
    ],
)
def test_damaged_entries_are_named(path: Path, statement: str, named: list[str]) -> None:
    _tamper(path, statement)
    damage = verify_journal(path).damage
    assert len(damage) >= len(named)
    for expected in named:
        assert any(expected in one and str(path) in one for one in damage), damage


def test_the_growth_of_a_journal_without_its_last_entry_is_unknown(path: Path) -> None:
    """Regression: `doctor` ended in a TypeError."""
    _tamper(path, "DELETE FROM entry WHERE sequence = 40")
    with pytest.raises(JournalError, match="entry 40 of the journal is damaged: the entry is miss"):
        growth_of(path)


def test_a_damaged_entry_does_not_hide_another_and_many_are_counted(path: Path) -> None:
    _tamper(path, "UPDATE entry SET source = 'x' WHERE sequence IN (4, 20)")
    damage = verify_journal(path).damage
    assert [one.split("entry ")[1].split()[0] for one in damage] == ["4", "20"]
    _tamper(path, "UPDATE entry SET source = 'x'")
    damage = verify_journal(path).damage
    assert len(damage) == NAMED_MAX + 1
    assert f"{ENTRIES - NAMED_MAX} further entries are damaged" in damage[-1]


def test_a_damaged_page_is_named_with_its_place(path: Path) -> None:
    for page in range(1, path.stat().st_size // 4096):
        _flip(path, page * 4096)
        damage = verify_journal(path).damage
        assert any(f"(byte {page * 4096})" in one for one in damage), (page, damage)
        _flip(path, page * 4096)


def test_a_file_that_ends_early_is_damaged(path: Path) -> None:
    content = path.read_bytes()
    for size in (len(content) // 2, len(content) - 4096, 100):
        path.write_bytes(content[:size])
        assert verify_journal(path).damage, size


def _tip(path: Path) -> Path:
    return path.with_name(f"{path.name}-tip")


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda path: _tip(path).unlink(), "journal.sqlite-tip: missing"),
        (lambda path: _flip(_tip(path), 30), "journal.sqlite-tip: damaged"),
        (lambda path: _flip(SnapshotFolder(path).files()[0], 200), "30.snapshot: damaged"),
        (lambda path: next(SnapshotFolder(path).path.glob("*.rows")).unlink(), ".rows: No such"),
    ],
)
def test_damaged_files_are_named(path: Path, change: Callable[[Path], None], named: str) -> None:
    change(path)
    (damage,) = verify_journal(path).damage
    assert named in damage


def test_a_journal_that_lost_its_end_lacks_acknowledged_entries(path: Path) -> None:
    acknowledged = _tip(path).read_bytes()
    shorter = path.with_name("shorter") / path.name
    shorter.parent.mkdir()
    _written(shorter, 20).close()
    _tip(shorter).write_bytes(acknowledged)
    (damage,) = verify_journal(shorter).damage
    assert "40 entries were acknowledged, but it contains only 20" in damage


def test_a_snapshot_of_another_journal_is_named(path: Path) -> None:
    other = path.with_name("other") / path.name
    other.parent.mkdir()
    _written(other, 20, size=901).close()
    SnapshotFolder(path).path.rename(SnapshotFolder(other).path)
    (damage,) = verify_journal(other).damage
    assert "the snapshot refers to entry 30, which is not in the journal" in damage
    longer = path.with_name("longer") / path.name
    longer.parent.mkdir()
    _written(longer, ENTRIES, size=901).close()
    SnapshotFolder(other).path.rename(SnapshotFolder(longer).path)
    (damage,) = verify_journal(longer).damage
    assert "the snapshot belongs to another journal: entry 30 differs" in damage


def test_damage_of_the_log_is_named_with_its_frame(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    journal = _written(path)
    log = path.with_name("journal.sqlite-wal")
    assert verify_journal(path).damage == ()
    killed = tmp_path / "killed"
    killed.mkdir()
    for file in (path, log, _tip(path)):
        (killed / file.name).write_bytes(file.read_bytes())
    journal.close()
    _flip(killed / log.name, 32 + 24 + 100)
    damage = verify_journal(killed / path.name).damage
    assert f"{killed / log.name}: frame 1 (byte 32)" in damage[0]


@pytest.mark.fault(23)
@pytest.mark.parametrize(
    "read",
    [
        lambda path: verify_journal(path).damage[0],
        lambda path: archive_journal(path, path.parent / "archive"),
        lambda path: write_backup(path, path.parent, {}, time_s=0.0, version="1"),
        journal_configuration,
        extent_of,
    ],
)
def test_an_empty_journal_keeps_its_log(tmp_path: Path, read: Callable[[Path], object]) -> None:
    """SQLite removed the log, with all acknowledged entries."""
    journal = _written(tmp_path / "journal.sqlite")
    killed = tmp_path / "killed" / "journal.sqlite"
    killed.parent.mkdir()
    killed.touch()
    for end in ("-wal", "-tip"):
        content = (tmp_path / f"journal.sqlite{end}").read_bytes()
        killed.with_name(f"{killed.name}{end}").write_bytes(content)
    journal.close()
    before = _content(killed)
    try:
        said = str(read(killed))
    except JournalError as error:
        said = str(error)
    assert f"{killed}: empty, although other files of this journal exist (journal.sqlite-w" in said
    assert before.items() <= _content(killed).items()


def test_a_mark_of_another_type_is_damage(path: Path) -> None:
    _tamper(path, "UPDATE skipped SET reason = x'80'")
    assert "entry 7 of the journal is damaged" in "".join(verify_journal(path).damage)


@pytest.mark.parametrize("content", [b"", b"hello"])
def test_what_is_no_journal_is_no_damage(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "journal.sqlite"
    with pytest.raises(InputError, match="no such file"):
        verify_journal(tmp_path / "absent" / "journal.sqlite")
    file.write_bytes(content or b"not a database")
    with pytest.raises(JournalError, match="not a journal"):
        verify_journal(file)


@pytest.mark.parametrize(("version", "advice"), [(1, "migrate it"), (4, "use the multiradar")])
def test_another_format_says_what_reads_it(path: Path, version: int, advice: str) -> None:
    _tamper(path, f"UPDATE header SET format_version = {version}")
    with pytest.raises(ConfigurationError, match=f"of format 2, was {version}; {advice}"):
        verify_journal(path)


@contextmanager
def _writing(journal: SqliteJournal, path: Path) -> Iterator[SimpleNamespace]:
    # Appends, and takes snapshots, until the end of the block.
    stopping, state = threading.Event(), SimpleNamespace(written=ENTRIES)

    def write() -> None:
        while not stopping.is_set():
            journal.append([entry(state.written, size=3000)])
            state.written += 1
            if state.written % 5 == 0:
                _add_snapshot(path, journal, state.written)

    thread = threading.Thread(target=write)
    thread.start()
    try:
        yield state
    finally:
        stopping.set()
        thread.join()


@pytest.mark.slow
def test_nothing_is_damaged_beside_a_service_that_writes(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    journal = _written(path)
    before = 0
    with _writing(journal, path) as state:
        # The log starts again after a thousand pages.
        while state.written < ENTRIES + 1500:
            found = verify_journal(path)
            assert found.damage == ()
            assert found.entries >= before
            before = found.entries
    journal.close()
    assert verify_journal(path).entries == state.written
