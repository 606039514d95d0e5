"""The journal on disk: SQLite with a write-ahead log, synced at each transaction.

====================  ==========================================================================
Table                 Rows
====================  ==========================================================================
``header``            one: format version, fingerprint of the configuration
``head``              one: last entry, its digest, rows accepted and rejected so far
``entry``             one for each message or mark, chained by digests
``quarantine``        one for each entry with rejected rows: the number of its first rejected row
``skipped``           one for each entry that the engine cannot process
====================  ==========================================================================

Reads are verified: the digest of each entry is recomputed from the previous one, the numbers must
be complete, and the last entry must be the one in ``head``. The chain does not detect that a
journal was replaced by an older copy of itself.
"""

import shutil
import sqlite3
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from multiradar.errors import ConfigurationError, JournalError, JournalFullError
from multiradar.storage.chain import Columns, entry_digest, mark_digest, origin_digest
from multiradar.storage.entries import Entry, JournalCounts, Quarantined, StoredEntry
from multiradar.storage.file_lock import FileLock
from multiradar.storage.folders import JOURNAL, content
from multiradar.storage.journal import Space
from multiradar.storage.sqlite_file import (
    SYNCHRONOUS_FULL,
    check_file_type,
    file_size,
    journal_errors,
    open_database,
    set_pragma,
    snapshot,
)

FORMAT_VERSION = 1

#: Entries read in one transaction; rows are fetched one at a time.
_PIECE_ENTRIES = 256

# Ends of the names of its files.
_FILES = ("", "-wal", "-shm")

