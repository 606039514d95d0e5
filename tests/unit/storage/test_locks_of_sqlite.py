"""What a service reads beside its journal leaves the locks of SQLite alone; commands share them.

Closing any descriptor of a file releases the POSIX locks of the whole process on it. Without them
the next command that writes to the journal removes the log of the running service.
"""

import json
import sqlite3
import sys
import threading
import zlib
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from multiradar.errors import JournalBusyError
from multiradar.storage.archive import archive_journal
from multiradar.storage.snapshots import Position
from multiradar.storage.sqlite import chain, shortening, sqlite_file
from multiradar.storage.sqlite.file_lock import unchanged
from multiradar.storage.sqlite.reading import journal_entries
from multiradar.storage.sqlite.shortening import digests_of, extent_of, remove_until
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.storage.verification import verify_journal
from support.inputs.journal_entries import entry
from support.processes.waiting import join, run_to_end, wait_until

# The shared lock of a connection (https://www.sqlite.org/lockingv3.html): first octet, and length.
_SHARED = (0x40000002, 510)
_TRY = """
import fcntl, sys
with open(sys.argv[1], "rb+") as file:
    try:
        fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, int(sys.argv[3]), int(sys.argv[2]))
    except BlockingIOError:
        sys.exit(7)
"""


def _is_locked(path: Path) -> bool:
    command = [sys.executable, "-S", "-c", _TRY, str(path), *map(str, _SHARED)]
    return run_to_end(command).returncode == 7


def _read_all(path: Path) -> None:
    with journal_entries(path) as (_, _, entries):
        assert list(entries)


@pytest.mark.parametrize(
    "read",
    [
        extent_of, verify_journal, _read_all,
        lambda path: archive_journal(path, path.parent / "archive"),
    ],
)  # fmt: skip
def test_reading_the_journal_of_this_process_keeps_its_locks(
    read: Callable[[Path], object], tmp_path: Path
) -> None:
    path = tmp_path / "journal.sqlite"
    journal = SqliteJournal(path, "fingerprint")
    journal.append([entry(1)])
    assert _is_locked(path)
    read(path)
    assert _is_locked(path)
    journal.close()
    assert not _is_locked(path)


# ---------------------------------------------------------------- commands beside a service


def _written(path: Path, entries: int, *, rejects: int = 0) -> Position:
    """Write entries, and return the last that can be removed."""
    journal = SqliteJournal(path, "fingerprint")
    journal.append([entry(number, rejects=rejects) for number in range(entries)])
    journal.close()
    return Position(entries - 1, digests_of(path, [entries - 1])[entries - 1])


def test_a_journal_that_another_process_has_locked_can_be_written_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A command stopped within a transaction (Ctrl-Z) ended the service for good."""
    monkeypatch.setattr(sqlite_file, "_BUSY_S", 0.01)
    path = tmp_path / "journal.sqlite"
    journal = SqliteJournal(path, "fingerprint")
    with closing(sqlite3.connect(path, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        for _ in range(2):
            with pytest.raises(JournalBusyError, match="nothing was written, retry later"):
                journal.append([entry(1)])
    assert journal.append([entry(1)]) == [1]
    journal.close()


def test_a_removal_neither_unpacks_rejected_rows_nor_removes_many_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Messages of 100 000 rejected rows each kept the journal locked for 10 s."""
    path = tmp_path / "journal.sqlite"
    until = _written(path, 8, rejects=3000)
    octets = len(chain.Columns.of(entry(1, rejects=3000)).rejects)
    removals: list[int] = []
    remove: Any = shortening.__dict__["_remove_some"]

    def counted(*given: Any) -> Any:
        removals.append(1)
        return remove(*given)

    with monkeypatch.context() as patch:
        patch.setattr(shortening, "OCTETS_MAX", 2 * octets)
        patch.setattr(shortening, "PAUSE_S", 0.0)
        patch.setattr(shortening, "_remove_some", counted)
        for name in ("_unpacked", "_packed"):
            patch.setattr(chain, name, lambda _rows: pytest.fail("it was unpacked or packed"))
        remove_until(path, until)
    assert len(removals) == 4
    journal = SqliteJournal(path, "fingerprint")
    assert len(list(journal.read(until.sequence))) == 1
    found = journal.find("key 3")
    assert found is not None
    assert found.entry.rejects == entry(3, rejects=3000).rejects
    assert journal.counts().rejected == 24_000
    journal.close()


@pytest.mark.parametrize("rejects", [0, 1, 15, 16, 17, 100_000])
def test_rejected_rows_are_counted_without_unpacking_them(rejects: int) -> None:
    packed = chain.Columns.of(entry(1, rejects=rejects)).rejects
    assert chain.rejects_count(packed) == rejects


def test_rejected_rows_of_earlier_versions_are_counted() -> None:
    rows = json.dumps([[place, "CODE", "reason", "{]"] for place in range(100)])
    assert chain.rejects_count(zlib.compress(rows.encode())) == 100


def test_a_service_that_starts_gets_its_turn_between_two_removals(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A removal took the lock again at once: a start gave up after 10 s."""
    path = tmp_path / "journal.sqlite"
    until = _written(path, 31)
    monkeypatch.setattr(shortening, "ENTRIES_MAX", 1)
    journal = SqliteJournal(path, "fingerprint")
    removing = threading.Thread(target=remove_until, args=(path, until))
    removing.start()
    turns = [0]

    def is_removing() -> bool:
        return journal.removed_until() > turns[-1] or not removing.is_alive()

    for _ in range(3):
        wait_until(is_removing, "an entry to be removed")
        with unchanged(path.with_name(f"{path.name}-tip")):
            turns.append(journal.removed_until())
    monkeypatch.setattr(shortening, "PAUSE_S", 0.0)
    join(removing)
    assert turns[-1] < until.sequence == journal.removed_until()
    journal.close()


@pytest.mark.parametrize("moment", ["is_shortened", "digest_of"])
def test_entries_that_are_removed_while_one_is_looked_up_do_not_matter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moment: str
) -> None:
    """The writer of a service stopped for good, since the entry before was missing."""
    path = tmp_path / "journal.sqlite"
    until = _written(path, 20)
    digests = digests_of(path, [4, 5])
    journal = SqliteJournal(path, "fingerprint")
    rows: Any = journal.__dict__["_rows"]
    real = getattr(rows, moment)

    def overtaken(*given: Any) -> Any:
        monkeypatch.setattr(rows, moment, real)
        found = real(*given) if moment == "is_shortened" else None
        remove_until(path, Position(5, digests[5]))
        return real(*given) if found is None else found

    monkeypatch.setattr(rows, moment, overtaken)
    if moment == "is_shortened":
        assert journal.digest(4) == digests[4]
    else:
        found = journal.find("key 4")
        assert found is not None
        assert (found.sequence, found.entry) == (5, entry(4))
    assert journal.removed_until() == 5
    remove_until(path, until)
    journal.close()
