"""An output folder that is either finished or not there.

The rule is that of `multiradar convert`, what a killed run left included; the sentences are those
of the service.
"""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from multiradar.errors import InputError, OutputExistsError
from multiradar_converters.errors import ConversionError, OutputTakenError
from multiradar_converters.output_folder import OutputFolder


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
        A hidden sibling to write to, removed when anything goes wrong; by the next run for the
        same folder when this one is killed.

    Raises
    ------
    OutputExistsError
        There is something of that name already; it is left alone.
    InputError
        There is no folder to make it in, or it cannot be written to.
    """
    check_new(path)
    parent = path.absolute().parent
    if not parent.is_dir():
        msg = f"{parent}: expected a folder to write {path.name} to, found none"
        raise InputError(msg)
    folder = OutputFolder(path.absolute())
    with ExitStack() as held:
        with _translated():
            held.enter_context(folder)
        yield folder.path
        with _translated():
            folder.finish()


def check_new(path: Path) -> None:
    """Raise `OutputExistsError` when there is something of that name."""
    if os.path.lexists(path):
        msg = f"{path}: already exists; choose another output directory or remove it"
        raise OutputExistsError(msg)


@contextmanager
def _translated() -> Iterator[None]:
    try:
        yield
    except OutputTakenError as error:
        raise OutputExistsError(str(error)) from error
    except ConversionError as error:
        raise InputError(str(error)) from error
