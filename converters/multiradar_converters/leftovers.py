"""What a run that is stopped must not leave behind.

Whoever makes a file or a folder that is to vanish unless all goes well says so here, besides
removing it on its own way out: a signal ends the process without that way out.
"""

import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

# Threads may go on writing to a folder while it is removed.
_TRIES = 20

# In the order in which they came; a process has one set of files.
_EXPECTED: dict[Path, None] = {}


def register_leftover(path: Path) -> None:
    """Have a file or folder removed when the process is stopped; to be said before it is made.

    Parameters
    ----------
    path : Path
        Of what is to be made.
    """
    _EXPECTED[path] = None


def unregister_leftover(path: Path) -> None:
    """Take it back: it is gone, or it has another name by now.

    Parameters
    ----------
    path : Path
        As it was told.
    """
    _EXPECTED.pop(path, None)


@contextmanager
def temporary_folder(prefix: str) -> Iterator[Path]:
    """Give a folder among the temporary ones, which is removed at the end or when stopped.

    Parameters
    ----------
    prefix : str
        Beginning of its name.

    Yields
    ------
    Path
        The folder, for this user alone.
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
    """Remove all that is expected to be removed, the latest first."""
    for path in reversed(tuple(_EXPECTED)):
        # Threads go on writing to it by its name; under another one they cannot.
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
