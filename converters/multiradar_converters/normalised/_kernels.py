"""Compiled reading of flat JSON objects into columns."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, loop
from multiradar_converters.normalised._number_kernels import number_bits, scan_number

Bytes = NDArray[np.uint8]
Words = NDArray[np.int64]
Floats = NDArray[np.uint64]

#: Types of values, in `forms`.
FLOAT, INTEGER, TEXT, BOOLEAN = range(4)

_TAB, _LF, _CR, _BLANK, _QUOTE, _COMMA, _COLON = 9, 10, 13, 32, 34, 44, 58
_OPEN, _CLOSE, _BACKSLASH, _ASCII_END = 123, 125, 92, 128
_A, _E, _F, _L, _N, _R, _S, _T, _U = 97, 101, 102, 108, 110, 114, 115, 116, 117
_INTEGER_MAX = np.uint64(2**63 - 1)


class Keys(NamedTuple):
    """The keys that an object may have.

    Attributes
    ----------
    names : (m, w) uint8
        Their letters; at most 63 keys.
    lengths : (m,) int64
        Length of each.
    forms : (m,) int64
        Type of its values.
    slots : (m,) int64
        Its column among those of that type; integers and booleans share columns.
    """

    names: Bytes
    lengths: Words
    forms: Words
    slots: Words


class Values(NamedTuple):
    """The values of at most r objects, as columns; 0 where there is none.

    Attributes
    ----------
    floats : (f, r) uint64
        The bits of numbers.
    integers : (k, r) int64
        Integers, and 1 for `true`.
    spans : (t, r, 2) int64
        Places of texts, and after them.
    given : (m, r) uint8
        1 for each value that is not null.
    counts : (m,) int64
        Number of these values of each key; −1 for a key that does not occur.
    """

    floats: Floats
    integers: Words
    spans: Words
    given: Bytes
    counts: Words


@in_loop
def _skip(text: Bytes, i: int, stop: int, separator: int) -> int:
    """Return the place after whitespace, of which LF is none where it separates objects."""
    while i < stop:
        octet = int(text[i])
        if octet > _BLANK or (octet == _LF and separator == _LF):
            break
        if octet not in (_BLANK, _LF, _CR, _TAB):
            break
        i += 1
    return i


@in_loop
def _is_word(text: Bytes, i: int, stop: int, a: int, b: int, c: int, d: int) -> bool:
    """Return whether the next octets are these four."""
    if i + 4 > stop:
        return False
    first = int(text[i]) == a and int(text[i + 1]) == b
    return first and int(text[i + 2]) == c and int(text[i + 3]) == d


@in_loop
def _end_of_text(text: Bytes, i: int, stop: int) -> int:
    """Return the place of the closing quotation mark; another one unless all is plain ASCII."""
    while i < stop:
        octet = int(text[i])
        if octet in (_QUOTE, _BACKSLASH) or octet < _BLANK or octet >= _ASCII_END:
            break
        i += 1
    return i


@in_loop
def _is_key(text: Bytes, begin: int, stop: int, name: int, keys: Keys) -> bool:
    """Return whether a name and a quotation mark follow."""
    size = keys.lengths[name]
    if begin + size >= stop or int(text[begin + size]) != _QUOTE:
        return False
    # All octets, so that several are compared at once.
    different = np.uint8(0)
    for k in range(size):
        different |= text[begin + k] ^ keys.names[name, k]
    return int(different) == 0


@in_loop
def _find(text: Bytes, begin: int, stop: int, keys: Keys, guess: int) -> int:
    """Return which name a key is; -1 for none."""
    found = -1
    for attempt in range(len(keys.lengths) + 1):
        name = attempt - 1 if attempt else guess
        if _is_key(text, begin, stop, name, keys):
            found = name
            break
    return found


@in_loop
def _read_value(
    text: Bytes, i: int, stop: int, form: int, slot: int, row: int, powers: Floats, values: Values,
) -> tuple[int, bool]:  # fmt: skip
    """Return the place after a value, −1 if it is not as expected, and whether it is one.

    `null` is none. The value is stored in the row of the column `slot` of its form.
    """
    if _is_word(text, i, stop, _N, _U, _L, _L):
        return i + 4, False
    if form == TEXT:
        if i >= stop or int(text[i]) != _QUOTE:
            return -1, False
        end = _end_of_text(text, i + 1, stop)
        if end >= stop or int(text[end]) != _QUOTE:
            return -1, False
        values.spans[slot, row, 0] = i + 1
        values.spans[slot, row, 1] = end
        return end + 1, True
    if form == BOOLEAN:
        if _is_word(text, i, stop, _T, _R, _U, _E):
            values.integers[slot, row] = 1
            return i + 4, True
        if _is_word(text, i + 1, stop, _A, _L, _S, _E) and int(text[i]) == _F:
            return i + 5, True
        return -1, False
    end, negative, digits, exponent, is_integer, further = scan_number(text, i, stop)
    if form == INTEGER:
        if exponent or further or not is_integer or digits > _INTEGER_MAX:
            return -1, False
        values.integers[slot, row] = -np.int64(digits) if negative else np.int64(digits)
        return end, True
    good, bits = number_bits(negative, digits, exponent, further, powers)
    values.floats[slot, row] = bits
    return end if good else -1, True


@in_loop
def _read_object(
    text: Bytes, i: int, stop: int, separator: int, keys: Keys, after: Words, row: int,
    powers: Floats, values: Values,
) -> int:  # fmt: skip
    """Return the place after the closing brace of an object; −1 if it is not as expected."""
    seen = 0
    name = len(keys.lengths)
    while True:
        i = _skip(text, i, stop, separator)
        if i >= stop or int(text[i]) != _QUOTE:
            return -1
        found = _find(text, i + 1, stop, keys, after[name])
        if found < 0 or seen >> found & 1:
            return -1
        seen |= 1 << found
        after[name] = found
        name = found
        i = _skip(text, i + keys.lengths[found] + 2, stop, separator)
        if i >= stop or int(text[i]) != _COLON:
            return -1
        i = _skip(text, i + 1, stop, separator)
        i, is_given = _read_value(
            text, i, stop, keys.forms[name], keys.slots[name], row, powers, values
        )
        if i < 0:
            return -1
        if is_given:
            values.given[name, row] = 1
        values.counts[name] = max(values.counts[name], 0) + is_given
        i = _skip(text, i, stop, separator)
        if i >= stop:
            return -1
        i += 1
        if int(text[i - 1]) == _CLOSE:
            return i
        if int(text[i - 1]) != _COMMA:
            return -1


@loop
def read_objects(
    text: Bytes, separator: int, longest: int, keys: Keys, after: Words, powers: Floats,
    values: Values,
) -> int:  # fmt: skip
    """Read flat objects into columns.

    Parameters
    ----------
    text : uint8[n]
        The objects.
    separator : int
        Comma or LF.
    longest : int
        Maximum octets of an object.
    keys : Keys
        Known keys.
    after : int64[m + 1]
        Key after each, as a guess, and the first key; updated in place.
    powers : uint64[k, 2]
        As of `powers_of_five`.
    values : Values
        Filled.

    Returns
    -------
    int
        Number of objects; -1 if something is not as expected: more of them, unknown or repeated
        keys, values of another type, numbers that cannot be read here, nested values, escapes.
    """
    stop = len(text)
    objects, i = 0, 0
    while True:
        i = _skip(text, i, stop, separator)
        if i >= stop or int(text[i]) != _OPEN or objects == values.given.shape[1]:
            return -1
        bound = min(stop, i + longest)
        i = _read_object(text, i + 1, bound, separator, keys, after, objects, powers, values)
        if i < 0:
            return -1
        objects += 1
        i = _skip(text, i, stop, separator)
        if i == stop:
            return objects
        if int(text[i]) != separator:
            return -1
        i += 1


@loop
def count_objects(text: Bytes) -> int:
    """Return the number of opening braces; of flat objects, whose texts have none, their number."""
    count = 0
    for i in range(len(text)):
        count += text[i] == _OPEN
    return count


@loop
def join_texts(text: Bytes, spans: Words, joined: Bytes) -> int:
    """Copy texts one after the other, with LF between them; return their octets.

    Parameters
    ----------
    text : uint8[n]
        What has the texts.
    spans : int64[r, 2]
        Place of each, and after it.
    joined : uint8[k]
        Filled; long enough.
    """
    size = 0
    for row in range(len(spans)):
        if row:
            joined[size] = _LF
            size += 1
        for i in range(spans[row, 0], spans[row, 1]):
            joined[size] = text[i]
            size += 1
    return size
