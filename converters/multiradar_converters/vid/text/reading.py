"""Reads a dump file: lines in, columns of accepted rows out, with accounting of every line."""

import codecs
import re
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.vid import fields
from multiradar_converters.vid.accounting import Account, RejectedLine, RejectsFile
from multiradar_converters.vid.text import _kernels
from multiradar_converters.vid.text.arrays import Keys, Limits, ParsedLines
from multiradar_converters.vid.text.blocks import BLOCK_BYTES, Block, read_blocks
from multiradar_converters.vid.text.layout import FileLayout
from multiradar_converters.vid.text.lines import (
    Line,
    RejectedError,
    is_truncated,
    lacks_fields,
    parse_line,
)
from multiradar_converters.vid.text.time_filter import Parsed, Rows, TimeFilter
from multiradar_converters.vid.text.times import TimeUnwrapper
from multiradar_schemas.reject import RejectCode

#: Called with the number of bytes read since the last call.
Progress = Callable[[int], None]

#: Maximum blocks being parsed at a time; the memory is a few times this.
_IN_WORK_MAX = 4

#: Minimum length of a record, so a block of n bytes has at most n / this rows.
_ROW_BYTES_MIN = 16

_LAST_VALUE = re.compile(rb"[^\s,;|=]*\s*$")

#: Number of pairs of a line whose keys are guessed from the previous line.
_HINTS = 32


class _Tables:
    """The layout as arrays for the kernels."""

    def __init__(self, layout: FileLayout) -> None:
        self.roles = np.array(layout.columns, dtype=np.int64)
        low, high, scale = (np.array(one) for one in (layout.low, layout.high, layout.scale))
        self.limits = Limits(low, high, scale)
        width = max((len(key) for key in layout.keys), default=1)
        padded = b"".join(key.ljust(width, b"\0") for key in layout.keys)
        needed = set(layout.key_roles) - fields.OPTIONAL_ROLES
        self.keys = Keys(
            np.frombuffer(padded, dtype=np.uint8).reshape(-1, width),
            np.array([len(key) for key in layout.keys], dtype=np.int64),
            np.array(layout.key_roles, dtype=np.int64),
            sum(1 << role for role in needed),
        )


def read_rows(
    path: Path,
    layout: FileLayout,
    *,
    pool: Executor,
    account: Account,
    rejects: RejectsFile,
    progress: Progress,
    clock: TimeUnwrapper | None = None,
    block_bytes: int = BLOCK_BYTES,
) -> Iterator[Rows]:
    """Read the accepted rows of a file, in file order.

    Parameters
    ----------
    path : Path
        The file.
    layout : FileLayout
        Its layout.
    pool : Executor
        Threads that parse blocks.
    account : Account
        Updated.
    rejects : RejectsFile
        Receives the rejected lines, in file order.
    progress : Progress
        Called with bytes read.
    clock : TimeUnwrapper or None
        Unwraps times and rejects outliers; None leaves times unchanged.
    block_bytes : int
        Bytes to read at a time.

    Yields
    ------
    Rows
        Non-empty.

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
    time_filter = TimeFilter(layout, clock, account, rejects)
    for block in read_blocks(path, layout.data_offset, layout.terminator, block_bytes):
        in_work.append(pool.submit(_parse_block, block, layout, tables))
        if len(in_work) == _IN_WORK_MAX:
            yield from _accepted(in_work.popleft().result(), time_filter, account, progress)
    while in_work:
        yield from _accepted(in_work.popleft().result(), time_filter, account, progress)
    time_filter.finish()
    account.check()


def _enter_head(path: Path, layout: FileLayout, account: Account, rejects: RejectsFile) -> None:
    """Account for the header and the lines before it."""
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
            reason = "expected a header line with the column names"
            rejected = RejectedLine(account.lines, RejectCode.MALFORMED_LINE, reason, line)
            rejects.write(account.file, layout.encoding, rejected)
            account.reject(rejected)


def _accepted(
    parsed: Parsed, time_filter: TimeFilter, account: Account, progress: Progress
) -> list[Rows]:
    """Account for a block; return its rows."""
    rows = time_filter.push(parsed)
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
        written = ParsedLines(
            np.empty((fields.NUMBERS, room)),
            np.empty((fields.INTEGERS, room), dtype=np.int64),
            np.empty(room, dtype=np.int64),
            np.empty((room, 4), dtype=np.int64),
        )
        if layout.form == "columns":
            place, count, odds, lines, blank = _kernels.parse_columns(
                text, place, len(text), layout.terminator, layout.separator, tables.roles,
                layout.iso_time, tables.limits, written,
            )  # fmt: skip
        else:
            place, count, odds, lines, blank = _kernels.parse_pairs(
                text, place, len(text), layout.terminator, tables.keys, hints, layout.iso_time,
                tables.limits, written,
            )  # fmt: skip
        rows = Rows(written.numbers, written.integers, written.begins).chosen(slice(count))
        parsed.rows.append(_settle(rows, written.odd[:odds], block.text, layout, parsed))
        parsed.lines += lines
        parsed.blank += blank
    return parsed


def _settle(
    rows: Rows, odd: NDArray[np.int64], text: bytes | bytearray, layout: FileLayout, parsed: Parsed
) -> Rows:
    """Parse odd lines with the reference form; return the accepted rows."""
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
    """Parse a line with the reference form; return whether it is accepted."""
    raw = raw.removesuffix(b"\r")
    try:
        found = parse_line(raw, layout)
    except RejectedError as error:
        parsed.rejected.append(RejectedLine(line, error.code, error.reason, raw))
        return False
    if isinstance(found, Line):
        parsed.blank += found is Line.BLANK
        parsed.header += found is Line.HEADER
        return False
    rows.numbers[:, place] = found.numbers
    rows.integers[:, place] = found.integers
    return True


def _parse_special(block: Block, layout: FileLayout, parsed: Parsed) -> None:
    """Process a line longer than a block, or the last line without a line end."""
    parsed.lines = 1
    raw = bytes(block.text)
    if block.overlong:
        reason = (
            f"expected a line of at most {BLOCK_BYTES} bytes, found {block.size}; the beginning is "
            f"retained"
        )
        parsed.rejected.append(RejectedLine(0, RejectCode.TOO_LARGE, reason, raw))
        return
    rows = Rows(
        np.empty((fields.NUMBERS, 1)),
        np.empty((fields.INTEGERS, 1), dtype=np.int64),
        np.zeros(1, dtype=np.int64),
    )
    truncated = is_truncated(raw, block.before) or lacks_fields(raw, layout)
    if not truncated and _decide(raw, 0, place=0, rows=rows, layout=layout, parsed=parsed):
        parsed.rows.append(rows)
    elif truncated or _ends_shorter(parsed.rejected, block.before):
        reason = "the file ends in the middle of this line"
        parsed.rejected[:] = [RejectedLine(0, RejectCode.TRUNCATED, reason, raw)]


# A code or an address of too few digits is no number.
def _ends_shorter(rejected: list[RejectedLine], before: bytes) -> bool:
    if not rejected or rejected[0].code != RejectCode.NOT_A_NUMBER:
        return False
    last, last_before = (_LAST_VALUE.findall(one)[0] for one in (rejected[0].raw, before))
    return len(last) < len(last_before)
