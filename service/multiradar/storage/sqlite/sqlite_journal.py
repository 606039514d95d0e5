"""The journal on disk: SQLite with a write-ahead log, synced at each transaction.

Its tables, and how reads of them are verified: `multiradar.storage.sqlite.journal_rows`. Before
SQLite opens a journal for writing, and changes its files, the write-ahead log, the pages and the
tip are verified: the last acknowledged entry must be there (`multiradar.storage.sqlite.tip`).
"""

import shutil
import sqlite3
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

from multiradar.errors import ConfigurationError, JournalError, JournalFullError
from multiradar.storage.entries import Entry, JournalCounts, Quarantined, StoredEntry
from multiradar.storage.journal import Space
from multiradar.storage.sqlite.chain import Columns, entry_digest, mark_digest
from multiradar.storage.sqlite.file_lock import FileLock, OpenFiles, unchanged
from multiradar.storage.sqlite.journal_rows import (
    ENTRY,
    FORMAT_VERSION,
    SCHEMA,
    Head,
    JournalRows,
    fingerprint_of,
)
from multiradar.storage.sqlite.sqlite_file import (
    SYNCHRONOUS_FULL,
    check_file_type,
    check_pages,
    file_size,
    journal_errors,
    open_database,
    set_pragma,
    snapshot,
    sync,
)
from multiradar.storage.sqlite.tip import ACCEPT, Tip, TipFile
from multiradar.storage.sqlite.write_ahead_log import log_damage
from multiradar_schemas.documents.contents import JOURNAL, content

#: Entries read in one transaction; rows are fetched one at a time.
_PIECE_ENTRIES = 256

# Ends of the names of its files.
_FILES = ("", "-wal", "-shm", "-tip")


