"""Compiled search for the keys and values of flat JSON objects."""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, loop

Bytes = NDArray[np.uint8]
Words = NDArray[np.int64]
Flags = NDArray[np.bool_]

_TAB, _LF, _CR, _BLANK, _QUOTE, _COMMA, _COLON = 9, 10, 13, 32, 34, 44, 58
_OPEN, _CLOSE, _OPEN_LIST, _BACKSLASH, _L, _N, _U = 123, 125, 91, 92, 108, 110, 117


@in_loop
def _skip(text: Bytes, i: int, stop: int, separator: int) -> int:
    """Return the place after whitespace, of which LF become blanks unless they separate objects."""
    while i < stop:
        if int(text[i]) == _LF and separator != _LF:
            text[i] = _BLANK
        elif int(text[i]) not in (_BLANK, _CR, _TAB):
            break
        i += 1
    return i


@in_loop
def _is_null(text: Bytes, i: int) -> bool:
    """Return whether four octets are `null`."""
    second, third, fourth = int(text[i + 1]), int(text[i + 2]), int(text[i + 3])
    return int(text[i]) == _N and second == _U and third == _L and fourth == _L


@in_loop
def _end_of_text(text: Bytes, i: int, stop: int) -> int:
    """Return the place of the closing quotation mark; another place if there is none."""
    while i < stop and int(text[i]) not in (_QUOTE, _BACKSLASH) and int(text[i]) >= _BLANK:
        i += 1
    return i


@in_loop
def _find(text: Bytes, begin: int, size: int, names: Bytes, lengths: Words, guess: int) -> int:
    """Return which name a key is; -1 for none."""
    found = -1
    for attempt in range(len(lengths) + 1):
        name = attempt - 1 if attempt else guess
        if lengths[name] == size:
            k = 0
            while k < size and text[begin + k] == names[name, k]:
                k += 1
            if k == size:
                found = name
                break
    return found


@in_loop
def _scan_object(
    text: Bytes, i: int, stop: int, separator: int, names: Bytes, lengths: Words, is_text: Flags,
    after: Words, values: Words,
) -> int:  # fmt: skip
    """Return the place after the closing brace of an object; -1 if it is not as expected."""
    seen = 0
    name = len(lengths)
    while True:
        i = _skip(text, i, stop, separator)
        end = _end_of_text(text, i + 1, stop)
        if end + 1 >= stop or int(text[i]) != _QUOTE or int(text[end]) != _QUOTE:
            return -1
        found = _find(text, i + 1, end - i - 1, names, lengths, after[name])
        if found < 0 or seen >> found & 1:
            return -1
        seen |= 1 << found
        after[name] = found
        name = found
        i = _skip(text, end + 1, stop, separator)
        if i >= stop or int(text[i]) != _COLON:
            return -1
        i = _skip(text, i + 1, stop, separator)
        if i >= stop:
            return -1
        first, count = int(text[i]), 1
        if first == _QUOTE:
            i = _end_of_text(text, i + 1, stop)
            if i >= stop or int(text[i]) != _QUOTE or not is_text[name]:
                return -1
            i += 1
        else:
            begin = i
            while i < stop and int(text[i]) > _BLANK and int(text[i]) not in (_COMMA, _CLOSE):
                if int(text[i]) in (_QUOTE, _OPEN, _OPEN_LIST):
                    return -1
                i += 1
            is_null = i - begin == 4 and _is_null(text, begin)
            if not is_null and (is_text[name] or first == _N):
                return -1
            count -= is_null
        values[name] = max(values[name], 0) + count
        i = _skip(text, i, stop, separator)
        if i >= stop:
            return -1
        i += 1
        if int(text[i - 1]) == _CLOSE:
            return i
        if int(text[i - 1]) != _COMMA:
            return -1


@loop
def scan_objects(
    text: Bytes, separator: int, longest: int, names: Bytes, lengths: Words, is_text: Flags,
    after: Words, values: Words,
) -> int:  # fmt: skip
    """Find the keys and values of flat objects, and put each object on a line of its own.

    Whether numbers and words are JSON is left to a parser of the lines.

    Parameters
    ----------
    text : uint8[n]
        The objects. Each separator of two objects becomes LF, every other LF a blank.
    separator : int
        Comma or LF.
    longest : int
        Maximum octets of an object.
    names : uint8[m, w]
        Known keys, at most 63.
    lengths : int64[m]
        Length of each.
    is_text : bool[m]
        Whether its values are texts.
    after : int64[m + 1]
        Key after each, as a guess, and the first key; updated in place.
    values : int64[m]
        -1; filled with the number of values that are not null, of each key that occurs.

    Returns
    -------
    int
        Number of objects; -1 if something is not as expected: unknown or repeated keys, texts where
        there are none or the reverse, nested values, escapes.
    """
    stop = len(text)
    objects, i = 0, 0
    while True:
        i = _skip(text, i, stop, separator)
        if i >= stop or int(text[i]) != _OPEN:
            return -1
        bound = min(stop, i + longest)
        i = _scan_object(text, i + 1, bound, separator, names, lengths, is_text, after, values)
        if i < 0:
            return -1
        objects += 1
        i = _skip(text, i, stop, separator)
        if i == stop:
            return objects
        if int(text[i]) != separator:
            return -1
        text[i] = _LF
        i += 1
