"""Large JSON and NDJSON bodies of valid rows, read as columns.

A compiled parser reads all rows at once; it skips unknown keys, keeps the first of two values of a
key, and makes texts of numbers. The keys and values are therefore searched before; where there are
others, there are no columns, and the rows are read one by one.
"""

import io

import numpy as np
import polars as pl

from multiradar_converters.normalised._kernels import scan_objects
from multiradar_converters.normalised.arrow import parse_columns
from multiradar_converters.normalised.parsed import Parsed
from multiradar_schemas.errors import BodyError
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA

#: Shorter messages are read faster row by row.
ROWS_MIN = 200
#: Larger ones would be in memory ten times.
OCTETS_MAX = 8 * 1024 * 1024
_WHITESPACE = b" \t\r\n"
_COMMA, _LF = b",\n"
_TYPES = pl.Schema({**MEASUREMENT_SCHEMA, "time_ns": pl.Int64()})
_NAMES = np.array([name.encode() for name in _TYPES])
_LENGTHS = np.char.str_len(_NAMES).astype(np.int64)
_LETTERS = _NAMES.view(np.uint8).reshape(len(_NAMES), -1)
_IS_TEXT = np.array([kind == pl.String() for kind in _TYPES.values()])


def parse_array(body: bytes, rows_max: int, row_octets_max: int) -> Parsed | None:
    """Read an array of valid rows; see `parse_lines`."""
    if len(body) > OCTETS_MAX:
        return None
    inner = body.strip(_WHITESPACE)
    if not (inner.startswith(b"[") and inner.endswith(b"]")):
        return None
    return _parse(inner[1:-1], _COMMA, rows_max, row_octets_max)


def parse_lines(lines: bytes, rows_max: int, row_octets_max: int) -> Parsed | None:
    """Read objects, one per line, if all are valid rows without escapes and blank lines.

    Parameters
    ----------
    lines : bytes
        The objects, separated by LF.
    rows_max, row_octets_max : int
        Maximum number of rows, and of octets of a row.

    Returns
    -------
    Parsed or None
        All rows, accepted, as the other readers accept them; None if one may not be valid, or to
        read them in this way does not pay.
    """
    return None if len(lines) > OCTETS_MAX else _parse(lines, _LF, rows_max, row_octets_max)


def _parse(objects: bytes, separator: int, rows_max: int, row_octets_max: int) -> Parsed | None:
    text = np.frombuffer(objects, np.uint8).copy()
    after = np.append(np.arange(1, len(_NAMES) + 1) % len(_NAMES), 0)
    values = np.full(len(_NAMES), -1)
    rows = scan_objects(
        text, separator, row_octets_max, _LETTERS, _LENGTHS, _IS_TEXT, after, values
    )
    if not ROWS_MIN <= rows <= rows_max:
        return None
    found = dict(zip(_TYPES, values.tolist(), strict=True))
    try:
        # The parser does not require it of texts.
        objects.decode()
        schema = {name: kind for name, kind in _TYPES.items() if found[name] >= 0}
        frame = pl.read_ndjson(io.BytesIO(text.data), schema=schema)
        nulls = frame.null_count().row(0)
        if len(frame) != rows or any(
            rows - null != found[name] for name, null in zip(schema, nulls, strict=True)
        ):
            return None
        parsed = parse_columns(frame)
    # A panic of the parser is a BaseException.
    except (UnicodeDecodeError, pl.exceptions.PolarsError, pl.exceptions.PanicException, BodyError):
        return None
    return None if parsed.rejected else parsed
