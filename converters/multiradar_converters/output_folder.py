"""The output folder: it appears under its name only when it is complete.

Work happens in `.NAME.partial-PID` beside it, which is locked while its process lives and renamed
at the end. What a killed run left is recognised by its free lock and removed by the next run.
"""

import fcntl
import os
import shutil
from pathlib import Path
from types import TracebackType
from typing import Self

from multiradar_converters.errors import ConversionError, OutputTakenError
from multiradar_converters.leftovers import register_leftover, unregister_leftover

_LOCK = ".lock"


class OutputFolder:
    """Context in which an output folder comes to be; leaving it by an error leaves nothing.

    Parameters
    ----------
    target : Path
        The folder to make; must not exist.

    Raises
    ------
    OutputTakenError
        On entering or finishing: the target exists.
    ConversionError
        On entering: the folder above it does not exist or cannot be written to.
    """

    def __init__(self, target: Path) -> None:
        self._target = target
        self.path = target.with_name(f"{_prefix(target)}{os.getpid()}")
        self._lock: int | None = None

    def finish(self) -> None:
        """Give the folder its name."""
        (self.path / _LOCK).unlink()
        self._refuse_if_taken()
        self.path.rename(self._target)

    def __enter__(self) -> Self:
        self._refuse_if_taken()
        if not self._target.parent.is_dir():
            msg = (
                f"{self._target}: expected a folder {self._target.parent} to make it in, found none"
            )
            raise ConversionError(msg)
        try:
            _remove_abandoned(self._target)
            register_leftover(self.path)
            self.path.mkdir()
            self._lock = os.open(self.path / _LOCK, os.O_CREAT | os.O_RDWR, 0o600)
            fcntl.flock(self._lock, fcntl.LOCK_EX)
        except BaseException as error:
            # An interruption, too: without its lock no later run would remove the folder.
            if isinstance(error, FileExistsError):
                unregister_leftover(self.path)
            else:
                self.__exit__(None, None, None)
            if not isinstance(error, OSError):
                raise
            msg = f"{self._target}: cannot be made: {error.strerror}"
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

    def _refuse_if_taken(self) -> None:
        if os.path.lexists(self._target):
            msg = f"{self._target}: already exists; choose another output directory or remove it"
            raise OutputTakenError(msg)


def _prefix(target: Path) -> str:
    return f".{target.name}.partial-"


def _remove_abandoned(target: Path) -> None:
    """Remove what killed runs for the same target left."""
    for path in target.parent.glob(f"{_prefix(target)}*"):
        try:
            lock = os.open(path / _LOCK, os.O_RDWR)
        except OSError:
            # Without a lock it is being made or finished at this moment, or it is not ours.
            continue
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            continue
        else:
            shutil.rmtree(path, ignore_errors=True)
        finally:
            os.close(lock)
