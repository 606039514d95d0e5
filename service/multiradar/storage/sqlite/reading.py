"""Reading a journal that a service may be writing."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from multiradar.storage.entries import StoredEntry
from multiradar.storage.sqlite.journal_rows import ENTRY, JournalRows, header_of
from multiradar.storage.sqlite.opening import open_for_reading, require_journal
from multiradar.storage.sqlite.sqlite_file import journal_errors, snapshot


@contextmanager
def journal_entries(journal: Path) -> Iterator[tuple[int, int, Iterator[StoredEntry]]]:
    """Open a journal for reading; nothing is changed, and a service may go on writing.

    Parameters
    ----------
    journal : Path
        The database file.

    Yields
    ------
    int, int
        Number of the first entry that it has, and of the last one.
    Iterator of StoredEntry
        All its entries, each verified when it is read.

    Raises
    ------
    InputError
        There is no such journal.
    JournalError
        It is damaged.
    ConfigurationError
        It is of another format.
    """
    path = journal.resolve() if journal.is_symlink() else journal
    require_journal(path)
    with (
        journal_errors(path),
        closing(open_for_reading(path)) as connection,
        snapshot(connection),
    ):
        version, fingerprint = header_of(connection, path)
        rows = JournalRows(path, fingerprint, version)
        base, head = rows.base(connection), rows.head(connection)

        def entries() -> Iterator[StoredEntry]:
            sequence, digest = base.sequence, base.digest
            for row in connection.execute(f"{ENTRY}ORDER BY sequence"):
                stored = rows.verified(digest, sequence + 1, row)
                sequence, digest = stored.sequence, stored.digest
                yield stored
            rows.check_end(head, sequence, digest)

        yield base.sequence + 1, head.sequence, entries()


def removed_changes(journal: Path) -> list[bytes]:
    """Return the changes of sensors before the first entry of a journal; raises as above."""
    path = journal.resolve() if journal.is_symlink() else journal
    with (
        journal_errors(path),
        closing(open_for_reading(path)) as connection,
        snapshot(connection),
    ):
        version, fingerprint = header_of(connection, path)
        return JournalRows(path, fingerprint, version).removed_changes(connection)
