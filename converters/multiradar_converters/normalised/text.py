"""JSON and NDJSON bodies.

JSON is RFC 8259 in UTF-8 without a byte order mark: an array of measurement objects. NDJSON is one
such object per line, with LF or CR LF line ends; blank lines are ignored.

A valid body takes the fast path: one compiled call validates it. A body with any error takes the
slow path, row by row, which accepts the valid rows and reports each invalid one. The fast path
accepts nothing that the slow path would reject.
"""

import json
import re
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict, FailFast, TypeAdapter, ValidationError

from multiradar_converters.normalised.json_columns import parse_array, parse_lines
from multiradar_converters.normalised.parsed import (
    ROWS_MAX,
    Parsed,
    ParsedReject,
    check_rows_max,
    rows_frame,
)
from multiradar_schemas.documents.explain import explain
from multiradar_schemas.documents.names import did_you_mean, shown
from multiradar_schemas.errors import BodyError
from multiradar_schemas.measurements.measurement import MEASUREMENT, Measurement, RadarMeasurement
from multiradar_schemas.reject import RejectCode

#: Integers with more digits are read as floats: no field accepts them, and exact parsing takes
#: quadratic time.
INTEGER_DIGITS_MAX = 30
#: Characters of a row that are parsed; the interpreter stands still while one value is. Longer rows
#: are rejected: a valid one has a few hundred.
ROW_CHARACTERS_MAX = 64 * 1024
#: Unknown names of a message for which a similar one is searched, and their length.
HINTS_MAX, HINT_LENGTH_MAX = 8, 40
# Of most rows it is enough to copy so many.
_ROW_CHARACTERS = 1024

# Texts that it caches would keep the memory of the whole message in which they first occurred.
_ROWS: TypeAdapter[list[Measurement]] = TypeAdapter(
    Annotated[list[Measurement], FailFast()], config=ConfigDict(cache_strings="keys")
)
_WHITESPACE = " \t\n\r"
# Possessive: without it the search keeps 64 octets for each escape of a text, to come back to it.
_TEXT = re.compile(r'"[^"\\]*+(?:\\.[^"\\]*+)*+"', re.DOTALL)
_OPENING = frozenset("[{")
# Change of the depth by each character.
_LEVELS = np.zeros(256, np.int8)
_LEVELS[list(b"[{")], _LEVELS[list(b"]}")] = 1, -1
_QUOTE, _BACKSLASH = ord('"'), ord("\\")
# Characters of which the brackets are counted at once.
_COUNTED = 1 << 16
_BLANKS = re.compile(r"[ \t\n\r]*")
# From the first character of a line that is not blank to its end: a message may have millions of
# blank lines.
_LINES = re.compile(rb"[^ \t\n\r][^\n]*")
#: Names of all fields, the same for every kind of measurement.
_FIELDS = tuple(sorted(RadarMeasurement.model_fields))
_TEXTS = ("mode_3a", "mode_s_address", "callsign", "time")
_TEXTS_ALWAYS = 2  # sensor_id and kind
#: Maximum quotation marks of a valid row.
_MARKS_MAX = 2 * (len(_FIELDS) + _TEXTS_ALWAYS + len(_TEXTS))


def parse_json(body: bytes, *, rows_max: int = ROWS_MAX) -> Parsed:
    """Read a JSON array of measurements.

    Parameters
    ----------
    body : bytes
        The array, UTF-8.
    rows_max : int
        Maximum number of measurements.

    Returns
    -------
    Parsed
        Accepted and rejected rows; an invalid row does not affect the others.

    Raises
    ------
    BodyError
        When the body is not UTF-8 (ENCODING), not JSON or not an array (MALFORMED_JSON), or has
        too many rows (TOO_LARGE).
    """
    parsed = parse_array(body, rows_max, ROW_CHARACTERS_MAX)
    if parsed is not None:
        return parsed
    rows = _fast(body, rows_max)
    if rows is not None:
        return Parsed(rows_frame(rows), [])
    return _slow_array(_decoded(body), rows_max)


def parse_ndjson(body: bytes, *, rows_max: int = ROWS_MAX) -> Parsed:
    """Read measurements, one JSON object per line.

    Parameters
    ----------
    body : bytes
        The lines, UTF-8; the last line end is optional. Blank lines are ignored.
    rows_max : int
        Maximum number of measurements.

    Returns
    -------
    Parsed
        Accepted and rejected rows; the index is that of the line, from 0, including blank lines. A
        line that is not JSON or not UTF-8 is a rejected row.

    Raises
    ------
    BodyError
        When there are too many rows (TOO_LARGE).
    """
    parsed = parse_lines(body.rstrip(b"\r\n"), rows_max, ROW_CHARACTERS_MAX)
    if parsed is not None:
        return parsed
    lines: list[tuple[int, bytes]] = []
    index = place = 0
    for found in _LINES.finditer(body):
        index += body.count(b"\n", place, found.start())
        place = found.start()
        lines.append((index, found[0].rstrip(_WHITESPACE.encode())))
        check_rows_max(len(lines), rows_max)
    rows = _fast_lines(body, [line for _, line in lines], rows_max)
    if rows is not None:
        return Parsed(rows_frame(rows, [index for index, _ in lines]), [])
    collected = _Collected()
    for index, line in lines:
        _read_line(collected, index, line)
    return collected.parsed()


