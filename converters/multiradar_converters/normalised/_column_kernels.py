"""Compiled tests and translation of columns in place; see `exported` for their form.

Of every column: ``values`` or ``views``; ``valid`` = bits of the rows with a value, empty if all
have; ``begin`` = bit of the first row; ``odd`` = rows that may not be accepted, marked in place.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, loop

Bits = NDArray[np.uint8]
Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MISSING = -1
_LENGTH = 0xFFFFFFFF
_INLINE_MAX = 12
_BLANK, _ZERO, _NINE, _A, _Z = 32, 48, 57, 65, 90
_LOWER_CASE = 32
_PUNCTUATION = (45, 46, 95)
_CALLSIGN_MAX, _LETTER_BITS, _LETTER_MASK = 8, 6, 63


@in_loop
def _has(valid: Bits, begin: int, row: int) -> bool:
    """Return whether a row has a value."""
    bit = begin + row
    return len(valid) == 0 or (int(valid[bit >> 3]) >> (bit & 7)) & 1 != 0


@in_loop
def _letter(views: Integers, row: int, place: int) -> int:
    """Return an octet of a text of at most 12."""
    word, shift = (0, 32 + 8 * place) if place < 4 else (1, 8 * (place - 4))
    return int(views[row, word] >> shift) & 255


@in_loop
def _capital(letter: int) -> int:
    """Return a letter as a capital; 0 unless it is a letter or a digit of ASCII."""
    if _ZERO <= letter <= _NINE or _A <= letter <= _Z:
        return letter
    if _A <= letter - _LOWER_CASE <= _Z:
        return letter - _LOWER_CASE
    return 0


@loop
def mark_absent(valid: Bits, begin: int, odd: Flags) -> None:
    """Mark the rows without a value."""
    if len(valid):
        for row in range(len(odd)):
            if not _has(valid, begin, row):
                odd[row] = True


@loop
def mark_needed(
    valid: Bits, begin: int, kinds: NDArray[np.int32], needed: Flags, odd: Flags
) -> None:
    """Mark the rows without a value whose kind, an index into `needed` if any, needs one."""
    if len(valid):
        for row in range(len(odd)):
            if kinds[row] >= 0 and needed[kinds[row]] and not _has(valid, begin, row):
                odd[row] = True


@loop
def mark_outside(
    values: Floats, valid: Bits, begin: int, least: float, most: float, odd: Flags
) -> None:
    """Mark numbers that are not within bounds, inclusive; NaN is not."""
    for row in range(len(values)):
        inside = values[row] >= least and values[row] <= most
        if not inside and _has(valid, begin, row):
            odd[row] = True


@loop
def text_octets(views: Integers, valid: Bits, begin: int) -> int:
    """Return the octets of all texts together; negative if one is longer than 12 octets."""
    total, long = 0, False
    for row in range(len(views)):
        if _has(valid, begin, row):
            size = views[row, 0] & _LENGTH
            total += size
            long = long or size > _INLINE_MAX
    return -total if long else total


@loop
def mark_names(views: Integers, valid: Bits, begin: int, odd: Flags) -> None:
    """Mark texts other than 1 to 12 letters, digits, dots, hyphens and underscores."""
    for row in range(len(views)):
        if not _has(valid, begin, row):
            continue
        size = views[row, 0] & _LENGTH
        good = 0 < size <= _INLINE_MAX
        if good:
            for place in range(size):
                letter = _letter(views, row, place)
                if _capital(letter) == 0 and letter not in _PUNCTUATION:
                    good = False
        if not good:
            odd[row] = True


@in_loop
def _name_place(first: int, second: int) -> int:
    """Return where the search for a text begins, modulo the size of the table."""
    mixed = first ^ second
    mixed = (mixed ^ (mixed >> 32)) & 0xFFFFFFFF
    return (mixed * 0x9E3B) >> 13


@loop
def enter_names(
    views: Integers, entered: NDArray[np.int32], names: Integers, number: NDArray[np.int32]
) -> None:
    """Enter texts of at most 12 octets, with their numbers, into the table of `find_names`."""
    mask = len(names) - 1
    for row in range(len(views)):
        place = _name_place(views[row, 0], views[row, 1]) & mask
        while names[place, 0] != 0:
            place = (place + 1) & mask
        names[place, 0] = views[row, 0]
        names[place, 1] = views[row, 1]
        number[place] = entered[row]


@loop
def find_names(
    views: Integers, valid: Bits, begin: int, names: Integers, number: NDArray[np.int32],
    found: NDArray[np.int32], odd: Flags,
) -> None:  # fmt: skip
    """Find texts in a table, and mark those that are not there.

    Parameters
    ----------
    names : (m, 2) int64
        Views of names in an open hash table; zero where it is empty. m is a power of two, greater
        than the number of names.
    number : (m,) int32
        Number of each.
    found : (n,) int32
        Filled with the number of each row's text, −1 where it has none or another.
    """
    mask = len(names) - 1
    for row in range(len(views)):
        found[row] = MISSING
        if not _has(valid, begin, row):
            continue
        first, second = views[row, 0], views[row, 1]
        place = _name_place(first, second) & mask
        while names[place, 0] != 0:
            if names[place, 0] == first and names[place, 1] == second:
                found[row] = number[place]
                break
            place = (place + 1) & mask
        if names[place, 0] == 0:
            odd[row] = True


@loop
def read_codes(
    views: Integers, valid: Bits, begin: int, codes: NDArray[np.int32], odd: Flags
) -> None:
    """Read Mode 3/A codes, four octal digits; −1 where there is none."""
    for row in range(len(views)):
        codes[row] = MISSING
        if not _has(valid, begin, row):
            continue
        code = 0
        good = views[row, 0] & _LENGTH == 4
        for place in range(4):
            digit = _letter(views, row, place) - _ZERO
            good = good and 0 <= digit <= 7
            code = 8 * code + digit
        if good:
            codes[row] = code
        else:
            odd[row] = True


@loop
def read_addresses(
    views: Integers, valid: Bits, begin: int, addresses: Integers, odd: Flags
) -> int:
    """Read Mode S addresses, six hexadecimal digits; −1 where there is none.

    Returns
    -------
    int
        Number of rows with capitals.
    """
    capitals = 0
    for row in range(len(views)):
        addresses[row] = MISSING
        if not _has(valid, begin, row):
            continue
        address = 0
        good = views[row, 0] & _LENGTH == 6
        changed = False
        for place in range(6):
            letter = _letter(views, row, place)
            digit = letter - _ZERO
            if not 0 <= digit <= 9:
                capital = _capital(letter)
                changed = changed or capital == letter
                digit = capital - _A + 10
                good = good and 10 <= digit <= 15
            address = 16 * address + digit
        if good:
            addresses[row] = address
            capitals += changed
        else:
            odd[row] = True
    return capitals


@loop
def read_callsigns(
    views: Integers, valid: Bits, begin: int, callsigns: Integers, odd: Flags
) -> int:
    """Read callsigns of at most 12 octets as eight characters of six bits; −1 where there is none.

    Returns
    -------
    int
        Number of rows that are not as they are stored, in capitals without blanks around them.
    """
    unusual = 0
    for row in range(len(views)):
        callsigns[row] = MISSING
        if not _has(valid, begin, row):
            continue
        size = views[row, 0] & _LENGTH
        good = size <= _INLINE_MAX
        first, last = 0, size - 1 if good else -1
        while first <= last and _letter(views, row, first) == _BLANK:
            first += 1
        while first <= last and _letter(views, row, last) == _BLANK:
            last -= 1
        good = good and 0 <= last - first < _CALLSIGN_MAX
        changed = last - first + 1 != size
        packed = 0
        if good:
            for place in range(first, first + _CALLSIGN_MAX):
                letter = _letter(views, row, place) if place <= last else _BLANK
                capital = _capital(letter)
                good = good and (capital != 0 or letter == _BLANK)
                changed = changed or capital not in (letter, 0)
                code = _BLANK if letter == _BLANK else capital
                packed = packed << _LETTER_BITS | code & _LETTER_MASK
        if good:
            callsigns[row] = packed
            unusual += changed
        else:
            odd[row] = True
    return unusual


@loop
def read_integers(values: Integers, valid: Bits, begin: int, numbers: Integers, odd: Flags) -> None:
    """Read integers of at least 0; −1 where there is none."""
    for row in range(len(values)):
        numbers[row] = MISSING
        if _has(valid, begin, row):
            numbers[row] = values[row]
            if values[row] < 0:
                odd[row] = True


@loop
def read_floats(
    values: Floats, valid: Bits, begin: int, kinds: NDArray[np.int32], used: Flags, scale: float,
    numbers: Floats,
) -> None:  # fmt: skip
    """Read numbers of the kinds (index into `used`) that use them, times a scale; NaN for others.

    -0.0 becomes 0.0, because rows are compared by content.
    """
    for row in range(len(values)):
        numbers[row] = np.nan
        if used[kinds[row]] and _has(valid, begin, row):
            numbers[row] = (values[row] + 0.0) * scale


@loop
def mark_unfit(
    sensor: NDArray[np.int32], kinds: NDArray[np.int32], fits: Flags, range_m: Floats,
    range_end_m: Floats, disabled: Flags, odd: Flags,
) -> None:  # fmt: skip
    """Mark rows that their sensor cannot have measured.

    Parameters
    ----------
    sensor : (n,) int32
        Sensor of each row, negative for an unknown one.
    kinds : (n,) int8
        Kind of each row, not negative.
    fits : (m, k) bool
        Whether each sensor measures each kind.
    range_m : (n,) float64
        Ranges, NaN where there is none.
    range_end_m : (m,) float64
        Greatest range of each sensor.
    disabled : (m,) bool
        Sensors that are disabled.
    """
    for row in range(len(sensor)):
        s = sensor[row]
        if s < 0 or disabled[s] or not fits[s, kinds[row]] or range_m[row] > range_end_m[s]:
            odd[row] = True
