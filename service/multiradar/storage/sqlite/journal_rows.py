"""What a journal in SQLite holds: rows that are verified as they are read.

====================  ==========================================================================
Table                 Rows
====================  ==========================================================================
``header``            one: format version, fingerprint of the configuration
``head``              one: last entry, its digest, rows accepted and rejected so far
``entry``             one for each message or mark, chained by digests
``quarantine``        one for each entry with rejected rows: the number of its first rejected row
``skipped``           one for each entry that the engine cannot process
``base``              one, in a shortened journal: the last removed entry
``removed``           one for each removed entry with a key, which is still recognised
``sensor_change``     one for each removed change of a sensor, which a migration needs
====================  ==========================================================================

The digest of each entry is recomputed from the previous one, the numbers must be complete, and the
last entry must be the one in ``head``. The first entry of a shortened journal follows ``base``.
"""

import sqlite3
from pathlib import Path
from typing import Any, NamedTuple

from multiradar.errors import ConfigurationError, JournalError, RemovedEntriesError
from multiradar.storage.entries import StoredEntry
from multiradar.storage.sqlite.chain import Columns, entry_digest, mark_digest, origin_digest

FORMAT_VERSION = 2
#: In the header of a shortened journal, which earlier versions would find damaged. The digests are
#: those of the format above.
SHORTENED_VERSION = 3
#: Of version 0.2.0: without a tip, so that it is read, but not continued.
EARLIER_VERSION = 1

SCHEMA = """
CREATE TABLE header (format_version INTEGER NOT NULL, fingerprint TEXT NOT NULL);
CREATE TABLE head (
    sequence INTEGER NOT NULL, digest BLOB NOT NULL,
    accepted INTEGER NOT NULL, rejected INTEGER NOT NULL
);
CREATE TABLE entry (
    sequence INTEGER PRIMARY KEY, kind TEXT NOT NULL, source TEXT NOT NULL,
    idempotency_key TEXT UNIQUE, payload BLOB NOT NULL, accepted INTEGER NOT NULL,
    rejects TEXT NOT NULL, admission TEXT NOT NULL, digest BLOB NOT NULL
);
CREATE TABLE quarantine (first INTEGER PRIMARY KEY, sequence INTEGER NOT NULL);
CREATE TABLE skipped (sequence INTEGER PRIMARY KEY, reason TEXT NOT NULL, digest BLOB NOT NULL);
"""
#: What the fingerprint is made of; journals of earlier versions have no such table.
DESCRIPTION_SCHEMA = "CREATE TABLE IF NOT EXISTS configuration (description TEXT NOT NULL)"
#: Further tables of a shortened journal.
SHORTENED_SCHEMA = """
CREATE TABLE base (
    sequence INTEGER NOT NULL, digest BLOB NOT NULL,
    accepted INTEGER NOT NULL, rejected INTEGER NOT NULL, keys INTEGER NOT NULL
);
CREATE TABLE removed (
    idempotency_key TEXT PRIMARY KEY, sequence INTEGER NOT NULL, kind TEXT NOT NULL,
    accepted INTEGER NOT NULL, rejects TEXT NOT NULL, admission TEXT NOT NULL, digest BLOB NOT NULL
) WITHOUT ROWID;
"""
#: Changes of sensors among the removed entries.
CHANGES_SCHEMA = (
    "CREATE TABLE IF NOT EXISTS sensor_change "
    "(sequence INTEGER PRIMARY KEY, payload TEXT NOT NULL, digest BLOB NOT NULL)"
)
#: The columns of an entry, in the order in which `JournalRows.verified` expects them.
ENTRY = (
    "SELECT kind, source, idempotency_key, payload, accepted, rejects, admission, digest, sequence "
    "FROM entry "
)

#: The columns of a removed entry, in the order that `JournalRows.verified_removed` expects.
REMOVED = (
    "SELECT idempotency_key, sequence, kind, accepted, rejects, admission, digest FROM removed "
)

Row = tuple[Any, ...]


class Head(NamedTuple):
    """The end of a journal: its last entry and the digest of it, and the rows so far."""

    sequence: int
    digest: bytes
    accepted: int
    rejected: int


class Base(NamedTuple):
    """The end of the removed part of a journal.

    Attributes
    ----------
    sequence, digest : int, bytes
        The last removed entry and its digest; 0 and the digest before the first entry without any.
    accepted, rejected : int
        Measurements and rejected rows up to it.
    keys : int
        Removed entries with a key.
    """

    sequence: int
    digest: bytes
    accepted: int
    rejected: int
    keys: int


