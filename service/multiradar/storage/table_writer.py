"""Parquet files written piece by piece; the bytes do not depend on the size of the pieces."""

import shutil
from pathlib import Path

import polars as pl

#: Rows in a row group of the file, and in a part of the spool.
ROW_GROUP_ROWS = 131_072
#: The data are mostly noise, which higher levels do not compress further.
COMPRESSION_LEVEL = 1
#: Small pieces are concatenated when there are so many, so that pieces of one row are cheap.
_PIECES_MAX = 256


class TableWriter:
    """A Parquet file written from frames of any size, in bounded memory.

    Parts of `ROW_GROUP_ROWS` rows go to a spool beside the file; `finish` streams them into the
    file in order. The bytes depend on the rows alone.

    Parameters
    ----------
    path : Path
        The file to create; its folder exists.
    schema : Schema
        Columns and types of every frame.
    """

    def __init__(self, path: Path, schema: pl.Schema) -> None:
        self._path = path
        self._schema = schema
        self._spool = path.with_name(f".{path.name}.spool")
        self._spool.mkdir()
        self._parts: list[Path] = []
        self._joined = [pl.DataFrame(schema=schema)]
        self._pieces: list[pl.DataFrame] = []
        self._pending_rows = 0

    def append(self, frame: pl.DataFrame) -> None:
        """Append the rows of a frame.

        Parameters
        ----------
        frame : DataFrame
            Columns in the order of the schema.
        """
        if frame.is_empty():
            return
        self._pieces.append(frame)
        self._pending_rows += len(frame)
        if self._pending_rows >= ROW_GROUP_ROWS:
            self._spill()
        elif len(self._pieces) >= _PIECES_MAX:
            self._joined.append(pl.concat(self._pieces))
            self._pieces = []

    def finish(self) -> None:
        """Write pending rows, create the file and remove the spool."""
        self._write_part(pl.concat([*self._joined, *self._pieces]))
        pl.scan_ipc(self._parts).sink_parquet(
            self._path,
            compression="zstd",
            compression_level=COMPRESSION_LEVEL,
            row_group_size=ROW_GROUP_ROWS,
        )
        shutil.rmtree(self._spool)

    def _spill(self) -> None:
        rows = pl.concat([*self._joined, *self._pieces])
        whole = len(rows) - len(rows) % ROW_GROUP_ROWS
        for start in range(0, whole, ROW_GROUP_ROWS):
            self._write_part(rows.slice(start, ROW_GROUP_ROWS))
        self._joined, self._pieces = [rows.slice(whole)], []
        self._pending_rows = len(rows) - whole

    def _write_part(self, rows: pl.DataFrame) -> None:
        part = self._spool / f"{len(self._parts):08d}.arrow"
        rows.rechunk().write_ipc(part)
        self._parts.append(part)
