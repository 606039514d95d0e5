"""A recording on disk, `measurements.parquet`, read in bounded blocks."""

import copy
import hashlib
import json
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.errors import InputError, MissingColumnError
from multiradar_schemas.documents.contents import other_table, unreadable
from multiradar_schemas.measurements.columns import MEASUREMENT_LATER, MEASUREMENT_SCHEMA
from multiradar_schemas.measurements.measurement import TIME_MAX_S

#: Rows in memory at a time.
BLOCK_ROWS = 65_536
_HASH_CHUNK_BYTES = 1 << 20

#: Name of the file that `multiradar convert` writes into its output folder.
MEASUREMENTS_FILE = "measurements.parquet"

#: Column of a block with the position of each row in the file.
INDEX_COLUMN = "index"


@dataclass(frozen=True, slots=True)
class RejectedLines:
    """Lines of a dump that its conversion rejected, which are no rows of the recording.

    Attributes
    ----------
    rejects : Path
        `rejects.ndjson` of the conversion.
    by_code : mapping of str to mapping
        Number of lines by reject code, by file.
    kinds : mapping of str to str
        Kind of the measurements of a file, by file; a file without measurements is not in it.
    """

    rejects: Path
    by_code: Mapping[str, Mapping[str, int]]
    kinds: Mapping[str, str]

    def counts(self, kinds: Collection[str] | None = None) -> Counter[str]:
        """Return the number of lines of the selected kinds by code; all when absent."""
        total: Counter[str] = Counter()
        for file in self._files(kinds):
            total.update(self.by_code[file])
        return total

    def lines(self, kinds: Collection[str] | None = None) -> Iterator[str]:
        """Yield the rejects of the selected kinds, as lines of `rejects.ndjson`."""
        wanted = {*self._files(kinds)}
        with self.rejects.open(encoding="utf-8") as stream:
            for line in stream:
                if kinds is None or json.loads(line)["file"] in wanted:
                    yield line

    def _files(self, kinds: Collection[str] | None) -> list[str]:
        return [one for one in self.by_code if kinds is None or self.kinds.get(one) in kinds]


