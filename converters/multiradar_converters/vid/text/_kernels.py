"""Compiled parsing of dump lines; the reference form is `lines.parse_line`.

The text of a call consists of whole lines, so its last byte is a line end and every search stops
there. A line that is not obviously valid is marked in `odd` and left to the reference form, which
accepts it (for example with an exponent or 17 digits) or reports the error.
"""

import numpy as np

from multiradar_compiled.kernels import in_loop, loop
from multiradar_converters.vid.text._value_kernels import CODE, FIRST_INTEGER, HEIGHT, read_value
from multiradar_converters.vid.text.arrays import Bytes, Keys, Limits, Numbers, ParsedLines, Words

# These functions do not allocate, so they need no reference counting by numba, which costs several
# atomic operations per field and array (64 ns per field instead of 9).

_TAB, _CR, _BLANK, _EQUALS, _SEMICOLON = 9, 13, 32, 61, 59


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
    text: Bytes,
    i: int,
    stop: int,
    terminator: int,
    separator: int,
    roles: Words,
    iso: bool,
    limits: Limits,
    numbers: Numbers,
    integers: Words,
    row: int,
) -> tuple[bool, int]:
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
            if runs or (role != HEIGHT and role != CODE):
                return False, i
            if role == HEIGHT:
                numbers[role, row] = np.nan
            else:
                integers[role - FIRST_INTEGER, row] = -1
        else:
            after = read_value(text, i, stop, role, iso, limits, numbers, integers, row)
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
    text: Bytes,
    i: int,
    stop: int,
    terminator: int,
    keys: Keys,
    hints: Words,
    iso: bool,
    limits: Limits,
    numbers: Numbers,
    integers: Words,
    row: int,
) -> tuple[bool, int]:
    """Parse a line of pairs; return whether it is valid and where parsing stopped."""
    names, lengths, roles, required = keys
    numbers[HEIGHT, row] = np.nan
    integers[CODE - FIRST_INTEGER, row] = -1
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
                same = text[i + k] == names[key, k]
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
                if role != HEIGHT and role != CODE:
                    return False, i
            else:
                i = read_value(text, i, stop, role, iso, limits, numbers, integers, row)
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
    text: Bytes,
    start: int,
    stop: int,
    terminator: int,
    separator: int,
    roles: Words,
    iso: bool,
    limits: Limits,
    written: ParsedLines,
) -> tuple[int, int, int, int, int]:
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
    limits : Limits
        Bounds and units of numbers.
    written : ParsedLines
        The output.

    Returns
    -------
    tuple of int
        Where parsing stopped, rows, odd lines, lines, blank lines.
    """
    numbers, integers, begins, odd = written
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
            text, i, stop, terminator, separator, roles, iso, limits, numbers, integers, row
        )
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
    text: Bytes,
    start: int,
    stop: int,
    terminator: int,
    keys: Keys,
    hints: Words,
    iso: bool,
    limits: Limits,
    written: ParsedLines,
) -> tuple[int, int, int, int, int]:
    """Parse lines of pairs; as `parse_columns`, except for these parameters.

    Parameters
    ----------
    keys : Keys
        The known keys.
    hints : int64[p]
        Key at each position of the previous line, as a guess; updated in place.
    """
    numbers, integers, begins, odd = written
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
                text, i, stop, terminator, keys, hints, iso, limits, numbers, integers, row
            )
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
