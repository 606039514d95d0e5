"""Large JSON and NDJSON bodies of valid rows, read as columns.

A compiled loop reads keys and values in one pass. Where something is not as expected, there are no
columns, and the rows are read one by one, by a parser that names what is wrong.
"""

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar_converters.normalised import _kernels as kernels
from multiradar_converters.normalised._number_kernels import powers_of_five
from multiradar_converters.normalised.arrow import parse_columns
from multiradar_converters.normalised.parsed import Parsed
from multiradar_schemas.errors import BodyError
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA

#: Shorter messages are read faster row by row.
ROWS_MIN = 200
#: Larger ones would be in memory several times.
OCTETS_MAX = 8 * 1024 * 1024
_WHITESPACE = b" \t\r\n"
_COMMA, _LF = b",\n"
_TYPES = pl.Schema({**MEASUREMENT_SCHEMA, "time_ns": pl.Int64()})
_NAMES = np.array([name.encode() for name in _TYPES])
_FORM_OF: dict[type[pl.DataType], int] = {
    pl.Float64: kernels.FLOAT,
    pl.Int64: kernels.INTEGER,
    pl.String: kernels.TEXT,
    pl.Boolean: kernels.BOOLEAN,
}
_FORMS = np.array([_FORM_OF[type(kind)] for kind in _TYPES.values()])
# Integers and booleans share columns.
_TABLES = np.where(_FORMS == kernels.BOOLEAN, kernels.INTEGER, _FORMS)
_SLOTS = np.array([np.sum(_TABLES[:place] == table) for place, table in enumerate(_TABLES)])
_FLOATS, _INTEGERS, _TEXTS = (
    int(np.sum(one == _TABLES)) for one in (kernels.FLOAT, kernels.INTEGER, kernels.TEXT)
)
_KEYS = kernels.Keys(
    _NAMES.view(np.uint8).reshape(len(_NAMES), -1),
    np.char.str_len(_NAMES).astype(np.int64),
    _FORMS,
    _SLOTS,
)
_POWERS = powers_of_five()


def parse_array(body: bytes, rows_max: int, row_octets_max: int) -> Parsed | None:
    """Read an array of valid rows; see `parse_lines`."""
    if len(body) > OCTETS_MAX:
        return None
    begin = len(body) - len(body.lstrip(_WHITESPACE))
    end = len(body.rstrip(_WHITESPACE))
    if end - begin < len("[]") or body[begin : begin + 1] != b"[" or body[end - 1 : end] != b"]":
        return None
    text = np.frombuffer(body, np.uint8)[begin + 1 : end - 1]
    return _parse(text, _COMMA, rows_max, row_octets_max)


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
    if not 0 < len(lines) <= OCTETS_MAX:
        return None
    return _parse(np.frombuffer(lines, np.uint8), _LF, rows_max, row_octets_max)


def _parse(
    text: NDArray[np.uint8], separator: int, rows_max: int, row_octets_max: int
) -> Parsed | None:
    most = kernels.count_objects(text)
    if not ROWS_MIN <= most <= rows_max:
        return None
    after = np.append(np.arange(1, len(_NAMES) + 1) % len(_NAMES), 0)
    # Of columns that do not occur, no memory is touched.
    values = kernels.Values(
        np.zeros((_FLOATS, most), np.uint64),
        np.zeros((_INTEGERS, most), np.int64),
        np.zeros((_TEXTS, most, 2), np.int64),
        np.zeros((len(_NAMES), most), np.uint8),
        np.full(len(_NAMES), -1),
    )
    rows = kernels.read_objects(text, separator, row_octets_max, _KEYS, after, _POWERS, values)
    if rows != most:
        return None
    # A column without a value is as good as none.
    columns = [_column(text, place, values) for place in np.flatnonzero(values.counts > 0).tolist()]
    try:
        parsed = parse_columns(pl.DataFrame(columns))
    except BodyError:
        return None
    return None if parsed.rejected else parsed


def _column(text: NDArray[np.uint8], place: int, values: kernels.Values) -> pl.Series:
    form, slot = _FORMS[place], _SLOTS[place]
    if form == kernels.TEXT:
        column = _texts(text, values.spans[slot])
    elif form == kernels.FLOAT:
        column = pl.Series(values.floats[slot].view(np.float64))
    else:
        column = pl.Series(values.integers[slot])
    if form == kernels.BOOLEAN:
        column = column.cast(pl.Boolean)
    if values.counts[place] < len(column):
        column = column.set(pl.Series(values.given[place] == 0), None)
    return column.alias(_TYPES.names()[place])


def _texts(text: NDArray[np.uint8], spans: NDArray[np.int64]) -> pl.Series:
    joined = np.empty(int((spans[:, 1] - spans[:, 0]).sum()) + len(spans), np.uint8)
    size = kernels.join_texts(text, spans, joined)
    texts: pl.Series = pl.Series([joined[:size].tobytes().decode("ascii")]).str.split("\n")[0]
    return texts
