"""Arrow bodies: an IPC stream with columns of `MEASUREMENT_SCHEMA`, in any order.

Optional columns may be missing. Text may be utf8, large_utf8, utf8_view or a dictionary of texts.
Float columns accept any integer or float type, integer columns any integer type. The time may also
be the column `time_ns` (integer) or `time` (a timestamp with zone) instead of `time_s`. Null means
missing. Rows with NaN or infinities are rejected.
"""

import io
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import polars as pl

from multiradar_converters.normalised.arrow_layout import ArrowLayoutError, check_layout
from multiradar_converters.normalised.checks import (
    Tested,
    rejected_rows,
    tested_by_loops,
    text_octets,
)
from multiradar_converters.normalised.parsed import (
    INDEX_COLUMN,
    PARSED_SCHEMA,
    ROWS_MAX,
    SECONDS,
    Parsed,
    ParsedReject,
    check_rows_max,
)
from multiradar_schemas.documents.names import did_you_mean
from multiradar_schemas.errors import BodyError
from multiradar_schemas.measurements.columns import (
    MEASUREMENT_REQUIRED,
    MEASUREMENT_SCHEMA,
    complete,
)
from multiradar_schemas.measurements.directions import without_empty_columns
from multiradar_schemas.measurements.gates import LISTED_ROWS_MAX, PHYSICAL_GATES, Gate
from multiradar_schemas.reject import RejectCode

#: Maximum total text, as a multiple of the body: dictionaries and views can repeat one long text in
#: every row.
TEXT_EXPANSION_MAX = 16

#: Total text up to which it is counted as Python texts: an expression takes longer.
_LISTED_BYTES_MAX = 1 << 22

_FILE_MAGIC, _PARQUET_MAGIC = b"ARROW1", b"PAR1"
_ROWS_CEILING = 2**31 - 1
_TIMES = ("time_s", "time_ns", "time")
_COLUMNS = (*_TIMES, *[name for name in MEASUREMENT_SCHEMA if name != "time_s"])
_LOST = "__lost"
_TEXTS = [name for name, kind in MEASUREMENT_SCHEMA.items() if kind == pl.String()]
_INTEGERS = (
    pl.Int8,
    pl.Int16,
    pl.Int32,
    pl.Int64,
    pl.UInt8,
    pl.UInt16,
    pl.UInt32,
    pl.UInt64,
)
#: Accepted input types by column type.
_ACCEPTED: dict[pl.DataType, tuple[str, tuple[type[pl.DataType], ...]]] = {
    pl.String(): ("text", (pl.String, pl.Categorical, pl.Enum)),
    pl.Float64(): ("numbers", (pl.Float32, pl.Float64, *_INTEGERS)),
    pl.Int64(): ("integers", _INTEGERS),
    pl.Boolean(): ("true or false", (pl.Boolean,)),
}

_NO_ROWS = pl.DataFrame(
    schema={**MEASUREMENT_SCHEMA, "time_ns": pl.Int64(), "time": pl.Datetime("us", "UTC")}
)
_NONE_LOST = pl.Series(_LOST, [None], dtype=pl.String)


def parse_arrow(body: bytes, *, rows_max: int = ROWS_MAX) -> Parsed:
    """Read an Arrow IPC stream of measurements.

    Parameters
    ----------
    body : bytes
        The stream, without compression.
    rows_max : int
        Maximum number of measurements.

    Returns
    -------
    Parsed
        Accepted and rejected rows; an invalid row does not affect the others.

    Raises
    ------
    BodyError
        When the body is not an Arrow stream or a column has the wrong type (MALFORMED_ARROW), a
        column is unknown (UNKNOWN_FIELD) or missing (MISSING_FIELD), or there are too many rows or
        too much text (TOO_LARGE).
    """
    if body.startswith(_FILE_MAGIC):
        raise _malformed("expected an Arrow IPC stream, found an Arrow file")
    if body.startswith(_PARQUET_MAGIC):
        raise _malformed("expected an Arrow IPC stream, found a Parquet file; `replay` sends one")
    try:
        check_rows_max(check_layout(body, _ROWS_CEILING), rows_max)
    except ArrowLayoutError as error:
        raise _malformed(f"not a valid Arrow IPC stream: {error}") from error
    frame = _read(body)
    _check_names(frame.columns)
    frame = _typed(frame)
    _check_text(frame, len(body))
    return _gated(frame)


def parse_columns(frame: pl.DataFrame) -> Parsed:
    """Read a table with the columns of an Arrow body.

    Parameters
    ----------
    frame : DataFrame
        The table.

    Returns
    -------
    Parsed
        As of `parse_arrow`.

    Raises
    ------
    BodyError
        When a column is unknown, missing or has the wrong type.
    """
    _check_names(frame.columns)
    return _gated(_typed(frame))


def _malformed(reason: str) -> BodyError:
    return BodyError(RejectCode.MALFORMED_ARROW, reason)


def _read(body: bytes) -> pl.DataFrame:
    try:
        return pl.read_ipc_stream(io.BytesIO(body), use_pyarrow=False)
    except pl.exceptions.PanicException as error:  # A BaseException: `except Exception` misses it.
        raise _malformed("the Arrow IPC stream is damaged") from error
    except (pl.exceptions.PolarsError, OSError, ValueError, MemoryError) as error:
        first_line = str(error).partition("\n")[0][:120]
        raise _malformed(f"not a valid Arrow IPC stream: {first_line}") from error


