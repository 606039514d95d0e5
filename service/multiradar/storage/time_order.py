"""Sorts a recording by time in bounded memory and two passes.

The first pass writes sorted runs; the second merges them, one time span after the other. Rows of
the same time keep their order.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count, islice
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.storage.recording import BLOCK_ROWS, INDEX_COLUMN, Recording
from multiradar.storage.table_writer import TableWriter
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA

#: Rows of a run; at most two runs are in memory.
RUN_ROWS = 16 * BLOCK_ROWS
#: Interval of the time samples of a run, rows, from which time spans that fit in memory are found.
SAMPLE_ROWS = 8192
#: Rows before a gap among the first rows are attributed to a wrong clock: number of rows, gap in s.
FIRST_ROWS = 5
GAP_MAX_S = 600.0
_TIME_MAX_S = 1e11


def disorder_s(recording: Recording) -> float:
    """Return the maximum time by which a row lags behind an earlier row, s; 0 when in order."""
    latest_s, greatest_s = -np.inf, 0.0
    for time_s in recording.times():
        known_s = time_s[_usable(time_s)]
        if len(known_s):
            reached_s = np.maximum.accumulate(np.maximum(known_s, latest_s))
            greatest_s = max(greatest_s, float(np.max(reached_s - known_s)))
            latest_s = float(reached_s[-1])
    return greatest_s


def in_time_order(recording: Recording, folder: Path) -> Recording:
    """Return the recording in order of time.

    Rows without a valid time come last, and so do a few rows (less than `FIRST_ROWS`) that precede
    all others by more than `GAP_MAX_S`, so that admission rejects these and not the others.

    Parameters
    ----------
    recording : Recording
        The recording.
    folder : Path
        Existing, empty folder for temporary files, from which the result is read.

    Returns
    -------
    Recording
        The same rows with their original positions.

    Raises
    ------
    InputError
        The recording cannot be read.
    """
    runs = list(_write_runs(recording, folder, _begin_s(recording)))
    file = folder / "in-order.parquet"
    schema = pl.Schema({**MEASUREMENT_SCHEMA, INDEX_COLUMN: pl.get_index_type()})
    writer = TableWriter(file, schema)
    for piece in _merged(runs):
        writer.append(piece.select(list(schema)))
    writer.finish()
    return recording.in_order_of(file)


def _usable(time_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.abs(time_s) < _TIME_MAX_S


def _begin_s(recording: Recording) -> float:
    first_s = np.empty(0)
    for time_s in recording.times():
        first_s = np.sort(np.append(first_s, time_s[_usable(time_s)]))[:FIRST_ROWS]
    gaps = np.flatnonzero(np.diff(first_s) > GAP_MAX_S)
    return float(first_s[gaps[-1] + 1]) if len(gaps) else -np.inf


@dataclass(frozen=True, slots=True)
class _Run:
    # Rows in order of time on disk, and their times, memory-mapped.
    rows: pl.LazyFrame
    order: NDArray[np.float64]

    def span(self, start: int, stop: int) -> pl.DataFrame:
        return self.rows.slice(start, stop - start).collect()


def _write_runs(recording: Recording, folder: Path, begin_s: float) -> Iterator[_Run]:
    blocks = recording.blocks()
    # A run consists of several blocks; the last run may have fewer.
    for number in count():
        pending = list(islice(blocks, max(RUN_ROWS // BLOCK_ROWS, 1)))
        if not pending:
            return
        yield _write_run(pl.concat(pending), folder / f"run-{number:06d}", begin_s)


def _write_run(rows: pl.DataFrame, path: Path, begin_s: float) -> _Run:
    time_s = rows["time_s"].fill_null(np.nan).to_numpy()
    key = np.where(_usable(time_s) & (time_s >= begin_s), time_s, np.inf)
    places = np.argsort(key, kind="stable")
    key[places].tofile(path.with_suffix(".order"))
    file = path.with_suffix(".parquet")
    # Small row groups, so that a span is read without the rest of the run.
    rows[places].write_parquet(file, compression="zstd", row_group_size=SAMPLE_ROWS)
    return _Run(pl.scan_parquet(file), np.memmap(path.with_suffix(".order"), np.float64, "r"))


# Consecutive pieces in time, each small enough for memory unless all its times are equal.
def _merged(runs: Sequence[_Run]) -> Iterator[pl.DataFrame]:
    starts = [0] * len(runs)
    for bound in [*_bounds(runs), np.inf]:
        stops = [int(np.searchsorted(run.order, bound)) for run in runs]
        spans = [*zip(runs, starts, stops, strict=True)]
        keys = np.concatenate([run.order[start:stop] for run, start, stop in spans])
        piece = pl.concat([run.span(start, stop) for run, start, stop in spans])
        yield piece[np.argsort(keys, kind="stable")]
        starts = stops
    for run, start in zip(runs, starts, strict=True):
        for offset in range(start, len(run.order), BLOCK_ROWS):
            yield run.span(offset, min(offset + BLOCK_ROWS, len(run.order)))


def _bounds(runs: Sequence[_Run]) -> NDArray[np.float64]:
    # Between two bounds there are as many samples as runs: at most about 2 × `SAMPLE_ROWS` rows of
    # each run.
    samples = np.sort(np.concatenate([run.order[::SAMPLE_ROWS] for run in runs]))
    return np.unique(samples[np.isfinite(samples)][:: len(runs)])
