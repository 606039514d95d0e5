"""An archive of a journal: sealed segments, compressed, chained by the digests of its entries.

A segment is one file, `000000000001-000000004096.segment.xz`: the entries first-last of a journal
in a format that needs no database. Decompressed (`xz -d`), it has a line of JSON with its place in
the chain, for each entry a line of JSON and the octets whose lengths stand in it, and a last line
with the digest of the last entry. The container has a SHA-256 of its own. A file gets its name when
it is on disk and is never changed; a run that ends early leaves complete segments.
"""

import fcntl
import json
import lzma
import os
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, NamedTuple

from multiradar.errors import InputError, JournalError, OutputExistsError
from multiradar.storage.entries import StoredEntry, in_pieces
from multiradar.storage.segments import (
    SEGMENT_VERSION,
    Segment,
    SegmentReader,
    check_chain,
    not_continued,
    not_following,
    order_of,
    remedy,
    require_one_archive,
    require_order,
    segments_of,
    span,
)
from multiradar.storage.sqlite.chain import Columns, origin_digest
from multiradar.storage.sqlite.journal_rows import (
    ENTRY,
    FORMAT_VERSION,
    JournalRows,
    Row,
    fingerprint_of,
)
from multiradar.storage.sqlite.opening import beside, require_journal
from multiradar.storage.sqlite.sqlite_file import (
    journal_errors,
    open_database,
    snapshot,
    sync,
)
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.storage.sqlite.tip import Tip
from multiradar_schemas.documents.contents import no_such

#: Octets of the entries of a segment as the journal stores them, after which it is sealed.
SEGMENT_OCTETS = 64 * 1024 * 1024

_PARTIAL = ".partial"
#: 28 octets a measurement at 6, 29 at 1, which takes a quarter of the time.
_PRESET = 6

#: Called with the entries done so far, and those of all.
Progress = Callable[[int, int], None]


# Of the journal: its rejected rows stay packed, which may take a hundred times as much.
class _Sealed(NamedTuple):
    columns: Columns
    digest: bytes


class _End(NamedTuple):
    # The entry before a segment, and the configuration of its journal.
    sequence: int
    digest: bytes
    fingerprint: str


@dataclass(frozen=True, slots=True)
class Archived:
    """What an archive contains.

    Attributes
    ----------
    first, last : int
        Its first and last entry; 0 without any.
    accepted, rejected : int
        Measurements and rejected rows in them.
    segments, octets : int
        Its files.
    fingerprint, digest : str
        Fingerprint of the configuration, and digest of the last entry, hexadecimal.
    damage : tuple of str
        A sentence for each damaged or missing segment, with the entry.
    """

    first: int
    last: int
    accepted: int
    rejected: int
    segments: int
    octets: int
    fingerprint: str
    digest: str
    damage: tuple[str, ...]


# ---------------------------------------------------------------- writing


def archive_journal(
    journal: Path,
    folder: Path,
    *,
    segment_octets: int = SEGMENT_OCTETS,
    on_progress: Progress = lambda _done, _total: None,
) -> list[Segment]:
    """Seal the entries of a journal, which may be in use, that are not yet in an archive.

    Parameters
    ----------
    journal : Path
        The database file of the journal.
    folder : Path
        The archive; created when absent, with the parent in place.
    segment_octets : int
        Octets of stored entries after which a segment is sealed; the last one may have fewer.
    on_progress : callable
        Called with the number of the last sealed entry and that of all.

    Returns
    -------
    list of Segment
        The new ones.

    Raises
    ------
    InputError
        There is no such journal, or the archive cannot be written.
    JournalError
        The journal is damaged or lacks an acknowledged entry, or a segment is damaged, missing,
        repeated or that of another archive.
    ConfigurationError
        The journal is of another format.
    """
    require_journal(journal)
    # Before the journal: it then has the acknowledged entry.
    tip = Tip.read(beside(journal.resolve(), "-tip"))
    new: list[Segment] = []
    with (
        locked_archive(folder),
        journal_errors(journal),
        closing(open_database(journal, "ro")) as connection,
        snapshot(connection),
    ):
        fingerprint = fingerprint_of(connection, journal)
        rows = JournalRows(journal, fingerprint)
        head, marks = rows.head(connection), rows.skipped(connection)
        if tip is not None:
            tip.require(journal, head.sequence)
        end = _continued(connection, journal, rows, folder, fingerprint)
        found = connection.execute(ENTRY + "WHERE sequence > ? ORDER BY sequence", (end.sequence,))
        while end.sequence < head.sequence:
            sealed = _sealed(rows, end, found, segment_octets)
            new.append(_write(folder, end, sealed, marks))
            end = _End(new[-1].last, sealed[-1].digest, fingerprint)
            on_progress(end.sequence, head.sequence)
    return new


