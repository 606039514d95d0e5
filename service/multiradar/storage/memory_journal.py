"""A journal in memory, for tests and for runs without durable storage."""

import threading
from collections.abc import Iterator, Sequence

from multiradar.errors import JournalError
from multiradar.storage.entries import Entry, JournalCounts, Quarantined, StoredEntry
from multiradar.storage.journal import Space
from multiradar.storage.sqlite.chain import Columns, entry_digest, origin_digest


class MemoryJournal:
    """A journal with the lifetime of the object; closing it keeps the content.

    Parameters
    ----------
    fingerprint : str
        Fingerprint of the configuration.
    """

    def __init__(self, fingerprint: str = "") -> None:
        self._entries: list[StoredEntry] = []
        self._quarantine: list[Quarantined] = []
        self._keys: dict[str, int] = {}
        self._skipped: dict[int, str] = {}
        self._origin = origin_digest(0, fingerprint)
        self._lock = threading.Lock()

    def append(self, entries: Sequence[Entry]) -> list[int]:
        """Add entries and return their sequence numbers."""
        with self._lock:
            keys = [entry.idempotency_key for entry in entries if entry.idempotency_key is not None]
            if len(set(keys)) < len(keys) or any(key in self._keys for key in keys):
                raise JournalError("expected idempotency keys not yet in the journal")
            return [self._append(entry) for entry in entries]

    def read(self, after: int) -> Iterator[StoredEntry]:
        """Yield the entries after a sequence number."""
        place = after
        while place < len(self._entries):
            yield self._entries[place]
            place += 1

    def verify_pages(self) -> None:
        """Do nothing: it has no pages."""

    def stop_verifying(self) -> None:
        """Do nothing: it has no pages."""

    def find(self, idempotency_key: str) -> StoredEntry | None:
        """Return the entry with this key, or None."""
        sequence = self._keys.get(idempotency_key)
        return None if sequence is None else self._entries[sequence - 1]

    def quarantined(self, after: int, limit: int) -> list[Quarantined]:
        """Return at most `limit` rejected rows after a number in the quarantine."""
        return self._quarantine[after : after + limit]

    def counts(self) -> JournalCounts:
        """Return the number of entries and measurements, and the state of the admission."""
        return JournalCounts(
            entries=len(self._entries),
            accepted=sum(stored.entry.accepted for stored in self._entries),
            rejected=len(self._quarantine),
            admission=self._entries[-1].entry.admission if self._entries else "",
        )

    def removed_until(self) -> int:
        """Return 0: no entry is ever removed."""
        return 0

    def digest(self, sequence: int) -> bytes:
        """Return the digest of an entry, which covers all before it."""
        return self._entries[sequence - 1].digest if sequence else self._origin

    def skip(self, sequence: int, reason: str) -> None:
        """Mark an entry so that replays skip it."""
        self._skipped[sequence] = reason

    def skipped(self) -> dict[int, str]:
        """Return the entries that replays skip, with their reasons."""
        return dict(self._skipped)

    def space(self) -> Space | None:
        """Return None: it has no disk."""
        return None

    def close(self) -> None:
        """Keep the content for the next service."""

    def _append(self, entry: Entry) -> int:
        sequence = len(self._entries) + 1
        previous = self._entries[-1].digest if self._entries else self._origin
        self._entries.append(
            StoredEntry(sequence, entry, entry_digest(previous, sequence, Columns.of(entry)))
        )
        if entry.idempotency_key is not None:
            self._keys[entry.idempotency_key] = sequence
        for row in entry.rejects:
            number = len(self._quarantine) + 1
            self._quarantine.append(Quarantined(number, sequence, entry.source, row))
        return sequence
