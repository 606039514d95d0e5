"""Entries of the journal: one for each batch or mark, with its rejected rows."""

import hashlib
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum

from multiradar_schemas.reject import RejectCode

#: Octets of the content of a rejected row, and characters of its reason, that are kept.
RAW_BYTES_MAX = 4096
REASON_CHARACTERS_MAX = 1000
#: Codes of rejects whose content is a valid measurement: the service did not use it for its time,
#: or for a sensor that it did not have at that time.
RECOVERABLE = (
    RejectCode.UNKNOWN_SENSOR,
    RejectCode.SENSOR_DISABLED,
    RejectCode.TIME_LATE,
    RejectCode.TIME_FUTURE,
    RejectCode.RATE_EXCEEDED,
)
#: Octets of the contents of all rejected rows of a message that are kept: those of measurements,
#: which are processed later, and others.
MEASUREMENTS_BYTES_MAX, RAWS_BYTES_MAX = 16 << 20, 1 << 20
#: Entries that are written in one transaction at most, and octets in memory after which there are
#: no more of them; a rejected row takes so many beside its content.
PIECE_ENTRIES, PIECE_OCTETS, ROW_OCTETS = 256, 16 << 20, 400
#: The note that replaces the rest of a content is shorter than this.
_NOTE_BYTES_MAX = 128
_NOTE = re.compile(r"… \[[0-9]+ octets, sha256 [0-9a-f]{64}\]\Z")


class EntryKind(StrEnum):
    """Kind of an entry of the journal."""

    BATCH = "batch"
    """Measurements, in the order of their arrival."""

    FLUSH = "flush"
    """The end of a stream: measurements in the reorder buffer are released."""

    CLOCK = "clock"
    """An operator has set the data clock; the entry contains the admission with the new time."""

    SENSOR = "sensor"
    """An operator has added or changed a sensor: the payload says how, as JSON."""

    HANDOVER = "handover"
    """A neighbouring region has handed over tracks and biases: the payload is its message."""


@dataclass(frozen=True, slots=True)
class RejectedRow:
    """A rejected row of a message.

    Attributes
    ----------
    index : int
        Index of the row in the message, from 0.
    code : str
        Stable code, one of `multiradar_schemas.reject.RejectCode`.
    reason : str
        Reason in words.
    raw : str
        Content as JSON or as the received text; empty when it was not retained. Of a longer one
        the first `RAW_BYTES_MAX` octets, with the length and the SHA-256 of the whole.
    """

    index: int
    code: str
    reason: str
    raw: str = ""

    def __post_init__(self) -> None:
        # One line of a hostile sender must cost no more than others, at each restart.
        object.__setattr__(self, "raw", _shortened(self.raw))
        if len(self.reason) > REASON_CHARACTERS_MAX:
            object.__setattr__(self, "reason", self.reason[: REASON_CHARACTERS_MAX - 1] + "…")


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry to append to the journal.

    Attributes
    ----------
    kind : EntryKind
        A batch of measurements, the end of a stream, a new time of the data clock, a change of a
        sensor, or what a neighbouring region handed over.
    source : str
        Input it was received from.
    idempotency_key : str or None
        The sender's unique key of the message.
    payload : bytes
        The accepted measurements as an Arrow IPC stream; or JSON, the change of a sensor or the
        message of a region; else empty.
    accepted : int
        Number of measurements in the payload.
    rejects : tuple of RejectedRow
        Rejected rows of the same message.
    admission : str
        State of the admission after this entry, as JSON, from which a restart continues.
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
    """A verified entry of the journal.

    Attributes
    ----------
    sequence : int
        Position in the journal, from 1.
    entry : Entry
        The entry.
    digest : bytes
        SHA-256 over the digest of the previous entry and the content of this one.
    """

    sequence: int
    entry: Entry
    digest: bytes


@dataclass(frozen=True, slots=True)
class Quarantined:
    """A rejected row in the quarantine.

    Attributes
    ----------
    number : int
        Number in the quarantine, from 1.
    sequence : int
        Entry of the journal it belongs to.
    source : str
        Input it was received from.
    row : RejectedRow
        The row with its reason and content.
    """

    number: int
    sequence: int
    source: str
    row: RejectedRow


@dataclass(frozen=True, slots=True)
class JournalCounts:
    """Counts of the journal.

    Attributes
    ----------
    entries : int
        Entries; equal to the sequence number of the last one.
    accepted, rejected : int
        Accepted measurements and rejected rows.
    admission : str
        State of the admission after the last entry; empty without entries.
    """

    entries: int
    accepted: int
    rejected: int
    admission: str


def in_pieces(entries: Iterable[Entry]) -> Iterator[list[Entry]]:
    """Yield entries as lists of at most `PIECE_ENTRIES`, and of few if they are large."""
    piece: list[Entry] = []
    octets = 0
    for entry in entries:
        piece.append(entry)
        octets += len(entry.payload) + len(entry.admission)
        octets += sum(ROW_OCTETS + len(row.reason) + len(row.raw) for row in entry.rejects)
        if len(piece) == PIECE_ENTRIES or octets >= PIECE_OCTETS:
            yield piece
            piece, octets = [], 0
    if piece:
        yield piece


def bounded(rows: Iterable[RejectedRow]) -> tuple[RejectedRow, ...]:
    """Return the rejected rows of a message, without those contents that are too much together.

    The measurements among them have `MEASUREMENTS_BYTES_MAX` octets, the others `RAWS_BYTES_MAX`.
    Of the rows beyond it the length and the SHA-256 are kept.
    """
    left = {True: MEASUREMENTS_BYTES_MAX, False: RAWS_BYTES_MAX}
    found = []
    for row in rows:
        kind = row.code in RECOVERABLE
        # Otherwise no character has more than four octets.
        left[kind] -= len(row.raw) if row.raw.isascii() else 4 * len(row.raw)
        if left[kind] < 0:
            # The length and the hash are those of what was sent.
            note = _NOTE.search(row.raw)
            row = replace(row, raw=note[0] if note else _shortened(row.raw, 0))
        found.append(row)
    return tuple(found)


def _shortened(raw: str, bytes_max: int = RAW_BYTES_MAX) -> str:
    if 4 * len(raw) <= bytes_max + _NOTE_BYTES_MAX:
        return raw
    octets = raw.encode("utf-8", "surrogatepass")
    if len(octets) <= bytes_max + _NOTE_BYTES_MAX:
        return raw
    kept = octets[:bytes_max].decode("utf-8", "ignore")
    return f"{kept}… [{len(octets)} octets, sha256 {hashlib.sha256(octets).hexdigest()}]"
