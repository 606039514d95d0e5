"""What is verified of a journal before a service uses it; no file is changed.

A service that follows a journal verifies header and pages when it starts to, and the rest when it
takes over: the entries by their digests as they come.

The pages of a large file take longer than a start may: `SqliteJournal.verify_pages` verifies them
later, unless pages are free. A free page that is in use would be overwritten.
"""

import sqlite3
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path

from multiradar.errors import ConfigurationError, InputError, JournalError
from multiradar.storage.snapshots import SnapshotFolder
from multiradar.storage.sqlite.journal_rows import JournalRows, description_of, fingerprint_of
from multiradar.storage.sqlite.sqlite_file import (
    check_file_type,
    check_pages,
    file_size,
    open_database,
    reading_mode,
)
from multiradar.storage.sqlite.tip import ACCEPT, Tip
from multiradar.storage.sqlite.write_ahead_log import log_damage
from multiradar_schemas.documents.contents import JOURNAL, content, no_such

#: The pages of a file of up to so many octets are verified when it is opened.
_AT_ONCE_BYTES = 256 << 20
#: Octets of the header of a database (https://www.sqlite.org/fileformat.html, section 1.3).
_HEADER_OCTETS = 100


def beside(path: Path, end: str) -> Path:
    """Return another file of a journal by the end of its name."""
    return path.with_name(path.name + end)


class Verification:
    """Verifies the files of a journal.

    Parameters
    ----------
    path : Path
        The file.
    rows : JournalRows
        Its tables.
    fingerprint : str
        Fingerprint of the configuration.
    description : str
        What the fingerprint is made of.
    differences : callable
        Returns how two descriptions differ, in words; empty where that is unknown.
    """

    def __init__(
        self, path: Path, rows: JournalRows, fingerprint: str, description: str,
        differences: Callable[[str, str], str],
    ) -> None:  # fmt: skip
        self._path, self._rows = path, rows
        self._fingerprint = fingerprint
        self._description, self._differences = description, differences
        self._log_path, self._tip_path = beside(path, "-wal"), beside(path, "-tip")
        #: Whether its pages have been verified.
        self.pages_verified = False

    def followed(self) -> bool:
        """Verify header and pages of a journal in use; return False if it is not created yet."""
        check_file_type(self._path)
        if not file_size(self._path) or not file_size(self._tip_path):
            return False
        with closing(open_database(self._path, "ro")) as connection:
            if not _has_tables(connection):
                return False
            self._check_header(connection)
            self._check_some_pages(connection)
        return True

    def tip(self) -> Tip | None:
        """Return the last entry of a journal with all acknowledged ones; None for a new journal.

        It changes no file: a reader does not trim the log.
        """
        check_file_type(self._path)
        tip = Tip.read(self._tip_path)
        if not file_size(self._path):
            self._check_new(tip)
            return None
        damage = None if tip and tip.accepts_any else log_damage(self._log_path)
        if damage is not None:
            raise self._incomplete(f"{self._log_path.name} is damaged: {damage}")
        # A kill at the first start may leave a change to be rolled back: the only one without log.
        mode = "rw" if beside(self._path, "-journal").exists() else "ro"
        with closing(open_database(self._path, mode)) as connection:
            return self._tip_in(connection, tip)

    # Nothing was acknowledged before.
    def _check_new(self, tip: Tip | None) -> None:
        error = _without_header(
            self._path, "missing or empty", has_entries=bool(tip and tip.sequence)
        )
        if error is not None:
            raise JournalError(f"{error}, or remove these to start without the earlier data")

    def _tip_in(self, connection: sqlite3.Connection, tip: Tip | None) -> Tip | None:
        tables = _has_tables(connection)
        if tables:
            # First: journals of earlier versions have no tip.
            self._check_header(connection)
        if tip is None:
            raise self._incomplete(f"{self._tip_path.name} is missing")
        if not tables and tip.sequence:
            raise self._incomplete(
                f"{tip.sequence} entries were acknowledged, but the journal contains none"
            )
        if not tables:
            return None
        if not self.pages_verified:
            self._check_some_pages(connection)
        return self._check_tip(connection, tip)

    # All pages of a file that is not large, or has free ones.
    def _check_some_pages(self, connection: sqlite3.Connection) -> None:
        free = connection.execute("PRAGMA freelist_count").fetchone()[0]
        if free or file_size(self._path) <= _AT_ONCE_BYTES:
            check_pages(connection, self._path)
            self.pages_verified = True

    def _check_tip(self, connection: sqlite3.Connection, tip: Tip) -> Tip:
        end = self._rows.head(connection).sequence
        if end < tip.sequence:
            raise self._incomplete(
                f"entry {end + 1} of the journal is missing: {tip.sequence} were acknowledged, "
                f"but it contains only {end}"
            )
        if (
            tip.sequence
            # Removed entries were on disk: after a power failure the tip may be of one before.
            and tip.sequence >= self._rows.base(connection).sequence
            and self._rows.digest_of(connection, tip.sequence) != tip.digest
        ):
            raise self._incomplete(f"entry {tip.sequence} differs from the acknowledged entry")
        return Tip(end, self._rows.digest_of(connection, end))

    def _check_header(self, connection: sqlite3.Connection) -> None:
        written_with = fingerprint_of(connection, self._path)
        if written_with != self._fingerprint:
            other = self._differences(description_of(connection), self._description) or (
                "other sensors or tracking settings, or on a different kind of processor "
                f"(fingerprint {written_with[:12]}, now {self._fingerprint[:12]})"
            )
            raise ConfigurationError(
                f"{self._path}: the journal was created with {other}; use the original "
                "configuration, or migrate the journal to a new state directory (multiradar "
                "migrate)"
            )

    def _incomplete(self, how: str) -> JournalError:
        return JournalError(
            f"{self._path}: {how}; restore all files {self._path.name}* from the same copy, or "
            f'write "{ACCEPT}" into {self._tip_path.name} to continue with the remaining entries'
        )


