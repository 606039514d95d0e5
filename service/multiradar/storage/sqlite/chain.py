"""The hash chain of the journal: each digest covers the digest before and the entry's content."""

import hashlib
import itertools
import json
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple, Self

from multiradar.storage.entries import Entry, EntryKind, RejectedRow

#: Rejected rows of more characters are compressed, and so many are stored by column.
_COMPRESSED_FROM = 1024
_BY_COLUMN_FROM = 16
#: Octets of compressed text that are read at once, where its beginning is enough.
_PIECE_OCTETS = 1 << 16
#: Values that are encoded at once: less than 1 ms.
_PIECE_VALUES = 200
#: Start of the chain, hashed with the fingerprint of the configuration.
_ORIGIN = b"multiradar journal"


class Columns(NamedTuple):
    """An entry as the values of its columns, which the digest covers."""

    kind: str
    source: str
    idempotency_key: str | None
    payload: bytes
    accepted: int
    rejects: str | bytes
    admission: str

    @classmethod
    def of(cls, entry: Entry) -> Self:
        """Return the columns of an entry."""
        return cls(
            str(entry.kind),
            entry.source,
            entry.idempotency_key,
            entry.payload,
            entry.accepted,
            _packed(entry.rejects),
            entry.admission,
        )

    @property
    def octets(self) -> int:
        """Octets that the columns without a bound of their own take."""
        return len(self.payload) + len(self.rejects) + len(self.admission)

    def entry(self) -> Entry:
        """Return the entry of these columns."""
        return Entry(
            EntryKind(self.kind),
            self.source,
            self.idempotency_key,
            self.payload,
            self.accepted,
            () if self.rejects == "[]" else _unpacked(self.rejects),
            self.admission,
        )


def rejects_count(packed: str | bytes) -> int:
    """Return the number of packed rejected rows; of many rows without unpacking them."""
    if isinstance(packed, str):
        return len(json.loads(packed))
    unpacker = zlib.decompressobj()
    text = unpacker.decompress(packed, _PIECE_OCTETS)
    if not text.startswith(b"{"):
        return len(_unpacked(packed))
    # The first column has a number for each row.
    while b"]" not in text and unpacker.unconsumed_tail:
        text += unpacker.decompress(unpacker.unconsumed_tail, _PIECE_OCTETS)
    return text.partition(b"]")[0].count(b",") + 1


def json_array(values: Iterable[object]) -> str:
    """Return values as a JSON array, encoded in pieces.

    No other thread runs while the encoder does: not for all of a hostile message at once.
    """
    return "".join(_array_pieces(values))


def _array_pieces(values: Iterable[object]) -> Iterator[str]:
    iterator = iter(values)
    before = "["
    while piece := list(itertools.islice(iterator, _PIECE_VALUES)):
        yield f"{before}{json.dumps(piece)[1:-1]}"
        before = ", "
    yield "[]" if before == "[" else "]"


def origin_digest(format_version: int, fingerprint: str) -> bytes:
    """Return the digest before the first entry; it covers the header of the journal."""
    return _digest(_ORIGIN, [str(format_version).encode(), fingerprint.encode()])


def entry_digest(previous: bytes, sequence: int, columns: Columns) -> bytes:
    """Return the SHA-256 of an entry and of everything before it.

    Parameters
    ----------
    previous : bytes
        Digest of the entry before.
    sequence : int
        Position in the journal.
    columns : Columns
        The content.
    """
    key = columns.idempotency_key
    return _digest(
        previous,
        [
            str(sequence).encode(),
            columns.kind.encode(),
            columns.source.encode(),
            b"-" if key is None else b"+" + key.encode(),
            columns.payload,
            str(columns.accepted).encode(),
            # Marked, so that no flipped bit makes compressed text of plain one.
            b"+" + columns.rejects
            if isinstance(columns.rejects, bytes)
            else columns.rejects.encode(),
            columns.admission.encode(),
        ],
    )


def mark_digest(sequence: int, reason: str) -> bytes:
    """Return the SHA-256 of a mark on an entry."""
    return _digest(_ORIGIN, [str(sequence).encode(), reason.encode()])


def _packed(rows: Sequence[RejectedRow]) -> str | bytes:
    if len(rows) >= _BY_COLUMN_FROM:
        # Half the size of rows: many have one code and reason, and successive indices.
        steps = itertools.starmap(int.__sub__, _neighbours([row.index for row in rows]))
        columns = {
            "step": steps,
            "code": (row.code for row in rows),
            "reason": (row.reason for row in rows),
            "raw": (row.raw for row in rows),
        }
        return _compressed(_object_pieces(columns))
    text = json_array([row.index, row.code, row.reason, row.raw] for row in rows)
    return text if len(text) < _COMPRESSED_FROM else zlib.compress(text.encode())


def _object_pieces(columns: Mapping[str, Iterable[object]]) -> Iterator[str]:
    before = "{"
    for name, values in columns.items():
        yield f'{before}"{name}": '
        yield from _array_pieces(values)
        before = ", "
    yield "}"


# The text of a message may have 16 MiB: it is never whole.
def _compressed(pieces: Iterable[str]) -> bytes:
    compressor = zlib.compressobj()
    found = [compressor.compress(piece.encode()) for piece in pieces]
    return b"".join([*found, compressor.flush()])


# Each index with the one before, the first with 0.
def _neighbours(indices: Sequence[int]) -> Iterable[tuple[int, int]]:
    return zip(indices, (0, *indices), strict=False)


def _unpacked(packed: str | bytes) -> tuple[RejectedRow, ...]:
    text = packed if isinstance(packed, str) else zlib.decompress(packed).decode()
    found = json.loads(text)
    if isinstance(found, dict):
        indices = itertools.accumulate(found["step"])
        rows = zip(indices, found["code"], found["reason"], found["raw"], strict=True)
    else:
        # Of few rows, and of earlier versions.
        rows = found
    return tuple(itertools.starmap(RejectedRow, rows))


def _digest(previous: bytes, parts: Sequence[bytes]) -> bytes:
    # Each part is preceded by its length, so that the boundaries are unambiguous.
    whole = hashlib.sha256(previous)
    for part in parts:
        whole.update(len(part).to_bytes(8, "little"))
        whole.update(part)
    return whole.digest()