_SCHEMA = """
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
_ENTRY = (
    "SELECT kind, source, idempotency_key, payload, accepted, rejects, admission, digest, sequence "
    "FROM entry "
)


class _Head(NamedTuple):
    # The end of the journal.
    sequence: int
    digest: bytes
    accepted: int
    rejected: int


class SqliteJournal:
    """A journal in one SQLite file (and its write-ahead log); one process opens it at a time.

    Parameters
    ----------
    path : Path
        The file; created when absent, with its folder.
    fingerprint : str
        Fingerprint of the configuration that the output depends on.
    setting_of : callable, optional
        Returns the setting that differs in a journal with another fingerprint, such as
        "filter joint, not imm"; empty where it is unknown.

    Raises
    ------
    JournalError
        If the file cannot be opened, would be in the output folder of another command, is not a
        journal, is damaged, or is in use.
    ConfigurationError
        If the journal was created with another configuration or format version.
    """

    def __init__(
        self, path: Path, fingerprint: str, setting_of: Callable[[str], str] = lambda _: ""
    ) -> None:
        self._path = path
        self._setting_of = setting_of
        self._writing = threading.Lock()
        self._reading = threading.Lock()
        self._broken: JournalError | None = None
        self._closed = False
        try:
            if path.parent.exists() and not path.parent.is_dir():
                msg = f"{path.parent}: expected a folder for the journal, was a file"
                raise JournalError(msg)
            found = None if path.exists() else content(path.parent)
            if found not in (None, JOURNAL):
                msg = (
                    f"{path.parent}: expected the folder of a journal, was {found}; choose another "
                    "folder, which is created (`replay` sends a recording to the service)"
                )
                raise JournalError(msg)
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise JournalError(f"{path.parent}: {error.strerror}") from error
        self._file_lock = FileLock(path.with_name(path.name + ".lock"))
        try:
            with journal_errors(self._path):
                self._open(fingerprint)
        except BaseException:
            self._file_lock.release()
            raise

    def append(self, entries: Sequence[Entry]) -> list[int]:
        """Write entries in one transaction and return their sequence numbers, once on disk.

        Raises
        ------
        JournalFullError
            If the disk is full; nothing was written and the journal stays usable.
        JournalError
            If writing failed. The content on disk is unknown, and the journal accepts nothing until
            it is opened again.
        """
        with self._writing:
            if self._broken is not None:
                raise self._broken
            try:
                with journal_errors(self._path), self._transaction():
                    return self._insert(entries)
            except JournalFullError:
                raise
            except JournalError as error:
                self._broken = error
                raise

    def read(self, after: int) -> Iterator[StoredEntry]:
        """Yield the verified entries after a sequence number, in bounded pieces."""
        with journal_errors(self._path), closing(open_database(self._path, "ro")) as connection:
            previous = self._digest_of(connection, after)
            sequence = after
            while True:
                begin = sequence
                with snapshot(connection):
                    head = self._head(connection)
                    piece = connection.execute(
                        _ENTRY + "WHERE sequence > ? ORDER BY sequence LIMIT ?",
                        (sequence, _PIECE_ENTRIES),
                    )
                    for row in piece:
                        sequence += 1
                        stored = self._verified(previous, sequence, row)
                        previous = stored.digest
                        yield stored
                if sequence - begin < _PIECE_ENTRIES:
                    self._check_end(head, sequence, previous)
                if sequence == begin:
                    break

    def find(self, idempotency_key: str) -> StoredEntry | None:
        """Return the entry with this key, or None."""
        # On the writer's connection, so that long reads do not block the writer.
        with journal_errors(self._path), self._writing:
            row = self._writer.execute(
                _ENTRY + "WHERE idempotency_key = ?", (idempotency_key,)
            ).fetchone()
            return None if row is None else self._alone(self._writer, row)

    def quarantined(self, after: int, limit: int) -> list[Quarantined]:
        """Return at most `limit` rejected rows after a number in the quarantine."""
        with journal_errors(self._path), self._reading, snapshot(self._reader):
            total = self._head(self._reader).rejected
            begin = self._reader.execute(
                "SELECT max(first) FROM quarantine WHERE first <= ?", (after + 1,)
            ).fetchone()[0]
            places = self._reader.execute(
                "SELECT first, sequence FROM quarantine WHERE first >= ? ORDER BY first",
                (begin or 0,),
            )
            found: list[Quarantined] = []
            number = begin or 1
            for first, sequence in places:
                stored = self._entry(sequence)
                if first != number or not stored.entry.rejects:
                    raise self._damaged(
                        sequence, f"expected its rejected rows to start at {number}"
                    )
                found.extend(_numbered(stored, first))
                number = first + len(stored.entry.rejects)
                if number > after + limit:
                    break
            if number <= min(after + limit, total):
                raise JournalError(f"{self._path}: rejected row {number} is missing")
        return [one for one in found if one.number > after][:limit]

    def counts(self) -> JournalCounts:
        """Return the number of entries and measurements, and the state of the admission."""
        with journal_errors(self._path), self._reading:
            head = self._head(self._reader)
            admission = self._entry(head.sequence).entry.admission if head.sequence else ""
            return JournalCounts(head.sequence, head.accepted, head.rejected, admission)

    def skip(self, sequence: int, reason: str) -> None:
        """Mark an entry that the engine cannot process, so that replays skip it."""
        with self._writing, journal_errors(self._path), self._transaction():
            self._writer.execute(
                "INSERT OR REPLACE INTO skipped VALUES (?, ?, ?)",
                (sequence, reason, mark_digest(sequence, reason)),
            )

    def skipped(self) -> dict[int, str]:
        """Return the entries that replays skip, with their reasons."""
        with journal_errors(self._path), self._reading:
            marks = self._reader.execute(
                "SELECT sequence, reason, digest FROM skipped ORDER BY sequence"
            ).fetchall()
        for sequence, reason, digest in marks:
            if mark_digest(sequence, reason) != digest:
                raise self._damaged(sequence, "its mark does not verify")
        return {sequence: reason for sequence, reason, _ in marks}

    def space(self) -> Space | None:
        """Return the space on its disk; None if the disk cannot be read."""
        try:
            disk = shutil.disk_usage(self._path.parent)
        except OSError:
            return None
        files = (self._path.with_name(self._path.name + end) for end in _FILES)
        return Space(disk.free, disk.total, sum(file_size(file) for file in files))

    def close(self) -> None:
        """Close the journal; may be called twice."""
        with self._writing, self._reading:
            if self._closed:
                return
            self._closed = True
            try:
                self._reader.close()
                self._writer.close()
            finally:
                self._file_lock.release()

    # ---------------------------------------------------------------- opening

    def _open(self, fingerprint: str) -> None:
        check_file_type(self._path)
        self._writer = open_database(self._path, "rwc")
        try:
            set_pragma(self._writer, self._path, "journal_mode", "WAL", "wal")
            set_pragma(self._writer, self._path, "synchronous", "FULL", SYNCHRONOUS_FULL)
            if not self._writer.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
                self._create(fingerprint)
            self._check_header(fingerprint)
            self._reader = open_database(self._path, "ro")
        except BaseException:
            self._writer.close()
            raise

    def _create(self, fingerprint: str) -> None:
        with self._transaction():
            for statement in _SCHEMA.strip().split(";\n"):
                self._writer.execute(statement)
            self._writer.execute("INSERT INTO header VALUES (?, ?)", (FORMAT_VERSION, fingerprint))
            origin = origin_digest(FORMAT_VERSION, fingerprint)
            self._writer.execute("INSERT INTO head VALUES (0, ?, 0, 0)", (origin,))

    def _check_header(self, fingerprint: str) -> None:
        rows = self._writer.execute("SELECT format_version, fingerprint FROM header").fetchall()
        if len(rows) != 1:
            raise JournalError(f"{self._path}: expected a journal with one header, was {len(rows)}")
        version, written_with = rows[0]
        if version != FORMAT_VERSION:
            raise ConfigurationError(
                f"{self._path}: expected a journal of format {FORMAT_VERSION}, was {version}; "
                "use the version of the program that wrote it, or choose another journal"
            )
        if written_with != fingerprint:
            other = self._setting_of(written_with) or (
                "other sensors or tracking settings, or on another kind of processor (fingerprint "
                f"{written_with[:12]}, now {fingerprint[:12]})"
            )
            raise ConfigurationError(
                f"{self._path}: the journal was created with {other}; start with those, or choose "
                "another journal (--state) and replay the measurements into it"
            )
        self._origin = origin_digest(version, written_with)

    # ---------------------------------------------------------------- writing

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self._writer.execute("BEGIN IMMEDIATE")
        try:
            yield
            self._writer.execute("COMMIT")
        except BaseException:
            if self._writer.in_transaction:
                self._writer.execute("ROLLBACK")
            raise

    def _insert(self, entries: Sequence[Entry]) -> list[int]:
        sequence, digest, accepted, rejected = self._head(self._writer)
        first = sequence + 1
        for entry in entries:
            sequence += 1
            columns = Columns.of(entry)
            digest = entry_digest(digest, sequence, columns)
            self._writer.execute(
                "INSERT INTO entry (sequence, kind, source, idempotency_key, payload, accepted, "
                "rejects, admission, digest) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (sequence, *columns, digest),
            )
            if entry.rejects:
                self._writer.execute(
                    "INSERT INTO quarantine VALUES (?, ?)", (rejected + 1, sequence)
                )
            accepted += entry.accepted
            rejected += len(entry.rejects)
        self._writer.execute(
            "UPDATE head SET sequence = ?, digest = ?, accepted = ?, rejected = ?",
            (sequence, digest, accepted, rejected),
        )
        return list(range(first, sequence + 1))

    # ---------------------------------------------------------------- verifying

    def _verified(self, previous: bytes, sequence: int, row: tuple[Any, ...]) -> StoredEntry:
        columns = Columns(*row[:7])
        digest, found = row[7:]
        if found != sequence:
            raise self._damaged(sequence, f"expected this entry, found {found}")
        try:
            intact = entry_digest(previous, sequence, columns) == digest
        except (AttributeError, TypeError, UnicodeError):
            # A column has a type other than the written one.
            intact = False
        if not intact:
            raise self._damaged(sequence, "its digest does not match its content")
        return StoredEntry(sequence, columns.entry(), digest)

    def _entry(self, sequence: int) -> StoredEntry:
        row = self._reader.execute(_ENTRY + "WHERE sequence = ?", (sequence,)).fetchone()
        if row is None:
            raise self._damaged(sequence, "the entry is missing")
        return self._alone(self._reader, row)

    def _check_end(self, head: _Head, sequence: int, digest: bytes) -> None:
        if sequence < head.sequence:
            raise self._damaged(sequence + 1, "the entry is missing")
        if sequence > head.sequence or digest != head.digest:
            raise self._damaged(sequence, "it is not the last entry written")

    # A single entry, verified against the digest of the previous entry.
    def _alone(self, connection: sqlite3.Connection, row: tuple[Any, ...]) -> StoredEntry:
        sequence = row[8]
        if not isinstance(sequence, int):
            raise JournalError(f"{self._path}: expected a sequence number, was {sequence!r}")
        return self._verified(self._digest_of(connection, sequence - 1), sequence, row)

    def _digest_of(self, connection: sqlite3.Connection, sequence: int) -> bytes:
        if sequence == 0:
            return self._origin
        row = connection.execute(
            "SELECT digest FROM entry WHERE sequence = ?", (sequence,)
        ).fetchone()
        if row is None or not isinstance(row[0], bytes):
            raise self._damaged(sequence, "the entry is missing")
        return row[0]

    def _head(self, connection: sqlite3.Connection) -> _Head:
        rows = connection.execute(
            "SELECT sequence, digest, accepted, rejected FROM head"
        ).fetchall()
        intact = len(rows) == 1 and [type(value) for value in rows[0]] == [int, bytes, int, int]
        if not intact:
            raise JournalError(f"{self._path}: expected a journal with one head, was {rows}")
        return _Head(*rows[0])

    def _damaged(self, sequence: int, how: str) -> JournalError:
        return JournalError(f"{self._path}: entry {sequence} of the journal is damaged: {how}")


def _numbered(stored: StoredEntry, first: int) -> list[Quarantined]:
    return [
        Quarantined(first + place, stored.sequence, stored.entry.source, row)
        for place, row in enumerate(stored.entry.rejects)
    ]
