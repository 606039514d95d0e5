"""Verification of a journal with its snapshots: everything that is damaged is named.

It changes no file, and a service may use the journal meanwhile.
"""

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from multiradar.errors import JournalError, SnapshotError
from multiradar.storage.snapshots import KEPT, Position, SnapshotFolder
from multiradar.storage.sqlite.journal_rows import (
    ENTRY,
    REMOVED,
    Base,
    Head,
    JournalRows,
    Row,
    fingerprint_of,
)
from multiradar.storage.sqlite.opening import require_journal
from multiradar.storage.sqlite.sqlite_file import (
    check_pages,
    journal_errors,
    open_database,
    reading_mode,
    snapshot,
)
from multiradar.storage.sqlite.tip import Tip
from multiradar.storage.sqlite.write_ahead_log import log_damage

#: Damaged entries that are named; further ones are counted.
NAMED_MAX = 20
#: Entries from one call of `on_progress` to the next.
_STEP_ENTRIES = 256

#: Called with the entries verified so far, and those of the journal.
Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Verification:
    """What a verification found.

    Attributes
    ----------
    entries, accepted, rejected : int
        Entries of the journal, and the measurements and rejected rows in them; with removed ones.
    fingerprint : str
        Fingerprint of the configuration that it was written with; empty where it is unreadable.
    digest : str
        Digest of the last entry, which covers all before it, hexadecimal.
    snapshots : int
        Sound snapshots.
    damage : tuple of str
        A sentence for each damaged file or entry, with its place.
    first : int
        The first entry that the journal has; above 1 in a shortened one.
    """

    entries: int
    accepted: int
    rejected: int
    fingerprint: str
    digest: str
    snapshots: int
    damage: tuple[str, ...]
    first: int = 1


def verify_journal(path: Path, on_progress: Progress = lambda _done, _total: None) -> Verification:
    """Verify a journal: its log, pages, tip, every entry with its digest, and its snapshots.

    Parameters
    ----------
    path : Path
        The database file of the journal.
    on_progress : callable
        Called with the number of verified entries and that of all.

    Returns
    -------
    Verification
        What was found.

    Raises
    ------
    InputError
        There is no such journal.
    JournalError
        It is not a journal.
    ConfigurationError
        It is of another format.
    """
    path = path.resolve() if path.is_symlink() else path
    require_journal(path)
    mode = reading_mode(path)
    found = _Check(path, on_progress, mode).run()
    # A service may have started meanwhile.
    if found.damage and mode != reading_mode(path):
        return _Check(path, on_progress, "ro").run()
    return found


class _Found(NamedTuple):
    # What the entries contain.
    sequence: int
    digest: bytes
    accepted: int
    rejected: int
    intact: bool


