"""Records cut into values, as they stand."""

import csv
import json
from dataclasses import dataclass

from multiradar_converters.adsb.reading.layout import Layout
from multiradar_converters.vid.text.lines import RefusedError
from multiradar_schemas.measurements.reject import RejectCode


@dataclass(frozen=True)
class Pairs:
    """A JSON object with its names in their order, even those that stand there twice."""

    pairs: list[tuple[str, object]]


_DECODER = json.JSONDecoder(
    object_pairs_hook=Pairs, parse_int=str, parse_float=str, parse_constant=str
)


def object_cells(raw: bytes, layout: Layout) -> dict[int, str]:
    """Read a JSON object; values are told as they stand.

    Parameters
    ----------
    raw : bytes
        The object.
    layout : Layout
        How the file is laid out.

    Returns
    -------
    dict of int to str
        Value of each role that is used: text without quotes, null as nothing.

    Raises
    ------
    RefusedError
        It is none, or names something twice.
    """
    cells: dict[int, str] = {}
    for name, value in object_pairs(raw):
        role = layout.roles.get(name)
        if role is None:
            continue
        if role in cells:
            raise RefusedError(RejectCode.DUPLICATE_KEY, f"{name!r} stands there twice")
        cells[role] = json_text(value)
    return cells


def object_pairs(raw: bytes) -> list[tuple[str, object]]:
    """Return the names and values of a JSON object, in their order.

    Raises
    ------
    RefusedError
        It is none.
    """
    value = json_value(raw)
    if not isinstance(value, Pairs):
        raise RefusedError(RejectCode.WRONG_TYPE, f"expected a JSON object, was {_shown(raw)}")
    return value.pairs


def json_value(raw: bytes) -> object:
    """Read a JSON value: numbers stay the text they are, objects are `Pairs`.

    Raises
    ------
    RefusedError
        It is none.
    """
    try:
        return _DECODER.decode(raw.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise RefusedError(RejectCode.ENCODING, "expected text in UTF-8, was another") from error
    except json.JSONDecodeError as error:
        reason = f"expected JSON, was not at character {error.pos}: {error.msg}"
        raise RefusedError(RejectCode.MALFORMED_JSON, reason) from error
    except RecursionError as error:
        raise RefusedError(RejectCode.MALFORMED_JSON, "expected JSON of few levels") from error


def json_text(value: object) -> str:
    """Return a JSON value as text: null as nothing, a list or an object as what no value is."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return value if isinstance(value, str) else "a list or an object"


def line_cells(raw: bytes, layout: Layout) -> dict[int, str]:
    """Read a line of columns.

    Parameters
    ----------
    raw : bytes
        The line.
    layout : Layout
        How the file is laid out.

    Returns
    -------
    dict of int to str
        Value of each role that is used.

    Raises
    ------
    RefusedError
        The line is broken.
    """
    found = split_line(raw, layout.separator)
    if len(found) != len(layout.columns):
        reason = f"expected {len(layout.columns)} fields, was {len(found)}"
        raise RefusedError(RejectCode.WRONG_FIELD_COUNT, reason)
    return {role: text for role, text in zip(layout.columns, found, strict=True) if role >= 0}


def split_line(raw: bytes, separator: bytes) -> list[str]:
    """Split a line of CSV; quotes and blanks around a value do not belong to it.

    Raises
    ------
    RefusedError
        It is no text, or a quote is not closed.
    """
    if b"\0" in raw:
        raise RefusedError(RejectCode.ENCODING, "expected text, found a NUL byte")
    try:
        text = raw.decode("utf-8")
        fields = next(csv.reader([text], delimiter=separator.decode(), strict=True), [])
    except UnicodeDecodeError as error:
        raise RefusedError(RejectCode.ENCODING, "expected text in UTF-8, was another") from error
    except csv.Error as error:
        raise RefusedError(RejectCode.MALFORMED_LINE, f"expected CSV, was not: {error}") from error
    return [field.strip(" ") for field in fields]


def _shown(raw: bytes) -> str:
    return repr(raw[:40].decode("utf-8", errors="backslashreplace"))
