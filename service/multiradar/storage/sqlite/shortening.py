"""Removal of the first entries of a journal, which are in a verified archive; a service may run.

Each transaction removes some entries and notes the last of them with its digest (``base``), from
which the rest is verified. So at every step, after a kill or a power failure too, the journal
either has an entry or has noted that it was removed. Pages that become free are used again by the
next entries; the file does not shrink.
"""

import sqlite3
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import NamedTuple

from multiradar.errors import JournalError
from multiradar.storage.entries import EntryKind
from multiradar.storage.snapshots import Position
from multiradar.storage.sqlite.chain import (
    Columns,
    entry_digest,
    mark_digest,
    rejects_count,
)
from multiradar.storage.sqlite.file_lock import unchanged
from multiradar.storage.sqlite.journal_rows import (
    CHANGES_SCHEMA,
    ENTRY,
    SHORTENED_SCHEMA,
    SHORTENED_VERSION,
    Base,
    JournalRows,
    fingerprint_of,
)
from multiradar.storage.sqlite.opening import (
    check_acknowledged,
    open_for_reading,
    require_header,
)
from multiradar.storage.sqlite.sqlite_file import (
    SYNCHRONOUS_FULL,
    check_file_type,
    journal_errors,
    open_database,
    set_pragma,
    snapshot,
)

#: Entries, and octets of their columns, that one transaction removes at most (but one entry): the
#: writer of a running service waits so long, less than 0.5 s.
ENTRIES_MAX, OCTETS_MAX = 256, 4 << 20
#: Between two transactions, s: a service that starts tries every 50 ms to open the journal, and the
#: writer of a running one at least every 100 ms to begin a transaction.
PAUSE_S = 0.12


class Extent(NamedTuple):
    """What a journal has.

    Attributes
    ----------
    base : Base
        The end of the removed part.
    last : int
        The last entry.
    first_admission, admission : str
        State of the admission after its first and its last entry; empty without entries.
    used_octets : int
        Octets of its file that are in use.
    """

    base: Base
    last: int
    first_admission: str
    admission: str
    used_octets: int


def extent_of(path: Path) -> Extent:
    """Return what a journal has, which may be in use; raises JournalError, ConfigurationError."""
    require_header(path)
    check_file_type(path)
    with (
        journal_errors(path),
        closing(open_for_reading(path)) as connection,
        snapshot(connection),
    ):
        rows = JournalRows(path, fingerprint_of(connection, path))
        last = rows.head(connection).sequence
        pages, free, octets = (
            int(connection.execute(f"PRAGMA {name}").fetchone()[0])
            for name in ("page_count", "freelist_count", "page_size")
        )
        base = rows.base(connection)
        first, admission = (
            rows.one(connection, one).entry.admission if last else ""
            for one in (base.sequence + 1, last)
        )
        return Extent(base, last, first, admission, (pages - free) * octets)


def digests_of(path: Path, sequences: list[int]) -> dict[int, bytes]:
    """Return the digests of those entries that a journal has; raises as `extent_of`."""
    found = {}
    with (
        journal_errors(path),
        closing(open_for_reading(path)) as connection,
        snapshot(connection),
    ):
        rows = JournalRows(path, fingerprint_of(connection, path))
        base, head = rows.base(connection), rows.head(connection)
        for one in sequences:
            if base.sequence <= one <= head.sequence:
                found[one] = rows.digest_of(connection, one)
    return found


def marks_of(path: Path) -> dict[int, str]:
    """Return the entries of a journal that replays skip, with their reasons; raises as above."""
    with journal_errors(path), closing(open_for_reading(path)) as connection:
        return JournalRows(path, fingerprint_of(connection, path)).skipped(connection)


def remove_until(path: Path, until: Position) -> None:
    """Remove the entries of a journal up to one; those that are removed already do not matter.

    Parameters
    ----------
    path : Path
        The database file of the journal.
    until : Position
        The last entry to remove, with the digest that it has in a verified archive. It is not the
        last entry of the journal.

    Raises
    ------
    JournalError
        The entry is another one, an entry before it or the log is damaged, an acknowledged entry is
        missing, or the journal cannot be written.
    """
    tip = path.with_name(f"{path.name}-tip")
    removed = 0
    # Without a service, the log is removed when the database is closed, and all behind damage too.
    with journal_errors(path):
        check_acknowledged(path)
    while removed < until.sequence:
        if removed:
            threading.Event().wait(PAUSE_S)
        # A service that starts meanwhile verifies the log, which is closed here, too.
        with (
            journal_errors(path),
            unchanged(tip),
            closing(open_database(path, "rw")) as connection,
        ):
            set_pragma(connection, path, "synchronous", "FULL", SYNCHRONOUS_FULL)
            rows = JournalRows(path, fingerprint_of(connection, path))
            with _transaction(connection):
                removed = _remove_some(connection, rows, path, until)


