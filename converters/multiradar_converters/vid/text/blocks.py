"""Reads a file of any size in blocks of whole lines."""

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

#: Bytes read at a time.
BLOCK_BYTES = 2 << 20

#: Maximum lines of a block; more lines, which cannot be records, are split into smaller blocks.
BLOCK_LINES_MAX = 1 << 16

_SMALL_BLOCK_BYTES = 1 << 16

#: Bytes retained of a line longer than a block.
LONG_LINE_KEPT_BYTES = 4096


@dataclass(frozen=True)
class Block:
    """Whole lines of a file, or one special line.

    Attributes
    ----------
    text : bytes-like
        The lines with their line ends; for a special line the retained bytes, without.
    size : int
        Bytes of the file that it represents.
    unterminated : bool
        Whether it is the last line of the file without a line end.
    overlong : bool
        Whether it is a line longer than a block.
    before : bytes
        For an unterminated line, the previous line.
    """

    text: bytearray | bytes
    size: int
    unterminated: bool = False
    overlong: bool = False
    before: bytes = b""


def read_blocks(
    path: Path, start: int, terminator: int, block_bytes: int = BLOCK_BYTES
) -> Iterator[Block]:
    """Read a file in blocks of whole lines.

    Parameters
    ----------
    path : Path
        The file.
    start : int
        Byte offset of the start.
    terminator : int
        Line end, a byte.
    block_bytes : int
        Bytes to read at a time.

    Yields
    ------
    Block
        Blocks in file order; their sizes add up to the bytes read.
    """
    mark = bytes((terminator,))
    with path.open("rb", buffering=0) as file:
        file.seek(start)
        rest = before = b""
        while True:
            buffer = bytearray(len(rest) + block_bytes)
            buffer[: len(rest)] = rest
            with memoryview(buffer) as view:
                count = file.readinto(view[len(rest) :])
            del buffer[len(rest) + (count or 0) :]
            if not count:
                break
            end = buffer.rfind(mark) + 1
            if end:
                rest = bytes(memoryview(buffer)[end:])
                del buffer[end:]
                before = bytes(buffer[buffer.rfind(mark, 0, end - 1) + 1 : end - 1])
                yield from _blocks(buffer, mark)
            elif len(buffer) <= block_bytes:
                rest = bytes(buffer)
            else:
                long_line, rest = _long_line(file, bytes(buffer), mark, block_bytes)
                yield long_line
        # There may be whole lines after a long line.
        end = rest.rfind(mark) + 1
        if end:
            before = rest[rest.rfind(mark, 0, end - 1) + 1 : end - 1]
            yield from _blocks(rest[:end], mark)
        if rest[end:]:
            yield Block(rest[end:], len(rest) - end, unterminated=True, before=before)


def _blocks(text: bytearray | bytes, mark: bytes) -> Iterator[Block]:
    """Yield whole lines as one block, or as many small ones if there are very many lines."""
    if text.count(mark) <= BLOCK_LINES_MAX:
        yield Block(text, len(text))
        return
    begin = 0
    while begin < len(text):
        end = text.rfind(mark, begin, begin + _SMALL_BLOCK_BYTES) + 1
        if end <= begin:
            end = text.find(mark, begin) + 1
        yield Block(bytes(text[begin:end]), end - begin)
        begin = end


def _long_line(file: io.FileIO, start: bytes, mark: bytes, block_bytes: int) -> tuple[Block, bytes]:
    """Read to the end of a line without keeping it; return its block and the bytes after it."""
    size = len(start)
    kept = start[:LONG_LINE_KEPT_BYTES]
    while True:
        more = file.read(block_bytes)
        if not more:
            return Block(kept, size, unterminated=True, overlong=True), b""
        end = more.find(mark) + 1
        if end:
            return Block(kept, size + end, overlong=True), more[end:]
        size += len(more)
