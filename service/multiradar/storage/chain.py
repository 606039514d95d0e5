"""The hash chain of the journal: each digest covers the digest before and the entry's content."""

import hashlib
import json
import zlib
from collections.abc import Sequence
from typing import NamedTuple, Self

from multiradar.storage.entries import Entry, EntryKind, RejectedRow

#: Rejected rows of more characters are compressed: many lines have one reason.
_COMPRESSED_FROM = 1024
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
        rows = [[row.index, row.code, row.reason, row.raw] for row in entry.rejects]
        return cls(
            str(entry.kind),
            entry.source,
            entry.idempotency_key,
            entry.payload,
            entry.accepted,
            _packed(json.dumps(rows)) if rows else "[]",
            entry.admission,
        )

    def entry(self) -> Entry:
        """Return the entry of these columns."""
        rows = [] if self.rejects == "[]" else json.loads(_unpacked(self.rejects))
        return Entry(
            EntryKind(self.kind),
            self.source,
            self.idempotency_key,
            self.payload,
            self.accepted,
            tuple(RejectedRow(*row) for row in rows),
            self.admission,
        )


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


def _packed(text: str) -> str | bytes:
    if len(text) < _COMPRESSED_FROM:
        return text
    return zlib.compress(text.encode())


def _unpacked(rejects: str | bytes) -> str:
    if isinstance(rejects, str):
        return rejects
    return zlib.decompress(rejects).decode()


def _digest(previous: bytes, parts: Sequence[bytes]) -> bytes:
    # Each part is preceded by its length, so that the boundaries are unambiguous.
    whole = hashlib.sha256(previous)
    for part in parts:
        whole.update(len(part).to_bytes(8, "little"))
        whole.update(part)
    return whole.digest()