def _check_names(names: list[str]) -> None:
    for name in names:
        if name not in _COLUMNS:
            reason = f"expected only the columns {', '.join(_COLUMNS)}, found {ascii(name)[:60]}"
            reason += did_you_mean(name[:60], _COLUMNS)
            raise BodyError(RejectCode.UNKNOWN_FIELD, reason)
    times = [name for name in _TIMES if name in names]
    if len(times) > 1:
        reason = (
            f"expected one of the columns time_s, time_ns and time, found {' and '.join(times)}"
        )
        raise BodyError(RejectCode.UNKNOWN_FIELD, reason)
    missing = [name for name in MEASUREMENT_REQUIRED[1:] if name not in names]
    if missing or not times:
        absent = ", ".join([*([] if times else ["time_s"]), *missing])
        reason = f"expected the columns {', '.join(MEASUREMENT_REQUIRED)}; missing: {absent}"
        raise BodyError(RejectCode.MISSING_FIELD, reason)


def _typed(frame: pl.DataFrame) -> pl.DataFrame:
    columns = {name: _column(frame[name]) for name in frame.columns}
    lost = [
        frame[name].cast(pl.String).set(columns[name].is_not_null(), None)
        for name in ("track_number", "time_ns")
        if name in columns and columns[name].null_count() > frame[name].null_count()
    ]
    given = pl.DataFrame(list(columns.values()))
    typed = complete(given) if "time_s" in columns else pl.concat([_NO_ROWS, given], how="diagonal")
    index = pl.Series(INDEX_COLUMN, np.arange(len(frame), dtype=np.uint32))
    typed = typed.hstack([_NONE_LOST.new_from_index(0, len(frame)), index])
    if lost:
        typed = typed.with_columns(pl.coalesce(*lost).alias(_LOST))
    return typed if "time_s" in columns else typed.with_columns(SECONDS)


def _column(column: pl.Series) -> pl.Series:
    """Return a column in the type of the schema; raise BodyError for an unsupported type."""
    if column.name == "time":
        return _instants(column)
    wanted = pl.Int64() if column.name == "time_ns" else MEASUREMENT_SCHEMA[column.name]
    expected, accepted = _ACCEPTED[wanted]
    if column.dtype != pl.Null() and not isinstance(column.dtype, accepted):
        raise _wrong_type(column, expected)
    if type(column.dtype) is type(wanted):
        return column
    # Only an integer can overflow; it becomes null here and its row is rejected.
    return column.cast(wanted, strict=False)


def _instants(column: pl.Series) -> pl.Series:
    found = column.dtype
    if not isinstance(found, pl.Datetime) or found.time_zone is None:
        raise _wrong_type(column, "a timestamp with time zone")
    return column.dt.convert_time_zone("UTC").dt.cast_time_unit("us")


def _wrong_type(column: pl.Series, expected: str) -> BodyError:
    return _malformed(f"column {column.name}: expected {expected}, was {column.dtype}")


def _check_text(frame: pl.DataFrame, body_bytes: int) -> None:
    texts = [name for name in _TEXTS if frame[name].null_count() < len(frame)]
    # Each text is a part of the body, so that those of a short one are short.
    if len(texts) * len(frame) * body_bytes <= _LISTED_BYTES_MAX:
        total = sum(len(one.encode()) for name in texts for one in frame[name].to_list() if one)
    else:
        total = text_octets(frame, texts)
    most = TEXT_EXPANSION_MAX * body_bytes
    if total > most:
        reason = f"expected at most {most} bytes of text in all rows, found {total}"
        raise BodyError(RejectCode.TOO_LARGE, reason)


_GATES = (
    Gate(
        RejectCode.OUT_OF_RANGE,
        "track_number",
        "an integer of at most 63 bits",
        pl.col(_LOST).is_not_null(),
        _LOST,
        clear=lambda columns: _LOST in columns.empty,
    ),
    *PHYSICAL_GATES,
)


_USUAL = {
    "mode_s_address": pl.col("mode_s_address").str.to_lowercase(),
    "callsign": pl.col("callsign").str.strip_chars(" ").str.to_uppercase(),
}


# The same for one text, of which few rows have another.
_AS_STORED: dict[str, Callable[[str], str]] = {
    "mode_s_address": str.lower,
    "callsign": lambda text: text.strip(" ").upper(),
}


def _gated(frame: pl.DataFrame) -> Parsed:
    with tested_by_loops(frame, _GATES) as tested:
        index, codes, reasons = rejected_rows(frame, _GATES, tested)
    taken = frame
    rejected: list[ParsedReject] = []
    if len(index):
        shown = without_empty_columns(frame[index].select(*MEASUREMENT_SCHEMA, _LOST)).to_dicts()
        rejected = [
            ParsedReject(int(place), code, reason, _raw(row))
            for place, code, reason, row in zip(index, codes, reasons, shown, strict=True)
        ]
        taken = frame.filter(~pl.col(INDEX_COLUMN).is_in(index))
    filled = [one for name, one in _USUAL.items() if _may_change(taken, name, tested)]
    usual = taken.with_columns(filled) if filled else taken
    return Parsed(usual[:, PARSED_SCHEMA.names()], rejected)


def _may_change(frame: pl.DataFrame, name: str, tested: Tested | None) -> bool:
    # A row that is odd was not read, and may have been accepted all the same.
    if tested is not None and not tested.odd.any():
        return tested.unusual.get(name, 0) > 0
    if len(frame) <= LISTED_ROWS_MAX:
        texts = {text for text in frame[name].to_list() if text is not None}
        return any(text != _AS_STORED[name](text) for text in texts)
    return frame[name].null_count() < len(frame)


def _raw(row: dict[str, Any]) -> str:
    lost = row.pop(_LOST)
    return json.dumps(row if lost is None else {**row, "track_number": int(lost)})
