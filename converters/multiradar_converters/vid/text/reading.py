"""Reading one file of a dump: lines in, columns of accepted rows out, every line accounted for."""

import codecs
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.vid import fields
from multiradar_converters.vid.accounting import Account, RejectedLine, RejectsFile
from multiradar_converters.vid.text import _kernels
from multiradar_converters.vid.text.blocks import BLOCK_BYTES, Block, read_blocks
from multiradar_converters.vid.text.layout import FileLayout
from multiradar_converters.vid.text.lines import Line, RefusedError, looks_cut, parse_line
from multiradar_converters.vid.text.sieve import Parsed, Rows, Sieve
from multiradar_converters.vid.times import Clockwork
from multiradar_schemas.measurements.reject import RejectCode

#: Called with the number of bytes that have been read since the last call.
Progress = Callable[[int], None]

#: Blocks that may be in work at once: the memory of reading is a few times this.
_IN_WORK_MAX = 4

#: No record is shorter, so a block of n bytes holds at most n / this rows at once.
_ROW_BYTES_MIN = 16

#: Places of a line of pairs at which a guess is kept of what stands there.
_HINTS = 32


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
    clock: Clockwork | None = None,
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
    clock : Clockwork or None
        Moves times to those of the recording and refuses outliers; None leaves them alone.
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
        _enter_head(path, layout, account, rejects)
    tables = _Tables(layout)
    in_work: deque[Future[Parsed]] = deque()
    sieve = Sieve(layout, clock, account, rejects)
    for block in read_blocks(path, layout.data_offset, layout.terminator, block_bytes):
        in_work.append(pool.submit(_parse_block, block, layout, tables))
        if len(in_work) == _IN_WORK_MAX:
            yield from _taken(in_work.popleft().result(), sieve, account, progress)
    while in_work:
        yield from _taken(in_work.popleft().result(), sieve, account, progress)
    sieve.finish()
    account.check()


def _enter_head(path: Path, layout: FileLayout, account: Account, rejects: RejectsFile) -> None:
    """Enter the header and what stands before it into the account."""
    with path.open("rb") as file:
        head = file.read(layout.data_offset)
    mark = bytes((layout.terminator,))
    for raw in head.removesuffix(mark).removeprefix(codecs.BOM_UTF8).split(mark):
        line = raw.rstrip(b"\r")
        account.lines += 1
        if line == layout.header:
            account.header += 1
        elif not line.strip(b" \t"):
            account.blank += 1
        else:
            reason = "expected a header line with the names of the columns"
            rejected = RejectedLine(account.lines, RejectCode.MALFORMED_LINE, reason, line)
            rejects.write(account.file, layout.encoding, rejected)
            account.reject(rejected)


def _taken(parsed: Parsed, sieve: Sieve, account: Account, progress: Progress) -> list[Rows]:
    """Enter a block into the account; return its rows."""
    rows = sieve.take(parsed)
    account.bytes_read += parsed.size
    account.lines += parsed.lines
    account.blank += parsed.blank
    account.header += parsed.header
    account.accepted += sum(len(each) for each in rows)
    progress(parsed.size)
    return rows


def _parse_block(block: Block, layout: FileLayout, tables: _Tables) -> Parsed:
    parsed = Parsed(block.size, block.text)
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
        begins = np.empty(room, dtype=np.int64)
        odd = np.empty((room, 4), dtype=np.int64)
        common = (
            layout.iso_time, tables.low, tables.high, tables.scale, numbers, integers, begins, odd,
        )  # fmt: skip
        if layout.form == "columns":
            place, count, odds, lines, blank = _kernels.parse_columns(
                text, place, len(text), layout.terminator, layout.separator, tables.roles, *common
            )
        else:
            place, count, odds, lines, blank = _kernels.parse_pairs(
                text, place, len(text), layout.terminator, tables.keys, tables.lengths,
                tables.key_roles, hints, tables.required, *common,
            )  # fmt: skip
        rows = Rows(numbers, integers, begins).chosen(slice(count))
        parsed.rows.append(_settle(rows, odd[:odds], block.text, layout, parsed))
        parsed.lines += lines
        parsed.blank += blank
    return parsed


def _settle(
    rows: Rows, odd: NDArray[np.int64], text: bytes | bytearray, layout: FileLayout, parsed: Parsed
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
    return rows.chosen(keep)


def _decide(
    raw: bytes, line: int, *, place: int, rows: Rows, layout: FileLayout, parsed: Parsed
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


def _parse_special(block: Block, layout: FileLayout, parsed: Parsed) -> None:
    """Take a line that is longer than a block, or the last one without an end mark."""
    parsed.lines = 1
    raw = bytes(block.text)
    if block.overlong:
        reason = (
            f"expected a line of at most {BLOCK_BYTES} bytes, was {block.size}; its begin is kept"
        )
        parsed.rejected.append(RejectedLine(0, RejectCode.TOO_LARGE, reason, raw))
        return
    rows = Rows(
        np.empty((fields.NUMBERS, 1)),
        np.empty((fields.INTEGERS, 1), dtype=np.int64),
        np.zeros(1, dtype=np.int64),
    )
    if looks_cut(raw, block.before):
        reason = "the file ends within this line"
        parsed.rejected.append(RejectedLine(0, RejectCode.TRUNCATED, reason, raw))
    elif _decide(raw, 0, place=0, rows=rows, layout=layout, parsed=parsed):
        parsed.rows.append(rows)