def require_journal(path: Path) -> None:
    """Check, before a file is opened for reading, that it is a journal; nothing is changed.

    Raises
    ------
    InputError
        There is no such file, and no other file of such a journal.
    JournalError
        It is another file, or has lost its beginning.
    """
    lost = not path.exists() and _without_header(path, "missing", has_entries=_has_entries(path))
    if not path.is_file() and not lost:
        raise InputError(no_such(path, JOURNAL))
    require_header(path)
    check_file_type(path)


def require_header(path: Path) -> None:
    """Raise JournalError for a journal that is missing or shorter than its header.

    SQLite deletes the log of a file without pages, even if that is only read.
    """
    size = file_size(path)
    if size >= _HEADER_OCTETS:
        return
    how = f"not a journal (only {size} of the {_HEADER_OCTETS} octets of a header)"
    if not size:
        how = "empty" if path.exists() else "missing"
    error = _without_header(path, how, has_entries=_has_entries(path))
    raise JournalError(error or f"{path}: {how}; choose another file")


def open_for_reading(path: Path) -> sqlite3.Connection:
    """Open a journal, which may be in use; raises as `require_header`."""
    require_header(path)
    return open_database(path, reading_mode(path))


# Whether the tip of a journal is that of an entry; one that cannot be read may be.
def _has_entries(path: Path) -> bool:
    tip_path = beside(path.resolve(), "-tip")
    with suppress(JournalError):
        tip = Tip.read(tip_path)
        return tip is not None and tip.sequence > 0
    return True


# The error of a journal without its header, if other files show that it had entries; None if not.
def _without_header(path: Path, how: str, *, has_entries: bool) -> str | None:
    real = path.resolve()
    log, tip, snapshots = beside(real, "-wal"), beside(real, "-tip"), SnapshotFolder(real)
    found = [log] if file_size(log) else []
    found += [tip] if has_entries else []
    found += [snapshots.path] if snapshots.files() else []
    if not found:
        return None
    names = ", ".join(one.name for one in found)
    return (
        f"{path}: {how}, although other files of this journal exist ({names}); restore all files "
        f"{path.name}* from the same copy"
    )


def check_acknowledged(path: Path) -> None:
    """Verify the log of a journal, which may be in use, and that no acknowledged entry is missing.

    Its pages are not verified. No file is changed.

    Raises
    ------
    JournalError
        The log is damaged, or an entry is missing.
    ConfigurationError
        The journal is of another format.
    """
    with closing(open_for_reading(path)) as connection:
        fingerprint = fingerprint_of(connection, path)
    rows = JournalRows(path, fingerprint)
    verification = Verification(path, rows, fingerprint, "", lambda _before, _now: "")
    verification.pages_verified = True
    verification.tip()


def _has_tables(connection: sqlite3.Connection) -> bool:
    found: int = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
    return found > 0


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
                "folder, which need not exist yet (`replay` sends a recording to the service)"
            )
            raise JournalError(msg)
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        msg = (
            f"{folder}: cannot create this folder for the journal ({error.strerror}); choose "
            "another folder with --state"
        )
        raise JournalError(msg) from error
