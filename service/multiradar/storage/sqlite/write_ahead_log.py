"""The write-ahead log of SQLite, verified before SQLite reads it.

SQLite uses the log up to the first frame whose checksum does not match, and silently discards the
rest. After a crash that is the transaction that was being written. A transaction starts only when
the one before is on disk; so an invalid frame with a complete transaction behind it, and the start
of another, is damage. Whether the last transaction is complete is decided by the tip of the journal
(`multiradar.storage.sqlite.tip`).

Format: https://www.sqlite.org/fileformat.html#the_write_ahead_log
"""

from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.storage.sqlite.sqlite_file import READINGS, file_errors

_HEADER_BYTES = 32
_FRAME_HEADER_BYTES = 24
#: The first word; its last bit is the byte order of the checksums.
_MAGIC = 0x377F0682
#: Frames that are verified at once.
_PIECE_FRAMES = 1024

_Words = NDArray[np.uint32]


class _Header(NamedTuple):
    page_bytes: int
    order: str
    salts: _Words
    checksum: _Words


class _Frames(NamedTuple):
    # For each frame of the log whether it is valid, and whether it ends a transaction.
    valid: NDArray[np.bool_]
    last: NDArray[np.bool_]


def log_damage(path: Path) -> str | None:
    """Return where a write-ahead log is damaged; None if it is intact, or there is none.

    An incomplete last transaction, as left by a crash, is not damage. A service may be writing it.
    """
    found = None
    for _ in range(READINGS):
        begin = _first_octets(path)
        found = _damage(path)
        # A log that starts again meanwhile is no longer the one whose header was read.
        if found is None or begin != _first_octets(path):
            return None
    return found


def _first_octets(path: Path) -> bytes:
    try:
        with file_errors(path), path.open("rb") as stream:
            return stream.read(_HEADER_BYTES)
    except FileNotFoundError:
        return b""


def _damage(path: Path) -> str | None:
    try:
        with file_errors(path), path.open("rb") as stream:
            begin = stream.read(_HEADER_BYTES)
            if len(begin) < _HEADER_BYTES:
                return None
            header = _header(begin)
            if header is None:
                # It is on disk before the first frame is written.
                return "the header is invalid"
            frames = _frames(stream, header)
    except FileNotFoundError:
        return None
    if frames.valid.all():
        return None
    first = int(np.argmin(frames.valid))
    behind = frames.valid[first:]
    ends = np.flatnonzero(behind & frames.last[first:])
    if not len(ends) or not behind[ends[0] + 1 :].any():
        return None
    offset = _HEADER_BYTES + first * (_FRAME_HEADER_BYTES + header.page_bytes)
    return (
        f"frame {first + 1} (byte {offset}) is invalid, but transactions written after it are valid"
    )


# The header of a log; None if it does not verify.
def _header(begin: bytes) -> _Header | None:
    magic, _, page_bytes, _, *salts = np.frombuffer(begin, ">u4")[:6].tolist()
    order = ">u4" if magic & 1 else "<u4"
    checksum = _checksums(
        np.frombuffer(begin, order)[np.newaxis, :6], np.zeros((1, 2), dtype=np.uint32)
    )
    if magic & ~1 != _MAGIC or (checksum[0] != np.frombuffer(begin, ">u4")[6:]).any():
        return None
    return _Header(page_bytes, order, np.array(salts, dtype=np.uint32), checksum[0])


# A frame is verified from the checksum in the frame before, so that one behind an invalid frame is
# recognised.
def _frames(stream: BinaryIO, header: _Header) -> _Frames:
    frame_bytes = _FRAME_HEADER_BYTES + header.page_bytes
    before = header.checksum
    valid, last = [np.empty(0, dtype=np.bool_)], [np.empty(0, dtype=np.bool_)]
    while piece := stream.read(_PIECE_FRAMES * frame_bytes):
        count = len(piece) // frame_bytes
        octets = np.frombuffer(piece, np.uint8, count * frame_bytes).reshape(count, frame_bytes)
        numbers = octets[:, :_FRAME_HEADER_BYTES].copy().view(">u4").astype(np.uint32)
        covered = np.hstack([octets[:, :8], octets[:, _FRAME_HEADER_BYTES:]]).view(header.order)
        stored = numbers[:, 4:]
        found = _checksums(covered, np.vstack([before, stored])[:count])
        valid.append(((found == stored) & (numbers[:, 2:4] == header.salts)).all(axis=1))
        last.append(numbers[:, 1] > 0)
        before = stored[-1] if count else before
    return _Frames(np.concatenate(valid), np.concatenate(last))


# The checksums of rows of words, each from the checksum before it.
def _checksums(rows: NDArray[np.integer], before: _Words) -> _Words:
    columns = np.ascontiguousarray(rows.T, dtype=np.uint32)
    first, second = before[:, 0].copy(), before[:, 1].copy()
    for place in range(0, len(columns), 2):
        first += columns[place] + second
        second += columns[place + 1] + first
    return np.column_stack([first, second])