class JournalRows:
    """Reads the tables of a journal through any connection.

    Every method raises `JournalError` for content that does not verify.

    Parameters
    ----------
    path : Path
        The file, for errors.
    fingerprint : str
        Fingerprint of the configuration in its header.
    version : int
        Version of the format in its header.
    """

    def __init__(self, path: Path, fingerprint: str, version: int = FORMAT_VERSION) -> None:
        self._path = path
        #: The digest before the first entry.
        self.origin = origin_digest(min(version, FORMAT_VERSION), fingerprint)

    def verified(self, previous: bytes, sequence: int, row: Row) -> StoredEntry:
        """Return an entry whose number and digest are those expected after the previous one."""
        return StoredEntry(sequence, self.intact(previous, sequence, row).entry(), row[7])

    def intact(self, previous: bytes, sequence: int, row: Row) -> Columns:
        """Return the columns of an entry, verified as `verified` does, without unpacking them."""
        columns = Columns(*row[:7])
        digest, found = row[7:]
        if found != sequence:
            raise self.damaged(sequence, f"found entry {found} in its place")
        try:
            intact = entry_digest(previous, sequence, columns) == digest
        except (AttributeError, TypeError, UnicodeError):
            # A column has a type other than the written one.
            intact = False
        if not intact:
            raise self.damaged(sequence, "the digest does not match the content")
        return columns

    def one(self, connection: sqlite3.Connection, sequence: int) -> StoredEntry:
        """Return a single entry, verified against the digest of the previous entry."""
        row = connection.execute(ENTRY + "WHERE sequence = ?", (sequence,)).fetchone()
        if row is None:
            raise self._absent(connection, sequence)
        return self.alone(connection, row)

    def alone(self, connection: sqlite3.Connection, row: Row) -> StoredEntry:
        """Return the entry of a row, verified against the digest of the previous entry."""
        sequence = row[8]
        if not isinstance(sequence, int):
            raise JournalError(f"{self._path}: expected a sequence number, found {sequence!r}")
        return self.verified(self.digest_of(connection, sequence - 1), sequence, row)

    def digest_of(self, connection: sqlite3.Connection, sequence: int) -> bytes:
        """Return the stored digest of an entry; of entry 0 that before the first one.

        Raises
        ------
        RemovedEntriesError
            It is before the last removed entry.
        JournalError
            It is missing.
        """
        if sequence == 0 or self.is_shortened(connection):
            base = self.base(connection)
            if sequence == base.sequence:
                return base.digest
        row = connection.execute(
            "SELECT digest FROM entry WHERE sequence = ?", (sequence,)
        ).fetchone()
        if row is None or not isinstance(row[0], bytes):
            raise self._absent(connection, sequence)
        return row[0]

    def is_shortened(self, connection: sqlite3.Connection) -> bool:
        """Return whether entries were removed."""
        rows = connection.execute("SELECT format_version FROM header").fetchall()
        return rows == [(SHORTENED_VERSION,)]

    def base(self, connection: sqlite3.Connection) -> Base:
        """Return the end of the removed part."""
        if not self.is_shortened(connection):
            return Base(0, self.origin, 0, 0, 0)
        rows = connection.execute(
            "SELECT sequence, digest, accepted, rejected, keys FROM base"
        ).fetchall()
        kinds = [int, bytes, int, int, int]
        if len(rows) != 1 or [type(value) for value in rows[0]] != kinds:
            raise JournalError(
                f"{self._path}: expected one record of the last removed entry, found {rows}"
            )
        return Base(*rows[0])

    def require(self, connection: sqlite3.Connection, after: int) -> Base:
        """Return the end of the removed part, and check that an entry is not before it."""
        base = self.base(connection)
        if after < base.sequence:
            raise self._removed(base)
        return base

    def removed(self, connection: sqlite3.Connection, key: str) -> StoredEntry | None:
        """Return what is left of a removed entry, without its measurements; None if it is none."""
        if not self.is_shortened(connection):
            return None
        row = connection.execute(REMOVED + "WHERE idempotency_key = ?", (key,)).fetchone()
        return None if row is None else self.verified_removed(row)

    def verified_removed(self, row: Row) -> StoredEntry:
        """Return what is left of a removed entry, verified by its digest."""
        key, sequence, kind, accepted, rejects, admission, digest = row
        columns = Columns(kind, "", key, b"", accepted, rejects, admission)
        try:
            intact = entry_digest(self.origin, sequence, columns) == digest
        except (AttributeError, TypeError, UnicodeError):
            # A column has a type other than the written one.
            intact = False
        if not intact:
            raise self.damaged(sequence, "the key does not match the digest")
        return StoredEntry(sequence, columns.entry(), digest)

    def removed_changes(self, connection: sqlite3.Connection) -> list[bytes]:
        """Return the changes of sensors among the removed entries, in their order."""
        if not _has_table(connection, "sensor_change"):
            return []
        found = connection.execute("SELECT * FROM sensor_change ORDER BY sequence").fetchall()
        for sequence, payload, digest in found:
            if mark_digest(sequence, str(payload)) != digest:
                raise self.damaged(sequence, "the sensor change does not match the digest")
        return [payload.encode() for _, payload, _ in found]

    def check_end(self, head: Head, sequence: int, digest: bytes) -> None:
        """Raise JournalError if the last entry read is not the one in the head."""
        if sequence < head.sequence:
            raise self.damaged(sequence + 1, "the entry is missing")
        if sequence > head.sequence or digest != head.digest:
            raise self.damaged(sequence, "not the last entry written")

    def check_counts(self, head: Head, accepted: int, rejected: int) -> None:
        """Raise JournalError if the rows of all entries are not those in the head."""
        if (accepted, rejected) != (head.accepted, head.rejected):
            raise self.damaged(head.sequence, "the counts do not match the entries")

    def head(self, connection: sqlite3.Connection) -> Head:
        """Return the end of the journal."""
        rows = connection.execute(
            "SELECT sequence, digest, accepted, rejected FROM head"
        ).fetchall()
        intact = len(rows) == 1 and [type(value) for value in rows[0]] == [int, bytes, int, int]
        if not intact:
            raise JournalError(f"{self._path}: expected one head row in the journal, found {rows}")
        return Head(*rows[0])

    def skipped(self, connection: sqlite3.Connection) -> dict[int, str]:
        """Return the entries that replays skip, with their reasons."""
        marks = connection.execute(
            "SELECT sequence, reason, digest FROM skipped ORDER BY sequence"
        ).fetchall()
        for sequence, reason, digest in marks:
            # A reason may have a type other than the written one.
            if not isinstance(reason, str) or mark_digest(sequence, reason) != digest:
                raise self.damaged(sequence, "the checksum does not match")
        return {sequence: reason for sequence, reason, _ in marks}

    def _absent(self, connection: sqlite3.Connection, sequence: int) -> JournalError:
        base = self.base(connection)
        if sequence <= base.sequence:
            return self._removed(base)
        return self.damaged(sequence, "the entry is missing")

    def _removed(self, base: Base) -> RemovedEntriesError:
        return RemovedEntriesError(
            f"{self._path}: the journal no longer starts with entry 1: entries up to "
            f"{base.sequence} are only in the archive, and no snapshot after them can be used; see "
            "the log, and restore the archive (docs/howto/backup.md#shorten-the-journal)"
        )

    def damaged(self, sequence: int, how: str) -> JournalError:
        """Return the error of a damaged entry."""
        return JournalError(f"{self._path}: entry {sequence} of the journal is damaged: {how}")


