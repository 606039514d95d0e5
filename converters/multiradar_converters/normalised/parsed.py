"""Result of parsing a message: accepted rows, and rejected rows with their index."""

from collections.abc import Sequence
from dataclasses import dataclass

import polars as pl

from multiradar_schemas.errors import BodyError
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.measurements.measurement import Measurement
from multiradar_schemas.reject import RejectCode

#: Column with the index of a row in its message.
INDEX_COLUMN = "index"

#: Default maximum of measurements per message.
ROWS_MAX = 100_000

#: Columns of `Parsed.frame`.
PARSED_SCHEMA = pl.Schema({**MEASUREMENT_SCHEMA, INDEX_COLUMN: pl.UInt32()})

_NAMES = MEASUREMENT_SCHEMA.names()
_ROW_SCHEMA = {
    **MEASUREMENT_SCHEMA,
    "time_ns": pl.Int64(),
    "time": pl.Datetime("us", "UTC"),
}

#: The time in seconds, from any of its three forms.
SECONDS = pl.coalesce(
    "time_s", pl.col("time_ns") / 1e9, pl.col("time").dt.timestamp("us") / 1e6
).alias("time_s")


@dataclass(frozen=True, slots=True)
class ParsedReject:
    """A rejected row.

    Attributes
    ----------
    index : int
        Index of the row in its message, from 0; for NDJSON the line, including blank lines.
    code : RejectCode
        Stable code.
    reason : str
        Reason in words.
    raw : str
        Original content; for a table, the row as JSON.
    """

    index: int
    code: RejectCode
    reason: str
    raw: str


@dataclass(frozen=True, slots=True)
class Parsed:
    """A message: every row of it is either in `frame` or in `rejected`.

    Attributes
    ----------
    frame : DataFrame
        Accepted rows: `MEASUREMENT_SCHEMA`, and `index` (UInt32), the index in the message.
    rejected : list of ParsedReject
        Rejected rows, by ascending index.
    """

    frame: pl.DataFrame
    rejected: list[ParsedReject]


def rows_frame(rows: Sequence[Measurement], index: Sequence[int] | None = None) -> pl.DataFrame:
    """Return validated measurements as a table of `PARSED_SCHEMA`.

    Parameters
    ----------
    rows : sequence of Measurement
        The measurements.
    index : sequence of int, optional
        Their indices in the message; default 0, 1, 2, …

    Returns
    -------
    DataFrame
        A row each, with the time in seconds.
    """
    places = pl.Series(INDEX_COLUMN, range(len(rows)) if index is None else index, dtype=pl.UInt32)
    fields = [row.__dict__ for row in rows]
    if fields and all(one["time_s"] is not None for one in fields):
        return pl.from_dicts(fields, MEASUREMENT_SCHEMA).hstack([places])
    frame = pl.DataFrame(fields, schema=_ROW_SCHEMA)
    if frame["time_s"].null_count():
        frame = frame.with_columns(SECONDS)
    return frame[:, _NAMES].hstack([places])


def check_rows_max(rows: int, rows_max: int) -> None:
    """Reject a message with more rows than a limit.

    Raises
    ------
    BodyError
        With the code TOO_LARGE.
    """
    if rows > rows_max:
        raise BodyError(
            RejectCode.TOO_LARGE, f"expected at most {rows_max} measurements, found {rows}"
        )
