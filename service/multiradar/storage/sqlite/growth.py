"""How fast a journal grows, from its last entries."""

from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from multiradar.storage.sqlite.journal_rows import JournalRows, fingerprint_of
from multiradar.storage.sqlite.opening import open_for_reading
from multiradar.storage.sqlite.sqlite_file import journal_errors, snapshot

#: Entries that count: at least 17 minutes of live data.
_ENTRIES = 10_000
# Octets on disk of an entry: pages of 4096 octets beyond 4061, and its share of the index of keys
# (https://www.sqlite.org/fileformat.html, section 1.6).
_OCTETS = (
    "SELECT sum(CASE WHEN octets > 4061 THEN (octets + 4091) / 4092 * 4096 ELSE octets END + 100) "
    "FROM (SELECT length(payload) + length(rejects) + length(admission) AS octets "
    "FROM entry WHERE sequence > ?)"
)
_ADMISSION = "SELECT admission FROM entry WHERE sequence = ?"


class Growth(NamedTuple):
    """The last entries of a journal.

    Attributes
    ----------
    octets : int
        Octets on disk of those after the first.
    first, last : str
        State of the admission after the first and the last.
    """

    octets: int
    first: str
    last: str


def growth_of(path: Path) -> Growth | None:
    """Return the last entries of a journal, which may be in use; None with fewer than two.

    Raises
    ------
    JournalError
        It cannot be read.
    ConfigurationError
        It is of another format.
    """
    with (
        journal_errors(path),
        closing(open_for_reading(path)) as connection,
        snapshot(connection),
    ):
        rows = JournalRows(path, fingerprint_of(connection, path))
        head = rows.head(connection)
        first = connection.execute(
            "SELECT min(sequence) FROM entry WHERE sequence >= ?", (head.sequence - _ENTRIES,)
        ).fetchone()[0]
        if first is None or first == head.sequence:
            return None
        octets = connection.execute(_OCTETS, (first,)).fetchone()[0]
        found = [
            connection.execute(_ADMISSION, (one,)).fetchone() for one in (first, head.sequence)
        ]
        if octets is None or None in found:
            raise rows.damaged(head.sequence, "the entry is missing")
        return Growth(int(octets), *(row[0] for row in found))
