"""The receipt of a message once it is in the journal."""

import json
from dataclasses import dataclass

from multiradar.storage.entries import RejectedRow
from multiradar.storage.sqlite.chain import json_array

__all__ = [
    "IDEMPOTENCY_KEY_FORM",
    "IDEMPOTENCY_KEY_LENGTH_MAX",
    "SENDER_SEPARATOR",
    "Receipt",
    "RejectedRow",
    "is_idempotency_key",
    "key_of_sender",
    "receipt_json",
]

IDEMPOTENCY_KEY_LENGTH_MAX = 128
#: Between the name of a sender and its key.
SENDER_SEPARATOR = "\x1f"
#: The form of an idempotency key, for error messages.
IDEMPOTENCY_KEY_FORM = (
    f"1 to {IDEMPOTENCY_KEY_LENGTH_MAX} printable ASCII characters without a space at either end"
)


@dataclass(frozen=True, slots=True)
class Receipt:
    """The answer to one message: all its rows are accounted for, and on disk.

    Attributes
    ----------
    accepted : int
        Rows in the journal.
    rejected : tuple of RejectedRow
        Rejected rows, by ascending index; they are in the quarantine.
    duplicate : bool
        True when a message with the same idempotency key was accepted before; the other fields
        are those of its receipt.
    journal_sequence : int
        Journal entry of the message.
    """

    accepted: int
    rejected: tuple[RejectedRow, ...]
    duplicate: bool
    journal_sequence: int


def receipt_json(receipt: Receipt) -> bytes:
    """Return the JSON document of a receipt, the same for all interfaces."""
    rejected = json_array(
        {"index": row.index, "code": row.code, "reason": row.reason} for row in receipt.rejected
    )
    rest = json.dumps(
        {"duplicate": receipt.duplicate, "journal_sequence": receipt.journal_sequence}
    )
    return f'{{"accepted": {receipt.accepted}, "rejected": {rejected}, {rest[1:]}'.encode()


def is_idempotency_key(text: str) -> bool:
    """Return whether a text is a valid idempotency key: `IDEMPOTENCY_KEY_FORM`."""
    return (
        0 < len(text) <= IDEMPOTENCY_KEY_LENGTH_MAX
        and text.isascii()
        and text.isprintable()
        and text == text.strip()
    )


def key_of_sender(sender: str, key: str | None) -> str | None:
    """Return a key as the journal keeps it: apart from the same key of another sender.

    A sender without a name, of a service without credentials, shares its keys with all such.
    """
    # No valid key has the separator.
    return f"{sender}{SENDER_SEPARATOR}{key}" if sender and key is not None else key