class SqliteJournal:
    """A journal in an SQLite file, its write-ahead log and its tip; one process opens it at a time.

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
        journal, is damaged or incomplete, or is in use. Its content is as it was.
    ConfigurationError
        If the journal was created with another configuration or format version.
    """

    def __init__(
        self, path: Path, fingerprint: str, setting_of: Callable[[str], str] = lambda _: ""
    ) -> None:
        # SQLite has the log beside the file, not beside a link to it.
        path = path.resolve() if path.is_symlink() else path
        self._path = path
        self._setting_of = setting_of
        self._rows = JournalRows(path, fingerprint)
        self._log_path, self._tip_path = self._beside("-wal"), self._beside("-tip")
        self._writing = threading.Lock()
        self._reading = threading.Lock()
        self._broken: JournalError | None = None
        self._closed = False
        make_folder(path)
        with ExitStack() as opened:
            opened.callback(FileLock(path).release)
            # No command changes the log while it is verified.
            with journal_errors(self._path), unchanged(self._tip_path):
                self._open(fingerprint, opened)
            self._opened = opened.pop_all()

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

    def find(self, idempotency_key: str) -> StoredEntry | None:
        """Return the entry with this key, or None; of a removed one without its measurements."""
        # On the writer's connection, so that long reads do not block the writer.
        with journal_errors(self._path), self._writing:
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
        with journal_errors(self._path), self._reading:
            return self._rows.digest_of(self._reader, sequence)

    def skip(self, sequence: int, reason: str) -> None:
        """Mark an entry that the engine cannot process, so that replays skip it."""
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
            return self._rows.skipped(self._reader)

    def space(self) -> Space | None:
        """Return the space on its disk; None if the disk cannot be read."""
        try:
            disk = shutil.disk_usage(self._path.parent)
        except OSError:
            return None
        files = (self._beside(end) for end in _FILES)
        return Space(disk.free, disk.total, sum(file_size(file) for file in files))

    def close(self) -> None:
        """Close the journal; may be called twice."""
        with self._writing, self._reading:
            if self._closed:
                return
            self._closed = True
            self._opened.close()

    # ---------------------------------------------------------------- opening

    def _open(self, fingerprint: str, opened: ExitStack) -> None:
        check_file_type(self._path)
        tip = self._verified_tip(fingerprint)
        created = tip is None
        if tip is None:
            tip = Tip(0, self._rows.origin)
        elif self._log_path.exists():
            # After a kill it may have entries that were never synced.
            sync(self._log_path)
        self._tip = TipFile(self._tip_path, tip)
        opened.callback(self._tip.close)
        self._writer = opened.enter_context(closing(open_database(self._path, "rwc")))
        set_pragma(self._writer, self._path, "journal_mode", "WAL", "wal")
        set_pragma(self._writer, self._path, "synchronous", "FULL", SYNCHRONOUS_FULL)
        if created:
            self._create(fingerprint)
        self._rows.head(self._writer)
        # One that can be read but not written is reported here, not by the first measurement.
        self._writer.execute("UPDATE head SET sequence = sequence WHERE 0")
        self._reader = opened.enter_context(closing(open_database(self._path, "ro")))
        self._files = OpenFiles([self._path, self._log_path, self._tip_path])

    # The last entry of a journal that has all acknowledged ones; None for a new journal. It changes
    # no file: a reader does not trim the log.
    def _verified_tip(self, fingerprint: str) -> Tip | None:
        tip = Tip.read(self._tip_path)
        empty = not file_size(self._path)
        if empty and (file_size(self._log_path) or (tip and tip.sequence)):
            raise self._incomplete("it is missing or empty, but its other files are not")
        if empty:
            return None
        damage = None if tip and tip.accepts_any else log_damage(self._log_path)
        if damage is not None:
            raise self._incomplete(f"{self._log_path.name} is damaged: {damage}")
        # A kill at the first start may leave a change to be rolled back: the only one without log.
        mode = "rw" if self._beside("-journal").exists() else "ro"
        with closing(open_database(self._path, mode)) as connection:
            tables = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
            if tables:
                # First: journals of earlier versions have no tip.
                self._check_header(connection, fingerprint)
            if tip is None:
                raise self._incomplete(f"{self._tip_path.name} is missing")
            if tables:
                check_pages(connection, self._path)
                return self._check_tip(connection, tip)
        if tip.sequence:
            raise self._incomplete(
                f"{tip.sequence} entries were acknowledged, but it contains none"
            )
        return None

    def _check_tip(self, connection: sqlite3.Connection, tip: Tip) -> Tip:
        end = self._rows.head(connection).sequence
        if end < tip.sequence:
            raise self._incomplete(
                f"entry {end + 1} of the journal is missing: {tip.sequence} were acknowledged, "
                f"but it contains {end}"
            )
        if (
            tip.sequence
            # Removed entries were on disk: after a power failure the tip may be of one before.
            and tip.sequence >= self._rows.base(connection).sequence
            and self._rows.digest_of(connection, tip.sequence) != tip.digest
        ):
            raise self._incomplete(f"entry {tip.sequence} differs from the acknowledged entry")
        return Tip(end, self._rows.digest_of(connection, end))

    def _create(self, fingerprint: str) -> None:
        with self._transaction():
            for statement in SCHEMA.strip().split(";\n"):
                self._writer.execute(statement)
            self._writer.execute("INSERT INTO header VALUES (?, ?)", (FORMAT_VERSION, fingerprint))
            self._writer.execute("INSERT INTO head VALUES (0, ?, 0, 0)", (self._rows.origin,))

    def _check_header(self, connection: sqlite3.Connection, fingerprint: str) -> None:
        written_with = fingerprint_of(connection, self._path)
        if written_with != fingerprint:
            other = self._setting_of(written_with) or (
                "other sensors or tracking settings, or on a different kind of processor "
                f"(fingerprint {written_with[:12]}, now {fingerprint[:12]})"
            )
            raise ConfigurationError(
                f"{self._path}: the journal was created with {other}; start with those, or carry "
                "it over into a new state (multiradar migrate)"
            )

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

    def _insert(self, entries: Sequence[Entry]) -> Head:
        sequence, digest, accepted, rejected = self._rows.head(self._writer)
        for entry in entries:
            key = entry.idempotency_key
            if key is not None and self._rows.removed(self._writer, key) is not None:
                raise JournalError(f"{self._path}: the key {key!r} is that of a removed entry")
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

    def _beside(self, end: str) -> Path:
        return self._path.with_name(self._path.name + end)

    def _incomplete(self, how: str) -> JournalError:
        return JournalError(
            f"{self._path}: {how}; restore all files {self._path.name}* from one copy, or write "
            f'"{ACCEPT}" into {self._tip_path.name} to continue with what is left'
        )


def _numbered(stored: StoredEntry, first: int) -> list[Quarantined]:
    return [
        Quarantined(first + place, stored.sequence, stored.entry.source, row)
        for place, row in enumerate(stored.entry.rejects)
    ]


def make_folder(path: Path) -> None:
    """Create the folder of a journal, if it can have one.

    Parameters
    ----------
    path : Path
        The file of the journal.

    Raises
    ------
    JournalError
        The folder is a file, contains something else, or cannot be created.
    """
    folder = path.parent
    try:
        if folder.exists() and not folder.is_dir():
            msg = f"{folder}: is a file; choose a folder for the journal"
            raise JournalError(msg)
        found = None if path.exists() else content(folder)
        if found not in (None, JOURNAL):
            msg = (
                f"{folder}: expected a folder with a journal, was {found}; choose another "
                "folder, which need not exist (`replay` sends a recording to the service)"
            )
            raise JournalError(msg)
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        msg = (
            f"{folder}: cannot be created for the journal ({error.strerror}); choose another "
            "folder with --state"
        )
        raise JournalError(msg) from error
