"""What comes out of a message: the rows taken, and the rows refused with their place."""

from collections.abc import Sequence
from dataclasses import dataclass

import polars as pl

from multiradar_schemas.errors import BodyError
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.measurements.measurement import Measurement
from multiradar_schemas.measurements.reject import RejectCode

#: Column that says where a row stood in its message.
INDEX_COLUMN = "index"

#: Most measurements of one message, unless told otherwise.
ROWS_MAX = 100_000

#: Columns of `Parsed.frame`.
PARSED_SCHEMA = pl.Schema({**MEASUREMENT_SCHEMA, INDEX_COLUMN: pl.UInt32()})

_ROW_SCHEMA = {
    **MEASUREMENT_SCHEMA,
    "time_ns": pl.Int64(),
    "time": pl.Datetime("us", "UTC"),
}

#: The time in seconds, whichever of its three forms a row has.
SECONDS = pl.coalesce(
    "time_s", pl.col("time_ns") / 1e9, pl.col("time").dt.timestamp("us") / 1e6
).alias("time_s")


@dataclass(frozen=True, slots=True)
class ParsedReject:
    """One row that was refused.

    Attributes
    ----------
    index : int
        Place of the row in its message, from 0; in NDJSON the line, blank ones counted.
    code : RejectCode
        Why, as a stable code.
    reason : str
        Why, as a sentence.
    raw : str
        What stood there; of a table, the row as JSON.
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
        The rows taken: `MEASUREMENT_SCHEMA`, and `index` (UInt32), the place in the message.
    rejected : list of ParsedReject
        The rows refused, by ascending index.
    """

    frame: pl.DataFrame
    rejected: list[ParsedReject]


def rows_frame(rows: Sequence[Measurement], index: Sequence[int] | None = None) -> pl.DataFrame:
    """Return checked measurements as a table of `PARSED_SCHEMA`.

    Parameters
    ----------
    rows : sequence of Measurement
        The measurements.
    index : sequence of int, optional
        Their places in the message; 0, 1, 2, … when not given.

    Returns
    -------
    DataFrame
        One row each, the time in seconds whichever way it was given.
    """
    frame = pl.DataFrame([row.__dict__ for row in rows], schema=_ROW_SCHEMA)
    places = pl.int_range(pl.len()) if index is None else pl.Series(index, dtype=pl.UInt32)
    return frame.with_columns(
        SECONDS,
        places.alias(INDEX_COLUMN),
    ).select(pl.col(name).cast(kind) for name, kind in PARSED_SCHEMA.items())


def check_rows_max(rows: int, rows_max: int) -> None:
    """Refuse a message with more rows than a configured limit.

    Raises
    ------
    BodyError
        With the code TOO_LARGE.
    """
    if rows > rows_max:
        raise BodyError(
            RejectCode.TOO_LARGE, f"expected at most {rows_max} measurements, was {rows}"
        )
