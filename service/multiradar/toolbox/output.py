"""Folders that a function or a command wrote, and their tables."""

import json
import shutil
import tempfile
import weakref
from pathlib import Path
from secrets import token_hex
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

from multiradar.errors import InputError
from multiradar.toolbox.arguments import typed
from multiradar_schemas.documents.contents import no_such, unreadable
from multiradar_schemas.documents.names import did_you_mean

if TYPE_CHECKING:
    import polars as pl

#: A path, as text or as an object.
PathLike: TypeAlias = str | Path

REPORT_FILE = "report.json"


class _OwnedPath(type(Path())):  # type: ignore[misc]  # the class of the system
    # `track(convert(…).folder, …)`: the path alone keeps the folder.
    owner: object

    def __repr__(self) -> str:
        return repr(Path(self))


class Output:
    """A folder that a function or a command made: tables with a report.

    Parameters
    ----------
    folder : str or Path
        The folder.

    Raises
    ------
    InputError
        There is no such folder, its report cannot be read, or another command made it.
    """

    #: What the folder should contain, for errors.
    _wanted: ClassVar[str]

    @typed
    def __init__(self, folder: PathLike) -> None:
        self._folder = Path(folder)
        path = self._folder / REPORT_FILE
        if not path.is_file():
            raise InputError(no_such(self._folder, self._wanted))
        try:
            self._report: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"{path}: not valid JSON: {error}") from error
        command = str(self._report.get("command", "")) if isinstance(self._report, dict) else ""
        if command.partition(" ")[0] not in self._wanted:
            found = f"the output of `{command.partition(' ')[0]}`" if command else "another report"
            raise InputError(f"{self._folder}: expected {self._wanted}, was {found}")
        self._tables: dict[str, pl.DataFrame] = {}

    @property
    def folder(self) -> Path:
        """The folder; a temporary one is removed when neither this object nor the path is used."""
        path = _OwnedPath(self._folder)
        path.owner = self
        return path

    @property
    def report(self) -> dict[str, Any]:
        """Contents of `report.json`: counts, rejects by code, settings, figures."""
        return self._report

    def names(self) -> list[str]:
        """Return the names of the tables."""
        return sorted(path.stem for path in self.folder.glob("*.parquet"))

    @typed
    def table(self, name: str) -> "pl.DataFrame":
        """Return a table; columns and units as in docs/reference/fields.md.

        Parameters
        ----------
        name : str
            Such as ``tracks``, ``measurements`` or a requested one such as ``forecasts``.

        Returns
        -------
        DataFrame
            All rows.

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
                meant = did_you_mean(name, self.names())
                raise InputError(f"{self.folder}: no table {name!r}{meant}; tables: {known}")
            try:
                self._tables[name] = pl.read_parquet(path)
            except (pl.exceptions.PolarsError, OSError) as error:
                raise InputError(unreadable(path, "a table", error)) from error
        return self._tables[name]


def new_output(out: PathLike | None) -> Path:
    """Return the folder to make: the one given, or a temporary one of this process."""
    if out is not None:
        return Path(out)
    return Path(tempfile.gettempdir()) / f"multiradar-{token_hex(8)}"


def remove_with(owner: object, folder: Path) -> None:
    """Remove a temporary folder when its owner is no longer used, or at the end of the process."""
    weakref.finalize(owner, shutil.rmtree, folder, ignore_errors=True)
