"""What the journal keeps: one entry for each batch or mark, and the rows that were refused."""

from dataclasses import dataclass
from enum import StrEnum


class EntryKind(StrEnum):
    """What an entry of the journal stands for."""

    BATCH = "batch"
    """Measurements, in the order of their arrival."""

    FLUSH = "flush"
    """The end of a stream: what waits to be put in order is released."""


@dataclass(frozen=True, slots=True)
class RejectedRow:
    """One row of a message that was refused.

    Attributes
    ----------
    index : int
        Place of the row in the message, from 0.
    code : str
        Stable code, one of `multiradar_schemas.measurements.reject.RejectCode`.
    reason : str
        One sentence for people.
    raw : str
        What stood there, as JSON or as the text it came in; empty when the edge did not keep it.
    """

    index: int
    code: str
    reason: str
    raw: str = ""


@dataclass(frozen=True, slots=True)
class Entry:
    """What is appended to the journal.

    Attributes
    ----------
    kind : EntryKind
        A batch of measurements, or the end of a stream.
    source : str
        Who sent it.
    idempotency_key : str or None
        The sender's name for the message; no two entries have the same.
    payload : bytes
        The accepted measurements as an Arrow IPC stream; empty when there are none.
    accepted : int
        Number of measurements in the payload.
    rejects : tuple of RejectedRow
        The rows of the same message that were refused.
    admission : str
        State of the admission after this entry, as JSON, so that a restart continues from it.
    """

    kind: EntryKind
    source: str
    idempotency_key: str | None
    payload: bytes
    accepted: int
    rejects: tuple[RejectedRow, ...]
    admission: str


@dataclass(frozen=True, slots=True)
class StoredEntry:
    """An entry as it stands in the journal, verified.

    Attributes
    ----------
    sequence : int
        Place in the journal, 1, 2, 3, …
    entry : Entry
        What was appended.
    digest : bytes
        SHA-256 over the digest of the entry before and the content of this one.
    """

    sequence: int
    entry: Entry
    digest: bytes


@dataclass(frozen=True, slots=True)
class Quarantined:
    """A refused row with its place in the quarantine.

    Attributes
    ----------
    number : int
        Place in the quarantine, 1, 2, 3, …
    sequence : int
        Entry of the journal that it belongs to.
    source : str
        Who sent it.
    row : RejectedRow
        The row, why it was refused, and what it said.
    """

    number: int
    sequence: int
    source: str
    row: RejectedRow


@dataclass(frozen=True, slots=True)
class JournalCounts:
    """What the journal holds, in numbers.

    Attributes
    ----------
    entries : int
        Entries; equal to the sequence number of the last one.
    accepted, rejected : int
        Measurements that were accepted, and rows that were refused.
    admission : str
        State of the admission after the last entry; empty when there is none.
    """

    entries: int
    accepted: int
    rejected: int
    admission: str
