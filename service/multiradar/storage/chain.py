"""The hash chain of the journal: each digest covers the digest before and the entry's content."""

import hashlib
import json
from collections.abc import Sequence

from multiradar.storage.entries import Entry, RejectedRow

#: What stands before the first entry, hashed with the fingerprint of the configuration.
_ORIGIN = b"multiradar journal"


def origin_digest(format_version: int, fingerprint: str) -> bytes:
    """Return the digest before the first entry; it covers the header of the journal."""
    return _digest(_ORIGIN, [str(format_version).encode(), fingerprint.encode()])


def entry_digest(previous: bytes, sequence: int, entry: Entry) -> bytes:
    """Return the SHA-256 of an entry and of everything before it.

    Parameters
    ----------
    previous : bytes
        Digest of the entry before.
    sequence : int
        Place in the journal.
    entry : Entry
        The content.
    """
    key = entry.idempotency_key
    return _digest(
        previous,
        [
            str(sequence).encode(),
            entry.kind.encode(),
            entry.source.encode(),
            b"-" if key is None else b"+" + key.encode(),
            entry.payload,
            str(entry.accepted).encode(),
            encode_rejects(entry.rejects).encode(),
            entry.admission.encode(),
        ],
    )


def encode_rejects(rejects: Sequence[RejectedRow]) -> str:
    """Return refused rows as JSON, exactly."""
    if not rejects:
        return "[]"
    return json.dumps([[row.index, row.code, row.reason, row.raw] for row in rejects])


def decode_rejects(text: str) -> tuple[RejectedRow, ...]:
    """Return the refused rows of `encode_rejects`."""
    if text == "[]":
        return ()
    return tuple(RejectedRow(*row) for row in json.loads(text))


def _digest(previous: bytes, parts: Sequence[bytes]) -> bytes:
    # Lengths stand before the parts, so that no content can slip from one into the next.
    whole = hashlib.sha256(previous)
    for part in parts:
        whole.update(len(part).to_bytes(8, "little"))
        whole.update(part)
    return whole.digest()
