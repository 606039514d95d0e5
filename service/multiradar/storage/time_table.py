"""A Parquet table that is read by time: any span, without the rest of its files.

Rows are read in blocks of the size of a row group; the last blocks read stay in memory. At the
start only the column of times is read.
"""

import threading
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.errors import InputError, MissingColumnError
from multiradar.storage.table_writer import ROW_GROUP_ROWS
from multiradar_schemas.documents.contents import other_table

TIME = "time_s"
#: Blocks in memory.
BLOCKS_MAX = 4
#: A file whose blocks together span more than this many times its own span is sorted first: each
#: span would otherwise lie in most of its blocks.
_OVERLAP_MAX = 4.0
#: Within a span of so many blocks times are compared; a single block is sorted in memory.
_SORTED_FILE = "in-order.parquet"


def scan_parts(paths: Sequence[Path]) -> pl.LazyFrame:
    """Return the rows of the parts of a table, in their order; raises errors of polars."""
    return pl.scan_parquet(
        list(paths), glob=False, missing_columns="insert", extra_columns="ignore"
    )


class TimeTable:
    """A table of one or more Parquet files whose rows are read by their time.

    Parameters
    ----------
    path : Path or sequence of Path
        The file, or the parts of the table; columns that later parts lack are null.
    columns : sequence of str
        Columns to read, `time_s` among them.
    optional : mapping of str to dtype
        Columns that are null where the file lacks them.
    folder : Path, optional
        Existing folder for a sorted copy of a table that is not nearly in order of time; without, a
        span of such a table is read from many of its blocks.
    block_rows : int, optional
        Rows read at once, those of a row group; a divisor of `ROW_GROUP_ROWS`, the default.

    Raises
    ------
    InputError
        The file cannot be read, or has no rows with a time.
    MissingColumnError
        It lacks one of the columns.
    """

    def __init__(
        self,
        path: Path | Sequence[Path],
        columns: Sequence[str],
        optional: Mapping[str, pl.DataType] | None = None,
        *,
        folder: Path | None = None,
        block_rows: int | None = None,
    ) -> None:
        self._block_rows = block_rows or ROW_GROUP_ROWS
        paths = [path] if isinstance(path, Path) else list(path)
        path = paths[0]
        self.path = path
        self._lock = threading.Lock()
        self._blocks: OrderedDict[int, tuple[pl.DataFrame, NDArray[np.float64]]] = OrderedDict()
        try:
            scan = scan_parts(paths)
            found = scan.collect_schema().names()
            absent = {name: dtype for name, dtype in (optional or {}).items() if name not in found}
            missing = [name for name in columns if name not in {*found, *absent}]
            if missing:
                raise MissingColumnError(str(path), missing, found, other_table(found, missing))
            self._scan = scan.with_columns(
                pl.lit(None, dtype).alias(name) for name, dtype in absent.items()
            ).select(columns)
            self._starts, self._first_s, self._last_s = self._indexed()
            if folder is not None and self._overlap() > _OVERLAP_MAX:
                copy = folder / f"{path.parent.name}-{_SORTED_FILE}"
                self._scan.sort(TIME, maintain_order=True).sink_parquet(
                    copy, row_group_size=ROW_GROUP_ROWS
                )
                self._scan = pl.scan_parquet(copy)
                self._starts, self._first_s, self._last_s = self._indexed()
        except (pl.exceptions.PolarsError, OSError) as error:
            msg = f"{path}: cannot be read as Parquet: {str(error).splitlines()[0]}"
            raise InputError(msg) from error
        if not len(self._starts):
            msg = f"{path}: no rows"
            raise InputError(msg)

    @property
    def span_s(self) -> tuple[float, float]:
        """The first and the last time, s."""
        return float(self._first_s.min()), float(self._last_s.max())

    def between(self, after_s: float, until_s: float) -> pl.DataFrame:
        """Return the rows of a span by ascending time.

        Parameters
        ----------
        after_s, until_s : float
            Rows later than the first and not later than the second.

        Returns
        -------
        DataFrame
            The chosen columns; rows of the same time in the order of the file.
        """
        met = np.flatnonzero((self._last_s > after_s) & (self._first_s <= until_s))
        parts, disordered = [], False
        latest_s = -np.inf
        for number in met.tolist():
            rows, time_s = self._block(number)
            first, last = np.searchsorted(time_s, [after_s, until_s], side="right").tolist()
            if first == last:
                continue
            disordered |= bool(time_s[first] < latest_s)
            latest_s = float(time_s[last - 1])
            parts.append(rows[first:last])
        if not parts:
            return self._block(0)[0].clear()
        found = pl.concat(parts)
        return found.sort(TIME, maintain_order=True) if disordered else found

    def _indexed(self) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        times = self._scan.select(pl.col(TIME).cast(pl.Float64))
        rows = int(self._scan.select(pl.len()).collect().item())
        starts, first_s, last_s = [], [], []
        for start in range(0, rows, ROW_GROUP_ROWS):
            found = times.slice(start, ROW_GROUP_ROWS).collect()[TIME].fill_null(np.nan).to_numpy()
            for place in range(0, len(found), self._block_rows):
                known = found[place : place + self._block_rows]
                known = known[np.isfinite(known)]
                if len(known):
                    starts.append(start + place)
                    first_s.append(known.min())
                    last_s.append(known.max())
        return np.array(starts, np.int64), np.array(first_s), np.array(last_s)

    def _overlap(self) -> float:
        if len(self._starts) < 2:
            return 0.0
        whole_s = self._last_s.max() - self._first_s.min()
        return float(np.sum(self._last_s - self._first_s) / whole_s) if whole_s else 0.0

    def _block(self, number: int) -> tuple[pl.DataFrame, NDArray[np.float64]]:
        with self._lock:
            if number not in self._blocks:
                block = self._scan.slice(int(self._starts[number]), self._block_rows).collect()
                block = block.with_columns(pl.col(TIME).cast(pl.Float64))
                block = block.filter(pl.col(TIME).is_finite())
                if not block[TIME].is_sorted():
                    block = block.sort(TIME, maintain_order=True)
                self._blocks[number] = (block.rechunk(), block[TIME].to_numpy())
                if len(self._blocks) > BLOCKS_MAX:
                    self._blocks.popitem(last=False)
            self._blocks.move_to_end(number)
            return self._blocks[number]
