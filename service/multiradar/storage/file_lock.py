"""A lock that at most one process holds; it is released when the process dies."""

import fcntl
import os
from pathlib import Path

from multiradar.errors import JournalError


class FileLock:
    """An exclusive lock on a file.

    Parameters
    ----------
    path : Path
        The lock file; created when absent, never removed.

    Raises
    ------
    JournalError
        If another process holds it, or the file cannot be created.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._file: int | None = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise JournalError(f"{path}: {error.strerror}") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            self.release()
            raise JournalError(
                f"{path}: another service uses this journal; stop it, or choose another journal"
            ) from error

    def release(self) -> None:
        """Release the lock; may be called twice."""
        if self._file is not None:
            os.close(self._file)
            self._file = None
