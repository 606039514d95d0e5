"""Files that are packed, and binary files that were written or transferred as text.

A block starts with a category and the two octets of its length, the first of which is mostly zero:
no recording consists of printable characters only.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_schemas.documents.contents import packed_form

#: Octets at the start that are examined as text, and as UTF-8.
_HEAD = 4096
#: A text has at least so many octets.
_TEXT_MIN = 64
#: So many line feeds that all follow a carriage return are no accident (1 of 256 would), and so
#: many characters of two octets.
_LINES_MIN, _CHARACTERS_MIN = 16, 32
_LINE_FEED, _RETURN = 10, 13
_HEX = b"0123456789abcdefABCDEF \t\r\n,;:x"


def damage_of(data: NDArray[np.uint8]) -> str:
    """Return how a recording was damaged, as it follows "found"; empty if it was not.

    Parameters
    ----------
    data : uint8[b]
        Octets from the start of a file.
    """
    head = data[:_HEAD].tobytes()
    if len(head) >= _TEXT_MIN and all(32 <= one < 127 or one in b"\t\r\n" for one in head):
        if all(one in _HEX for one in head):
            return "hexadecimal text; convert it to binary (`xxd -r -p`)"
        return "text"
    other = _other_form(head)
    if other:
        return other
    feeds = np.flatnonzero(data == _LINE_FEED)
    if len(feeds) >= _LINES_MIN and feeds[0] > 0 and (data[feeds - 1] == _RETURN).all():
        return (
            "a file corrupted by a transfer in text mode (each line feed follows a carriage "
            "return); transfer the file again in binary mode"
        )
    if _is_utf_8(head):
        return (
            "a file corrupted by a program that treated it as text (it is valid UTF-8); copy the "
            "original again"
        )
    return ""


def _other_form(head: bytes) -> str:
    if head[:4] == b"PAR1":
        return "a Parquet table, which is already converted"
    # As blocks, packed files would begin with one of a length of at least 14 000 octets.
    packed = packed_form(head)
    return f"{packed}; decompress it first" if packed is not None else ""


def _is_utf_8(head: bytes) -> bool:
    for end in range(len(head), max(len(head) - 4, 0), -1):
        try:
            text = head[:end].decode("utf-8")
        except UnicodeDecodeError:
            continue
        return sum(ord(one) > 127 for one in text) >= _CHARACTERS_MIN
    return False