def _fast(body: bytes, rows_max: int) -> list[Measurement] | None:
    """Return the rows of a valid body, or None."""
    # Checked first: the compiled parser would build millions of rows, or an error for each of
    # millions of unknown keys, before it fails.
    objects = body.count(b"{")
    if objects > rows_max or body.count(b'"') > _MARKS_MAX * objects or body.count(b"[") > 1:
        return None
    try:
        rows = _ROWS.validate_json(body)
    except ValidationError:
        return None
    return None if _has_duplicate_key(body, rows) else rows


def _fast_lines(body: bytes, lines: Sequence[bytes], rows_max: int) -> list[Measurement] | None:
    # Lines joined by commas could complete each other. They cannot if each begins and ends with a
    # brace and there are no other opening braces: a valid row has none inside.
    if body.count(b"{") != len(lines):
        return None
    if not all(line.startswith(b"{") and line.endswith(b"}") for line in lines):
        return None
    return _fast(b"[%s]" % b",".join(lines), rows_max)


def _has_duplicate_key(body: bytes, rows: Sequence[Measurement]) -> bool:
    """Return whether an object of a valid body has a duplicate key.

    The compiled parser silently keeps the last of two values. In a valid row no key and no text
    contains a quotation mark, not even an escaped one, so each key and text accounts for two marks.
    A dropped value leaves at least the marks of its key.
    """
    kept = sum(len(row.model_fields_set) for row in rows)
    kept += _TEXTS_ALWAYS * len(rows)
    for name in _TEXTS:
        kept += sum(getattr(row, name) is not None for row in rows)
    return body.count(b'"') != 2 * kept


class _Collected:
    """Rows of the slow path, accepted and rejected."""

    def __init__(self) -> None:
        self._rows: list[Measurement] = []
        self._index: list[int] = []
        self._rejected: list[ParsedReject] = []
        self._hints: dict[str, str] = {}

    def add(self, index: int, value: Any, raw: str) -> None:
        fault = self._shape_fault(value)
        if fault is not None:
            self.reject(index, *fault, raw)
            return
        try:
            row = MEASUREMENT.validate_python(value)
        except ValidationError as error:
            details = error.errors(include_url=False)[0]
            # The kind selected the model; it is not part of the location.
            known_kind = details["loc"][:1] == (value.get("kind"),)
            self.reject(
                index,
                *explain({**details, "loc": details["loc"][1:] if known_kind else details["loc"]}),
                raw,
            )
            return
        self._rows.append(row)
        self._index.append(index)

    def reject(self, index: int, code: RejectCode, reason: str, raw: str) -> None:
        self._rejected.append(ParsedReject(index, code, reason, raw))

    def parsed(self) -> Parsed:
        return Parsed(rows_frame(self._rows, self._index), self._rejected)

    def _shape_fault(self, value: Any) -> tuple[RejectCode, str] | None:
        if isinstance(value, _Oversized):
            reason = (
                f"expected a row of at most {ROW_CHARACTERS_MAX} characters, found {value.length}"
            )
            return RejectCode.TOO_LARGE, reason
        if isinstance(value, _Duplicated):
            reason = f"expected each key once, found {shown(value.key)} twice"
            return RejectCode.DUPLICATE_KEY, reason
        if not isinstance(value, dict):
            return RejectCode.WRONG_TYPE, f"expected an object, found {shown(value)}"
        for name in value:
            if name not in _FIELDS:
                return RejectCode.UNKNOWN_FIELD, f"unknown field {shown(name)}{self._meant(name)}"
        return None

    # A search takes a millisecond, and a hostile message has 100 000 different names.
    def _meant(self, name: str) -> str:
        if name not in self._hints and len(self._hints) < HINTS_MAX and len(name) < HINT_LENGTH_MAX:
            self._hints[name] = did_you_mean(name, _FIELDS)
        return self._hints.get(name, "")


class _Duplicated:
    """An object with a duplicate key."""

    def __init__(self, key: str) -> None:
        self.key = key


class _Oversized:
    """A row that is too long to be parsed."""

    def __init__(self, length: int) -> None:
        self.length = length


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any] | _Duplicated:
    values = dict(pairs)
    if len(values) == len(pairs):
        return values
    seen: set[str] = set()
    for key, _ in pairs:
        if key in seen:
            return _Duplicated(key)
        seen.add(key)
    return values


def _integer(text: str) -> int | float:
    return int(text) if len(text) <= INTEGER_DIGITS_MAX else float(text)


_DECODER = json.JSONDecoder(object_pairs_hook=_object, parse_int=_integer)


def _decoded(body: bytes) -> str:
    try:
        return body.decode("utf-8")
    except UnicodeDecodeError as error:
        raise BodyError(RejectCode.ENCODING, f"not valid UTF-8 at byte {error.start}") from error


