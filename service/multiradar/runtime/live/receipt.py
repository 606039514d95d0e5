"""What the sender of measurements is told once they are in the journal."""

from dataclasses import dataclass
from typing import Any

from multiradar.storage.entries import RejectedRow

__all__ = [
    "IDEMPOTENCY_KEY_FORM",
    "IDEMPOTENCY_KEY_LENGTH_MAX",
    "Receipt",
    "RejectedRow",
    "is_idempotency_key",
    "receipt_document",
]

IDEMPOTENCY_KEY_LENGTH_MAX = 128
#: What an idempotency key looks like, for people.
IDEMPOTENCY_KEY_FORM = (
    f"1 to {IDEMPOTENCY_KEY_LENGTH_MAX} printable ASCII characters without a space at either end"
)


@dataclass(frozen=True, slots=True)
class Receipt:
    """The answer to one message: everything in it is accounted for, and on disk.

    Attributes
    ----------
    accepted : int
        Rows that are in the journal.
    rejected : tuple of RejectedRow
        Rows that were refused, by ascending index; they are in the quarantine.
    duplicate : bool
        True when a message with the same idempotency key was taken before; nothing was taken
        again, and the other fields say what became of the first.
    journal_sequence : int
        Entry of the journal that holds the message.
    """

    accepted: int
    rejected: tuple[RejectedRow, ...]
    duplicate: bool
    journal_sequence: int


def receipt_document(receipt: Receipt) -> dict[str, Any]:
    """Return a receipt as its sender reads it, whatever way the message came."""
    return {
        "accepted": receipt.accepted,
        "rejected": [
            {"index": row.index, "code": row.code, "reason": row.reason} for row in receipt.rejected
        ],
        "duplicate": receipt.duplicate,
        "journal_sequence": receipt.journal_sequence,
    }


def is_idempotency_key(text: str) -> bool:
    """Return whether a sender may name a message so: `IDEMPOTENCY_KEY_FORM`."""
    return (
        0 < len(text) <= IDEMPOTENCY_KEY_LENGTH_MAX
        and text.isascii()
        and text.isprintable()
        and text == text.strip()
    )
