"""Compiled splitting of text into records."""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, loop

Bytes = NDArray[np.uint8]
Words = NDArray[np.int64]

_BACKSLASH, _QUOTE, _COMMA, _LF, _CR = 92, 34, 44, 10, 13
_OPEN, _CLOSE, _OPEN_LIST, _CLOSE_LIST = 123, 125, 91, 93

#: Indices in the state of `split_elements`.
DEPTH, IN_TEXT, ESCAPED, BEGIN, DONE, LOST, LONG = range(7)
STATE_WORDS = 7
_SCALAR = -1


@in_loop
def is_blank(c: int) -> bool:
    """Return whether a byte is JSON whitespace."""
    return c in (32, 9, 10, 13)


@loop
def split_elements(
    text: Bytes, start: int, stop: int, opening: int, longest: int, state: Words, begins: Words,
    ends: Words,
) -> tuple[int, int]:  # fmt: skip
    """Find the elements of a JSON list, or the values of JSON lines.

    Parameters
    ----------
    text : uint8[n]
        The text.
    start, stop : int
        Begin and end; the text before `start` was processed in the previous call.
    opening : int
        Opening bracket of elements. After a lost element, the next one follows the closing bracket,
        blanks or commas, and this bracket.
    longest : int
        Maximum length of an element, bytes.
    state : int64[STATE_WORDS]
        Depth (-1: within a number or a word), whether within quotes, whether after a backslash,
        begin of the element (-1: none), whether the list has ended, whether an element is lost (2:
        after its bracket), and whether the current element is too long. Updated in place.
    begins, ends : int64[r]
        Filled.

    Returns
    -------
    tuple of int
        Where parsing stopped, and the number of elements.
    """
    depth, in_text, escaped = state[DEPTH], state[IN_TEXT], state[ESCAPED]
    begin, lost = state[BEGIN], state[LOST]
    closing = opening + 2
    done = False
    room = len(begins)
    count = 0
    i = start
    bound = stop if begin < 0 else min(stop, begin + longest)
    while i < bound and count < room and not done:
        c = int(text[i])
        if lost > 0:
            if lost == 2 and c == _CLOSE_LIST:
                done = True
            elif c == closing:
                lost = 2
            elif lost == 2 and c == opening:
                lost, begin, depth = 0, i, 1
            elif not (is_blank(c) or c == _COMMA):
                lost = 1
        elif in_text:
            if escaped:
                escaped = 0
            else:
                while i < bound and int(text[i]) != _QUOTE and int(text[i]) != _BACKSLASH:
                    i += 1
                if i < bound:
                    escaped = 1 if int(text[i]) == _BACKSLASH else 0
                    in_text = escaped
        elif depth > 0:
            if c == _QUOTE:
                in_text = 1
            elif c in (_OPEN, _OPEN_LIST):
                depth += 1
            elif c in (_CLOSE, _CLOSE_LIST):
                depth -= 1
                if depth == 0:
                    begins[count] = begin
                    ends[count] = i + 1
                    count += 1
                    begin = -1
        elif c in (_OPEN, _OPEN_LIST, _CLOSE_LIST, _COMMA) or is_blank(c):
            if depth == _SCALAR:
                begins[count] = begin
                ends[count] = i
                count += 1
                begin, depth = -1, 0
                # Processed again in the new state.
                i -= 1
            elif c in (_OPEN, _OPEN_LIST):
                begin, depth = i, 1
            elif c == _CLOSE_LIST:
                done = True
        elif depth == 0:
            begin, depth = i, _SCALAR
        i += 1
        bound = stop if begin < 0 else min(stop, begin + longest)
    i = min(i, bound)
    state[DEPTH], state[IN_TEXT], state[ESCAPED] = depth, in_text, escaped
    state[BEGIN], state[DONE], state[LOST] = begin, 1 if done else 0, lost
    state[LONG] = 1 if begin >= 0 and i - begin >= longest else 0
    return i, count


@loop
def split_lines(text: Bytes, start: int, stop: int, begins: Words, ends: Words) -> tuple[int, int]:
    """Find complete lines, without LF or CR LF.

    Parameters
    ----------
    text : uint8[n]
        The text.
    start, stop : int
        Begin and end.
    begins, ends : int64[r]
        Filled.

    Returns
    -------
    tuple of int
        Begin of the line after the last one, and the number of lines.
    """
    room = len(begins)
    count = 0
    begin = start
    for i in range(start, stop):
        if text[i] == _LF:
            begins[count] = begin
            ends[count] = i - 1 if i > begin and text[i - 1] == _CR else i
            count += 1
            begin = i + 1
            if count == room:
                break
    return begin, count
