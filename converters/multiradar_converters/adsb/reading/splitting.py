"""Splitting of text blocks into records with their places, and into faults.

A record longer than `RECORD_BYTES_MAX`, because of a missing quote or brace, is rejected with its
first `KEPT_BYTES_MAX` bytes. After these, parsing continues behind the next `}` that is followed by
`{`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.adsb.reading import _splitting_kernels
from multiradar_converters.adsb.reading._splitting_kernels import (
    BEGIN,
    DEPTH,
    DONE,
    ESCAPED,
    IN_TEXT,
    LONG,
    LOST,
    STATE_WORDS,
)
from multiradar_schemas.reject import RejectCode

#: Maximum length of a record, and bytes retained of a longer one.
RECORD_BYTES_MAX = 1 << 16
KEPT_BYTES_MAX = 4096

#: Records per piece; bounds the memory.
PIECE_RECORDS = 1 << 15


@dataclass(frozen=True)
class Fault:
    """Text that is not a record."""

    place: int
    raw: bytes
    code: RejectCode
    reason: str


@dataclass(frozen=True)
class Piece:
    """A number of records.

    Attributes
    ----------
    text : uint8[n]
        Text with a line feed at the end.
    begins, ends : int64[r]
        Begin and end of each record in the text.
    places : int64[r]
        Place of each in the file: byte of a JSON text from 0, line of a CSV file from 1.
    faults : list of Fault
        Text that is not a record.
    """

    text: NDArray[np.uint8]
    begins: NDArray[np.int64]
    ends: NDArray[np.int64]
    places: NDArray[np.int64]
    faults: list[Fault]

    def raw(self, record: int) -> bytes:
        """Return the text of a record."""
        return self.text[self.begins[record] : self.ends[record]].tobytes()


class Elements:
    """Splits a JSON list, or JSON lines, into elements.

    Parameters
    ----------
    place : int
        Byte offset of the first text in the file, after the bracket of the list.
    opening : bytes
        Opening bracket of elements.
    """

    def __init__(self, place: int, opening: bytes = b"{") -> None:
        self._place = place
        self._opening = opening[0]
        self._carry = b""
        self._state = np.zeros(STATE_WORDS, dtype=np.int64)
        self._state[BEGIN] = -1
        self.rest = b""
        self.rest_place = 0

    @property
    def ended(self) -> bool:
        """Whether the list has been closed; text after it belongs to no element."""
        return bool(self._state[DONE])

    def push(self, block: bytes) -> list[Piece]:
        """Process a block of text; return the elements that end in it."""
        if self.ended:
            self._rest(block)
            return []
        text = np.frombuffer(self._carry + block + b"\n", dtype=np.uint8)
        size = len(text) - 1
        seen = len(self._carry)
        pieces: list[Piece] = []
        while seen < size and not self.ended:
            begins, ends = _scratch()
            seen, count = _splitting_kernels.split_elements(
                text, seen, size, self._opening, RECORD_BYTES_MAX, self._state, begins, ends
            )
            begins, ends = begins[:count], ends[:count]
            faults: list[Fault] = []
            if self._state[LONG]:
                seen = self._give_up(text, faults)
            pieces.append(Piece(text, begins, ends, begins + self._place, faults))
        self._keep(text[:size], seen)
        return pieces

    def finish(self, why: str) -> Fault | None:
        """Return the incomplete element at the end of the text, with a reason."""
        if not self._carry:
            return None
        return Fault(self._place, self._carry[:KEPT_BYTES_MAX], RejectCode.TRUNCATED, why)

    def _rest(self, text: bytes) -> None:
        """Retain the first text after the list."""
        if not self.rest:
            blanks = len(text) - len(text.lstrip())
            self.rest_place = self._place + blanks
        self.rest = (self.rest + text).strip()[:KEPT_BYTES_MAX]
        self._place += len(text)

    def _give_up(self, text: NDArray[np.uint8], faults: list[Fault]) -> int:
        """Report an overlong element; return where parsing continues."""
        begin = int(self._state[BEGIN])
        raw = text[begin : begin + KEPT_BYTES_MAX].tobytes()
        faults.append(_overlong(self._place + begin, raw))
        self._state[[DEPTH, IN_TEXT, ESCAPED, BEGIN, LOST]] = (0, 0, 0, -1, 1)
        return begin + KEPT_BYTES_MAX

    def _keep(self, text: NDArray[np.uint8], seen: int) -> None:
        begin = int(self._state[BEGIN])
        self._carry = b""
        if self.ended:
            self._place += seen
            self._rest(text[seen:].tobytes())
        elif begin < 0:
            self._place += len(text)
        else:
            self._carry = text[begin:].tobytes()
            self._place += begin
            self._state[BEGIN] = 0


class Lines:
    """Splits text into lines; blank lines are counted.

    Parameters
    ----------
    bytes_max : int
        Maximum length of a line; of a longer one only the beginning is retained.
    """

    def __init__(self, bytes_max: int = RECORD_BYTES_MAX) -> None:
        self._bytes_max = bytes_max
        self._carry = b""
        self._overlong = b""
        self.lines = 0
        self.blank = 0

    @property
    def carry(self) -> bytes:
        """The beginning of an incomplete line."""
        return (self._overlong or self._carry)[:KEPT_BYTES_MAX]

    def push(self, block: bytes, *, at_end: bool = False) -> list[Piece]:
        """Process a block of text; return the lines that end in it. `at_end` ends the last line."""
        if self._overlong:
            _, mark, block = block.partition(b"\n")
            if not mark and not at_end:
                return []
            block = self._overlong + mark + block
            self._overlong = b""
        data = self._carry + block
        if at_end and data and not data.endswith(b"\n"):
            data += b"\n"
        self._carry = b""
        text = np.frombuffer(data + b"\n", dtype=np.uint8)
        size = len(data)
        seen = 0
        pieces: list[Piece] = []
        while seen < size:
            begins, ends = _scratch()
            after, count = _splitting_kernels.split_lines(text, seen, size, begins, ends)
            if not count:
                break
            pieces.append(self._piece(text, begins[:count], ends[:count]))
            seen = after
        rest = data[seen:]
        if len(rest) > self._bytes_max:
            # The rest of the line is dropped.
            self._overlong = rest[: self._bytes_max + 1]
        else:
            self._carry = rest
        return pieces

    def _piece(
        self, text: NDArray[np.uint8], begins: NDArray[np.int64], ends: NDArray[np.int64]
    ) -> Piece:
        places = self.lines + 1 + np.arange(len(begins))
        self.lines += len(begins)
        filled = ends > begins
        self.blank += int((~filled).sum())
        long = ends - begins > self._bytes_max
        faults = [
            _overlong(
                int(places[k]),
                text[begins[k] : begins[k] + KEPT_BYTES_MAX].tobytes(),
                self._bytes_max,
            )
            for k in np.flatnonzero(long).tolist()
        ]
        own = filled & ~long
        return Piece(text, begins[own], ends[own], places[own], faults)


def _overlong(place: int, raw: bytes, bytes_max: int = RECORD_BYTES_MAX) -> Fault:
    reason = f"expected a record of at most {bytes_max} bytes, found a longer one"
    return Fault(place, raw[:KEPT_BYTES_MAX], RejectCode.TOO_LARGE, reason)


def _scratch() -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    return np.empty(PIECE_RECORDS, dtype=np.int64), np.empty(PIECE_RECORDS, dtype=np.int64)
