"""The tip of a journal: the last acknowledged entry, in a file beside it.

A journal that lost its end is a valid, shorter journal. The tip shows what is missing: it is
written when a transaction is on disk and before it is acknowledged. It survives `kill -9` as it is;
it is synced once a second and when it is closed, because a sync at each transaction would nearly
double the time of one. So after a power failure it may be the tip of a second before, never that of
an entry that was not on disk.
"""

import os
import threading
import zlib
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple, Self

from multiradar.errors import JournalError
from multiradar.storage.sqlite.sqlite_file import READINGS, file_errors, sync

#: What an operator writes into the file to continue with what the journal holds.
ACCEPT = "accept"

_SYNC_S = 1.0
_BYTES_MAX = 4096


class Tip(NamedTuple):
    """The last acknowledged entry of a journal, and its digest, which covers those before it."""

    sequence: int
    digest: bytes

    @classmethod
    def read(cls, path: Path) -> Self | None:
        """Return the tip in a file: of no entry if the operator accepts any; None without one.

        A kill at the first start may leave an empty file. A service may be writing it.

        Raises
        ------
        JournalError
            If the file cannot be read or is damaged.
        """
        for _ in range(READINGS - 1):
            with suppress(JournalError):
                return cls._read(path)
        return cls._read(path)

    @classmethod
    def _read(cls, path: Path) -> Self | None:
        try:
            with file_errors(path), path.open("rb") as stream:
                content = stream.read(_BYTES_MAX)
        except FileNotFoundError:
            return None
        if not content:
            return None
        if content.strip() == ACCEPT.encode():
            return cls(0, b"")
        try:
            sequence, digest, _ = content.decode("ascii").split(" ")
            tip = cls(int(sequence), bytes.fromhex(digest))
        except ValueError:
            tip = None
        if tip is None or tip.line() != content:
            raise JournalError(f"{path}: damaged")
        return tip

    def require(self, journal: Path, last: int) -> None:
        """Raise JournalError if a journal, which ends with an entry, lacks the acknowledged one."""
        if self.sequence > last:
            raise JournalError(
                f"{journal}: {self.sequence} entries were acknowledged, but it contains only "
                f"{last}; restore all its files from the same copy"
            )

    @property
    def accepts_any(self) -> bool:
        """Whether the operator continues with what the journal holds."""
        return not self.digest

    def line(self) -> bytes:
        """Return the content of the file; its length is always the same."""
        values = f"{self.sequence:020d} {self.digest.hex()}"
        return f"{values} {zlib.crc32(values.encode()):08x}\n".encode()


class TipFile:
    """The file of a tip, opened for writing; one thread writes.

    Parameters
    ----------
    path : Path
        The file; created when absent.
    tip : Tip
        The tip it starts with, on disk when this returns.

    Raises
    ------
    JournalError
        If it cannot be written; also by `write`.
    """

    def __init__(self, path: Path, tip: Tip) -> None:
        self._path = path
        self._failure: OSError | None = None
        self._unsynced = False
        self._closing = threading.Event()
        with file_errors(path):
            self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
            os.pwrite(self._file, tip.line(), 0)
            os.ftruncate(self._file, len(tip.line()))
            os.fsync(self._file)
            sync(path.parent)
        self._syncing = threading.Thread(target=self._sync, name="journal-tip", daemon=True)
        self._syncing.start()

    def write(self, tip: Tip) -> None:
        """Replace the tip, by one write within a sector: it is never half of one."""
        with file_errors(self._path):
            if self._failure is not None:
                raise self._failure
            os.pwrite(self._file, tip.line(), 0)
        self._unsynced = True

    def close(self) -> None:
        """Sync and close it; to be called once."""
        self._closing.set()
        self._syncing.join()
        os.close(self._file)

    def _sync(self) -> None:
        closing = False
        while not closing:
            closing = self._closing.wait(_SYNC_S)
            if self._unsynced:
                self._unsynced = False
                try:
                    os.fdatasync(self._file)
                except OSError as error:
                    self._failure = error
