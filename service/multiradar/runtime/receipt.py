"""What the sender of measurements is told once they are in the journal."""

from dataclasses import dataclass

from multiradar.storage.entries import RejectedRow

__all__ = ["Receipt", "RejectedRow"]


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