# The last entry of an archive that a journal continues.
def _continued(
    connection: sqlite3.Connection, journal: Path, rows: JournalRows, folder: Path, fingerprint: str
) -> _End:
    base, last = rows.base(connection).sequence, rows.head(connection).sequence
    end = _end_of(folder, base) or _End(0, rows.origin, fingerprint)
    if end.sequence < base:
        raise JournalError(
            f"{folder}: entries {end.sequence + 1} to {base} were removed from {journal}; "
            "continue the archive that contains them"
        )

    def has(sequence: int, digest: bytes) -> bool:
        if not base <= sequence <= last:
            return sequence < base
        return rows.digest_of(connection, sequence) == digest

    if end.fingerprint != fingerprint or not has(end.sequence, end.digest):
        raise JournalError(not_continued(journal, segments_of(folder), base, has))
    places = [one.first - 1 for one in segments_of(folder) if one.first > base]
    check_chain(folder, {one: rows.digest_of(connection, one) for one in places}, base)
    return end


# The entries of the next segment.
def _sealed(
    rows: JournalRows, end: _End, found: Iterable[Row], segment_octets: int
) -> list[_Sealed]:
    sealed: list[_Sealed] = []
    octets, digest = 0, end.digest
    for row in found:
        columns = rows.intact(digest, end.sequence + len(sealed) + 1, row)
        digest = row[7]
        sealed.append(_Sealed(columns, digest))
        octets += columns.octets
        if octets >= segment_octets:
            break
    if not sealed:
        raise rows.damaged(end.sequence + 1, "the entry is missing")
    return sealed


# The last entry in an archive, whose last segment is verified; None without one.
def _end_of(folder: Path, base: int) -> _End | None:
    found = segments_of(folder)
    if not found:
        return None
    require_one_archive(found)
    reader = SegmentReader(found[-1], remedy(found, len(found) - 1, found[-1].first, base))
    *_, entry = reader.entries()
    return _End(entry.sequence, entry.digest, reader.fingerprint)


def _write(folder: Path, before: _End, sealed: list[_Sealed], marks: Mapping[int, str]) -> Segment:
    first, last = before.sequence + 1, before.sequence + len(sealed)
    path = folder / f"{first:012d}-{last:012d}.segment.xz"
    partial = folder / f"{path.name}{_PARTIAL}"
    own = {str(one): reason for one, reason in marks.items() if first <= one <= last}
    try:
        with lzma.open(partial, "wb", preset=_PRESET, check=lzma.CHECK_SHA256) as stream:
            _line(stream, {
                "format": SEGMENT_VERSION, "fingerprint": before.fingerprint, "first": first,
                "before": before.digest.hex(),
            })  # fmt: skip
            for columns, _ in sealed:
                packed = columns.rejects if isinstance(columns.rejects, bytes) else None
                _line(stream, {
                    **columns._asdict(), "payload": len(columns.payload),
                    "rejects": columns.rejects if packed is None else len(packed),
                })  # fmt: skip
                stream.write(columns.payload)
                stream.write(packed or b"")
            _line(stream, {"last": last, "digest": sealed[-1].digest.hex(), "skipped": own})
        sync(partial)
        os.rename(partial, path)
        sync(folder)
    except OSError as error:
        with suppress(OSError):
            os.unlink(partial)
        raise InputError(
            f"{folder}: cannot write: {error.strerror}; segments before entry {first} are complete"
        ) from error
    return Segment(path, first, last)


def _line(stream: IO[bytes], document: Mapping[str, Any]) -> None:
    stream.write(json.dumps(document).encode() + b"\n")


@contextmanager
def locked_archive(folder: Path) -> Iterator[None]:
    """Keep other commands from writing an archive; it is created when absent.

    Raises
    ------
    InputError, OutputExistsError
        It cannot be written, or another command is writing to it.
    """
    try:
        folder.mkdir(exist_ok=True)
        lock = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise InputError(f"{folder}: cannot write: {error.strerror}") from error
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        for path in folder.glob(f"*{_PARTIAL}"):
            path.unlink()
        yield
    except BlockingIOError as error:
        raise OutputExistsError(
            f"{folder}: another command is writing to this archive; wait until it has finished"
        ) from error
    finally:
        os.close(lock)


