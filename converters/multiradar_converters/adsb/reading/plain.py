"""Reference parsing of a record; it must equal the compiled form and explains rejects."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.layout import Layout
from multiradar_converters.adsb.reading.time_forms import (
    CLOCK,
    DECIMAL,
    ISO_8601,
    OF_DAY_MAX_S,
    UNIX_MAX_S,
    UNIX_MIN_S,
    TimeForm,
    of_day,
)
from multiradar_converters.vid.text.lines import RejectedError, form_hint, unix_seconds
from multiradar_schemas.measurements.measurement import (
    HEIGHT_MAX_M,
    HEIGHT_MIN_M,
    LATITUDE_MAX_DEG,
    LONGITUDE_MAX_DEG,
)
from multiradar_schemas.reject import RejectCode

Flags = NDArray[np.bool_]

NAN = float("nan")

#: Texts of absent values.
NONE_TEXTS = frozenset({"", "null", "Null", "none", "None", "NA"})

_NON_FINITE = re.compile(r"[+-]?(?:inf|infinity|nan)", re.IGNORECASE)
_CODE = re.compile(r"([0-7]{1,4})(?:\.0)?")
_ADDRESS = re.compile(r"[0-9A-Fa-f]{6}")
_CALLSIGN = re.compile(r"[0-9A-Za-z]{1,8}")
_TRUTH = {"1": 1, "0": 0, "true": 1, "True": 1, "false": 0, "False": 0}
_GROUND = "ground"

#: Kinds of report, by number; only traces contain them.
KINDS = ("adsb", "mlat")

# Feeds repeat a position for some minutes after its reception, and clocks differ by some seconds.
_AGE_MAX_S, _AHEAD_MAX_S = 3600.0, 60.0
_NEEDED = (roles.TIME, roles.LATITUDE, roles.LONGITUDE)
# This address and 0 are not assigned to aircraft.
_BROADCAST = 0xFFFFFF


@dataclass(frozen=True)
class Row:
    """A record: numbers by role in SI units (NaN: absent), integers by role (see `roles`)."""

    numbers: tuple[float, ...]
    words: tuple[int, ...]


def read_cells(cells: Mapping[int, str], layout: Layout) -> Row:
    """Read the values of a record.

    Parameters
    ----------
    cells : mapping of int to str
        Text of each role present.
    layout : Layout
        Layout of the file.

    Returns
    -------
    Row
        Values in SI units; `fault_of` checks their plausibility.

    Raises
    ------
    RejectedError
        A value is malformed.
    """
    numbers = [NAN] * roles.NUMBERS
    words = [roles.ABSENT] * roles.WORDS
    for role, text in cells.items():
        if text in NONE_TEXTS or text.lower() == "nan":
            continue
        if role == roles.HEIGHT and text == _GROUND:
            words[roles.GROUND - roles.FIRST_WORD] = 1
        elif role in (roles.TIME, roles.POSITION_TIME):
            form = layout.time if role == roles.TIME else layout.position_time
            time_s = _time(text, form, layout.name_of(role), float(layout.divisor[role]))
            numbers[role] = time_s + 0.0  # -0 is 0, as in the compiled form
        elif role < roles.FIRST_WORD:
            numbers[role] = _number(text, layout.name_of(role)) * float(layout.scale[role]) + 0.0
        elif not (role == roles.GROUND and cells.get(roles.HEIGHT) == _GROUND):
            words[role - roles.FIRST_WORD] = _WORDS[role](text, layout.name_of(role))
    return Row(tuple(numbers), tuple(words))


def possible(numbers: NDArray[np.float64], words: NDArray[np.int64], layout: Layout) -> Flags:
    """Return which records are acceptable; `fault_of` returns the errors of the others.

    Parameters
    ----------
    numbers, words : float64[16, n], int64[5, n]
        Values by role.
    layout : Layout
        Layout of the file.

    Returns
    -------
    bool[n]
        False if a value is missing or out of bounds.
    """
    address = words[roles.ADDRESS - roles.FIRST_WORD]
    good: Flags = (address > 0) & (address < _BROADCAST)
    for role, low, high, _ in _bounds(layout):
        value = numbers[role]
        within = (value >= low) & (value <= high)
        good &= within if role in _NEEDED else within | np.isnan(value)
    if not of_day(layout.time):
        age_s = numbers[roles.TIME] - numbers[roles.POSITION_TIME]
        good &= np.isnan(age_s) | ((age_s >= -_AHEAD_MAX_S) & (age_s <= _AGE_MAX_S))
    return good


def fault_of(row: Row, layout: Layout) -> RejectedError | None:
    """Return the error of a record.

    Parameters
    ----------
    row : Row
        The record.
    layout : Layout
        Layout of the file.

    Returns
    -------
    RejectedError or None
        Error of the first value that is missing or out of bounds; None if all are valid.
    """
    address = row.words[roles.ADDRESS - roles.FIRST_WORD]
    missing = [roles.ADDRESS] if address < 0 else []
    missing += [role for role in _NEEDED if math.isnan(row.numbers[role])]
    if missing:
        reason = f"{layout.name_of(missing[0])}: expected a value, found none"
        return RejectedError(RejectCode.MISSING_FIELD, reason)
    if address in (0, _BROADCAST):
        reason = f"{layout.name_of(roles.ADDRESS)}: {address:06x} is not an aircraft address"
        return RejectedError(RejectCode.OUT_OF_RANGE, reason)
    for role, low, high, unit in _bounds(layout):
        value = row.numbers[role]
        if value < low or value > high:
            name = layout.name_of(role)
            reason = f"{name}: expected {low:.10g} to {high:.10g} {unit}, was {value:.10g}"
            return RejectedError(RejectCode.OUT_OF_RANGE, reason)
    age_s = row.numbers[roles.TIME] - row.numbers[roles.POSITION_TIME]
    if not of_day(layout.time) and (age_s < -_AHEAD_MAX_S or age_s > _AGE_MAX_S):
        reason = (
            f"{layout.name_of(roles.POSITION_TIME)}: expected at most {_AGE_MAX_S:.0f} s before "
            f"and {_AHEAD_MAX_S:.0f} s after the time of the record, was {age_s:.3f} s before"
        )
        return RejectedError(RejectCode.OUT_OF_RANGE, reason)
    return None


def _bounds(layout: Layout) -> list[tuple[int, float, float, str]]:
    return [
        (roles.TIME, *time_bounds(layout.time), "s"),
        (roles.LATITUDE, -LATITUDE_MAX_DEG, LATITUDE_MAX_DEG, "degrees"),
        (roles.LONGITUDE, -LONGITUDE_MAX_DEG, LONGITUDE_MAX_DEG, "degrees"),
        (roles.HEIGHT, HEIGHT_MIN_M, HEIGHT_MAX_M, "m"),
        (roles.GEOMETRIC, HEIGHT_MIN_M, HEIGHT_MAX_M, "m"),
        (roles.POSITION_TIME, *time_bounds(layout.position_time), "s"),
    ]


def time_bounds(form: TimeForm) -> tuple[float, float]:
    """Return the bounds of times of a form, s."""
    return (0.0, OF_DAY_MAX_S) if of_day(form) else (UNIX_MIN_S, UNIX_MAX_S)


def _number(text: str, name: str) -> float:
    if DECIMAL.fullmatch(text) is None:
        code = RejectCode.NON_FINITE if _NON_FINITE.fullmatch(text) else RejectCode.NOT_A_NUMBER
        hint = form_hint(text.encode())
        raise RejectedError(code, f"{name}: expected a number, was {text[:40]!r}{hint}")
    value = float(text)
    if abs(value) == float("inf"):
        reason = f"{name}: expected a finite number, was {text[:40]!r}"
        raise RejectedError(RejectCode.NON_FINITE, reason)
    return value


def _time(text: str, form: TimeForm, name: str, divisor: float) -> float:
    if form == "iso8601":
        return _moment(text, name)
    if form == "clock":
        match = CLOCK.fullmatch(text)
        if match is None:
            reason = f"{name}: expected hh:mm:ss, was {text[:40]!r}"
            raise RejectedError(RejectCode.NOT_A_NUMBER, reason)
        hour, minute, second = int(match[1]), int(match[2]), float(match[3])
        if hour > 23 or minute > 59 or second >= 61.0:
            reason = f"{name}: expected a valid time of day, was {text!r}"
            raise RejectedError(RejectCode.OUT_OF_RANGE, reason)
        return hour * 3600 + minute * 60 + second
    return _number(text, name) / divisor


def _moment(text: str, name: str) -> float:
    match = ISO_8601.fullmatch(text)
    if match is None:
        reason = f"{name}: expected an ISO 8601 date and time, was {text[:40]!r}"
        raise RejectedError(RejectCode.NOT_A_NUMBER, reason)
    fraction, sign, offset_hour, offset_minute = match.groups()[6:]
    try:
        whole = unix_seconds(match.groups()[:6])
    except ValueError as error:
        reason = f"{name}: expected a valid date and time, was {text!r}"
        raise RejectedError(RejectCode.OUT_OF_RANGE, reason) from error
    if sign is not None:
        offset = int(offset_hour) * 3600 + int(offset_minute) * 60
        whole += offset if sign == "-" else -offset
    digits = fraction or ""
    return int(f"{whole}{digits}") / 10 ** len(digits) if whole >= 0 else float(whole)


def _address(text: str, name: str) -> int:
    if _ADDRESS.fullmatch(text) is None:
        reason = f"{name}: expected six hexadecimal digits, was {text[:40]!r}"
        raise RejectedError(RejectCode.NOT_A_NUMBER, reason)
    return int(text, 16)


def _truth(text: str, name: str) -> int:
    if text not in _TRUTH:
        reason = f"{name}: expected true or false, was {text[:40]!r}"
        raise RejectedError(RejectCode.WRONG_TYPE, reason)
    return _TRUTH[text]


def _code(text: str, _name: str) -> int:
    match = _CODE.fullmatch(text)
    return roles.UNREADABLE if match is None else int(match[1], 8)


def _callsign(text: str, _name: str) -> int:
    callsign = text.strip(" ")
    if not callsign:
        return roles.ABSENT
    if _CALLSIGN.fullmatch(callsign) is None:
        return roles.UNREADABLE
    return int.from_bytes(callsign.encode(), "big")


def _kind(text: str, _name: str) -> int:
    return KINDS.index(text)


_WORDS: dict[int, Callable[[str, str], int]] = {
    roles.ADDRESS: _address,
    roles.CODE: _code,
    roles.CALLSIGN: _callsign,
    roles.GROUND: _truth,
    roles.KIND: _kind,
}
