"""Reference parsing of a line; it must equal the compiled form and explains rejects."""

import datetime as dt
import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

from multiradar_converters.vid import fields
from multiradar_converters.vid.text.layout import BLANK, FileLayout
from multiradar_schemas.documents.names import time_unit
from multiradar_schemas.reject import RejectCode

#: Said of values that a profile converts: its unit may be the wrong one.
BY_PROFILE = "by [units] of the profile"
_DECIMAL = re.compile(rb"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_NON_FINITE = re.compile(rb"[+-]?(?:nan|inf|infinity)", re.IGNORECASE)
_WHOLE = re.compile(rb"[0-9]{1,10}")
_DECIMAL_CODE = re.compile(rb"(?=[0-9]{1,4}\Z)[0-9]*[89][0-9]*")
_CODE = re.compile(rb"[0-7]{4}")
_ADDRESS = re.compile(rb"[0-9A-Fa-f]{6}")
_ISO_TIME = re.compile(
    rb"([0-9]{4})-([0-9]{2})-([0-9]{2})[T ]([0-9]{2}):([0-9]{2}):([0-9]{2})(?:\.([0-9]{1,9}))?"
    rb"(?:Z|([+-])([0-9]{2}):?([0-9]{2}))?"
)
_LAST_FIELD = re.compile(rb"(?:([^=\s;]+)=)?([^=\s;.]*)(?:\.([0-9]*))?$")
#: A longer field is no number.
_FIELD_OCTETS = 256
_OTHER_FORMS = (
    (re.compile(rb"[+-]?[0-9]+,[0-9]+"), " (a decimal comma; write a decimal point)"),
    (re.compile(rb"[0-9]{1,2}:[0-9]{2}(:[0-9.]+)?"), " (a time of day; write seconds)"),
    (
        # Comma, apostrophe, blank, no-break blank or narrow one before three digits.
        re.compile(
            rb"\"?[+-]?[0-9]{1,3}(?:(?:[,' \xa0]|\xc2\xa0|\xe2\x80\xaf)[0-9]{3})+(?:\.[0-9]*)?\"?"
        ),
        " (thousands separators; remove them)",
    ),
    (re.compile(rb"([\"']).*\1"), " (quotation marks; remove them)"),
)
#: What a code or an address lacks that a spreadsheet read as a number.
ZEROS_LOST = "(leading zeros lost?)"
_CODE_FORMS = (
    (_DECIMAL_CODE, " (a decimal number?)"),
    (re.compile(rb"[0-7]{1,3}"), f" {ZEROS_LOST}"),
)
_ADDRESS_FORMS = (
    (re.compile(rb"[0-9A-Fa-f]{1,5}"), f" {ZEROS_LOST}"),
    (re.compile(rb"[0-9]{7,8}"), " (a decimal number?)"),
    (re.compile(rb"[0-9]\.[0-9]+[eE]\+?[0-9]+"), " (read as a number by a spreadsheet?)"),
    (re.compile(rb"0[xX][0-9A-Fa-f]{6}"), " (without 0x)"),
)
_BEGIN = re.compile(rb"\s*[0-9][-0-9.:TZ]*(?:[\s,;|]|$)")
_FIELD_BREAKS = re.compile(rb"[\s;]+")
_EPOCH = dt.date(1970, 1, 1)
_PAIR_BREAKS = re.compile(rb"[ \t;]+")
_BLANKS = re.compile(rb"[ \t]+")


class Line(Enum):
    """Lines without a record."""

    BLANK = "blank"
    HEADER = "header"


@dataclass(frozen=True)
class Row:
    """An accepted record: numbers by role (NaN: absent), integers by role (-1: absent)."""

    numbers: tuple[float, ...]
    integers: tuple[int, ...]


class RejectedError(Exception):
    """A record is rejected, with a stable code."""

    def __init__(self, code: RejectCode, reason: str) -> None:
        self.code = code
        self.reason = reason
        super().__init__(reason)


def parse_line(line: bytes, layout: FileLayout) -> Row | Line:
    """Parse a line without its line end.

    Returns
    -------
    Row or Line
        The record, or the kind of a line without a record.

    Raises
    ------
    RejectedError
        The line is malformed.
    """
    line = line.rstrip(b"\r")
    if not line.strip(b" \t\r"):
        return Line.BLANK
    if layout.header is not None and line == layout.header:
        return Line.HEADER
    if b"\0" in line:
        raise RejectedError(RejectCode.ENCODING, "expected text, found a NUL byte")
    values = _columns(line, layout) if layout.form == "columns" else _pairs(line, layout)
    numbers = [float("nan")] * fields.NUMBERS
    integers = [fields.ABSENT] * fields.INTEGERS
    for role in layout.table.roles:
        text = values.get(role, b"")
        if not text:
            _check_may_be_empty(role, layout)
        elif role < fields.FIRST_INTEGER:
            numbers[role] = _number(text, role, layout)
        else:
            integers[role - fields.FIRST_INTEGER] = _integer(text, role, layout)
    return Row(tuple(numbers), tuple(integers))


def is_truncated(line: bytes, before: bytes) -> bool:
    """Return whether a last line without a line end is probably truncated in its last field.

    A number without its last digits is still a number, so the line is compared with the previous
    one: its last field is empty or has fewer decimals, or (in pairs) a field is missing.

    Parameters
    ----------
    line, before : bytes
        The last line and the previous line.

    Returns
    -------
    bool
        True if the line may be incomplete.
    """
    key, decimals = _last_field(line)
    key_before, decimals_before = _last_field(before) if before else (key, -1)
    if _keys(before) - _keys(line):
        return True
    return key == key_before and decimals < decimals_before


def lacks_fields(line: bytes, layout: FileLayout) -> bool:
    """Return whether a last line without a line end is a record with too few fields.

    Parameters
    ----------
    line : bytes
        The line.
    layout : FileLayout
        Layout of the file.

    Returns
    -------
    bool
        False for a line that does not begin with a digit, such as a remark at the end.
    """
    if layout.form != "columns" or not _BEGIN.match(line):
        return False
    return len(split_columns(line.rstrip(b"\r"), layout.separator)) < len(layout.columns)


# A pattern for all of them would be tried from every octet of a long field.
def _keys(line: bytes) -> set[bytes]:
    named = (field.split(b"=")[:-1] for field in _FIELD_BREAKS.split(line) if b"=" in field)
    return {key for keys in named for key in keys if key}


def _last_field(line: bytes) -> tuple[bytes, int]:
    """Return the name of the last field, if any, and its decimals (-1: no point, -2: empty)."""
    match = _LAST_FIELD.search(_FIELD_BREAKS.split(line.rstrip(b"\r"))[-1][-_FIELD_OCTETS:])
    if match is None:
        return b"", -1
    name, value, decimals = match.groups()
    if decimals is not None:
        return name or b"", len(decimals)
    return name or b"", -1 if value else -2


def split_columns(line: bytes, separator: int) -> list[bytes]:
    """Split a line at its separator; blanks around fields are removed."""
    if separator == BLANK:
        return _BLANKS.split(line.strip(b" \t"))
    return [field.strip(b" ") for field in line.split(bytes((separator,)))]


def _columns(line: bytes, layout: FileLayout) -> dict[int, bytes]:
    found = split_columns(line, layout.separator)
    expected = len(layout.columns)
    if layout.separator == BLANK and len(found) == expected - 1 and line[-1:] in (b" ", b"\t"):
        # With a separator after the last field but one, an empty last field may be intended.
        found.append(b"")
    if len(found) != expected:
        cause = "the line is truncated" if len(found) < expected else "too many fields"
        if len(found) > expected and not any(found[expected:]):
            cause = "a separator at the end of the line, which the header does not have; remove it"
        reason = f"expected {expected} fields, found {len(found)}: {cause}"
        raise RejectedError(RejectCode.WRONG_FIELD_COUNT, reason)
    return {role: text for role, text in zip(layout.columns, found, strict=True) if role >= 0}


def _pairs(line: bytes, layout: FileLayout) -> dict[int, bytes]:
    values: dict[int, bytes] = {}
    roles = dict(zip(layout.keys, layout.key_roles, strict=True))
    for token in _PAIR_BREAKS.split(line.strip(b" \t;")):
        key, equals, value = token.partition(b"=")
        if not equals or not key:
            reason = f"expected name=value, found {_shown(token)}"
            raise RejectedError(RejectCode.MALFORMED_LINE, reason)
        role = roles.get(key)
        if role is None:
            continue
        if role in values:
            raise RejectedError(RejectCode.DUPLICATE_KEY, f"{_shown(key)} is repeated")
        values[role] = value
    return values


def _check_may_be_empty(role: int, layout: FileLayout) -> None:
    if role not in fields.OPTIONAL_ROLES:
        reason = f"{layout.name_of(role)}: expected a value, found none"
        raise RejectedError(RejectCode.MISSING_FIELD, reason)


def _number(text: bytes, role: int, layout: FileLayout) -> float:
    name = layout.name_of(role)
    if role == fields.TIME and layout.iso_time:
        value = _iso_time(text, name)
    elif _DECIMAL.fullmatch(text):
        value = float(text)
    elif _NON_FINITE.fullmatch(text):
        raise RejectedError(
            RejectCode.NON_FINITE, f"{name}: expected a finite number, was {_shown(text)}"
        )
    else:
        raise RejectedError(
            RejectCode.NOT_A_NUMBER,
            f"{name}: expected a number, was {_shown(text)}{form_hint(text)}",
        )
    value = value * layout.scale[role] + 0.0
    if value in (float("inf"), float("-inf")):
        raise RejectedError(
            RejectCode.NON_FINITE, f"{name}: expected a finite number, was {_shown(text)}"
        )
    low, high = layout.low[role], layout.high[role]
    if not low <= value <= high:
        # The smallest positive number is the limit of "above 0".
        lowest = f"{low:.9g} to" if low <= 0.0 or low > 1e-300 else "above 0, at most"
        reason = f"{name}: expected {lowest} {high:.9g} {fields.UNITS[role]}, was {_shown(text)}"
        if layout.scale[role] != 1.0:
            reason += f" (times {layout.scale[role]:.6g} {BY_PROFILE})"
        if role == fields.TIME and value > high:
            reason += time_unit(value) or " (milliseconds?)"
        raise RejectedError(RejectCode.OUT_OF_RANGE, reason)
    return value


def unix_seconds(parts: Iterable[str | bytes]) -> int:
    """Return the Unix time of a date and time, UTC, s; second 60, a leap second, is the next one.

    Parameters
    ----------
    parts : iterable of str or bytes
        Year, month, day, hour, minute and second, in digits.

    Raises
    ------
    ValueError
        There is no such date and time.
    """
    year, month, day, hour, minute, second = map(int, parts)
    dt.time(hour, minute, min(second, 59))
    if second > 60:
        raise ValueError(second)
    days = (dt.date(year, month, day) - _EPOCH).days
    return days * 86_400 + hour * 3600 + minute * 60 + second


def _iso_time(text: bytes, name: str) -> float:
    match = _ISO_TIME.fullmatch(text)
    if match is None:
        reason = f"{name}: expected an ISO 8601 date and time, was {_shown(text)}"
        raise RejectedError(RejectCode.NOT_A_NUMBER, reason)
    fraction, sign, offset_hour, offset_minute = match.groups()[6:]
    try:
        whole = unix_seconds(match.groups()[:6])
    except ValueError as error:
        reason = f"{name}: no such date and time: {_shown(text)}"
        raise RejectedError(RejectCode.OUT_OF_RANGE, reason) from error
    if sign is not None:
        offset = int(offset_hour) * 3600 + int(offset_minute) * 60
        whole += offset if sign == b"-" else -offset
    digits = fraction or b""
    return int(f"{whole}{digits.decode()}") / 10 ** len(digits) if whole >= 0 else float(whole)


def _integer(text: bytes, role: int, layout: FileLayout) -> int:
    name = layout.name_of(role)
    if role == fields.CODE:
        return _coded(_CODE, text, 8, f"{name}: expected four octal digits")
    if role == fields.ADDRESS:
        return _coded(_ADDRESS, text, 16, f"{name}: expected six hexadecimal digits")
    if not _WHOLE.fullmatch(text):
        code = RejectCode.NON_FINITE if _NON_FINITE.fullmatch(text) else RejectCode.NOT_A_NUMBER
        raise RejectedError(code, f"{name}: expected a whole number, was {_shown(text)}")
    if int(text) > fields.INTEGER_MAX:
        reason = f"{name}: expected at most {fields.INTEGER_MAX}, was {_shown(text)}"
        raise RejectedError(RejectCode.OUT_OF_RANGE, reason)
    return int(text)


def _coded(pattern: re.Pattern[bytes], text: bytes, base: int, expectation: str) -> int:
    if not pattern.fullmatch(text):
        hint = form_hint(text, _CODE_FORMS if base == 8 else _ADDRESS_FORMS)
        raise RejectedError(RejectCode.NOT_A_NUMBER, f"{expectation}, was {_shown(text)}{hint}")
    return int(text, base)


def _shown(text: bytes) -> str:
    return repr(text[:40].decode("utf-8", errors="backslashreplace"))


def form_hint(text: bytes, forms: tuple[tuple[re.Pattern[bytes], str], ...] = _OTHER_FORMS) -> str:
    """Return what a text is instead of a number and what to write, or an empty text.

    Parameters
    ----------
    text : bytes
        A field.
    forms : tuple of (pattern, str)
        What it may be, and the hint for each.
    """
    return next((hint for form, hint in forms if form.fullmatch(text)), "")
