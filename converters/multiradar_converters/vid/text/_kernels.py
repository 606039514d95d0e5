"""Compiled parsing of dump lines; the reference form is `lines.parse_line`.

The text of a call consists of whole lines, so its last byte is a line end and every search stops
there. A line that is not obviously valid is marked in `odd` and left to the reference form, which
accepts it (for example with an exponent or 17 digits) or reports the error.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, loop

Bytes = NDArray[np.uint8]
Words = NDArray[np.int64]
Numbers = NDArray[np.float64]

# These functions do not allocate, so they need no reference counting by numba, which costs several
# atomic operations per field and array (64 ns per field instead of 9).

_TAB, _CR, _BLANK, _PLUS, _MINUS, _POINT, _EQUALS, _SEMICOLON = 9, 13, 32, 43, 45, 46, 61, 59
_TIME, _HEIGHT, _FIRST_INTEGER, _CODE, _ADDRESS = 0, 3, 6, 10, 11
_INTEGER_MAX = 2**31 - 1
# Limit up to which integers and powers of ten are exact in float64, so their quotient is rounded
# once.
_EXACT_MAX = 2**53
_DECIMALS_MAX = 22
_POWERS = 10.0 ** np.arange(_DECIMALS_MAX + 1)


@in_loop
def _decimal(text: Bytes, i: int) -> tuple[float, int, int]:
    """Return value, decimals (-1 without a point) and position after it, -1 on failure."""
    c = int(text[i])
    negative = c == _MINUS
    if negative or c == _PLUS:
        i += 1
    mantissa = 0
    digits = 0
    point = -1
    while True:
        c = int(text[i])
        digit = c - 48
        if 0 <= digit <= 9:
            mantissa = mantissa * 10 + digit
            digits += 1
        elif c == _POINT and point < 0:
            point = digits
        else:
            break
        i += 1
    if digits == 0 or digits > 18 or mantissa > _EXACT_MAX:
        return 0.0, i, -1
    value = float(mantissa)
    if point >= 0:
        value = value / _POWERS[digits - point]
    if negative:
        value = -value
    return value, i, i


@in_loop
def _digits(text: Bytes, i: int, count: int) -> int:
    """Return the number of exactly `count` digits, -1 if they are not digits."""
    value = 0
    for k in range(count):
        digit = int(text[i + k]) - 48
        if digit < 0 or digit > 9:
            return -1
        value = value * 10 + digit
    return value


@in_loop
def _days_from_civil(year: int, month: int, day: int) -> int:
    """Days since 1970-01-01 of a Gregorian date (Hinnant's algorithm)."""
    if month <= 2:
        year -= 1
        month += 12
    era = year // 400
    year_of_era = year - era * 400
    day_of_year = (153 * (month - 3) + 2) // 5 + day - 1
    return (
        era * 146097
        + year_of_era * 365
        + year_of_era // 4
        - year_of_era // 100
        + day_of_year
        - 719468
    )


@in_loop
def _iso_time(text: Bytes, i: int, stop: int) -> tuple[float, int]:
    """Read YYYY-MM-DDThh:mm:ss[.fff][Z]; other forms are left to the reference form."""
    if i + 20 > stop or int(text[i + 4]) != 45 or int(text[i + 7]) != 45:
        return 0.0, -1
    if int(text[i + 10]) != 84 or int(text[i + 13]) != 58 or int(text[i + 16]) != 58:
        return 0.0, -1
    year, month, day = _digits(text, i, 4), _digits(text, i + 5, 2), _digits(text, i + 8, 2)
    hour, minute = _digits(text, i + 11, 2), _digits(text, i + 14, 2)
    second = _digits(text, i + 17, 2)
    # Days 29 to 31 are left to the reference form unless every month has them.
    if (
        year < 0
        or month < 1
        or month > 12
        or day < 1
        or (day > 28 and not (day <= 30 and month != 2))
    ):
        return 0.0, -1
    if hour < 0 or hour > 23 or minute < 0 or minute > 59 or second < 0 or second > 59:
        return 0.0, -1
    whole = _days_from_civil(year, month, day) * 86400 + hour * 3600 + minute * 60 + second
    i += 19
    decimals = 0
    if int(text[i]) == _POINT:
        i += 1
        while 48 <= int(text[i]) <= 57:
            whole = whole * 10 + int(text[i]) - 48
            decimals += 1
            i += 1
            if decimals > 6:
                return 0.0, -1
        if decimals == 0:
            return 0.0, -1
    if int(text[i]) == 90:
        i += 1
    return float(whole) / _POWERS[decimals], i


@in_loop
def _code(text: Bytes, i: int) -> tuple[int, int]:
    """Return four octal digits as a number and the position after them, -1 on failure."""
    value = 0
    for k in range(4):
        digit = int(text[i + k]) - 48
        if digit < 0 or digit > 7:
            return 0, -1
        value = value * 8 + digit
    return value, i + 4


@in_loop
def _address(text: Bytes, i: int) -> tuple[int, int]:
    """Return six hexadecimal digits as a number and the position after them, -1 on failure."""
    value = 0
    for k in range(6):
        c = int(text[i + k])
        if 48 <= c <= 57:
            digit = c - 48
        elif 97 <= c <= 102:
            digit = c - 87
        elif 65 <= c <= 70:
            digit = c - 55
        else:
            return 0, -1
        value = value * 16 + digit
    return value, i + 6


@in_loop
def _unsigned(text: Bytes, i: int) -> tuple[int, int]:
    """Return an unsigned integer and the position after it, -1 on failure."""
    begin = i
    value = 0
    while True:
        digit = int(text[i]) - 48
        if digit < 0 or digit > 9:
            break
        value = value * 10 + digit
        i += 1
        if i - begin > 10:
            return 0, -1
    if i == begin or value > _INTEGER_MAX:
        return 0, -1
    return value, i


@in_loop
def _value(
    text: Bytes, i: int, stop: int, role: int, iso: bool, low: Numbers, high: Numbers, scale:
    Numbers, numbers: Numbers, integers: Words, row: int,
) -> int:  # fmt: skip
    """Read a value into its array; return the position after it, -1 when it is odd."""
    if role < _FIRST_INTEGER:
        if role == _TIME and iso:
            number, after = _iso_time(text, i, stop)
        else:
            number, _, after = _decimal(text, i)
        if after < 0:
            return -1
        number = number * scale[role] + 0.0
        if not (low[role] <= number <= high[role]):
            return -1
        numbers[role, row] = number
        return after
    if role == _CODE:
        whole, after = _code(text, i)
    elif role == _ADDRESS:
        whole, after = _address(text, i)
    else:
        whole, after = _unsigned(text, i)
    if after < 0:
        return -1
    integers[role - _FIRST_INTEGER, row] = whole
    return after


@in_loop
def _breaks(c: int) -> bool:
    """Return whether a byte separates pairs."""
    return c in (_BLANK, _TAB, _SEMICOLON)


@in_loop
def _ends(text: Bytes, i: int, terminator: int) -> bool:
    """Return whether a line ends here (LF, or CR before it)."""
    c = int(text[i])
    return c == terminator or (c == _CR and int(text[i + 1]) == terminator)


@in_loop
def _column_line(
    text: Bytes, i: int, stop: int, terminator: int, separator: int, roles: Words, iso: bool, low:
    Numbers, high: Numbers, scale: Numbers, numbers: Numbers, integers: Words, row: int,
) -> tuple[bool, int]:  # fmt: skip
    """Parse a line of columns; return whether it is valid and where parsing stopped."""
    runs = separator == _BLANK
    columns = len(roles)
    for column in range(columns):
        while int(text[i]) == _BLANK or (runs and int(text[i]) == _TAB):
            i += 1
        role = roles[column]
        c = int(text[i])
        at_end = _ends(text, i, terminator)
        if role < 0:
            while not (c in (separator, terminator, 0) or (runs and c == _TAB)):
                i += 1
                c = int(text[i])
            if int(text[i - 1]) == _CR and c == terminator:
                i -= 1
            if c == 0 or (runs and at_end):
                return False, i
        elif at_end or c == separator:
            if runs or (role != _HEIGHT and role != _CODE):
                return False, i
            if role == _HEIGHT:
                numbers[role, row] = np.nan
            else:
                integers[role - _FIRST_INTEGER, row] = -1
        else:
            after = _value(text, i, stop, role, iso, low, high, scale, numbers, integers, row)
            if after < 0:
                return False, i
            i = after
        value_end = i
        while int(text[i]) == _BLANK or (runs and int(text[i]) == _TAB):
            i += 1
        if column == columns - 1:
            return _ends(text, i, terminator), i
        if runs:
            if i == value_end:
                return False, i
        elif int(text[i]) == separator:
            i += 1
        else:
            return False, i
    return False, i


@in_loop
def _pair_line(
    text: Bytes, i: int, stop: int, terminator: int, keys: Bytes, lengths: Words, roles: Words,
    hints: Words, required: int, iso: bool, low: Numbers, high: Numbers, scale: Numbers, numbers:
    Numbers, integers: Words, row: int,
) -> tuple[bool, int]:  # fmt: skip
    """Parse a line of pairs; return whether it is valid and where parsing stopped."""
    numbers[_HEIGHT, row] = np.nan
    integers[_CODE - _FIRST_INTEGER, row] = -1
    seen = 0
    place = 0
    while True:
        c = int(text[i])
        while _breaks(c):
            i += 1
            c = int(text[i])
        if _ends(text, i, terminator):
            return (seen & required) == required, i
        found = -1
        for attempt in range(len(lengths) + 1):
            key = attempt - 1
            if attempt == 0:
                key = hints[place] if place < len(hints) else 0
            length = lengths[key]
            same = i + length < stop and int(text[i + length]) == _EQUALS
            k = 0
            while same and k < length:
                same = text[i + k] == keys[key, k]
                k += 1
            if same:
                found = key
                break
        if found >= 0:
            role = roles[found]
            if place < len(hints):
                hints[place] = found
            if seen & (1 << role):
                return False, i
            seen |= 1 << role
            i += lengths[found] + 1
            c = int(text[i])
            empty = _breaks(c) or _ends(text, i, terminator)
            if empty:
                if role != _HEIGHT and role != _CODE:
                    return False, i
            else:
                i = _value(text, i, stop, role, iso, low, high, scale, numbers, integers, row)
                if i < 0:
                    return False, -1
                c = int(text[i])
                if not (_breaks(c) or _ends(text, i, terminator)):
                    return False, i
        else:
            equals = False
            begin = i
            c = int(text[i])
            while not (_breaks(c) or c in (terminator, 0)):
                equals = equals or (c == _EQUALS and i > begin)
                i += 1
                c = int(text[i])
            if not equals or c == 0:
                return False, i
        place += 1


@in_loop
def _skip_to_end(text: Bytes, i: int, terminator: int) -> int:
    """Return the position after the line end."""
    while int(text[i]) != terminator:
        i += 1
    return i + 1


@in_loop
def _only_blanks(text: Bytes, i: int, terminator: int) -> bool:
    """Return whether only blanks precede the line end."""
    while int(text[i]) == _BLANK or int(text[i]) == _TAB:
        i += 1
    return _ends(text, i, terminator)


@loop
def parse_columns(
    text: Bytes, start: int, stop: int, terminator: int, separator: int, roles: Words, iso: bool,
    low: Numbers, high: Numbers, scale: Numbers, numbers: Numbers, integers: Words, begins: Words,
    odd: Words,
) -> tuple[int, int, int, int, int]:  # fmt: skip
    """Parse lines of columns until the end of the text or of the arrays.

    Parameters
    ----------
    text : uint8[n]
        Whole lines; ``text[stop - 1]`` is a line end.
    start, stop : int
        Begin and end.
    terminator, separator : int
        Line end and separator of fields, as bytes (32: runs of blanks and tabs).
    roles : int64[c]
        Role of each column, -1 for one to skip.
    iso : bool
        Whether times are ISO 8601.
    low, high, scale : float64[6]
        Bounds (SI, inclusive) and factor to SI of each number.
    numbers, integers : float64[6, r], int64[6, r]
        Filled, a column per non-blank line.
    begins : int64[r]
        Filled with the begin of the line of each column.
    odd : int64[r, 4]
        Filled, a row per line left to the reference form: its column in the arrays, its number
        within this call (from 0), its begin and end (line end excluded).

    Returns
    -------
    tuple of int
        Where parsing stopped, rows, odd lines, lines, blank lines.
    """
    room = numbers.shape[1]
    row = 0
    odds = 0
    lines = 0
    blank = 0
    i = start
    while i < stop and row < room:
        begin = i
        begins[row] = begin
        good, i = _column_line(
            text, i, stop, terminator, separator, roles, iso, low, high, scale, numbers, integers,
            row,
        )  # fmt: skip
        if good:
            i += 1 if int(text[i]) == terminator else 2
            row += 1
        elif _only_blanks(text, begin, terminator):
            i = _skip_to_end(text, begin, terminator)
            blank += 1
        else:
            i = _skip_to_end(text, begin, terminator)
            odd[odds, 0] = row
            odd[odds, 1] = lines
            odd[odds, 2] = begin
            odd[odds, 3] = i - 1
            odds += 1
            row += 1
        lines += 1
    return i, row, odds, lines, blank


@loop
def parse_pairs(
    text: Bytes, start: int, stop: int, terminator: int, keys: Bytes, lengths: Words, roles: Words,
    hints: Words, required: int, iso: bool, low: Numbers, high: Numbers, scale: Numbers, numbers:
    Numbers, integers: Words, begins: Words, odd: Words,
) -> tuple[int, int, int, int, int]:  # fmt: skip
    """Parse lines of pairs; as `parse_columns`, except for these parameters.

    Parameters
    ----------
    keys : uint8[k, w]
        Names of the known keys.
    lengths, roles : int64[k]
        Length and role of each name.
    hints : int64[p]
        Key at each position of the previous line, as a guess; updated in place.
    required : int
        Required roles of a line, as bits.
    """
    room = numbers.shape[1]
    row = 0
    odds = 0
    lines = 0
    blank = 0
    i = start
    while i < stop and row < room:
        begin = i
        if _only_blanks(text, begin, terminator):
            i = _skip_to_end(text, begin, terminator)
            blank += 1
        else:
            begins[row] = begin
            good, i = _pair_line(
                text, i, stop, terminator, keys, lengths, roles, hints, required, iso, low, high,
                scale, numbers, integers, row,
            )  # fmt: skip
            if good:
                i += 1 if int(text[i]) == terminator else 2
            else:
                i = _skip_to_end(text, begin, terminator)
                odd[odds, 0] = row
                odd[odds, 1] = lines
                odd[odds, 2] = begin
                odd[odds, 3] = i - 1
                odds += 1
            row += 1
        lines += 1
    return i, row, odds, lines, blank
