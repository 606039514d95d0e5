"""Text in blocks cut into records, each with its place; what is no record is told, too.

A record that is longer than `RECORD_BYTES_MAX`, because a quote or a brace is missing, is given up
with its first `KEPT_BYTES_MAX` bytes; behind these, reading goes on after the next `}` that `{`
follows.
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
from multiradar_schemas.measurements.reject import RejectCode

#: No record is longer, bytes; of what is longer so many are kept.
RECORD_BYTES_MAX = 1 << 16
KEPT_BYTES_MAX = 4096

#: Records of a piece: bounds the memory.
PIECE_RECORDS = 1 << 15


@dataclass(frozen=True)
class Fault:
    """Text that is no record."""

    place: int
    raw: bytes
    code: RejectCode
    reason: str


@dataclass(frozen=True)
class Piece:
    """Some records.

    Attributes
    ----------
    text : uint8[n]
        Text that holds them, a line feed at its end.
    begins, ends : int64[r]
        Where each begins and ends in it.
    places : int64[r]
        Place of each in its file: byte of a JSON text from 0, line of a CSV file from 1.
    faults : list of Fault
        What is no record.
    """

    text: NDArray[np.uint8]
    begins: NDArray[np.int64]
    ends: NDArray[np.int64]
    places: NDArray[np.int64]
    faults: list[Fault]

    def raw(self, record: int) -> bytes:
        """Return a record as it stands."""
        return self.text[self.begins[record] : self.ends[record]].tobytes()


class Elements:
    """Cuts a JSON list, or JSON lines, into its elements.

    Parameters
    ----------
    place : int
        Byte of the file at which the text given first begins, after the bracket of the list.
    opening : bytes
        The bracket with which the elements begin.
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
        """Whether the list has been closed; what follows is none of its elements."""
        return bool(self._state[DONE])

    def take(self, block: bytes) -> list[Piece]:
        """Return the elements that end in a block of text."""
        if self.ended:
            self._rest(block)
            return []
        text = np.frombuffer(self._carry + block + b"\n", dtype=np.uint8)
        size = len(text) - 1
        seen = len(self._carry)
        pieces: list[Piece] = []
        while seen < size and not self.ended:
            begins, ends = _room()
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
        """Return what is left of an element at the end of the text, and why it is cut."""
        if not self._carry:
            return None
        return Fault(self._place, self._carry[:KEPT_BYTES_MAX], RejectCode.TRUNCATED, why)

    def _rest(self, text: bytes) -> None:
        """Keep the first of what follows the list."""
        if not self.rest:
            blanks = len(text) - len(text.lstrip())
            self.rest_place = self._place + blanks
        self.rest = (self.rest + text).strip()[:KEPT_BYTES_MAX]
        self._place += len(text)

    def _give_up(self, text: NDArray[np.uint8], faults: list[Fault]) -> int:
        """Tell of an element that is too long; return where reading goes on."""
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
    """Cuts text into lines; blank ones are counted."""

    def __init__(self) -> None:
        self._carry = b""
        self._overlong = b""
        self.lines = 0
        self.blank = 0

    @property
    def carry(self) -> bytes:
        """The beginning of a line that has not ended."""
        return (self._overlong or self._carry)[:KEPT_BYTES_MAX]

    def take(self, block: bytes, *, at_end: bool = False) -> list[Piece]:
        """Return the lines that end in a block of text; `at_end` ends the last one."""
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
            begins, ends = _room()
            after, count = _splitting_kernels.split_lines(text, seen, size, begins, ends)
            if not count:
                break
            pieces.append(self._piece(text, begins[:count], ends[:count]))
            seen = after
        rest = data[seen:]
        if len(rest) > RECORD_BYTES_MAX:
            # What follows up to the end of the line is dropped.
            self._overlong = rest[: RECORD_BYTES_MAX + 1]
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
        long = ends - begins > RECORD_BYTES_MAX
        faults = [
            _overlong(int(places[k]), text[begins[k] : begins[k] + KEPT_BYTES_MAX].tobytes())
            for k in np.flatnonzero(long).tolist()
        ]
        own = filled & ~long
        return Piece(text, begins[own], ends[own], places[own], faults)


def _overlong(place: int, raw: bytes) -> Fault:
    reason = f"expected a record of at most {RECORD_BYTES_MAX} bytes, was a longer one"
    return Fault(place, raw[:KEPT_BYTES_MAX], RejectCode.TOO_LARGE, reason)


def _room() -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    return np.empty(PIECE_RECORDS, dtype=np.int64), np.empty(PIECE_RECORDS, dtype=np.int64)