class Recording:
    """The measurements of one Parquet file, in the order of its rows.

    Parameters
    ----------
    path : Path
        The file; or a folder with its parts, as in the history of a service.
    name : str, optional
        Its name in errors; the path by default.

    Attributes
    ----------
    path : Path
        The file.
    name : str
        Its name in errors.
    rows : int
        Number of measurements in it.
    sorted : bool
        Whether it is read in order of time instead of the order of the file.
    rejected_lines : RejectedLines, optional
        Of a dump that was converted for this reading.

    Raises
    ------
    InputError
        The file does not exist, is not Parquet, or a column has an unsupported type.
    MissingColumnError
        A required column of `MEASUREMENT_SCHEMA` is missing.
    """

    def __init__(self, path: Path, name: str | None = None) -> None:
        self.path = path
        self.name = name or str(path)
        self.sorted = False
        self.rejected_lines: RejectedLines | None = None
        self._files = sorted(path.glob("[0-9]*.parquet")) if path.is_dir() else [path]
        if not path.is_file() and not (path.is_dir() and self._files):
            msg = f"{path}: no such file" if not path.exists() else f"{path}: not a file"
            raise InputError(msg)
        try:
            self._scan = pl.scan_parquet(self._files, glob=False)
            found = self._scan.collect_schema()
            check_columns(self.name, found)
            self._scan = self._scan.with_columns(
                pl.lit(None, MEASUREMENT_SCHEMA[name]).alias(name)
                for name in MEASUREMENT_LATER
                if name not in found
            )
            self.rows = int(self._scan.select(pl.len()).collect().item())
        except (pl.exceptions.PolarsError, OSError) as error:
            raise _unreadable(path, error) from error

    def blocks(self, kinds: Collection[str] | None = None) -> Iterator[pl.DataFrame]:
        """Yield the rows of the selected kinds, block by block.

        Parameters
        ----------
        kinds : collection of str, optional
            Kinds of measurement to keep; all when absent.

        Yields
        ------
        DataFrame
            Columns of `MEASUREMENT_SCHEMA` and `index`, the position in the file. 0 to `BLOCK_ROWS`
            rows.

        Raises
        ------
        InputError
            The file changed or could not be read.
        """
        columns = [pl.col(name).cast(dtype) for name, dtype in MEASUREMENT_SCHEMA.items()]
        for start in range(0, self.rows, BLOCK_ROWS):
            # Slice first and add the index afterwards; the reverse reads the whole file every time.
            wanted = self._scan.slice(start, BLOCK_ROWS)
            if not self.sorted:
                wanted = wanted.with_row_index(INDEX_COLUMN, offset=start)
            wanted = wanted.select(*columns, INDEX_COLUMN)
            if kinds is not None:
                wanted = wanted.filter(pl.col("kind").is_in(sorted(kinds)))
            try:
                block = wanted.collect()
            except pl.exceptions.InvalidOperationError as error:
                msg = f"{self.name}: values do not match their column types ({_first_line(error)})"
                raise InputError(msg) from error
            except (pl.exceptions.PolarsError, OSError) as error:
                raise _unreadable(self.path, error) from error
            yield block

    def times(self) -> Iterator[NDArray[np.float64]]:
        """Yield the times of all rows, s, block by block; NaN where absent.

        Raises
        ------
        InputError
            The file changed or could not be read.
        """
        times = self._scan.select(pl.col("time_s").cast(pl.Float64).fill_null(np.nan))
        for start in range(0, self.rows, BLOCK_ROWS):
            try:
                block = times.slice(start, BLOCK_ROWS).collect()
            except (pl.exceptions.PolarsError, OSError) as error:
                raise _unreadable(self.path, error) from error
            yield block["time_s"].to_numpy()

    def span_s(self, kinds: Collection[str] | None = None) -> tuple[float, float] | None:
        """Return the first and last time of the selected kinds, s; None without rows."""
        time_s = pl.col("time_s").cast(pl.Float64)
        # Other times are rejected.
        rows = self._scan.filter(time_s.abs() < TIME_MAX_S)
        if kinds is not None:
            rows = rows.filter(pl.col("kind").cast(pl.String).is_in(sorted(kinds)))
        try:
            first, last = rows.select(time_s.min(), time_s.max().alias("last")).collect().row(0)
        except (pl.exceptions.PolarsError, OSError) as error:
            raise _unreadable(self.path, error) from error
        return None if first is None else (first, last)

    def in_order_of(self, file: Path) -> "Recording":
        """Return this recording, read in the order of another file.

        Parameters
        ----------
        file : Path
            Parquet with the same rows and, in `index`, their positions in this recording.
        """
        other = copy.copy(self)
        other.sorted = True
        other._scan = pl.scan_parquet(file)
        return other

    def with_rows_of(self, file: Path, rows: int) -> "Recording":
        """Return this recording with further rows.

        Parameters
        ----------
        file : Path
            Parquet with the rows of this recording that are to be used, and further ones, with
            their positions in `index`: those of further rows are beyond this recording.
        rows : int
            Their number.
        """
        other = self.in_order_of(file)
        other.rows = rows
        return other

    def rejected_by_code(self, kinds: Collection[str] | None = None) -> Counter[str]:
        """Return the number of rejected lines of the selected kinds by code."""
        lines = self.rejected_lines
        return Counter() if lines is None else lines.counts(kinds)

    @property
    def octets(self) -> int:
        """Size of its files."""
        return sum(file.stat().st_size for file in self._files)

    def content_sha256(self) -> str:
        """Return the SHA-256 of the bytes of its files and of its order, hexadecimal."""
        digest = hashlib.sha256(b"sorted" if self.sorted else b"")
        for file in self._files:
            with file.open("rb") as stream:
                while chunk := stream.read(_HASH_CHUNK_BYTES):
                    digest.update(chunk)
        return digest.hexdigest()


def measurements_path(given: Path) -> Path:
    """Return the measurements file of a path: the file itself, or the one in the folder."""
    inside = given / MEASUREMENTS_FILE
    return inside if given.is_dir() else given


def check_columns(name: str, found: pl.Schema) -> None:
    """Check that a table has the columns of measurements, of types that can be converted.

    Parameters
    ----------
    name : str
        Its name in errors.
    found : Schema
        Its columns.

    Raises
    ------
    MissingColumnError
        A required column of `MEASUREMENT_SCHEMA` is missing.
    InputError
        A column has an unsupported type.
    """
    missing = [one for one in MEASUREMENT_SCHEMA if one not in {*found, *MEASUREMENT_LATER}]
    if missing:
        raise MissingColumnError(name, missing, list(found), other_table(found, missing))
    if found["time_s"] == pl.Float32():
        msg = (
            f"{name}: expected Float64 or whole seconds in the column time_s, found Float32, "
            "whose resolution for Unix times is 128 s"
        )
        raise InputError(msg)
    for column, wanted in MEASUREMENT_SCHEMA.items():
        if not _convertible(found.get(column, wanted), wanted):
            msg = f"{name}: expected {wanted} in the column {column}, found {found[column]}"
            raise InputError(msg)


def _convertible(found: pl.DataType, wanted: pl.DataType) -> bool:
    if found == wanted or found == pl.Null():
        return True
    if wanted == pl.Float64():
        return found.is_numeric()
    if wanted == pl.Int64():
        return found.is_integer()
    # A number is not a code: 0123 would lose its first digit.
    return isinstance(found, pl.Categorical | pl.Enum)


def _unreadable(path: Path, error: Exception) -> InputError:
    hint = ""
    if path.suffix.lower() != ".parquet":
        hint = "; `multiradar convert` creates one from a recording"
    return InputError(f"{unreadable(path, 'measurements', error)}{hint}")


def _first_line(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return lines[0] if lines else repr(error)
