"""Large JSON and NDJSON bodies of valid rows, read as columns.

A compiled parser reads all rows at once; it skips unknown keys, keeps the first of two values of a
key, and makes texts of numbers. Counts of keys and quotation marks show that none of this happened;
where they do not, there are no columns, and the rows are read one by one.
"""

import io
import json
import re

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar_converters.normalised.arrow import parse_columns
from multiradar_converters.normalised.parsed import Parsed
from multiradar_schemas.errors import BodyError
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA

#: Shorter messages are read faster row by row.
ROWS_MIN = 200
#: Larger ones would be in memory ten times.
OCTETS_MAX = 8 * 1024 * 1024
#: Rows that are searched for the names of the fields.
SEARCHED = 50
#: Between two objects of an array.
_SEPARATOR = re.compile(rb"}[ \t\r\n]*,[ \t\r\n]*{")
_WHITESPACE = b" \t\r\n"
_TYPES = pl.Schema({**MEASUREMENT_SCHEMA, "time_ns": pl.Int64()})


def parse_array(body: bytes, rows_max: int, characters_max: int) -> Parsed | None:
    """Read an array of valid rows; see `parse_lines`."""
    if len(body) > OCTETS_MAX:
        return None
    inner = body.strip(_WHITESPACE)
    separator = _SEPARATOR.search(inner)
    if separator is None or not (inner.startswith(b"[") and inner.endswith(b"]")):
        return None
    lines = inner[1:-1].strip(_WHITESPACE).replace(separator[0], b"}\n{")
    return parse_lines(lines, rows_max, characters_max)


def parse_lines(lines: bytes, rows_max: int, characters_max: int) -> Parsed | None:
    """Read objects, one per line, if all are valid rows without escapes and blank lines.

    Parameters
    ----------
    lines : bytes
        The objects, separated by LF.
    rows_max, characters_max : int
        Maximum number of rows, and of characters of a row.

    Returns
    -------
    Parsed or None
        All rows, accepted, as the other readers accept them; None if one may not be valid, or to
        read them in this way does not pay.
    """
    if len(lines) > OCTETS_MAX:
        return None
    octets = np.frombuffer(lines, np.uint8)
    ends = np.flatnonzero(octets == ord("\n"))
    if not ROWS_MIN <= len(ends) + 1 <= rows_max or not _are_objects(octets, ends):
        return None
    names = _names(lines)
    if not names or not names <= set(_TYPES):
        return None
    schema = {name: _TYPES[name] for name in _TYPES if name in names}
    try:
        text = pl.DataFrame({"line": pl.Series([lines.decode()]).str.split("\n").explode()})
        frame = pl.read_ndjson(io.BytesIO(lines), schema=schema)
        if not _is_whole(octets, text, frame, characters_max):
            return None
        parsed = parse_columns(frame)
    # A panic of the parser is a BaseException.
    except (UnicodeDecodeError, pl.exceptions.PolarsError, pl.exceptions.PanicException, BodyError):
        return None
    return None if parsed.rejected else parsed


def _are_objects(octets: NDArray[np.uint8], ends: NDArray[np.intp]) -> bool:
    """Return whether each line is one object that contains none, and no text has an escape."""
    begins, closes = octets == ord("{"), octets == ord("}")
    return (
        bool(begins[0] and closes[-1])
        and bool(begins[ends + 1].all() and closes[ends - 1].all())
        and np.count_nonzero(begins) == np.count_nonzero(closes) == len(ends) + 1
        and not (octets == ord("\\")).any()
    )


def _names(lines: bytes) -> set[str]:
    names: set[str] = set()
    for line in lines.split(b"\n", SEARCHED)[:SEARCHED]:
        try:
            names.update(json.loads(line))
        except ValueError:
            return set()
    return names


def _is_whole(
    octets: NDArray[np.uint8], text: pl.DataFrame, frame: pl.DataFrame, characters_max: int
) -> bool:
    """Return whether the columns have all that the lines have.

    Without escapes a text contains no quotation mark: each key and each text has two, and the
    second one of a key is before a colon.
    """
    marks = octets == ord('"')
    line = pl.col("line")
    found = text.select(
        line.str.len_chars().max().alias("length"),
        *[line.str.count_matches(f'"{name}":', literal=True).alias(name) for name in frame.columns],
    )
    keys = sum(found.select(pl.col(frame.columns).sum()).row(0))
    texts = [name for name, kind in frame.schema.items() if kind == pl.String()]
    values = sum(len(frame) - frame[name].null_count() for name in texts)
    return (
        len(frame) == len(text)
        and found["length"][0] <= characters_max
        and max(found.select(pl.col(frame.columns).max()).row(0)) == 1
        and np.count_nonzero(marks[:-1] & (octets[1:] == ord(":"))) == keys
        and np.count_nonzero(marks) == 2 * (keys + values)
    )