# ---------------------------------------------------------------- reading


def verify_archive(folder: Path, on_progress: Progress = lambda _done, _total: None) -> Archived:
    """Verify every entry of an archive, and that no segment between the others is missing.

    The oldest segments may have been removed.

    Raises
    ------
    InputError
        There is no archive.
    """
    found = _required(folder)
    order = order_of(found)
    damage: list[str] = []
    accepted = rejected = 0
    end: _End | None = None
    before: Segment | None = None
    for segment in found:
        reader = SegmentReader(segment)
        is_repeated = segment in order.overlapping
        try:
            for one in reader.entries():
                accepted += 0 if is_repeated else one.entry.accepted
                rejected += 0 if is_repeated else len(one.entry.rejects)
                last = one
        except JournalError as error:
            damage.append(str(error))
            end = end if is_repeated else None
        else:
            if is_repeated:
                damage.append(order.overlapping[segment])
            else:
                damage += _gap(segment, reader, end, before)
                end = _End(last.sequence, last.digest, reader.fingerprint)
                before = segment
        on_progress(segment.last, found[-1].last)
    damage += [f"{folder}: {span(*one)} missing" for one in order.missing.values()]
    return Archived(
        found[0].first, max(one.last for one in found), accepted, rejected, len(found),
        sum(one.path.stat().st_size for one in found),
        "" if end is None else end.fingerprint, "" if end is None else end.digest.hex(),
        tuple(damage),
    )  # fmt: skip


def restore_archive(
    folder: Path, journal: Path, on_progress: Progress = lambda _done, _total: None
) -> Archived:
    """Write the entries of a verified archive into a new journal.

    Raises
    ------
    InputError
        There is no archive, or its first entries are not in it.
    JournalError
        A segment is damaged, or the journal cannot be written.
    """
    found = _required(folder)
    if found[0].first != 1:
        raise InputError(
            f"{folder}: starts at entry {found[0].first} instead of entry 1; the journal cannot "
            "be restored without the preceding segments"
        )
    archived = verify_archive(folder)
    if archived.damage:
        raise JournalError(archived.damage[0])
    written = SqliteJournal(journal, archived.fingerprint)
    try:
        for segment in found:
            reader = SegmentReader(segment)
            for piece in in_pieces(one.entry for one in reader.entries()):
                written.append(piece)
            for sequence, reason in reader.skipped.items():
                written.skip(sequence, reason)
            on_progress(segment.last, archived.last)
        if written.digest(archived.last).hex() != archived.digest:
            raise JournalError(f"{folder}: the last restored entry does not match the last entry")
    finally:
        written.close()
    return archived


@contextmanager
def archive_entries(folder: Path) -> Iterator[tuple[int, int, Iterator[StoredEntry]]]:
    """Open an archive for reading, as `journal_entries` opens a journal.

    Yields
    ------
    int, int
        Number of the first and of the last entry.
    Iterator of StoredEntry
        All of them, each verified when it is read.

    Raises
    ------
    InputError
        There is no archive.
    JournalError
        A segment is damaged, missing, repeated or that of another archive.
    """
    found = _required(folder)
    require_order(folder, found)

    def entries() -> Iterator[StoredEntry]:
        end: _End | None = None
        before: Segment | None = None
        for segment in found:
            reader = SegmentReader(segment)
            for one in reader.entries():
                if one.sequence == segment.first and (gap := _gap(segment, reader, end, before)):
                    raise JournalError(gap[0])
                yield one
            before = segment
            end = _End(one.sequence, one.digest, reader.fingerprint)

    yield found[0].first, found[-1].last, entries()


def _required(folder: Path) -> list[Segment]:
    found = segments_of(folder)
    if not found:
        raise InputError(no_such(folder, "the output of `archive`"))
    return found


# Why a segment does not follow the one before, or is not the first of a journal.
def _gap(
    segment: Segment, reader: SegmentReader, end: _End | None, before: Segment | None
) -> list[str]:
    if segment.first == 1:
        expected = _End(0, origin_digest(FORMAT_VERSION, reader.fingerprint), reader.fingerprint)
    elif end is None or end.sequence + 1 < segment.first:
        return []
    else:
        expected = end
    if (expected.digest, expected.fingerprint) == (reader.before, reader.fingerprint):
        return []
    return [not_following(segment, before)]
