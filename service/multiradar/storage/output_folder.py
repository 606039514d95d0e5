"""An output folder that is either finished or not there."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from multiradar.errors import InputError, OutputExistsError


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """Give a folder to write to; it takes its name when everything went well.

    Parameters
    ----------
    path : Path
        The folder to make; its parent exists.

    Yields
    ------
    Path
        A hidden sibling to write to, removed when anything goes wrong.

    Raises
    ------
    OutputExistsError
        There is something of that name already; it is left alone.
    InputError
        There is no folder to make it in.
    """
    check_new(path)
    parent = path.absolute().parent
    if not parent.is_dir():
        msg = f"{parent}: expected a folder to write {path.name} to, found none"
        raise InputError(msg)
    partial = Path(tempfile.mkdtemp(prefix=f".{path.name}.partial-", dir=parent))
    try:
        # mkdtemp makes it private; a finished folder is as open as the user wants it.
        partial.chmod(0o777 & ~_umask())
        yield partial
        check_new(path)
        partial.rename(path)
    except BaseException:
        shutil.rmtree(partial, ignore_errors=True)
        raise


def check_new(path: Path) -> None:
    """Raise `OutputExistsError` when there is something of that name."""
    if os.path.lexists(path):
        msg = f"{path}: expected a folder that does not exist yet, it does"
        raise OutputExistsError(msg)


def _umask() -> int:
    # The only way to read it is to set it.
    umask = os.umask(0o022)
    os.umask(umask)
    return umask
