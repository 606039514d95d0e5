"""A lock that at most one process holds, and that a killed process lets go."""

import fcntl
import os
from pathlib import Path

from multiradar.errors import JournalError


class FileLock:
    """An exclusive lock on a file beside the thing that it guards.

    Parameters
    ----------
    path : Path
        The file; it is made when absent, and stays.

    Raises
    ------
    JournalError
        If another process holds it, or the file cannot be made.
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
                f"{path}: another service uses this journal; stop it, or name another journal"
            ) from error

    def release(self) -> None:
        """Let go; releasing twice is allowed."""
        if self._file is not None:
            os.close(self._file)
            self._file = None
