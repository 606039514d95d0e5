"""An output folder that is created atomically.

The rules are those of `multiradar convert`, including leftovers of killed runs; the messages are
those of the service.
"""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from multiradar.errors import InputError, OutputExistsError
from multiradar.storage.full_disk import named_if_full
from multiradar.storage.sqlite.sqlite_file import sync
from multiradar_converters.errors import ConversionError, OutputFolderExistsError
from multiradar_converters.output_folder import OutputFolder, remove_if_abandoned


def parent_of(path: Path) -> Path:
    """Return the folder in which a file or folder is to be created.

    Raises
    ------
    InputError
        It does not exist, or is a file.
    """
    parent = path.absolute().parent
    if not parent.is_dir():
        msg = f"{parent}: no such folder; create it before writing {path.name}"
        if parent.exists():
            msg = f"{parent}: expected a folder for {path.name}, was a file; choose another folder"
        raise InputError(msg)
    return parent


@contextmanager
def new_folder(path: Path, *, durable: bool = False) -> Iterator[Path]:
    """Provide a folder to write to; it gets its name when everything succeeded.

    Parameters
    ----------
    path : Path
        The folder to create; its parent exists.
    durable : bool
        Whether its name is on disk at the end; its files are synced by the caller.

    Yields
    ------
    Path
        A hidden sibling to write to, removed on failure; if the run is killed, by the next run for
        the same folder.

    Raises
    ------
    OutputExistsError
        The name exists already; it is not changed.
    InputError
        The parent folder does not exist or cannot be written to, or the disk is full.
    """
    check_new(path)
    parent_of(path)
    folder = OutputFolder(path.absolute())
    with ExitStack() as held:
        with _translated():
            held.enter_context(folder)
        with named_if_full(path):
            yield folder.path
            with _translated():
                folder.finish()
    if durable:
        try:
            sync(folder.path.parent)
        except OSError as error:
            msg = f"{path}: complete, but perhaps not on disk: {error.strerror}"
            raise InputError(msg) from error


def remove_abandoned(parent: Path, file: str) -> None:
    """Remove the unfinished folders of killed runs, for any path, that contain a file.

    Parameters
    ----------
    parent : Path
        The folder in which they were to be created.
    file : str
        The name of the file.
    """
    for path in parent.glob(".*.partial-*"):
        if (path / file).is_file():
            remove_if_abandoned(path)


def check_new(path: Path) -> None:
    """Raise `OutputExistsError` when the path exists."""
    if os.path.lexists(path):
        msg = f"{path}: already exists; choose another output directory or remove it"
        raise OutputExistsError(msg)


@contextmanager
def _translated() -> Iterator[None]:
    try:
        yield
    except OutputFolderExistsError as error:
        raise OutputExistsError(str(error)) from error
    except ConversionError as error:
        raise InputError(str(error)) from error