def _remove_some(
    connection: sqlite3.Connection, rows: JournalRows, path: Path, until: Position
) -> int:
    base = rows.base(connection)
    if base.sequence >= until.sequence:
        return base.sequence
    if until.sequence >= rows.head(connection).sequence:
        raise JournalError(
            f"{path}: entry {until.sequence} is the last entry and cannot be removed"
        )
    if rows.digest_of(connection, until.sequence) != until.digest:
        raise JournalError(
            f"{path}: entry {until.sequence} does not match the archive; choose the archive of "
            f"this journal"
        )
    if not rows.is_shortened(connection):
        for statement in SHORTENED_SCHEMA.strip().split(";\n"):
            connection.execute(statement)
        connection.execute("INSERT INTO base VALUES (0, ?, 0, 0, 0)", (rows.origin,))
        connection.execute("UPDATE header SET format_version = ?", (SHORTENED_VERSION,))
    connection.execute(CHANGES_SCHEMA)
    keys = base.keys
    for sequence, digest, entry in _first(connection, rows, base, until):
        base = Base(
            sequence, digest, base.accepted + entry.accepted,
            base.rejected + rejects_count(entry.rejects), keys,
        )  # fmt: skip
        if entry.idempotency_key is not None:
            keys += 1
            _note_key(connection, rows, sequence, entry)
        _note_change(connection, sequence, entry)
    connection.execute("DELETE FROM entry WHERE sequence <= ?", (base.sequence,))
    connection.execute("DELETE FROM quarantine WHERE sequence <= ?", (base.sequence,))
    connection.execute(
        "UPDATE base SET sequence = ?, digest = ?, accepted = ?, rejected = ?, keys = ?",
        base._replace(keys=keys),
    )
    return base.sequence


# The first entries, as many as one transaction removes. Their rejected rows stay packed: those of
# one message may take 1 s to unpack.
def _first(
    connection: sqlite3.Connection, rows: JournalRows, base: Base, until: Position
) -> Iterator[tuple[int, bytes, Columns]]:
    octets, digest, sequence = 0, base.digest, base.sequence
    limited = ENTRY + "WHERE sequence > ? AND sequence <= ? ORDER BY sequence LIMIT ?"
    for row in connection.execute(limited, (base.sequence, until.sequence, ENTRIES_MAX)):
        sequence += 1
        entry, digest = rows.intact(digest, sequence, row), row[7]
        yield sequence, digest, entry
        octets += entry.octets
        if octets >= OCTETS_MAX:
            return
    if sequence == base.sequence:
        raise rows.damaged(sequence + 1, "the entry is missing")


# What is needed to answer a message that is sent again.
def _note_key(
    connection: sqlite3.Connection, rows: JournalRows, sequence: int, entry: Columns
) -> None:
    admission = entry.admission if entry.kind == EntryKind.CLOCK else ""
    kept = entry._replace(source="", payload=b"", admission=admission)
    digest = entry_digest(rows.origin, sequence, kept)
    connection.execute(
        "INSERT INTO removed VALUES (?, ?, ?, ?, ?, ?, ?)",
        (kept.idempotency_key, sequence, kept.kind, kept.accepted, kept.rejects,
         kept.admission, digest),
    )  # fmt: skip


# What a migration applies before the first entry.
def _note_change(connection: sqlite3.Connection, sequence: int, entry: Columns) -> None:
    if entry.kind == EntryKind.SENSOR:
        change = entry.payload.decode()
        given = (sequence, change, mark_digest(sequence, change))
        connection.execute("INSERT INTO sensor_change VALUES (?, ?, ?)", given)


@contextmanager
def _transaction(connection: sqlite3.Connection) -> Iterator[None]:
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise
