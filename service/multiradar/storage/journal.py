"""The journal: what was accepted, in order, on disk before it is acknowledged."""

from collections.abc import Iterator, Sequence
from typing import Protocol

from multiradar.storage.entries import Entry, JournalCounts, Quarantined, StoredEntry


class Journal(Protocol):
    """An append-only sequence of entries; one service writes it, any thread reads it.

    All methods raise `JournalError` when the journal cannot be read or written, or when what it
    holds does not verify.
    """

    def append(self, entries: Sequence[Entry]) -> list[int]:
        """Write entries in one transaction and return their sequence numbers, once on disk."""
        ...

    def read(self, after: int) -> Iterator[StoredEntry]:
        """Yield the entries that follow a sequence number, verified, in bounded pieces."""
        ...

    def find(self, idempotency_key: str) -> StoredEntry | None:
        """Return the entry with this key, or None."""
        ...

    def quarantined(self, after: int, limit: int) -> list[Quarantined]:
        """Return at most `limit` refused rows that follow a number of the quarantine."""
        ...

    def counts(self) -> JournalCounts:
        """Return the number of entries and measurements, and the state of the admission."""
        ...

    def skip(self, sequence: int, reason: str) -> None:
        """Mark an entry that the engine cannot process, so that no replay tries it again."""
        ...

    def skipped(self) -> dict[int, str]:
        """Return the entries that replays pass over, with the reason of each."""
        ...

    def close(self) -> None:
        """Let the journal go; closing twice is allowed."""
        ...
