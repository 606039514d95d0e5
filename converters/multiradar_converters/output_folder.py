"""The output folder, which is created atomically.

It is written as `.NAME.partial-PID` beside its path, locked while the process is alive, and renamed
at the end. The next run recognises a leftover of a killed run by its free lock and removes it; a
kill just after the renaming leaves the lock file in the folder.
"""

import fcntl
import os
import shutil
from pathlib import Path
from types import TracebackType
from typing import Self

from multiradar_converters.errors import ConversionError, OutputFolderExistsError
from multiradar_converters.leftovers import register_leftover, unregister_leftover

_LOCK = ".lock"


class OutputFolder:
    """Context that creates an output folder; an error leaves nothing behind.

    Parameters
    ----------
    target : Path
        The folder to create; must not exist.

    Raises
    ------
    OutputFolderExistsError
        On entering or finishing: the target exists.
    ConversionError
        On entering: the parent folder does not exist or cannot be written to.
    """

    def __init__(self, target: Path) -> None:
        self._target = target
        self.path = target.with_name(f"{_prefix(target)}{os.getpid()}")
        self._lock: int | None = None

    def finish(self) -> None:
        """Rename the folder to its final name.

        Until then it has its lock: without it, no later run would remove what a kill leaves.
        """
        self._check_free()
        self.path.rename(self._target)
        (self._target / _LOCK).unlink()

    def __enter__(self) -> Self:
        self._check_free()
        if not self._target.parent.is_dir():
            msg = f"{self._target}: no such folder {self._target.parent}; create it first"
            raise ConversionError(msg)
        try:
            _remove_abandoned(self._target)
            register_leftover(self.path)
            self.path.mkdir()
            self._lock = os.open(self.path / _LOCK, os.O_CREAT | os.O_RDWR, 0o600)
            fcntl.flock(self._lock, fcntl.LOCK_EX)
        except BaseException as error:
            # Also on an interruption: without its lock no later run would remove the folder.
            if isinstance(error, FileExistsError):
                unregister_leftover(self.path)
            else:
                self.__exit__(None, None, None)
            if not isinstance(error, OSError):
                raise
            msg = f"{self._target}: cannot be created: {error.strerror}"
            raise ConversionError(msg) from error
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._lock is not None:
            os.close(self._lock)
        shutil.rmtree(self.path, ignore_errors=True)
        unregister_leftover(self.path)

    def _check_free(self) -> None:
        if os.path.lexists(self._target):
            msg = f"{self._target}: already exists; choose another output directory or remove it"
            raise OutputFolderExistsError(msg)


def _prefix(target: Path) -> str:
    return f".{target.name}.partial-"


def _remove_abandoned(target: Path) -> None:
    """Remove leftovers of killed runs for the same target."""
    for path in target.parent.glob(f"{_prefix(target)}*"):
        remove_if_abandoned(path)


def remove_if_abandoned(path: Path) -> None:
    """Remove an unfinished output folder whose run was killed; that of a living run is kept.

    Parameters
    ----------
    path : Path
        The hidden folder. Without a lock file it is kept: it is being created, or belongs to
        another program.
    """
    try:
        lock = os.open(path / _LOCK, os.O_RDWR)
    except OSError:
        return
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return
    else:
        shutil.rmtree(path, ignore_errors=True)
    finally:
        os.close(lock)
