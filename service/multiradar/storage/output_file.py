"""An output file that is either finished or not there, and never takes the place of another."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from multiradar.errors import InputError, OutputExistsError
from multiradar_converters.leftovers import expect_leftover, forget_leftover

#: Numbers that are tried behind a name that is taken.
NUMBER_MAX = 9999


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Give a file to write to; it takes its name when everything went well.

    Parameters
    ----------
    path : Path
        The file to make; its folder exists.

    Yields
    ------
    Path
        A hidden empty sibling to write to, made at once, so that a folder that cannot be written
        to is told before the work; removed when anything goes wrong.

    Raises
    ------
    OutputExistsError
        There is something of that name already; it is left alone.
    InputError
        There is no folder to make it in, or it cannot be written to.
    """
    if os.path.lexists(path):
        raise _taken(path)
    folder = path.absolute().parent
    if not folder.is_dir():
        msg = f"{folder}: expected a folder to write {path.name} to, found none"
        raise InputError(msg)
    partial = folder / f".{path.name}.partial-{secrets.token_hex(4)}"
    expect_leftover(partial)
    try:
        partial.open("xb").close()
    except OSError as error:
        forget_leftover(partial)
        msg = f"{path}: cannot write there, {error.strerror or error}"
        raise InputError(msg) from error
    try:
        yield partial
        _finish(partial, path)
    finally:
        partial.unlink(missing_ok=True)
        forget_leftover(partial)


def free_name(path: Path) -> Path:
    """Return the path, or the first of ``name-2.html``, ``name-3.html`` … that is not taken.

    Raises
    ------
    OutputExistsError
        All of them are.
    """
    if not os.path.lexists(path):
        return path
    for number in range(2, NUMBER_MAX + 1):
        numbered = path.with_name(f"{path.stem}-{number}{path.suffix}")
        if not os.path.lexists(numbered):
            return numbered
    raise _taken(path)


def _finish(partial: Path, path: Path) -> None:
    # A link, unlike a rename, refuses a name that was taken meanwhile.
    try:
        os.link(partial, path)
    except FileExistsError as error:
        raise _taken(path) from error
    except OSError:
        # A file system without links; what remains is the moment between look and rename.
        if os.path.lexists(path):
            raise _taken(path) from None
        partial.rename(path)


def _taken(path: Path) -> OutputExistsError:
    return OutputExistsError(f"{path}: already exists; choose another file or remove it")
