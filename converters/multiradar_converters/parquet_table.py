"""Parquet tables written in frames of fixed size, so that their bytes depend on the rows alone."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray
from polars.io.plugins import register_io_source

#: Rows of a frame and of a row group.
FRAME_ROWS = 1 << 16


def write_frames(path: Path, frames: Iterator[pl.DataFrame], schema: pl.Schema) -> int:
    """Write a table.

    Parameters
    ----------
    path : Path
        The file.
    frames : iterator of DataFrame
        Its rows in frames of `FRAME_ROWS`; the last one is shorter (see `even_blocks`).
    schema : Schema
        Its columns.

    Returns
    -------
    int
        Number of rows.
    """
    count = 0
    failure: list[BaseException] = []

    def counted(*_: object) -> Iterator[pl.DataFrame]:
        nonlocal count
        try:
            for frame in frames:
                count += frame.height
                yield frame
            if not count:
                yield pl.DataFrame(schema=schema)
        except BaseException as error:
            failure.append(error)
            raise

    source = register_io_source(counted, schema=schema, is_pure=False)
    try:
        source.sink_parquet(
            path,
            compression="snappy",
            row_group_size=FRAME_ROWS,
            statistics=True,
            engine="streaming",
        )
    except pl.exceptions.PolarsError:
        # The generator failed; polars reports only the text of its error.
        if failure:
            raise failure[0] from None
        raise
    return count


def even_blocks(blocks: Iterator[NDArray[np.int64]]) -> Iterator[NDArray[np.int64]]:
    """Regroup rows into blocks of `FRAME_ROWS`; the last one is shorter.

    Parameters
    ----------
    blocks : iterator of int64[n, w]
        Rows in blocks of any size.

    Yields
    ------
    int64[m, w]
        The same rows.
    """
    parts: list[NDArray[np.int64]] = []
    held = 0
    for block in blocks:
        left = block
        while len(left):
            taken = left[: FRAME_ROWS - held]
            parts.append(taken)
            held += len(taken)
            left = left[len(taken) :]
            if held == FRAME_ROWS:
                yield np.concatenate(parts)
                parts, held = [], 0
    if held:
        yield np.concatenate(parts)
