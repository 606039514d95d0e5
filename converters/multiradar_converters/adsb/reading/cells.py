"""Splitting of records into the text of their values."""

import csv
import json
from dataclasses import dataclass

from multiradar_converters.adsb.reading.layout import Layout
from multiradar_converters.vid.text.lines import RejectedError
from multiradar_schemas.reject import RejectCode


@dataclass(frozen=True)
class Pairs:
    """A JSON object with its names in order, including duplicates."""

    pairs: list[tuple[str, object]]


_DECODER = json.JSONDecoder(
    object_pairs_hook=Pairs, parse_int=str, parse_float=str, parse_constant=str
)


def object_cells(raw: bytes, layout: Layout) -> dict[int, str]:
    """Read a JSON object; values are unconverted text.

    Returns
    -------
    dict of int to str
        Value of each used role: text without quotes; null as empty text.

    Raises
    ------
    RejectedError
        It is not an object, or has a duplicate name.
    """
    cells: dict[int, str] = {}
    for name, value in object_pairs(raw):
        role = layout.roles.get(name)
        if role is None:
            continue
        if role in cells:
            raise RejectedError(RejectCode.DUPLICATE_KEY, f"{name!r} is repeated")
        cells[role] = json_text(value)
    return cells


def object_pairs(raw: bytes) -> list[tuple[str, object]]:
    """Return the names and values of a JSON object, in order.

    Raises
    ------
    RejectedError
        It is not an object.
    """
    value = json_value(raw)
    if not isinstance(value, Pairs):
        raise RejectedError(RejectCode.WRONG_TYPE, f"expected a JSON object, found {_shown(raw)}")
    return value.pairs


def json_value(raw: bytes) -> object:
    """Read a JSON value; numbers stay text, objects become `Pairs`.

    Raises
    ------
    RejectedError
        It is not valid JSON.
    """
    try:
        return _DECODER.decode(raw.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise RejectedError(RejectCode.ENCODING, "expected UTF-8 text") from error
    except json.JSONDecodeError as error:
        reason = f"not valid JSON at character {error.pos}: {error.msg}"
        raise RejectedError(RejectCode.MALFORMED_JSON, reason) from error
    except RecursionError as error:
        raise RejectedError(RejectCode.MALFORMED_JSON, "the JSON is nested too deeply") from error


def json_text(value: object) -> str:
    """Return a JSON value as text; null is empty, a list or an object an invalid text."""
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
        Layout of the file.

    Returns
    -------
    dict of int to str
        Value of each used role.

    Raises
    ------
    RejectedError
        The line is malformed.
    """
    found = split_line(raw, layout.separator)
    if len(found) != len(layout.columns):
        reason = f"expected {len(layout.columns)} fields, found {len(found)}"
        raise RejectedError(RejectCode.WRONG_FIELD_COUNT, reason)
    return {role: text for role, text in zip(layout.columns, found, strict=True) if role >= 0}


def split_line(raw: bytes, separator: bytes) -> list[str]:
    """Split a line of CSV; quotes and blanks around values are removed.

    Raises
    ------
    RejectedError
        It is not text, or a quote is not closed.
    """
    if b"\0" in raw:
        raise RejectedError(RejectCode.ENCODING, "expected text, found a NUL byte")
    try:
        text = raw.decode("utf-8")
        fields = next(csv.reader([text], delimiter=separator.decode(), strict=True), [])
    except UnicodeDecodeError as error:
        raise RejectedError(RejectCode.ENCODING, "expected UTF-8 text") from error
    except csv.Error as error:
        raise RejectedError(RejectCode.MALFORMED_LINE, f"not valid CSV: {error}") from error
    return [field.strip(" ") for field in fields]


def _shown(raw: bytes) -> str:
    return repr(raw[:40].decode("utf-8", errors="backslashreplace"))
