"""Backups: a consistent copy of a journal, also of one in use, with the hashes of its files.

A backup is a folder:

============================  =================================================================
File                          Content
============================  =================================================================
``backup.json``               what it contains, with the SHA-256 of each other file and of itself
``journal.sqlite``            the entries up to the last one when the copy started
``journal.sqlite-tip``        that entry
``journal.sqlite-snapshots``  the newest intact snapshot of these entries
others                        files of the configuration, given by the caller
============================  =================================================================
"""

import hashlib
import json
import shutil
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

from multiradar.errors import DamageError, InputError, JournalError, SnapshotError
from multiradar.storage.snapshots import SnapshotFolder
from multiradar.storage.sqlite.journal_rows import Head, JournalRows, description_of, fingerprint_of
from multiradar.storage.sqlite.opening import open_for_reading, require_journal
from multiradar.storage.sqlite.shortening import digests_of
from multiradar.storage.sqlite.sqlite_file import (
    copy_database,
    file_size,
    journal_errors,
    open_database,
    snapshot,
    sync,
)
from multiradar.storage.sqlite.tip import Tip
from multiradar.storage.verification import Progress, Verification, verify_journal
from multiradar_schemas.documents.contents import BACKUP, no_such

FORMAT_VERSION = 1
MANIFEST = "backup.json"
#: The journal in a backup, whatever its name was.
DATABASE = "journal.sqlite"

_CHUNK_OCTETS = 1 << 20


class File(NamedTuple):
    """A file of a backup: its octets and their SHA-256, hexadecimal."""

    octets: int
    sha256: str


@dataclass(frozen=True, slots=True)
class Backup:
    """What a backup contains.

    Attributes
    ----------
    time_s : float
        When it was made, UTC, seconds since the Unix epoch.
    version : str
        The version of multiradar that made it.
    fingerprint : str
        Fingerprint of the configuration of the journal.
    entries, accepted, rejected : int
        Entries of the journal, and the measurements and rejected rows in them.
    digest : str
        Digest of the last entry, which covers all before it, hexadecimal.
    snapshot : str or None
        The snapshot, by the name of its file.
    files : mapping of str to File
        The files by name, below its folder.
    """

    time_s: float
    version: str
    fingerprint: str
    entries: int
    accepted: int
    rejected: int
    digest: str
    snapshot: str | None
    files: Mapping[str, File]


# ---------------------------------------------------------------- making


def write_backup(
    journal: Path,
    folder: Path,
    extra: Mapping[str, bytes],
    *,
    time_s: float,
    version: str,
    on_progress: Progress = lambda _done, _total: None,
) -> Backup:
    """Copy a journal, which may be in use, into a folder, and verify the copy.

    Parameters
    ----------
    journal : Path
        The database file of the journal.
    folder : Path
        An empty folder.
    extra : mapping of str to bytes
        Further files, by name.
    time_s : float
        The time, UTC, seconds since the Unix epoch.
    version : str
        The version of multiradar.
    on_progress : callable
        Called with the number of verified entries and that of all.

    Returns
    -------
    Backup
        What it contains.

    Raises
    ------
    InputError
        There is no such journal, or the disk has no room for the copy.
    DamageError
        The journal is damaged; each damage is named.
    JournalError
        It cannot be read, or lacks an acknowledged entry.
    ConfigurationError
        It is of another format.
    """
    journal_configuration(journal)
    journal = journal.resolve() if journal.is_symlink() else journal
    _require_space(journal, folder)
    # Before the journal: it then has the entry of the snapshot, and the acknowledged one.
    tip = Tip.read(journal.with_name(f"{journal.name}-tip"))
    database = folder / DATABASE
    snapshot_name = _copy_snapshot(journal, SnapshotFolder(database))
    head, fingerprint = _copy_journal(journal, database, tip)
    (folder / f"{DATABASE}-tip").write_bytes(Tip(head.sequence, head.digest).line())
    for name, octets in extra.items():
        (folder / name).write_bytes(octets)
    found = verify_journal(database, on_progress)
    if found.damage:
        # Of the journal: the copy has its pages.
        raise DamageError([one.replace(str(database), str(journal)) for one in found.damage])
    made = Backup(
        time_s, version, fingerprint, head.sequence, head.accepted, head.rejected,
        head.digest.hex(), snapshot_name, {name: _file(folder / name) for name in _names(folder)},
    )  # fmt: skip
    (folder / MANIFEST).write_text(_text(made), encoding="utf-8")
    for name in (*made.files, MANIFEST):
        sync(folder / name)
    for path in {(folder / name).parent for name in made.files}:
        sync(path)
    return made


def _require_space(journal: Path, folder: Path) -> None:
    parts = [journal, journal.with_name(f"{journal.name}-wal"), *next(_snapshots(journal), [])]
    octets = sum(file_size(path) for path in parts)
    free = shutil.disk_usage(folder).free
    if octets > free:
        msg = (
            f"{folder.parent}: a backup needs {octets / 1e6:.0f} MB, but the disk has only "
            f"{free / 1e6:.0f} MB left; choose another folder, or free some space"
        )
        raise InputError(msg)


# The files of each snapshot that the journal continues, the newest first; its rows may be damaged.
def _snapshots(journal: Path) -> Iterator[list[Path]]:
    folder = SnapshotFolder(journal)
    for path in folder.files():
        try:
            found = folder.read(path)
            sequence, digest = found.position
            known = digests_of(journal, [sequence]).get(sequence)
        except (JournalError, SnapshotError):
            # Damage of the journal is named when the copy is verified.
            continue
        if known == digest:
            rows = [file.name for files in found.tables.values() for file in files]
            yield [path, *(folder.path / name for name in rows)]


