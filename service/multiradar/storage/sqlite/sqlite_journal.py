"""The journal on disk: SQLite with a write-ahead log, synced at each transaction.

Its tables, and how reads of them are verified: `multiradar.storage.sqlite.journal_rows`. Before
SQLite opens a journal for writing, and changes its files, the write-ahead log, the pages and the
tip are verified: the last acknowledged entry must be there (`multiradar.storage.sqlite.tip`).

Two services never write. The file is locked by the one that does; should the file system lose the
lock, each opening for writing also has a number, in the header of the database (`user_version`),
which each transaction compares: a service that finds a later one writes no more.
"""

import shutil
import sqlite3
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path

from multiradar.errors import JournalBusyError, JournalError, JournalFullError
from multiradar.storage.entries import Entry, JournalCounts, Quarantined, StoredEntry
from multiradar.storage.journal import Space
from multiradar.storage.sqlite.chain import Columns, entry_digest, mark_digest
from multiradar.storage.sqlite.file_lock import FileLock, OpenFiles, unchanged
from multiradar.storage.sqlite.journal_rows import (
    DESCRIPTION_SCHEMA,
    ENTRY,
    FORMAT_VERSION,
    SCHEMA,
    Head,
    JournalRows,
    description_of,
)
from multiradar.storage.sqlite.opening import Verification, beside, make_folder
from multiradar.storage.sqlite.sqlite_file import (
    SYNCHRONOUS_FULL,
    check_pages,
    file_errors,
    file_size,
    journal_errors,
    open_database,
    set_pragma,
    snapshot,
    write_again,
)
from multiradar.storage.sqlite.tip import Tip, TipFile

#: Entries read in one transaction; rows are fetched one at a time.
_PIECE_ENTRIES = 256

# Ends of the names of its files.
_FILES = ("", "-wal", "-shm", "-tip")

_BUSY = (
    "another process, such as `multiradar shorten`, has locked the journal; nothing was written, "
    "retry later"
)

# Another service creates the journal in less than a second: 10 s in all.
_TRIES, _TRY_S = 200, 0.05


