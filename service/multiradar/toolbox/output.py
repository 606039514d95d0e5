"""Folders that a function or a command wrote, and their tables."""

import json
import shutil
import tempfile
import weakref
from pathlib import Path
from secrets import token_hex
from typing import TYPE_CHECKING, Any, TypeAlias

from multiradar.errors import InputError
from multiradar.storage.folders import no_such

if TYPE_CHECKING:
    import polars as pl

#: A path, as text or as an object.
PathLike: TypeAlias = str | Path

REPORT_FILE = "report.json"


class Output:
    """A folder of tables with a report; tables are read when first used.

    Parameters
    ----------
    folder : Path
        The folder.
    wanted : str
        What it should contain, for errors.

    Attributes
    ----------
    folder : Path
        The folder.
    report : dict
        Contents of `report.json`.

    Raises
    ------
    InputError
        There is no such folder, or its report cannot be read.
    """

    def __init__(self, folder: Path, wanted: str) -> None:
        self.folder = folder
        path = folder / REPORT_FILE
        if not path.is_file():
            raise InputError(no_such(folder, wanted))
        try:
            self.report: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"{path}: not valid JSON: {error}") from error
        self._tables: dict[str, pl.DataFrame] = {}

    def names(self) -> list[str]:
        """Return the names of the tables."""
        return sorted(path.stem for path in self.folder.glob("*.parquet"))

    def table(self, name: str) -> "pl.DataFrame":
        """Return a table by its name, such as ``tracks``.

        Raises
        ------
        InputError
            The folder has no such table, or it cannot be read.
        """
        import polars as pl

        if name not in self._tables:
            path = self.folder / f"{name}.parquet"
            if not path.is_file():
                known = ", ".join(self.names()) or "none"
                raise InputError(f"{self.folder}: no table {name!r}; tables: {known}")
            try:
                self._tables[name] = pl.read_parquet(path)
            except (pl.exceptions.PolarsError, OSError) as error:
                raise InputError(f"{path}: not readable as Parquet: {error}") from error
        return self._tables[name]


def new_output(out: PathLike | None) -> Path:
    """Return the folder to make: the one given, or a temporary one of this process."""
    if out is not None:
        return Path(out)
    return Path(tempfile.gettempdir()) / f"multiradar-{token_hex(8)}"


def remove_with(owner: object, folder: Path) -> None:
    """Remove a temporary folder when its owner is no longer used, or at the end of the process."""
    weakref.finalize(owner, shutil.rmtree, folder, ignore_errors=True)
