"""Tables as arguments: polars, anything with the Arrow PyCapsule interface, or a path."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeAlias, runtime_checkable

import numpy as np
import polars as pl

from multiradar.errors import InputError, MultiradarError
from multiradar.toolbox.arguments import checked_value
from multiradar.toolbox.output import Output, PathLike
from multiradar_converters.leftovers import temporary_folder

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@runtime_checkable
class ArrowTable(Protocol):
    """A table of another package: pandas, pyarrow, DuckDB and others."""

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        """Return its rows as an Arrow C stream."""
        ...


#: A table: polars, pandas, pyarrow and others by the Arrow PyCapsule interface, a structured NumPy
#: array, columns by name, rows as mappings, or what `convert` or `simulate` returned.
Frame: TypeAlias = (
    "pl.DataFrame | pl.LazyFrame | Output | ArrowTable | np.ndarray | Mapping[str, ArrayLike]"
    " | Sequence[Mapping[str, object]]"
)
#: A table, or the path of one.
FrameOrPath: TypeAlias = "Frame | PathLike"


def to_polars(given: object, name: str) -> pl.DataFrame:
    """Return a table as a polars frame.

    Parameters
    ----------
    given : Frame
        The table.
    name : str
        Its name in errors.

    Returns
    -------
    DataFrame
        The same columns.

    Raises
    ------
    InputError
        It is not a table.
    """
    if isinstance(given, pl.DataFrame | pl.LazyFrame):
        return _not_empty(given.lazy().collect(), name)
    if isinstance(given, Output):
        return given.table(name)
    structured = isinstance(given, np.ndarray) and given.dtype.names is not None
    try:
        if structured or isinstance(given, ArrowTable | Mapping) or _are_rows(given):
            # NumPy has no other mark of a missing value.
            frame = pl.DataFrame(given, nan_to_null=True)  # type: ignore[arg-type]  # checked above
            return _without_objects(_not_empty(frame, name))
    except (pl.exceptions.PolarsError, TypeError, ValueError, ImportError) as error:
        reason = str(error).strip().split("\n", maxsplit=1)[0]
        raise InputError(f"{name}: cannot be read as a table: {reason}") from error
    raise InputError(f"{name}: expected a path or a table, was {type(given).__name__}")


def _not_empty(frame: pl.DataFrame, name: str) -> pl.DataFrame:
    if not frame.width:
        raise InputError(f"{name}: an empty table, without columns and rows")
    return frame


def _without_objects(frame: pl.DataFrame) -> pl.DataFrame:
    # Columns of NumPy and pandas that have texts and missing values.
    columns = frame.get_columns()
    return frame.with_columns(
        pl.Series(one.name, one.to_list()) for one in columns if one.dtype == pl.Object
    )


def _are_rows(given: object) -> bool:
    rows = isinstance(given, Sequence) and not isinstance(given, str | bytes)
    return rows and all(isinstance(row, Mapping) for row in given)  # type: ignore[attr-defined]  # a sequence


@contextmanager
def as_file(given: object, name: str) -> Iterator[tuple[Path, str]]:
    """Provide a table as a file; a path as it is.

    Parameters
    ----------
    given : FrameOrPath
        A table or a path.
    name : str
        Name of the table in errors, and of the file.

    Yields
    ------
    Path, str
        The file, removed afterwards if it was made here, and its name in errors.

    Raises
    ------
    InputError
        It is neither a table nor a path.
    """
    if isinstance(given, Output):
        given = given.folder
    if isinstance(given, str | Path):
        yield Path(checked_value(name, given, PathLike)), str(given)
        return
    frame = to_polars(given, name)
    with temporary_folder("multiradar-table-") as folder:
        path = folder / f"{name}.parquet"
        frame.write_parquet(path, compression="uncompressed")
        try:
            yield path, name
        except MultiradarError as error:
            # The user knows the table, not the file.
            error.args = (str(error).replace(str(path), name),)
            raise
