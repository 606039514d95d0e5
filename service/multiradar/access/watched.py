"""A file that is read again when it changes."""

from collections.abc import Callable
from pathlib import Path
from typing import Generic, TypeVar

from multiradar.access.security_log import SECURITY_LOG
from multiradar.errors import ConfigurationError

Content = TypeVar("Content")


class Watched(Generic[Content]):
    """The content of a file. A change that cannot be read is logged and changes nothing.

    Parameters
    ----------
    file : Path
        The file.
    read : callable
        Reads it; raises `ConfigurationError`.
    what : str
        Its name in the log.

    Raises
    ------
    ConfigurationError
        If it cannot be read at first.
    """

    def __init__(self, file: Path, read: Callable[[Path], Content], what: str) -> None:
        self._file, self._read, self._what = file, read, what
        self._version = _version(file)
        self._content = read(file)

    def current(self) -> Content:
        """Return the present content."""
        version = _version(self._file)
        if version != self._version:
            self._version = version
            try:
                self._content = self._read(self._file)
            except ConfigurationError as error:
                # An unfinished edit locks no client out.
                SECURITY_LOG.error("file_not_read", what=self._what, reason=str(error))
        return self._content


def _version(file: Path) -> tuple[int, int, int] | None:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