class SqliteJournal:
    """A journal in an SQLite file, its write-ahead log and its tip; one process opens it at a time.

    Parameters
    ----------
    path : Path
        The file; created when absent, with its folder.
    fingerprint : str
        Fingerprint of the configuration that the output depends on.
    description : str
        What the fingerprint is made of, for the error about another one.
    differences : callable, optional
        Returns how two descriptions differ, in words; empty where that is unknown.
    standby : bool
        Whether to follow a journal that another service writes, rather than raise an error; see
        `following` and `lead`.

    Raises
    ------
    JournalError
        If the file cannot be opened, would be in the output folder of another command, is not a
        journal, is damaged or incomplete, or is in use. Its content is as it was.
    ConfigurationError
        If the journal was created with another configuration or format version.
    """

    def __init__(
        self, path: Path, fingerprint: str, description: str = "",
        differences: Callable[[str, str], str] = lambda _before, _now: "", *, standby: bool = False,
    ) -> None:  # fmt: skip
        # SQLite has the log beside the file, not beside a link to it.
        path = path.resolve() if path.is_symlink() else path
        self._path = path
        self._fingerprint = fingerprint
        self._rows = JournalRows(path, fingerprint)
        self._description = description
        given = (path, self._rows, fingerprint, description, differences)
        self._verification = Verification(*given)
        self._log_path, self._tip_path = beside(path, "-wal"), beside(path, "-tip")
        self._writing = threading.Lock()
        self._reading = threading.Lock()
        self._broken: JournalError | None = None
        self._verified: sqlite3.Connection | None = None
        self._closed = False
        self._marks: dict[int, str] = {}
        #: Whether another service writes it, and this one only reads.
        self.following = False
        make_folder(path)
        with ExitStack() as opened:
            self._lock = FileLock(path, wait=standby)
            opened.callback(self._lock.release)
            self.following = standby and not self._lock.acquire()
            if self.following:
                self._follow(opened)
            else:
                self._open(opened)
            self._opened = opened.pop_all()

    def lead(self) -> bool:
        """Open it for writing if no other service does any more; return whether that is so.

        All entries of the other service are read from then on. Marks of `skip` are written.

        Raises
        ------
        JournalError
            If it is damaged or incomplete, or another file is in its place.
        """
        with journal_errors(self._path):
            self._files.check()
        if not self._lock.acquire():
            return False
        with self._writing, self._reading:
            self._open(self._opened)
            self.following = False
        written = self.skipped()
        for sequence, reason in self._marks.items():
            if sequence not in written:
                self.skip(sequence, reason)
        return True

    def acknowledged(self) -> int | None:
        """Return the last entry that another service has acknowledged; None while it is written."""
        with suppress(JournalError):
            tip = Tip.read(self._tip_path)
            return None if tip is None else tip.sequence
        return None

    def append(self, entries: Sequence[Entry]) -> list[int]:
        """Write entries in one transaction and return their sequence numbers, once on disk.

        Raises
        ------
        JournalFullError
            If the disk is full; nothing was written and the journal stays usable.
        JournalBusyError
            If another process has had it locked for 10 s; as above.
        JournalError
            If writing failed. The content on disk is unknown, and the journal accepts nothing until
            it is opened again.
        """
        with self._writing:
            if self._broken is not None:
                raise self._broken
            if self.following:
                raise JournalError(f"{self._path}: another service is writing this journal")
            try:
                with journal_errors(self._path):
                    with self._transaction():
                        head = self._insert(entries)
                    self._files.check()
                    self._tip.write(Tip(head.sequence, head.digest))
            except JournalFullError:
                raise
            except JournalError as error:
                self._broken = error
                raise
            return list(range(head.sequence - len(entries) + 1, head.sequence + 1))

    def read(self, after: int) -> Iterator[StoredEntry]:
        """Yield the verified entries after a sequence number, in bounded pieces."""
        with journal_errors(self._path), closing(open_database(self._path, "ro")) as connection:
            with snapshot(connection):
                base = self._rows.require(connection, after)
                previous = self._rows.digest_of(connection, after)
            sequence = after
            accepted, rejected = base.accepted, base.rejected
            while True:
                begin = sequence
                with snapshot(connection):
                    # A slow reader may be overtaken.
                    self._rows.require(connection, sequence)
                    head = self._rows.head(connection)
                    piece = connection.execute(
                        ENTRY + "WHERE sequence > ? ORDER BY sequence LIMIT ?",
                        (sequence, _PIECE_ENTRIES),
                    )
                    for row in piece:
                        sequence += 1
                        stored = self._rows.verified(previous, sequence, row)
                        previous = stored.digest
                        accepted += stored.entry.accepted
                        rejected += len(stored.entry.rejects)
                        yield stored
                if sequence - begin < _PIECE_ENTRIES:
                    self._rows.check_end(head, sequence, previous)
                    if after == base.sequence:
                        self._rows.check_counts(head, accepted, rejected)
                if sequence == begin:
                    break

    def verify_pages(self) -> None:
        """Verify the pages of the file, unless that was done when it was opened.

        It takes seconds for each 10 GB, and raises `JournalError` for damage.
        """
        if self._verification.pages_verified:
            return
        with journal_errors(self._path), closing(open_database(self._path, "ro")) as connection:
            self._verified = connection
            check_pages(connection, self._path)
        self._verification.pages_verified = True

    def stop_verifying(self) -> None:
        """Have `verify_pages` in another thread end, with an error."""
        with suppress(sqlite3.ProgrammingError):  # it is closed
            if self._verified is not None:
                self._verified.interrupt()

    def find(self, idempotency_key: str) -> StoredEntry | None:
        """Return the entry with this key, or None; of a removed one without its measurements."""
        # On the writer's connection, so that long reads do not block the writer, and in one
        # transaction, because a command may remove the entry before it meanwhile.
        with journal_errors(self._path), self._writing, snapshot(self._writer):
            row = self._writer.execute(
                ENTRY + "WHERE idempotency_key = ?", (idempotency_key,)
            ).fetchone()
            if row is None:
                return self._rows.removed(self._writer, idempotency_key)
            return self._rows.alone(self._writer, row)

    def quarantined(self, after: int, limit: int) -> list[Quarantined]:
        """Return at most `limit` rejected rows after a number in the quarantine."""
        with journal_errors(self._path), self._reading, snapshot(self._reader):
            total = self._rows.head(self._reader).rejected
            removed = self._rows.base(self._reader).rejected
            after = max(after, removed)
            begin = self._reader.execute(
                "SELECT max(first) FROM quarantine WHERE first <= ?", (after + 1,)
            ).fetchone()[0]
            places = self._reader.execute(
                "SELECT first, sequence FROM quarantine WHERE first >= ? ORDER BY first",
                (begin or 0,),
            )
            found: list[Quarantined] = []
            number = begin or removed + 1
            for first, sequence in places:
                stored = self._rows.one(self._reader, sequence)
                if first != number or not stored.entry.rejects:
                    raise self._rows.damaged(
                        sequence, f"expected rejected rows starting at number {number}"
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
        with journal_errors(self._path), self._reading, snapshot(self._reader):
            head = self._rows.head(self._reader)
            admission = (
                self._rows.one(self._reader, head.sequence).entry.admission if head.sequence else ""
            )
            return JournalCounts(head.sequence, head.accepted, head.rejected, admission)

    def removed_until(self) -> int:
        """Return the last entry that was removed, whose successor is the first; 0: none."""
        with journal_errors(self._path), self._reading:
            return self._rows.base(self._reader).sequence

    def digest(self, sequence: int) -> bytes:
        """Return the digest of an entry, which covers all before it."""
        with journal_errors(self._path), self._reading, snapshot(self._reader):
            return self._rows.digest_of(self._reader, sequence)

    def skip(self, sequence: int, reason: str) -> None:
        """Mark an entry that the engine cannot process, so that replays skip it."""
        if self.following:
            self._marks[sequence] = reason
            return
        with self._writing, journal_errors(self._path):
            with self._transaction():
                self._writer.execute(
                    "INSERT OR REPLACE INTO skipped VALUES (?, ?, ?)",
                    (sequence, reason, mark_digest(sequence, reason)),
                )
            self._files.check()

    def skipped(self) -> dict[int, str]:
        """Return the entries that replays skip, with their reasons."""
        with journal_errors(self._path), self._reading:
            marks = self._rows.skipped(self._reader)
        return {**self._marks, **marks} if self.following else marks

    def space(self) -> Space | None:
        """Return the space on its disk; None if the disk cannot be read."""
        try:
            disk = shutil.disk_usage(self._path.parent)
        except OSError:
            return None
        files = (beside(self._path, end) for end in _FILES)
        return Space(disk.free, disk.total, sum(file_size(file) for file in files))

    def close(self) -> None:
        """Close the journal; may be called twice."""
        with self._writing, self._reading:
            if self._closed:
                return
            self._closed = True
            self._opened.close()

    # ---------------------------------------------------------------- opening

    def _open(self, opened: ExitStack) -> None:
        # No command changes the log while it is verified.
        with journal_errors(self._path), unchanged(self._tip_path):
            tip = self._verification.tip()
            created = tip is None
            if tip is None:
                tip = Tip(0, self._rows.origin)
            elif self._log_path.exists():
                # After a kill it may have entries that were never synced, or whose sync failed.
                with file_errors(self._log_path):
                    write_again(self._log_path)
            self._tip = TipFile(self._tip_path, tip)
            opened.callback(self._tip.close)
            self._writer = opened.enter_context(closing(open_database(self._path, "rwc")))
            set_pragma(self._writer, self._path, "journal_mode", "WAL", "wal")
            set_pragma(self._writer, self._path, "synchronous", "FULL", SYNCHRONOUS_FULL)
            if created:
                self._create()
            self._rows.head(self._writer)
            # One that can be read but not written is reported here, not by the first measurement.
            self._writer.execute("UPDATE head SET sequence = sequence WHERE 0")
            self._number_opening()
            if not self.following:
                self._reader = opened.enter_context(closing(open_database(self._path, "ro")))
            self._files = OpenFiles([beside(self._path, end) for end in _FILES])

    def _follow(self, opened: ExitStack) -> None:
        with journal_errors(self._path):
            for left in reversed(range(_TRIES)):
                if self._verification.followed():
                    break
                if not left:
                    raise JournalError(
                        f"{self._path}: journal not yet created by the service; start the service "
                        "first"
                    )
                threading.Event().wait(_TRY_S)
            self._reader = opened.enter_context(closing(open_database(self._path, "ro")))
            self._files = OpenFiles([self._path, self._tip_path])

    def _create(self) -> None:
        with self._written():
            for statement in SCHEMA.strip().split(";\n"):
                self._writer.execute(statement)
            header = (FORMAT_VERSION, self._fingerprint)
            self._writer.execute("INSERT INTO header VALUES (?, ?)", header)
            self._writer.execute("INSERT INTO head VALUES (0, ?, 0, 0)", (self._rows.origin,))

    def _number_opening(self) -> None:
        # On a full disk the lock of the file must do.
        with suppress(JournalFullError), journal_errors(self._path), self._written():
            self._writer.execute(f"PRAGMA user_version = {self._opening() + 1}")
            if self._description and self._description != description_of(self._writer):
                self._writer.execute(DESCRIPTION_SCHEMA)
                self._writer.execute("DELETE FROM configuration")
                self._writer.execute("INSERT INTO configuration VALUES (?)", (self._description,))
        self._number = self._opening()

    def _opening(self) -> int:
        number: int = self._writer.execute("PRAGMA user_version").fetchone()[0]
        return number

    # ---------------------------------------------------------------- writing

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        with self._written():
            if self._opening() != self._number:
                raise JournalError(
                    f"{self._path}: another service has opened this journal for writing; this "
                    "service no longer writes to it"
                )
            yield

    @contextmanager
    def _written(self) -> Iterator[None]:
        try:
            self._writer.execute("BEGIN IMMEDIATE")
        except sqlite3.OperationalError as error:
            if error.sqlite_errorname.startswith("SQLITE_BUSY"):
                raise JournalBusyError(_BUSY) from error
            raise
        try:
            yield
            self._writer.execute("COMMIT")
        except BaseException:
            if self._writer.in_transaction:
                self._writer.execute("ROLLBACK")
            raise

    def _insert(self, entries: Sequence[Entry]) -> Head:
        sequence, digest, accepted, rejected = self._rows.head(self._writer)
        for entry in entries:
            key = entry.idempotency_key
            if key is not None and self._rows.removed(self._writer, key) is not None:
                raise JournalError(f"{self._path}: the key {key!r} belongs to a removed entry")
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
        return Head(sequence, digest, accepted, rejected)


def _numbered(stored: StoredEntry, first: int) -> list[Quarantined]:
    return [
        Quarantined(first + place, stored.sequence, stored.entry.source, row)
        for place, row in enumerate(stored.entry.rejects)
    ]
