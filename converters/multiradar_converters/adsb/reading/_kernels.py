"""Compiled parsing of records; the reference form is `plain.read_cells`.

A record that is not obviously valid is marked in `odd` and left to the reference form, which
accepts it or reports the error. The text of a call ends in a byte that belongs to no value, so
every search stops there.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, loop
from multiradar_converters.adsb.reading._splitting_kernels import is_blank
from multiradar_converters.adsb.reading.roles import (
    ABSENT,
    ADDRESS,
    CALLSIGN,
    CODE,
    FIRST_WORD,
    GROUND,
)
from multiradar_converters.vid.text._value_kernels import (
    read_address,
    read_date_time,
    read_decimal,
    read_digits,
)

Bytes = NDArray[np.uint8]
Words = NDArray[np.int64]
Numbers = NDArray[np.float64]
Flags = NDArray[np.bool_]

_BACKSLASH, _QUOTE, _COMMA, _COLON, _BLANK, _MINUS = 92, 34, 44, 58, 32, 45
_OPEN, _CLOSE, _OPEN_LIST, _CLOSE_LIST = 123, 125, 91, 93
_CALLSIGN_MAX = 8


@in_loop
def _none(text: Bytes, i: int, end: int) -> bool:
    """Return whether a value is absent: empty, or null, nan, None, NA."""
    size = end - i
    if size == 0:
        return True
    if size == 4:
        a, b, c, d = int(text[i]), int(text[i + 1]), int(text[i + 2]), int(text[i + 3])
        null = b == 117 and c == 108 and d == 108
        none = b == 111 and c == 110 and d == 101
        return (a in (110, 78)) and (null or none)
    if size == 3:
        a, b, c = int(text[i]), int(text[i + 1]), int(text[i + 2])
        return (a in (110, 78)) and (b in (97, 65)) and (c in (110, 78))
    return size == 2 and int(text[i]) == 78 and int(text[i + 1]) == 65


@in_loop
def _moment(text: Bytes, i: int, end: int) -> tuple[float, bool]:
    """Read YYYY-MM-DDThh:mm:ss[.fff][Z|+00:00] (or a blank for the T)."""
    if end - i < 19 or int(text[i + 10]) not in (84, _BLANK):
        return 0.0, False
    value, i = read_date_time(text, i, end)
    if i < 0:
        return 0.0, False
    if i < end and int(text[i]) == 90:
        i += 1
    elif (
        end - i == 6
        and int(text[i]) == 43
        and read_digits(text, i + 1, 2) == 0
        and int(text[i + 3]) == 58
        and read_digits(text, i + 4, 2) == 0
    ):
        i += 6
    return value, i == end


@in_loop
def _code(text: Bytes, i: int, end: int) -> tuple[int, bool]:
    """Read up to four octal digits in the forms of tables: 0021, 21, 21.0."""
    value = 0
    digits = 0
    while i < end and 48 <= int(text[i]) <= 55 and digits < 4:
        value = value * 8 + int(text[i]) - 48
        digits += 1
        i += 1
    if end - i == 2 and int(text[i]) == 46 and int(text[i + 1]) == 48:
        i += 2
    return value, digits > 0 and i == end


@in_loop
def _callsign(text: Bytes, i: int, end: int) -> tuple[int, bool]:
    """Pack up to eight letters and digits without surrounding blanks; 0 for none."""
    while i < end and int(text[i]) == _BLANK:
        i += 1
    while end > i and int(text[end - 1]) == _BLANK:
        end -= 1
    if end - i > _CALLSIGN_MAX:
        return 0, False
    value = 0
    for k in range(i, end):
        c = int(text[k])
        if not (48 <= c <= 57 or 65 <= c <= 90 or 97 <= c <= 122):
            return 0, False
        value = (value << 8) | c
    return value, True


@in_loop
def _truth(text: Bytes, i: int, end: int) -> tuple[int, bool]:
    """Read a boolean: a word, or 1 or 0."""
    c = int(text[i])
    size = end - i
    if size == 1 and (c in (48, 49)):
        return c - 48, True
    if size == 4 and (c in (84, 116)):
        return 1, int(text[i + 1]) == 114 and int(text[i + 2]) == 117 and int(text[i + 3]) == 101
    if size == 5 and (c in (70, 102)):
        same = int(text[i + 1]) == 97 and int(text[i + 2]) == 108 and int(text[i + 3]) == 115
        return 0, same and int(text[i + 4]) == 101
    return 0, False


@in_loop
def _read_value(
    text: Bytes, i: int, end: int, role: int, worded: Flags, scale: Numbers, divisor:
    Numbers, numbers: Numbers, words: Words, row: int,
) -> bool:  # fmt: skip
    """Read a value into its array; return whether it is valid."""
    if _none(text, i, end):
        return True
    if role < FIRST_WORD:
        if worded[role]:
            value, good = _moment(text, i, end)
        else:
            value, _, after = read_decimal(text, i)
            good = after == end
            value = value / divisor[role] * scale[role]
        numbers[role, row] = value + 0.0
        return good
    whole, good = 0, False
    if role == ADDRESS:
        if end - i == 6:
            whole, after = read_address(text, i)
            good = after == end
    elif role == CODE:
        whole, good = _code(text, i, end)
    elif role == CALLSIGN:
        whole, good = _callsign(text, i, end)
        if whole == 0:
            whole = ABSENT
    elif role == GROUND:
        whole, good = _truth(text, i, end)
    words[role - FIRST_WORD, row] = whole
    return good


@in_loop
def _is_literal(text: Bytes, i: int, end: int) -> bool:
    """Return whether a text is a JSON literal: a number without exponent, or a word."""
    c, size = int(text[i]), end - i
    if c in (116, 102):
        return _truth(text, i, end)[1]
    if size >= 3 and c in (110, 78):
        second, third = int(text[i + 1]), int(text[i + 2])
        if size == 3:
            # NaN is common, though it is not JSON.
            return c == 78 and second == 97 and third == 78
        return size == 4 and c == 110 and second == 117 and third == 108 and int(text[i + 3]) == 108
    if c == _MINUS:
        i += 1
    begin = i
    while i < end and 48 <= int(text[i]) <= 57:
        i += 1
    if i == begin or (int(text[begin]) == 48 and i - begin > 1):
        return False
    if i < end and int(text[i]) == 46:
        i += 1
        begin = i
        while i < end and 48 <= int(text[i]) <= 57:
            i += 1
        if i == begin:
            return False
    return i == end


@in_loop
def _object(
    text: Bytes, i: int, end: int, keys: Bytes, lengths: Words, roles: Words, hints: Words,
    worded: Flags, scale: Numbers, divisor: Numbers, numbers: Numbers, words: Words, row: int,
) -> bool:  # fmt: skip
    """Read a flat JSON object; return whether it is valid."""
    if int(text[i]) != _OPEN:
        return False
    i += 1
    seen = 0
    place = 0
    while True:
        while is_blank(int(text[i])):
            i += 1
        if int(text[i]) != _QUOTE:
            return False
        i += 1
        begin = i
        while int(text[i]) != _QUOTE:
            # A line feed cannot occur in a text; the sentinel of a call is one.
            if int(text[i]) == _BACKSLASH or int(text[i]) < _BLANK or i >= end:
                return False
            i += 1
        size = i - begin
        found = -1
        for attempt in range(len(lengths) + 1):
            key = attempt - 1
            if attempt == 0:
                key = hints[place] if place < len(hints) else 0
            if lengths[key] != size:
                continue
            k = 0
            while k < size and text[begin + k] == keys[key, k]:
                k += 1
            if k == size:
                found = key
                break
        i += 1
        while is_blank(int(text[i])):
            i += 1
        if int(text[i]) != _COLON:
            return False
        i += 1
        while is_blank(int(text[i])):
            i += 1
        quoted = int(text[i]) == _QUOTE
        if quoted:
            i += 1
        begin = i
        while True:
            c = int(text[i])
            if quoted:
                if c == _QUOTE:
                    break
                if c == _BACKSLASH or c < _BLANK:
                    return False
            elif c in (_COMMA, _CLOSE) or is_blank(c):
                break
            elif c in (_OPEN, _OPEN_LIST, _QUOTE, _CLOSE_LIST):
                return False
            i += 1
            if i >= end:
                return False
        if not quoted and not _is_literal(text, begin, i):
            return False
        if found >= 0:
            if place < len(hints):
                hints[place] = found
            role = roles[found]
            if seen & (1 << role):
                return False
            seen |= 1 << role
            if not _read_value(text, begin, i, role, worded, scale, divisor, numbers, words, row):
                return False
        if quoted:
            i += 1
        while is_blank(int(text[i])):
            i += 1
        if int(text[i]) == _CLOSE:
            return i + 1 == end
        if int(text[i]) != _COMMA:
            return False
        i += 1
        place += 1


@loop
def read_objects(
    text: Bytes, begins: Words, ends: Words, keys: Bytes, lengths: Words, roles: Words, hints:
    Words, worded: Flags, scale: Numbers, divisor: Numbers, numbers: Numbers, words: Words, odd:
    Flags,
) -> int:  # fmt: skip
    """Read JSON objects.

    Parameters
    ----------
    text : uint8[n]
        The text.
    begins, ends : int64[r]
        Begin and end of each object.
    keys : uint8[k, w]
        Used names.
    lengths, roles : int64[k]
        Length and role of each.
    hints : int64[p]
        Name at each position of the previous object, as a guess; updated in place.
    worded : bool[7]
        Which numbers are dates or times of day.
    scale, divisor : float64[7]
        Factor to SI of each number, and the divisor applied before.
    numbers, words : float64[16, r], int64[5, r]
        Filled where a value is present.
    odd : bool[r]
        Filled: records left to the reference form.

    Returns
    -------
    int
        Number of odd records.
    """
    count = 0
    for row in range(len(begins)):
        good = _object(
            text, begins[row], ends[row], keys, lengths, roles, hints, worded, scale,
            divisor, numbers, words, row,
        )  # fmt: skip
        odd[row] = not good
        if not good:
            count += 1
    return count


@loop
def read_columns(
    text: Bytes, begins: Words, ends: Words, separator: int, roles: Words, worded: Flags,
    scale: Numbers, divisor: Numbers, numbers: Numbers, words: Words, odd: Flags,
) -> int:  # fmt: skip
    """Read lines of columns; as `read_objects`, except for these parameters.

    Parameters
    ----------
    separator : int
        Separator of columns, a byte.
    roles : int64[c]
        Role of each column, -1 if unused.
    """
    count = 0
    columns = len(roles)
    for row in range(len(begins)):
        i, end = begins[row], ends[row]
        good = True
        for column in range(columns):
            while i < end and int(text[i]) == _BLANK:
                i += 1
            begin = i
            while i < end and int(text[i]) != separator:
                if int(text[i]) == _QUOTE or int(text[i]) == 0:
                    good = False
                i += 1
            if not good or (i < end) != (column < columns - 1):
                good = False
                break
            stop = i
            while stop > begin and int(text[stop - 1]) == _BLANK:
                stop -= 1
            if roles[column] >= 0 and not _read_value(
                text, begin, stop, roles[column], worded, scale, divisor, numbers, words, row
            ):
                good = False
                break
            i += 1
        odd[row] = not good
        if not good:
            count += 1
    return count
