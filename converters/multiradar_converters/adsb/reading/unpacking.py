"""Text of a file in blocks, plain or compressed by gzip, with bounded expansion.

Gzip is detected by its first two octets, 1F 8B, not by the name: readsb compresses its traces under
the name `.json`. Concatenated gzip members are one text. A truncated file yields the text before
the end; a damaged one is rejected, because the text before may be wrong, too.
"""

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from multiradar_converters.errors import LayoutError
from multiradar_schemas.documents.contents import GZIP, packed_form

#: Text read at a time, bytes.
BLOCK_BYTES = 1 << 20

#: Maximum expansion ratio and additional allowance. Trajectories compress 10 to 20 times; higher
#: ratios indicate a decompression bomb.
EXPANSION_MAX = 100
EXPANSION_FREE_BYTES = 1 << 26

_READ_BYTES = 1 << 18
_WINDOW_OF_GZIP = 31
# Other forms that are not packed, by their first octets, for messages.
_OTHERS = {b"PAR1": "Parquet", b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16"}


@dataclass
class Unpacked:
    """State of a file being decompressed.

    Attributes
    ----------
    path : Path
        The file.
    packed_bytes, text_bytes : int
        Bytes read and bytes produced so far.
    damage : str
        Reason why the text is truncated; empty if it is not.
    """

    path: Path
    packed_bytes: int = 0
    text_bytes: int = 0
    damage: str = ""


def read_text(unpacked: Unpacked, progress: Callable[[int], None]) -> Iterator[bytes]:
    """Read a file.

    Parameters
    ----------
    unpacked : Unpacked
        State; updated.
    progress : callable
        Called with the number of bytes read from the file.

    Yields
    ------
    bytes
        Text, 1 to `BLOCK_BYTES` bytes.

    Raises
    ------
    LayoutError
        The file cannot be read, has another compression, is damaged, or expands too much.
    """
    path = unpacked.path
    if path.exists() and not path.is_file():
        msg = f"{path}: not a regular file"
        raise LayoutError(msg)
    try:
        with path.open("rb") as file:
            first = file.read(_READ_BYTES)
            _reject_other_formats(path, first)
            chunks = _chunks(first, file.read, unpacked, progress)
            blocks = _unzipped(chunks, unpacked) if first.startswith(GZIP) else chunks
            for block in blocks:
                unpacked.text_bytes += len(block)
                yield block
    except OSError as error:
        msg = f"{path}: cannot be read: {error.strerror or error}"
        raise LayoutError(msg) from error


def _reject_other_formats(path: Path, first: bytes) -> None:
    if first.startswith(GZIP):
        return
    found = packed_form(first) or _OTHERS.get(first[:4]) or _OTHERS.get(first[:2])
    if found is not None:
        msg = f"{path}: expected JSON or CSV, plain or gzip-compressed, was {found}"
        raise LayoutError(msg)


def _chunks(
    first: bytes,
    read: Callable[[int], bytes],
    unpacked: Unpacked,
    progress: Callable[[int], None],
) -> Iterator[bytes]:
    chunk = first
    while chunk:
        unpacked.packed_bytes += len(chunk)
        progress(len(chunk))
        yield chunk
        chunk = read(_READ_BYTES)


def _unzipped(chunks: Iterator[bytes], unpacked: Unpacked) -> Iterator[bytes]:
    part = zlib.decompressobj(_WINDOW_OF_GZIP)
    for chunk in chunks:
        waiting = chunk
        while waiting:
            if part.eof:
                if not waiting.strip(b"\0"):
                    break
                part = zlib.decompressobj(_WINDOW_OF_GZIP)
            try:
                block = part.decompress(waiting, BLOCK_BYTES)
            except zlib.error as error:
                msg = f"{unpacked.path}: the compressed file is damaged: {error}"
                raise LayoutError(msg) from error
            waiting = part.unused_data if part.eof else part.unconsumed_tail
            if block:
                _check_growth(unpacked, len(block))
                yield block
    if not part.eof:
        unpacked.damage = "the compressed file is truncated"


def _check_growth(unpacked: Unpacked, more: int) -> None:
    bound = EXPANSION_MAX * unpacked.packed_bytes + EXPANSION_FREE_BYTES
    if unpacked.text_bytes + more > bound:
        msg = (
            f"{unpacked.path}: expected a compression ratio of at most {EXPANSION_MAX}, but "
            f"{unpacked.packed_bytes} bytes expanded to more than {bound}"
        )
        raise LayoutError(msg)