def fingerprint_of(connection: sqlite3.Connection, path: Path) -> str:
    """Return the fingerprint of the configuration that a journal was written with.

    Raises
    ------
    JournalError
        If it has not one header.
    ConfigurationError
        If it is of another format.
    """
    version, fingerprint = header_of(connection, path)
    if version == EARLIER_VERSION:
        raise ConfigurationError(
            f"{path}: expected a journal of format {FORMAT_VERSION}, was {version}; migrate it "
            "to a new state directory (multiradar migrate)"
        )
    return fingerprint


def description_of(connection: sqlite3.Connection) -> str:
    """Return the description of the configuration of a journal; empty if it has none."""
    if not _has_table(connection, "configuration"):
        return ""
    found = connection.execute("SELECT description FROM configuration").fetchone()
    return "" if found is None else str(found[0])


def _has_table(connection: sqlite3.Connection, name: str) -> bool:
    known = connection.execute("SELECT 1 FROM sqlite_master WHERE name = ?", (name,))
    return known.fetchone() is not None


def header_of(connection: sqlite3.Connection, path: Path) -> tuple[int, str]:
    """Return the version of the format of a journal that can be read, and its fingerprint.

    Raises
    ------
    JournalError, ConfigurationError
        As `fingerprint_of`.
    """
    rows = connection.execute("SELECT format_version, fingerprint FROM header").fetchall()
    if len(rows) != 1:
        raise JournalError(f"{path}: expected one header row in the journal, found {len(rows)}")
    version, fingerprint = rows[0]
    if version not in (EARLIER_VERSION, FORMAT_VERSION, SHORTENED_VERSION):
        raise ConfigurationError(
            f"{path}: expected a journal of format {FORMAT_VERSION}, was {version}; "
            "use the multiradar version that wrote it, or choose another journal"
        )
    if not isinstance(fingerprint, str):
        raise JournalError(f"{path}: expected a fingerprint in the header, found {fingerprint!r}")
    return version, fingerprint
