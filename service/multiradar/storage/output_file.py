"""An output file that is created atomically and never replaces another."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from multiradar.errors import InputError, OutputExistsError
from multiradar.storage.full_disk import named_if_full
from multiradar.storage.output_folder import parent_of
from multiradar_converters.leftovers import register_leftover, unregister_leftover

#: Highest number tried after a name that exists.
NUMBER_MAX = 9999


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Provide a file to write to; it gets its name when everything succeeded.

    Parameters
    ----------
    path : Path
        The file to create; its folder exists.

    Yields
    ------
    Path
        A hidden empty sibling to write to, created at once, so that a folder without write
        permission is reported before the work; removed on failure.

    Raises
    ------
    OutputExistsError
        The name exists already; it is not changed.
    InputError
        The parent folder does not exist or cannot be written to, or the disk is full.
    """
    if os.path.lexists(path):
        raise _exists_error(path)
    folder = parent_of(path)
    partial = folder / f".{path.name}.partial-{secrets.token_hex(4)}"
    register_leftover(partial)
    try:
        partial.open("xb").close()
    except OSError as error:
        unregister_leftover(partial)
        msg = f"{path}: cannot write: {error.strerror or error}"
        raise InputError(msg) from error
    try:
        with named_if_full(path):
            yield partial
            _finish(partial, path)
    finally:
        partial.unlink(missing_ok=True)
        unregister_leftover(partial)


@contextmanager
def replaced_file(path: Path) -> Iterator[Path]:
    """Provide a file to write to; it replaces the one at a path when everything succeeded.

    Parameters
    ----------
    path : Path
        The file; its folder exists.

    Yields
    ------
    Path
        A hidden sibling to write to, removed on failure. After a crash there is the old file, the
        new one, or none.

    Raises
    ------
    InputError
        The disk is full.
    """
    partial = path.with_name(f".{path.name}.partial-{secrets.token_hex(4)}")
    register_leftover(partial)
    try:
        with named_if_full(path):
            yield partial
            with partial.open("rb+") as written:
                os.fsync(written.fileno())
            os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
        unregister_leftover(partial)


def free_name(path: Path) -> Path:
    """Return the path, or the first of ``name-2.html``, ``name-3.html`` … that does not exist.

    Raises
    ------
    OutputExistsError
        All of them exist.
    """
    if not os.path.lexists(path):
        return path
    for number in range(2, NUMBER_MAX + 1):
        numbered = path.with_name(f"{path.stem}-{number}{path.suffix}")
        if not os.path.lexists(numbered):
            return numbered
    raise _exists_error(path)


def _finish(partial: Path, path: Path) -> None:
    # A link, unlike a rename, fails when the name was created meanwhile.
    try:
        os.link(partial, path)
    except FileExistsError as error:
        raise _exists_error(path) from error
    except OSError:
        # A file system without links; a race between check and rename remains.
        if os.path.lexists(path):
            raise _exists_error(path) from None
        partial.rename(path)


def _exists_error(path: Path) -> OutputExistsError:
    return OutputExistsError(f"{path}: already exists; choose another file or remove it")