# Copies the newest intact snapshot with its rows; returns its name.
def _copy_snapshot(journal: Path, copy: SnapshotFolder) -> str | None:
    for found in _snapshots(journal):
        name = found[0].name
        try:
            copy.path.mkdir(exist_ok=True)
            for one in found:
                shutil.copyfile(one, copy.path / one.name)
            for files in copy.read(copy.path / name).tables.values():
                copy.read_rows(files)
        except (FileNotFoundError, SnapshotError):
            # Damaged, or removed meanwhile by the running service.
            shutil.rmtree(copy.path, ignore_errors=True)
        else:
            return name
    return None


def _copy_journal(journal: Path, copy: Path, tip: Tip | None) -> tuple[Head, str]:
    with (
        journal_errors(journal),
        closing(open_database(journal, "ro")) as connection,
        snapshot(connection),
    ):
        fingerprint = fingerprint_of(connection, journal)
        rows = JournalRows(journal, fingerprint)
        head = rows.head(connection)
        if tip is not None:
            tip.require(journal, head.sequence)
        copy_database(connection, copy)
    return head, fingerprint


def journal_configuration(journal: Path) -> tuple[str, str]:
    """Return fingerprint and description of the configuration that a journal was written with.

    The description is empty in a journal of an earlier version.

    Raises
    ------
    InputError
        There is no such journal.
    JournalError, ConfigurationError
        It is not a journal, or has another format.
    """
    require_journal(journal)
    with journal_errors(journal), closing(open_for_reading(journal)) as connection:
        return fingerprint_of(connection, journal), description_of(connection)


# ---------------------------------------------------------------- reading


def read_backup(folder: Path) -> Backup:
    """Return what a backup contains, by its list of files.

    Raises
    ------
    InputError
        There is no backup, its list is damaged, or it is of another format.
    """
    path = folder / MANIFEST
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise InputError(no_such(folder, BACKUP)) from error
    except (OSError, UnicodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    try:
        document = json.loads(text)
        version = document["format"]
        if version == FORMAT_VERSION:
            files = {name: File(*one) for name, one in document["files"].items()}
            fields = {name: document[name] for name in Backup.__dataclass_fields__}
            found = Backup(**fields | {"files": files})
            outside = next(filter(_is_outside, files), None)
            if outside is not None:
                raise InputError(f"{path}: the path {outside!r} leads outside the backup folder")
            if _text(found) == text:
                return found
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: damaged") from error
    if version != FORMAT_VERSION:
        raise InputError(
            f"{path}: expected a backup of format {FORMAT_VERSION}, was {version}; use the "
            "multiradar version that created it"
        )
    raise InputError(f"{path}: damaged: the SHA-256 does not match the content")


def verify_backup(folder: Path, on_progress: Progress = lambda _done, _total: None) -> Verification:
    """Verify a backup: each file by its hash, and the journal as `verify_journal` does.

    Raises
    ------
    InputError
        There is no backup, or its list of files cannot be used.
    """
    listed = read_backup(folder)
    damage = [*_differing(folder, listed)]
    if not (folder / DATABASE).is_file():
        return Verification(0, 0, 0, "", "", 0, tuple(damage))
    try:
        found = verify_journal(folder / DATABASE, on_progress)
    except JournalError as error:
        return Verification(0, 0, 0, "", "", 0, (*damage, str(error)))
    if not damage and not found.damage and found.digest != listed.digest:
        damage.append(f"{folder / DATABASE}: the last entry does not match {MANIFEST}")
    return Verification(**asdict(found) | {"damage": (*damage, *found.damage)})


def copy_backup(folder: Path, to: Path) -> None:
    """Copy the files of a verified backup into an empty folder, synced and verified.

    Raises
    ------
    InputError
        See `read_backup`.
    DamageError
        The copy differs.
    """
    listed = read_backup(folder)
    for name in listed.files:
        (to / name).parent.mkdir(exist_ok=True)
        shutil.copyfile(folder / name, to / name)
        sync(to / name)
        sync((to / name).parent)
    damage = [*_differing(to, listed)] or verify_journal(to / DATABASE).damage
    if damage:
        raise DamageError(damage)


# Files that are not as listed; files that are not listed do not matter.
def _differing(folder: Path, listed: Backup) -> list[str]:
    found = []
    for name, expected in listed.files.items():
        path = folder / name
        try:
            present = _file(path)
        except OSError as error:
            found.append(f"{path}: {error.strerror}")
            continue
        if present.octets != expected.octets:
            found.append(f"{path}: expected {expected.octets} octets, was {present.octets}")
        elif present != expected:
            found.append(f"{path}: damaged: the SHA-256 does not match {MANIFEST}")
    return found


# Whether the name of a file points outside its folder.
def _is_outside(name: str) -> bool:
    path = Path(name)
    return path.is_absolute() or ".." in path.parts


def _names(folder: Path) -> list[str]:
    # Without the mark of an unfinished output folder.
    return sorted(
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and not path.name.startswith(".")
    )


def _file(path: Path) -> File:
    whole, octets = hashlib.sha256(), 0
    with path.open("rb") as stream:
        while chunk := stream.read(_CHUNK_OCTETS):
            whole.update(chunk)
            octets += len(chunk)
    return File(octets, whole.hexdigest())


# The list of a backup with its own hash.
def _text(backup: Backup) -> str:
    document: dict[str, Any] = {"format": FORMAT_VERSION, **asdict(backup)}
    document["files"] = {name: list(one) for name, one in backup.files.items()}
    digest = hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()
    return json.dumps(document | {"sha256": digest}, indent=1) + "\n"
