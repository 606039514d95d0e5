"""Entries for tests of the journal."""

from multiradar.storage.entries import Entry, EntryKind, RejectedRow


def entry(number: int, *, key: str | None = "", rejects: int = 0, size: int = 200) -> Entry:
    """Return an entry whose content follows from a number."""
    return Entry(
        kind=EntryKind.BATCH if number % 5 else EntryKind.FLUSH,
        source=f"source {number % 3}",
        idempotency_key=f"key {number}" if key == "" else key,
        payload=bytes((number + place) % 251 for place in range(size)),
        accepted=number,
        rejects=tuple(
            RejectedRow(place, "OUT_OF_RANGE", f"because of {number}", f'{{"range_m": {place}.5}}')
            for place in range(rejects)
        ),
        admission=f"state {number}",
    )
