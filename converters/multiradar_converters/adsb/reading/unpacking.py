"""Text of a file in blocks, whether it is packed by gzip or plain; what it may grow to is bounded.

Gzip is found by its first two octets, 1F 8B, not by the name: readsb packs its traces under the
name `.json`. Several packed parts one after another are one text. A packed file that is cut short
gives what came before; a damaged one is refused, for what came before may be wrong, too.
"""

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from multiradar_converters.errors import LayoutError

#: Text taken at once, bytes.
BLOCK_BYTES = 1 << 20

#: A packed file may unpack to so many times its size and so much beside. Trajectories shrink
#: to a tenth or a twentieth; what grows more is made to fill memories and disks.
EXPANSION_MAX = 100
EXPANSION_FREE_BYTES = 1 << 26

_READ_BYTES = 1 << 18
_GZIP = b"\x1f\x8b"
_WINDOW_OF_GZIP = 31
# Other packings by their first octets, to name them.
_OTHERS = {
    b"\x28\xb5\x2f\xfd": "Zstandard",
    b"BZh": "bzip2",
    b"\xfd7zXZ": "xz",
    b"PK\x03\x04": "zip",
    b"PAR1": "Parquet",
    b"\xff\xfe": "UTF-16",
    b"\xfe\xff": "UTF-16",
}


@dataclass
class Unpacked:
    """A file on its way out.

    Attributes
    ----------
    path : Path
        The file.
    packed_bytes, text_bytes : int
        What was read of it, and what came out, so far.
    damage : str
        Why the text ends before its end; empty while it does not.
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
        Names the file; filled.
    progress : callable
        Told the bytes read from the file.

    Yields
    ------
    bytes
        Text, never empty, at most `BLOCK_BYTES`.

    Raises
    ------
    LayoutError
        The file cannot be read, is packed otherwise or damaged, or grows beyond all bounds.
    """
    path = unpacked.path
    if path.exists() and not path.is_file():
        msg = f"{path}: expected a file, was something else"
        raise LayoutError(msg)
    try:
        with path.open("rb") as file:
            first = file.read(_READ_BYTES)
            _refuse_others(path, first)
            chunks = _chunks(first, file.read, unpacked, progress)
            blocks = _unzipped(chunks, unpacked) if first.startswith(_GZIP) else chunks
            for block in blocks:
                unpacked.text_bytes += len(block)
                yield block
    except OSError as error:
        msg = f"{path}: cannot be read: {error.strerror or error}"
        raise LayoutError(msg) from error


def _refuse_others(path: Path, first: bytes) -> None:
    for mark, name in _OTHERS.items():
        if first.startswith(mark):
            msg = f"{path}: expected JSON or CSV, plain or packed by gzip, was {name}"
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
                msg = f"{unpacked.path}: expected a whole packed file, was a damaged one: {error}"
                raise LayoutError(msg) from error
            waiting = part.unused_data if part.eof else part.unconsumed_tail
            if block:
                _check_growth(unpacked, len(block))
                yield block
    if not part.eof:
        unpacked.damage = "the packed file is cut short"


def _check_growth(unpacked: Unpacked, more: int) -> None:
    bound = EXPANSION_MAX * unpacked.packed_bytes + EXPANSION_FREE_BYTES
    if unpacked.text_bytes + more > bound:
        msg = (
            f"{unpacked.path}: expected a packed file that grows at most {EXPANSION_MAX} times, "
            f"was {unpacked.packed_bytes} bytes that gave more than {bound}"
        )
        raise LayoutError(msg)
