"""What a service reads beside its journal leaves the locks of SQLite alone.

Closing any descriptor of a file releases the POSIX locks of the whole process on it. Without them
the next command that writes to the journal removes the log of the running service.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from multiradar.storage.archive import archive_journal
from multiradar.storage.sqlite.reading import journal_entries
from multiradar.storage.sqlite.shortening import extent_of
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.storage.verification import verify_journal
from support.inputs.journal_entries import entry
from support.processes.waiting import run_to_end

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
