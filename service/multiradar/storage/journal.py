"""The journal: accepted measurements in order, on disk before they are acknowledged."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol

from multiradar.storage.entries import Entry, JournalCounts, Quarantined, StoredEntry


class Space(NamedTuple):
    """Space on the disk of a journal, and what the journal uses of it, bytes."""

    free_bytes: int
    size_bytes: int
    used_bytes: int


class Journal(Protocol):
    """An append-only sequence of entries; one service writes it, any thread reads it.

    All methods raise `JournalError` when the journal cannot be read or written, or when its content
    does not verify.
    """

    def append(self, entries: Sequence[Entry]) -> list[int]:
        """Write entries in one transaction and return their sequence numbers, once on disk."""
        ...

    def read(self, after: int) -> Iterator[StoredEntry]:
        """Yield the verified entries after a sequence number, in bounded pieces.

        Raises `RemovedEntriesError` if some of them were removed.
        """
        ...

    def verify_pages(self) -> None:
        """Verify what is not verified when it is opened, nor by reading its entries."""
        ...

    def stop_verifying(self) -> None:
        """Have `verify_pages` in another thread end, with an error."""
        ...

    def find(self, idempotency_key: str) -> StoredEntry | None:
        """Return the entry with this key, or None; of a removed one without its measurements."""
        ...

    def quarantined(self, after: int, limit: int) -> list[Quarantined]:
        """Return at most `limit` rejected rows after a number in the quarantine."""
        ...

    def counts(self) -> JournalCounts:
        """Return the number of entries and measurements, and the state of the admission."""
        ...

    def removed_until(self) -> int:
        """Return the last entry that was removed, whose successor is the first; 0: none."""
        ...

    def digest(self, sequence: int) -> bytes:
        """Return the digest of an entry, which covers all before it."""
        ...

    def skip(self, sequence: int, reason: str) -> None:
        """Mark an entry that the engine cannot process, so that replays skip it."""
        ...

    def skipped(self) -> dict[int, str]:
        """Return the entries that replays skip, with their reasons."""
        ...

    def space(self) -> Space | None:
        """Return the space on its disk; None where it has none."""
        ...

    def close(self) -> None:
        """Close the journal; may be called twice."""
        ...
