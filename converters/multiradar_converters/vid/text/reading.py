"""Reading one file of a dump: lines in, columns of accepted rows out, every line accounted for."""

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.vid import fields
from multiradar_converters.vid.accounting import Account, RejectedLine, RejectsFile
from multiradar_converters.vid.text import _kernels
from multiradar_converters.vid.text.blocks import BLOCK_BYTES, Block, read_blocks
from multiradar_converters.vid.text.layout import FileLayout
from multiradar_converters.vid.text.lines import Line, RefusedError, looks_cut, parse_line
from multiradar_schemas.reject import RejectCode

#: Called with the number of bytes that have been read since the last call.
Progress = Callable[[int], None]

#: Blocks that may be in work at once: the memory of reading is a few times this.
_IN_WORK_MAX = 4

#: No record is shorter, so a block of n bytes holds at most n / this rows at once.
_ROW_BYTES_MIN = 16

#: Places of a line of pairs at which a guess is kept of what stands there.
_HINTS = 32


@dataclass
class Rows:
    """Accepted rows of a block.

    Attributes
    ----------
    numbers : float64[6, n]
        By role, SI and degrees; NaN where absent. Roles the table lacks are undefined.
    integers : int64[6, n]
        By role less `FIRST_INTEGER`; -1 where absent.
    """

    numbers: NDArray[np.float64]
    integers: NDArray[np.int64]

    def number(self, role: int) -> NDArray[np.float64]:
        """Return the column of a role."""
        column: NDArray[np.float64] = self.numbers[role]
        return column

    def integer(self, role: int) -> NDArray[np.int64]:
        """Return the column of a role."""
        column: NDArray[np.int64] = self.integers[role - fields.FIRST_INTEGER]
        return column

    def __len__(self) -> int:
        return len(self.numbers[0])


@dataclass
class _Parsed:
    size: int
    lines: int = 0
    blank: int = 0
    header: int = 0
    rows: list[Rows] = field(default_factory=list)
    # Numbers of the lines count within the block, from 0.
    rejected: list[RejectedLine] = field(default_factory=list)


class _Tables:
    """The layout as arrays for the kernels."""

    def __init__(self, layout: FileLayout) -> None:
        self.roles = np.array(layout.columns, dtype=np.int64)
        self.low = np.array(layout.low)
        self.high = np.array(layout.high)
        self.scale = np.array(layout.scale)
        width = max((len(key) for key in layout.keys), default=1)
        padded = b"".join(key.ljust(width, b"\0") for key in layout.keys)
        self.keys = np.frombuffer(padded, dtype=np.uint8).reshape(-1, width)
        self.lengths = np.array([len(key) for key in layout.keys], dtype=np.int64)
        self.key_roles = np.array(layout.key_roles, dtype=np.int64)
        needed = set(layout.key_roles) - fields.OPTIONAL_ROLES
        self.required = sum(1 << role for role in needed)


def read_rows(
    path: Path,
    layout: FileLayout,
    *,
    pool: Executor,
    account: Account,
    rejects: RejectsFile,
    progress: Progress,
    block_bytes: int = BLOCK_BYTES,
) -> Iterator[Rows]:
    """Read the accepted rows of a file, in its order.

    Parameters
    ----------
    path : Path
        The file.
    layout : FileLayout
        How it is laid out.
    pool : Executor
        Threads that parse blocks.
    account : Account
        Filled.
    rejects : RejectsFile
        Takes the broken lines, in the order of the file.
    progress : Progress
        Told of bytes read.
    block_bytes : int
        How much to read at once.

    Yields
    ------
    Rows
        Never empty.

    Raises
    ------
    AccountingError
        At the end, when a line or byte is unaccounted for.
    """
    account.bytes_read += layout.data_offset
    if layout.header is not None:
        # Blank lines before the header are blank lines of the file.
        with path.open("rb") as file:
            before = file.read(layout.data_offset)
        account.lines += max(1, before.count(bytes((layout.terminator,))))
        account.header += 1
        account.blank += account.lines - 1
    tables = _Tables(layout)
    in_work: deque[Future[_Parsed]] = deque()
    for block in read_blocks(path, layout.data_offset, layout.terminator, block_bytes):
        in_work.append(pool.submit(_parse_block, block, layout, tables))
        if len(in_work) == _IN_WORK_MAX:
            yield from _taken(in_work.popleft().result(), layout, account, rejects, progress)
    while in_work:
        yield from _taken(in_work.popleft().result(), layout, account, rejects, progress)
    account.check()


