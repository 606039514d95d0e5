"""A file in blocks of whole lines, whatever its size and whatever the length of its lines."""

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

#: Text read at once.
BLOCK_BYTES = 2 << 20

#: Lines of a block; more of them, which must be rubbish, come in smaller blocks.
BLOCK_LINES_MAX = 1 << 16

_SMALL_BLOCK_BYTES = 1 << 16

#: What is kept of a line longer than a block.
LONG_LINE_KEPT_BYTES = 4096


@dataclass(frozen=True)
class Block:
    """Whole lines of a file, or one line that is special.

    Attributes
    ----------
    text : bytes-like
        The lines with their end marks; for a special line what is kept of it, without.
    size : int
        Bytes of the file it stands for.
    unterminated : bool
        Whether it is the last line of the file, its end mark missing.
    overlong : bool
        Whether it is one line longer than a block.
    before : bytes
        For an unterminated line, the line before it.
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
        Where to begin, bytes.
    terminator : int
        The byte that ends a line.
    block_bytes : int
        How much to read at once.

    Yields
    ------
    Block
        Blocks in the order of the file; their sizes add up to what was there to read.
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
        # After a long line there may be whole lines among what is left.
        end = rest.rfind(mark) + 1
        if end:
            before = rest[rest.rfind(mark, 0, end - 1) + 1 : end - 1]
            yield from _blocks(rest[:end], mark)
        if rest[end:]:
            yield Block(rest[end:], len(rest) - end, unterminated=True, before=before)


def _blocks(text: bytearray | bytes, mark: bytes) -> Iterator[Block]:
    """Yield whole lines as one block, or as many small ones if they are very many."""
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


def _long_line(file: io.FileIO, begun: bytes, mark: bytes, block_bytes: int) -> tuple[Block, bytes]:
    """Read on to the end of a line without keeping it; return it and what came after."""
    size = len(begun)
    kept = begun[:LONG_LINE_KEPT_BYTES]
    while True:
        more = file.read(block_bytes)
        if not more:
            return Block(kept, size, unterminated=True, overlong=True), b""
        end = more.find(mark) + 1
        if end:
            return Block(kept, size + end, overlong=True), more[end:]
        size += len(more)