class _Check:
    def __init__(self, path: Path, on_progress: Progress, mode: str) -> None:
        self._path, self._mode = path, mode
        self._on_progress = on_progress
        self._damage: list[str] = []
        self._unnamed = 0

    def run(self) -> Verification:
        # Before the transaction: a running service adds to both only what it has journalled.
        tip = self._read_tip()
        self._check_log()
        positions = self._read_snapshots()
        head, fingerprint, first = Head(0, b"", 0, 0), "", 1
        with (
            self._noting(),
            closing(open_database(self._path, self._mode)) as connection,
            snapshot(connection),
        ):
            with self._noting():
                check_pages(connection, self._path)
            fingerprint = fingerprint_of(connection, self._path)
            rows = JournalRows(self._path, fingerprint)
            head = rows.head(connection)
            base = rows.base(connection)
            first = base.sequence + 1
            self._check_entries(connection, rows, head, base)
            with self._noting():
                rows.skipped(connection)
            self._check_removed(connection, rows, base)
            if tip is not None:
                self._check_tip(connection, rows, head, tip)
            for name, position in positions.items():
                self._check_position(connection, rows, head, name, position)
            if base.sequence and not any(
                one.sequence >= base.sequence for one in positions.values()
            ):
                self._damage.append(
                    f"{self._path}: entries up to {base.sequence} are only in the archive, and "
                    "no intact snapshot follows them: a service cannot start; restore the archive"
                )
        if self._unnamed:
            self._damage.append(f"{self._path}: {self._unnamed} further entries are damaged")
        return Verification(
            head.sequence, head.accepted, head.rejected, fingerprint, head.digest.hex(),
            len(positions), tuple(self._damage), first,
        )  # fmt: skip

    @contextmanager
    def _noting(self) -> Iterator[None]:
        try:
            with journal_errors(self._path):
                yield
        except JournalError as error:
            self._damage.append(str(error))

    # ---------------------------------------------------------------- files

    def _read_tip(self) -> Tip | None:
        path = self._path.with_name(f"{self._path.name}-tip")
        try:
            tip = Tip.read(path)
        except JournalError as error:
            self._damage.append(str(error))
            return None
        if tip is None:
            self._damage.append(f"{path}: missing or empty")
        return tip

    def _check_log(self) -> None:
        path = self._path.with_name(f"{self._path.name}-wal")
        found = log_damage(path)
        if found is not None:
            self._damage.append(f"{path}: {found}")

    def _read_snapshots(self) -> dict[str, Position]:
        folder = SnapshotFolder(self._path)
        positions = {}
        for path in folder.files():
            try:
                found = folder.read(path)
                for files in found.tables.values():
                    folder.read_rows(files)
            except SnapshotError as error:
                # A running service removes those that it no longer needs.
                if path in folder.files()[:KEPT]:
                    self._damage.append(f"{folder.path}: {error}")
            else:
                positions[path.name] = found.position
        return positions

    # ---------------------------------------------------------------- content

    def _check_entries(
        self, connection: sqlite3.Connection, rows: JournalRows, head: Head, base: Base
    ) -> None:
        found = _Found(base.sequence, base.digest, base.accepted, base.rejected, intact=True)
        places = connection.execute("SELECT first, sequence FROM quarantine ORDER BY first")
        numbered = True
        with self._noting(), self._readable(lambda: found.sequence):
            for row in connection.execute(ENTRY + "ORDER BY sequence"):
                rejected = found.rejected
                found = self._next(rows, found, row)
                if found.intact and found.rejected > rejected and numbered:
                    numbered = places.fetchone() == (rejected + 1, found.sequence)
                    if not numbered:
                        how = f"expected rejected rows starting at number {rejected + 1}"
                        self._name(rows.damaged(found.sequence, how))
                if found.sequence % _STEP_ENTRIES == 0:
                    self._on_progress(found.sequence, head.sequence)
        self._on_progress(head.sequence, head.sequence)
        with self._noting():
            rows.check_end(head, found.sequence, found.digest)
            if found.intact:
                rows.check_counts(head, found.accepted, found.rejected)

    # The keys of removed entries.
    def _check_removed(self, connection: sqlite3.Connection, rows: JournalRows, base: Base) -> None:
        if not base.sequence:
            return
        count = 0
        with self._noting():
            rows.removed_changes(connection)
        with self._noting():
            for row in connection.execute(REMOVED):
                count += 1
                try:
                    rows.verified_removed(row)
                except JournalError as error:
                    self._name(error)
            if count != base.keys:
                raise JournalError(
                    f"{self._path}: expected {base.keys} keys of removed entries, found {count}"
                )

    # The entries up to and including a row.
    def _next(self, rows: JournalRows, before: _Found, row: Row) -> _Found:
        sequence, digest = row[8], row[7] if isinstance(row[7], bytes) else b""
        first = before.sequence + 1
        if sequence < first:
            # Only before the first entry: they come in order.
            self._name(rows.damaged(sequence, "marked as removed"))
            return before._replace(intact=False)
        if sequence != first:
            self._name(JournalError(f"{self._path}: {_missing(first, sequence - 1)}"))
            return before._replace(sequence=sequence, digest=digest, intact=False)
        try:
            stored = rows.verified(before.digest, sequence, row)
        except JournalError as error:
            self._name(error)
            return before._replace(sequence=sequence, digest=digest, intact=False)
        return _Found(
            sequence,
            digest,
            before.accepted + stored.entry.accepted,
            before.rejected + len(stored.entry.rejects),
            before.intact,
        )

    def _name(self, error: JournalError) -> None:
        if len(self._damage) < NAMED_MAX:
            self._damage.append(str(error))
        else:
            self._unnamed += 1

    # Names the entry behind which the database can no longer be read.
    @contextmanager
    def _readable(self, sequence: Callable[[], int]) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, UnicodeError) as error:
            raise JournalError(
                f"{self._path}: entry {sequence() + 1} and all later entries cannot be read: "
                f"{error}"
            ) from error

    def _check_tip(
        self, connection: sqlite3.Connection, rows: JournalRows, head: Head, tip: Tip
    ) -> None:
        if tip.accepts_any:
            return
        with self._noting():
            if tip.sequence > head.sequence:
                raise JournalError(
                    f"{self._path}: {tip.sequence} entries were acknowledged, but it contains only "
                    f"{head.sequence}"
                )
            # Removed entries were on disk: after a power failure the tip may be of one before.
            removed = tip.sequence < rows.base(connection).sequence
            if not removed and rows.digest_of(connection, tip.sequence) != tip.digest:
                raise rows.damaged(tip.sequence, "different from the acknowledged entry")

    def _check_position(
        self, connection: sqlite3.Connection, rows: JournalRows, head: Head, name: str,
        position: Position,
    ) -> None:  # fmt: skip
        with self._noting():
            if position.sequence > head.sequence:
                how = (
                    f"the snapshot refers to entry {position.sequence}, which is not in the journal"
                )
            elif rows.digest_of(connection, position.sequence) != position.digest:
                how = f"the snapshot belongs to another journal: entry {position.sequence} differs"
            else:
                return
            raise JournalError(f"{SnapshotFolder(self._path).path}: {name}: {how}")


def _missing(first: int, last: int) -> str:
    if first == last:
        return f"entry {first} of the journal is missing"
    return f"entries {first} to {last} of the journal are missing"
