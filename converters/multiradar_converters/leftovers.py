"""Temporary files and folders to remove when the process is stopped by a signal.

Code that creates temporary files registers them here, in addition to its own clean-up, which a
signal skips.
"""

import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

# Threads may still write to a folder while it is removed.
_TRIES = 20

# In order of registration; one set per process.
_EXPECTED: dict[Path, None] = {}


def register_leftover(path: Path) -> None:
    """Register a file or folder for removal when the process is stopped, before it is created.

    Parameters
    ----------
    path : Path
        Path of the file or folder.
    """
    _EXPECTED[path] = None


def unregister_leftover(path: Path) -> None:
    """Undo the registration: the file was removed or renamed.

    Parameters
    ----------
    path : Path
        As registered.
    """
    _EXPECTED.pop(path, None)


@contextmanager
def temporary_folder(prefix: str) -> Iterator[Path]:
    """Provide a temporary folder, which is removed at the end or when the process is stopped.

    Yields
    ------
    Path
        The folder, accessible to this user only.
    """
    path = Path(tempfile.gettempdir()) / f"{prefix}{secrets.token_hex(8)}"
    register_leftover(path)
    try:
        path.mkdir(mode=0o700)
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)
        unregister_leftover(path)


def remove_leftovers() -> None:
    """Remove all registered files and folders, the latest first."""
    for path in reversed(tuple(_EXPECTED)):
        # Renamed first, so that threads cannot write to it by its name.
        renamed = path.with_name(f"{path.name}.removed")
        with suppress(OSError):
            path.rename(renamed)
        for one in (renamed, path):
            _remove(one)


def _remove(path: Path) -> None:
    for _ in range(_TRIES):
        shutil.rmtree(path, ignore_errors=True)
        with suppress(OSError):
            path.unlink(missing_ok=True)
        if not os.path.lexists(path):
            break