def _taken(
    parsed: _Parsed,
    layout: FileLayout,
    account: Account,
    rejects: RejectsFile,
    progress: Progress,
) -> list[Rows]:
    """Enter a block into the account; return its rows."""
    for rejected in parsed.rejected:
        line = RejectedLine(
            account.lines + 1 + rejected.line, rejected.code, rejected.reason, rejected.raw
        )
        rejects.write(account.file, layout.encoding, line)
        account.rejected[rejected.code] += 1
    account.bytes_read += parsed.size
    account.lines += parsed.lines
    account.blank += parsed.blank
    account.header += parsed.header
    account.accepted += sum(len(rows) for rows in parsed.rows)
    progress(parsed.size)
    return [rows for rows in parsed.rows if len(rows)]


def _parse_block(block: Block, layout: FileLayout, tables: _Tables) -> _Parsed:
    parsed = _Parsed(block.size)
    if block.overlong or block.unterminated:
        _parse_special(block, layout, parsed)
        return parsed
    text = np.frombuffer(block.text, dtype=np.uint8)
    hints = np.arange(_HINTS, dtype=np.int64) % max(1, len(layout.keys))
    place = 0
    while place < len(text):
        room = (len(text) - place) // _ROW_BYTES_MIN + 1
        numbers = np.empty((fields.NUMBERS, room))
        integers = np.empty((fields.INTEGERS, room), dtype=np.int64)
        odd = np.empty((room, 4), dtype=np.int64)
        common = (layout.iso_time, tables.low, tables.high, tables.scale, numbers, integers, odd)
        if layout.form == "columns":
            place, count, odds, lines, blank = _kernels.parse_columns(
                text, place, len(text), layout.terminator, layout.separator, tables.roles, *common
            )
        else:
            place, count, odds, lines, blank = _kernels.parse_pairs(
                text, place, len(text), layout.terminator, tables.keys, tables.lengths,
                tables.key_roles, hints, tables.required, *common,
            )  # fmt: skip
        rows = Rows(numbers[:, :count], integers[:, :count])
        parsed.rows.append(_settle(rows, odd[:odds], block.text, layout, parsed))
        parsed.lines += lines
        parsed.blank += blank
    return parsed


def _settle(
    rows: Rows, odd: NDArray[np.int64], text: bytes | bytearray, layout: FileLayout, parsed: _Parsed
) -> Rows:
    """Let the plain form decide about the odd lines; return the rows that stand."""
    if not len(odd):
        return rows
    keep = np.ones(len(rows), dtype=np.bool_)
    for place, line, begin, end in odd.tolist():
        keep[place] = _decide(
            bytes(text[begin:end]), parsed.lines + line,
            place=place, rows=rows, layout=layout, parsed=parsed,
        )  # fmt: skip
    return Rows(rows.numbers[:, keep], rows.integers[:, keep])


def _decide(
    raw: bytes, line: int, *, place: int, rows: Rows, layout: FileLayout, parsed: _Parsed
) -> bool:
    """Let the plain form take or refuse a line; return whether its row stands."""
    raw = raw.removesuffix(b"\r")
    try:
        found = parse_line(raw, layout)
    except RefusedError as refused:
        parsed.rejected.append(RejectedLine(line, refused.code, refused.reason, raw))
        return False
    if isinstance(found, Line):
        parsed.blank += found is Line.BLANK
        parsed.header += found is Line.HEADER
        return False
    rows.numbers[:, place] = found.numbers
    rows.integers[:, place] = found.integers
    return True


def _parse_special(block: Block, layout: FileLayout, parsed: _Parsed) -> None:
    """Take a line that is longer than a block, or the last one without an end mark."""
    parsed.lines = 1
    raw = bytes(block.text)
    if block.overlong:
        reason = (
            f"expected a line of at most {BLOCK_BYTES} bytes, was {block.size}; its begin is kept"
        )
        parsed.rejected.append(RejectedLine(0, RejectCode.TOO_LARGE, reason, raw))
        return
    rows = Rows(np.empty((fields.NUMBERS, 1)), np.empty((fields.INTEGERS, 1), dtype=np.int64))
    if looks_cut(raw, block.before):
        reason = "the file ends within this line"
        parsed.rejected.append(RejectedLine(0, RejectCode.TRUNCATED, reason, raw))
    elif _decide(raw, 0, place=0, rows=rows, layout=layout, parsed=parsed):
        parsed.rows.append(rows)
