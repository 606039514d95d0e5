"""How an SQLite file is opened, read in one view, and how its errors are told."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import quote

from multiradar.errors import JournalError, JournalFullError

SYNCHRONOUS_FULL = 2

#: How long a reader waits for SQLite to finish a recovery or checkpoint, s.
_BUSY_S = 10.0
#: The first bytes of a database file (https://www.sqlite.org/fileformat.html, section 1.3.1).
_MAGIC = b"SQLite format 3\0"


def open_database(path: Path, mode: str) -> sqlite3.Connection:
    """Open a database file; `mode` is `ro` (read) or `rwc` (write, make when absent)."""
    return sqlite3.connect(
        f"file:{quote(str(path.absolute()))}?mode={mode}",
        uri=True,
        timeout=_BUSY_S,
        isolation_level=None,
        check_same_thread=False,
    )


def refuse_other_files(path: Path) -> None:
    """Raise JournalError for a file that is there and no database.

    SQLite itself takes a file that is too short for an empty database, and writes over it.
    """
    try:
        with path.open("rb") as stream:
            begin = stream.read(len(_MAGIC))
    except FileNotFoundError:
        return
    except OSError as error:
        raise JournalError(f"{path}: {error.strerror}") from error
    if begin and begin != _MAGIC:
        raise JournalError(f"{path}: expected a journal, was another kind of file")


def set_pragma(
    connection: sqlite3.Connection, path: Path, pragma: str, value: str, expected: str | int
) -> None:
    """Set a pragma and raise JournalError if it did not take."""
    connection.execute(f"PRAGMA {pragma}={value}")
    actual = connection.execute(f"PRAGMA {pragma}").fetchone()[0]
    if actual != expected:
        raise JournalError(
            f"{path}: expected {pragma} {expected}, was {actual}; "
            "the file system cannot hold a journal"
        )


@contextmanager
def snapshot(connection: sqlite3.Connection) -> Iterator[None]:
    """Read in one view: what is read inside belongs together."""
    connection.execute("BEGIN")
    try:
        yield
    finally:
        # An error may have ended it already.
        if connection.in_transaction:
            connection.execute("ROLLBACK")


@contextmanager
def errors_told(path: Path) -> Iterator[None]:
    """Turn errors of SQLite into errors of the journal that name the file."""
    try:
        yield
    except UnicodeError as error:
        raise JournalError(f"{path}: damaged, {error}") from error
    except sqlite3.Error as error:
        name = getattr(error, "sqlite_errorname", type(error).__name__)
        if name == "SQLITE_FULL":
            raise JournalFullError(f"{path}: no room on the disk") from error
        raise JournalError(f"{path}: {error} ({name})") from error