def _slow_array(text: str, rows_max: int) -> Parsed:
    collected = _Collected()
    place = _skip(text, 0)
    if text[place : place + 1] != "[":
        raise BodyError(
            RejectCode.MALFORMED_JSON, f"expected a JSON array, found {_at(text, place)}"
        )
    place = _skip(text, place + 1)
    index = 0
    closed = text[place : place + 1] == "]"
    while not closed:
        value, end = _value(text, place)
        check_rows_max(index + 1, rows_max)
        collected.add(index, value, text[place:end])
        index += 1
        place = _skip(text, end)
        closed = text[place : place + 1] == "]"
        if not closed:
            place = _skip(text, _after_comma(text, place))
    if _skip(text, place + 1) != len(text):
        reason = f"expected nothing after the array, found {_at(text, _skip(text, place + 1))}"
        raise BodyError(RejectCode.MALFORMED_JSON, reason)
    return collected.parsed()


def _after_comma(text: str, place: int) -> int:
    if text[place : place + 1] != ",":
        reason = f"expected a comma or the end of the array, found {_at(text, place)}"
        raise BodyError(RejectCode.MALFORMED_JSON, reason)
    return place + 1


def _value(text: str, place: int) -> tuple[Any, int]:
    for count in (_ROW_CHARACTERS, ROW_CHARACTERS_MAX):
        part = text[place : place + count]
        try:
            value, end = _DECODER.raw_decode(part)
        except json.JSONDecodeError:
            # It may only be cut.
            continue
        except RecursionError as error:
            reason = f"the JSON is nested too deeply, at character {place}"
            raise BodyError(RejectCode.MALFORMED_JSON, reason) from error
        if end < len(part) or place + end == len(text):
            return value, place + end
    if len(text) - place > ROW_CHARACTERS_MAX:
        end = _end_of_value(text, place)
        if end - place > ROW_CHARACTERS_MAX:
            return _Oversized(end - place), end
    return _whole_value(text[: place + ROW_CHARACTERS_MAX], place)


def _end_of_value(text: str, place: int) -> int:
    """Return the end of an array or object, found by its brackets, or of a text; or `place`."""
    if text[place] == '"':
        found = _TEXT.match(text, place)
        return place if found is None else found.end()
    if text[place] not in _OPENING:
        return place
    # A step for each bracket or text would take 0.1 s per MB.
    depth, quotes, backslashes = 0, 0, 0
    for begin in range(place, len(text), _COUNTED):
        # One octet for each character.
        piece = text[begin : begin + _COUNTED].encode("latin-1", "replace")
        octets = np.frombuffer(piece, np.uint8)
        marks = np.flatnonzero(octets == _QUOTE)
        # Before each character, the last other one than a backslash: after an odd number of them, a
        # mark is part of its text.
        before = np.arange(-1, len(octets))
        before[0] = -1 - backslashes
        before[1:][octets == _BACKSLASH] = before[0]
        before = np.maximum.accumulate(before)
        opened = np.zeros(len(octets), np.int64)
        opened[marks[(marks - 1 - before[marks]) % 2 == 0]] = 1
        inside = (np.cumsum(opened) + quotes) % 2 == 1
        depths = depth + np.cumsum(np.where(inside, 0, _LEVELS[octets]), dtype=np.int64)
        ends = np.flatnonzero(depths <= 0)
        if len(ends):
            return begin + int(ends[0]) + 1
        depth, quotes = int(depths[-1]), quotes + int(opened.sum())
        backslashes = len(octets) - 1 - int(before[-1])
    return len(text)


def _whole_value(text: str, place: int) -> tuple[Any, int]:
    try:
        return _DECODER.raw_decode(text, place)
    except json.JSONDecodeError as error:
        reason = f"not valid JSON at character {error.pos}: {error.msg}"
        raise BodyError(RejectCode.MALFORMED_JSON, reason) from error
    except RecursionError as error:
        reason = f"the JSON is nested too deeply, at character {place}"
        raise BodyError(RejectCode.MALFORMED_JSON, reason) from error


def _skip(text: str, place: int) -> int:
    blanks = _BLANKS.match(text, place)
    return place if blanks is None else blanks.end()


def _at(text: str, place: int) -> str:
    return (
        f"{shown(text[place : place + 20])} at character {place}"
        if place < len(text)
        else "the end"
    )


def _read_line(collected: _Collected, index: int, line: bytes) -> None:
    raw = line.rstrip(b"\r").decode("utf-8", "backslashreplace")
    try:
        text = _decoded(line).strip(_WHITESPACE)
        value, end = _value(text, 0)
    except BodyError as error:
        collected.reject(index, error.code, error.reason, raw)
        return
    if end != len(text):
        reason = f"expected one object per line, found {_at(text, _skip(text, end))} after it"
        collected.reject(index, RejectCode.MALFORMED_JSON, reason, raw)
        return
    collected.add(index, value, raw)
