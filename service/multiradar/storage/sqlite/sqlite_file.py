"""Files of a journal: opening, consistent reads, copies, translation of errors."""

import errno
import os
import re
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from urllib.parse import quote

from multiradar.errors import JournalError, JournalFullError
from multiradar.storage.full_disk import is_full, space_error

SYNCHRONOUS_FULL = 2
#: What a running service writes may be read by half: damage must be found so often.
READINGS = 3

#: How long a reader waits for SQLite to finish a recovery or checkpoint, s.
_BUSY_S = 10.0
#: The first bytes of a database file (https://www.sqlite.org/fileformat.html, section 1.3.1).
_MAGIC = b"SQLite format 3\0"
#: Pages that are copied at once: 4 MiB, between which other threads and writers have their turn.
_STEP_PAGES = 1024
#: Octets of a file that are written again at once.
_CHUNK_OCTETS = 1 << 20
_PAGE = re.compile(r"page (\d+)", re.IGNORECASE)


def open_database(path: Path, mode: str) -> sqlite3.Connection:
    """Open a database file.

    Parameters
    ----------
    path : Path
        The file.
    mode : str
        `ro` (read), `rw`, `rwc` (create when absent), or `ro&immutable=1` for a file that no other
        process changes: its folder is not written to either.

    Raises
    ------
    JournalError
        It is to be read and is empty, but has a write-ahead log, which SQLite would remove: also
        of a file of one octet.
    """
    log = path.with_name(f"{path.name}-wal")
    if mode.startswith("ro") and path.exists() and file_size(path) <= 1 and file_size(log):
        raise JournalError(
            f"{path}: empty, although it has the log {log.name}; restore all files {path.name}* "
            "from the same copy"
        )
    return sqlite3.connect(
        f"file:{quote(str(path.absolute()))}?mode={mode}",
        uri=True,
        timeout=_BUSY_S,
        isolation_level=None,
        check_same_thread=False,
    )


def reading_mode(path: Path) -> str:
    """Return how to open a database file, so that reading it changes nothing in its folder.

    Without the files of a write-ahead log no service uses it: it would create them. The file must
    have its header (`multiradar.storage.sqlite.opening.require_header`).
    """
    used = any(path.with_name(f"{path.name}{end}").exists() for end in ("-wal", "-shm"))
    return "ro" if used else "ro&immutable=1"


def check_file_type(path: Path) -> None:
    """Raise JournalError for an existing file that is not a database.

    SQLite knows: the file is not opened otherwise, because closing it would release the locks of a
    connection that this process may have (https://www.sqlite.org/howtocorrupt.html, section 2.2).
    But SQLite treats a file of one octet as an empty database, and overwrites it.

    With a rollback journal beside it, the creation of the database was interrupted: SQLite restores
    the empty file when it is opened for writing.
    """
    size = file_size(path)
    if size == 0 or path.with_name(f"{path.name}-journal").exists():
        return
    known = size >= len(_MAGIC)
    if known:
        with closing(open_database(path, reading_mode(path))) as connection:
            try:
                connection.execute("PRAGMA schema_version")
            except sqlite3.Error as error:
                # A file that it does not know has no connection.
                known = error.sqlite_errorname != "SQLITE_NOTADB" or _begins_as_database(path)
    if not known:
        raise JournalError(f"{path}: not a journal; choose another file")


def _begins_as_database(path: Path) -> bool:
    with file_errors(path), path.open("rb") as stream:
        return stream.read(len(_MAGIC)) == _MAGIC


def check_pages(connection: sqlite3.Connection, path: Path) -> None:
    """Raise JournalError if tables and indexes of a database are not consistent.

    Only the first inconsistency is named: of further ones SQLite may report none.
    """
    found = connection.execute("PRAGMA integrity_check(1)").fetchone()[0]
    if found == "ok":
        return
    line = found.splitlines()[-1]
    page = _PAGE.search(line)
    octets = connection.execute("PRAGMA page_size").fetchone()[0]
    place = "" if page is None else f" (byte {(int(page[1]) - 1) * octets})"
    raise JournalError(f"{path}: damaged: {line}{place}")


