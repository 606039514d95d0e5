"""The files of a running journal: locked by one process, and still the ones that it opened."""

import fcntl
import os
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from multiradar.errors import JournalError
from multiradar.storage.sqlite.sqlite_file import file_errors

#: Another process has the journal for less than a second: 10 s in all.
_TRIES, _TRY_S = 200, 0.05


class FileLock:
    """An exclusive lock on a file itself; released when the process dies.

    SQLite locks ranges of the same file by another mechanism (`fcntl`), whose locks a process loses
    when it closes the file anywhere. So this must be taken before SQLite opens the file, and
    released after SQLite has closed it.

    Parameters
    ----------
    path : Path
        The file; created when absent.
    wait : bool
        Whether another process may hold it; `acquire` then takes it when it is free.

    Raises
    ------
    JournalError
        If another process holds it, or the file cannot be created.
    """

    def __init__(self, path: Path, *, wait: bool = False) -> None:
        self._path = path
        with file_errors(path):
            self._file: int | None = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        if not wait and not self.acquire():
            self.release()
            raise JournalError(
                f"{path}: another service is using this journal; stop that service, or choose "
                "another journal"
            )

    def acquire(self) -> bool:
        """Take the lock if no other process holds it; return whether it is held."""
        if self._file is None:
            return False
        # The file stays open if not: closing it would release the locks of SQLite.
        try:
            with file_errors(self._path):
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except JournalError as error:
            if isinstance(error.__cause__, BlockingIOError):
                return False
            raise
        return True

    def release(self) -> None:
        """Release the lock; may be called twice."""
        if self._file is not None:
            os.close(self._file)
            self._file = None


@contextmanager
def unchanged(tip: Path) -> Iterator[None]:
    """Keep other processes from starting a service on a journal, or from removing its entries.

    A service holds this only while it opens the journal. It is a lock of the tip, which is a file
    that SQLite does not know.

    Parameters
    ----------
    tip : Path
        The tip of the journal; without it there is nothing to lock.

    Raises
    ------
    JournalError
        If another process holds it for longer than 10 s.
    """
    try:
        with file_errors(tip):
            file = os.open(tip, os.O_RDONLY)
    except FileNotFoundError:
        yield
        return
    try:
        for left in reversed(range(_TRIES)):
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError as error:
                if not left:
                    raise JournalError(
                        f"{tip}: another process is changing this journal; wait until it has "
                        "finished"
                    ) from error
                threading.Event().wait(_TRY_S)
        yield
    finally:
        os.close(file)


class OpenFiles:
    """Files that must stay where they were opened.

    Parameters
    ----------
    paths : sequence of Path
        Their paths; the files exist.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        self._inodes = {path: _inode(path) for path in paths}

    def check(self) -> None:
        """Raise JournalError if one is no longer at its path."""
        for path, inode in self._inodes.items():
            found = _inode(path)
            if found != inode:
                how = "removed" if found is None else "replaced by another file"
                raise JournalError(f"{path}: {how} while the service was using it")


# Device and number of the file at a path; None without one.
def _inode(path: Path) -> tuple[int, int] | None:
    try:
        with file_errors(path):
            found = path.stat()
    except FileNotFoundError:
        return None
    return found.st_dev, found.st_ino