def copy_database(connection: sqlite3.Connection, copy: Path) -> None:
    """Copy a database as the present transaction of a connection reads it.

    Parameters
    ----------
    connection : Connection
        The database, within a transaction: others may write meanwhile.
    copy : Path
        The file to create; it has no write-ahead log, and is not synced.

    Raises
    ------
    OSError
        The disk of the copy is full.
    """
    with closing(open_database(copy, "rwc")) as target:
        # The file is synced as a whole when it is complete.
        target.execute("PRAGMA journal_mode=OFF")
        target.execute("PRAGMA synchronous=OFF")
        try:
            connection.backup(target, pages=_STEP_PAGES)
            target.execute("PRAGMA journal_mode=DELETE")
        except sqlite3.Error as error:
            code = _full_code(error, copy.parent)
            if code is None:
                raise
            raise OSError(code, os.strerror(code)) from error


def sync(path: Path) -> None:
    """Write what the kernel holds of a file or folder to the disk; raises OSError."""
    file = os.open(path, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)


def write_again(path: Path) -> None:
    """Write the content of a file to the disk, also where an earlier sync failed; raises OSError.

    After a failed sync the kernel holds as written what is not on disk, and a further sync alone
    writes nothing (https://www.usenix.org/conference/atc20/presentation/rebello). On a full disk
    that copies on write, a sync must do.
    """
    file = os.open(path, os.O_RDWR)
    try:
        place = 0
        try:
            while octets := os.pread(file, _CHUNK_OCTETS, place):
                place += os.pwrite(file, octets, place)
        except OSError as error:
            if not is_full(error):
                raise
        os.fsync(file)
    finally:
        os.close(file)


def file_size(path: Path) -> int:
    """Return the size of a file, bytes; 0 where there is none."""
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0


def set_pragma(
    connection: sqlite3.Connection, path: Path, pragma: str, value: str, expected: str | int
) -> None:
    """Set a pragma; raise JournalError if it has no effect."""
    connection.execute(f"PRAGMA {pragma}={value}")
    actual = connection.execute(f"PRAGMA {pragma}").fetchone()[0]
    if actual != expected:
        raise JournalError(
            f"{path}: expected {pragma} {expected}, was {actual}; this file system is not suitable "
            "for a journal"
        )


@contextmanager
def snapshot(connection: sqlite3.Connection) -> Iterator[None]:
    """Read within one transaction, so that the results are consistent."""
    connection.execute("BEGIN")
    try:
        yield
    finally:
        # An error may have ended it already.
        if connection.in_transaction:
            connection.execute("ROLLBACK")


#: Errors of SQLite on a full disk other than in writing a row.
_NO_ROOM = frozenset({"SQLITE_IOERR_SHMSIZE"})


@contextmanager
def journal_errors(path: Path) -> Iterator[None]:
    """Translate errors of SQLite into journal errors that name the file."""
    try:
        yield
    except UnicodeError as error:
        raise JournalError(f"{path}: damaged, {error}") from error
    except sqlite3.Error as error:
        name = getattr(error, "sqlite_errorname", type(error).__name__)
        code = _full_code(error, path.parent)
        if code is not None:
            how = "disk full" if code == errno.ENOSPC else os.strerror(code).lower()
            raise JournalFullError(f"{path}: {how}; free some space") from error
        if name in _NO_ROOM:
            raise JournalError(
                f"{path}: disk full ({name}); free some space and start again"
            ) from error
        raise JournalError(f"{path}: {error} ({name})") from error


# Why a write failed for want of space; None for another error. Of a quota SQLite knows only that a
# write failed, and its transaction is rolled back as on a full disk.
def _full_code(error: sqlite3.Error, folder: Path) -> int | None:
    name = getattr(error, "sqlite_errorname", "")
    if name == "SQLITE_IOERR_WRITE":
        return space_error(folder)
    return errno.ENOSPC if name == "SQLITE_FULL" else None


@contextmanager
def file_errors(path: Path) -> Iterator[None]:
    """Translate errors of a file into journal errors; a missing file stays FileNotFoundError."""
    try:
        yield
    except FileNotFoundError:
        raise
    except OSError as error:
        raise JournalError(f"{path}: {error.strerror}") from error
