"""Segments of an archive: order, reading and verification."""

import json
import lzma
import os
import re
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, NamedTuple

from multiradar.errors import JournalError
from multiradar.storage.entries import StoredEntry
from multiradar.storage.snapshots import Position
from multiradar.storage.sqlite.chain import Columns, entry_digest
from multiradar.storage.sqlite.sqlite_file import sync

SEGMENT_VERSION = 1
#: No line of a segment is longer, octets.
LINE_MAX = 1 << 26

#: Advice where segments of several archives are in a folder.
ONE_ARCHIVE = "keep only the segments of one archive in the folder"

# The end of an xz file: CRC-32 of the next six octets, size of the index, flags, magic.
_FOOTER_OCTETS, _FOOTER_MAGIC = 12, b"YZ"
_NAME = re.compile(r"(\d{12})-(\d{12})\.segment\.xz")


class Segment(NamedTuple):
    """A segment by its name: the numbers of its first and last entry."""

    path: Path
    first: int
    last: int


def segments_of(folder: Path) -> list[Segment]:
    """Return the segments in a folder, in order; empty where there are none."""
    found = []
    for path in folder.glob("*.segment.xz"):
        name = _NAME.fullmatch(path.name)
        if name is not None:
            found.append(Segment(path, int(name[1]), int(name[2])))
    return sorted(found, key=lambda one: (one.first, one.last, one.path.name))


class Order(NamedTuple):
    """Where segments do not follow each other by their numbers.

    Attributes
    ----------
    overlapping : dict of Segment to str
        Segments with entries that an earlier one has as well, each with a sentence.
    missing : dict of Segment to tuple of int
        First and last entry that are missing before a segment.
    """

    overlapping: dict[Segment, str]
    missing: dict[Segment, tuple[int, int]]


def order_of(found: Sequence[Segment]) -> Order:
    """Return where sorted segments overlap, and what is missing between them."""
    order, newest = Order({}, {}), found[0] if found else None
    for one in found[1:]:
        assert newest is not None
        if one.first <= newest.last:
            both = span(one.first, min(one.last, newest.last))
            order.overlapping[one] = (
                f"{one.path.parent}: {both} in both {newest.path.name} and {one.path.name}; "
                f"{ONE_ARCHIVE}"
            )
        elif one.first > newest.last + 1:
            order.missing[one] = newest.last + 1, one.first - 1
        newest = max(newest, one, key=lambda each: each.last)
    return order


def require_one_archive(found: Sequence[Segment]) -> Order:
    """Return the order of sorted segments; raises JournalError if some have the same entries."""
    order = order_of(found)
    for sentence in order.overlapping.values():
        raise JournalError(sentence)
    return order


def require_order(folder: Path, found: Sequence[Segment]) -> None:
    """Check that sorted segments follow each other by their numbers; raises JournalError."""
    for first, last in require_one_archive(found).missing.values():
        raise JournalError(f"{folder}: {span(first, last)} missing")


class SegmentReader:
    """Reads a segment once; every entry is verified.

    Parameters
    ----------
    segment : Segment
        The segment.
    advice : str
        What to do if it is damaged; the errors end with it.

    Attributes
    ----------
    fingerprint, before : str, bytes
        Fingerprint of the configuration, and digest of the entry before; known once the first entry
        is read.
    skipped : dict of int to str
        Marks on its entries; known once all entries are read.
    """

    def __init__(self, segment: Segment, advice: str = "") -> None:
        self._segment, self._advice = segment, advice
        self.fingerprint, self.before = "", b""
        self.skipped: dict[int, str] = {}
        self._sequence = segment.first

    def read_ends(self) -> None:
        """Read what precedes its entries, and check that the file is complete.

        Raises
        ------
        JournalError
            It is missing or incomplete, or the name does not match; damage within is not found.
        """
        with self._naming_damage(), open(self._segment.path, "rb") as file:
            with lzma.open(file, "rb") as stream:
                self._read_header(stream)
            file.seek(0)
            flags = file.read(8)[6:]
            file.seek(-_FOOTER_OCTETS, os.SEEK_END)
            footer = file.read()
            checked = zlib.crc32(footer[4:10]).to_bytes(4, "little")
            if footer[:4] + footer[8:] != checked + flags + _FOOTER_MAGIC:
                raise self._damaged("the file is incomplete")

    def entries(self) -> Iterator[StoredEntry]:
        """Yield its entries; raises JournalError where it is damaged."""
        with self._naming_damage(), lzma.open(self._segment.path, "rb") as stream:
            self._read_header(stream)
            yield from self._entries(stream)

    @contextmanager
    def _naming_damage(self) -> Iterator[None]:
        try:
            yield
        except FileNotFoundError as error:
            raise self._damaged("the file is missing") from error
        except (OSError, EOFError, lzma.LZMAError) as error:
            raise self._damaged(f"the file cannot be read: {error}") from error
        except (AttributeError, KeyError, TypeError, UnicodeError, ValueError) as error:
            raise self._damaged("the file is not an archive segment") from error

    def _read_header(self, stream: IO[bytes]) -> None:
        header = json.loads(stream.readline(LINE_MAX))
        if header["format"] != SEGMENT_VERSION:
            raise JournalError(
                f"{self._segment.path}: expected a segment of format {SEGMENT_VERSION}, was "
                f"{header['format']}; use the multiradar version that wrote it"
            )
        if header["first"] != self._segment.first:
            raise self._damaged(f"the file name does not match entry {header['first']}")
        self.fingerprint, self.before = header["fingerprint"], bytes.fromhex(header["before"])

    def _entries(self, stream: IO[bytes]) -> Iterator[StoredEntry]:
        digest = self.before
        while self._sequence <= self._segment.last:
            found = json.loads(stream.readline(LINE_MAX))
            found["payload"] = stream.read(found["payload"])
            if isinstance(found["rejects"], int):
                found["rejects"] = stream.read(found["rejects"])
            columns = Columns(**found)
            digest = entry_digest(digest, self._sequence, columns)
            yield StoredEntry(self._sequence, columns.entry(), digest)
            self._sequence += 1
        last = json.loads(stream.readline(LINE_MAX))
        # To its end, so that the container is checked, too.
        if stream.read(1) or last["last"] != self._segment.last or last["digest"] != digest.hex():
            raise self._damaged("the digest does not match the entries")
        self.skipped = {int(one): reason for one, reason in last["skipped"].items()}

    def _damaged(self, how: str) -> JournalError:
        advice = f"; {self._advice}" if self._advice else ""
        return JournalError(
            f"{self._segment.path}: damaged at entry {self._sequence}: {how}{advice}"
        )


def check_chain(folder: Path, digests: Mapping[int, bytes], base: int) -> None:
    """Check that the segments in a folder are those of one archive, without gaps.

    Only the oldest segment is read to its end, and of the others what precedes the entries.

    Parameters
    ----------
    folder : Path
        The archive.
    digests : mapping of int to bytes
        Digests of the journal for the entries before segments, where it has them.
    base : int
        The last entry that was removed from the journal.

    Raises
    ------
    JournalError
        A segment is missing, damaged or repeated, or is not of this archive; with advice.
    """
    found = segments_of(folder)
    order = require_one_archive(found)
    known, fingerprint = dict(digests), ""
    for number, segment in enumerate(found):
        if segment in order.missing:
            first, last = order.missing[segment]
            advice = remedy(found, number, first, base)
            raise JournalError(f"{folder}: {span(first, last)} missing; {advice}")
        reader = SegmentReader(segment, remedy(found, number, segment.first, base))
        if number:
            reader.read_ends()
        else:
            end = _end_of_oldest(reader, segment, known)
            known[end.sequence], fingerprint = end.digest, reader.fingerprint
        expected = known.get(segment.first - 1, reader.before)
        if (reader.before, reader.fingerprint) != (expected, fingerprint):
            raise JournalError(not_following(segment, found[number - 1] if number else None))


# It is read to its end: its header alone is that of any journal of this configuration.
def _end_of_oldest(
    reader: SegmentReader, segment: Segment, digests: Mapping[int, bytes]
) -> StoredEntry:
    *_, end = reader.entries()
    if digests.get(end.sequence, end.digest) != end.digest:
        raise JournalError(
            f"{segment.path}: entry {end.sequence} does not match the journal; choose the archive "
            "of this journal, and keep only its segments in the folder"
        )
    return end


def not_following(segment: Segment, before: Segment | None) -> str:
    """Return the sentence for a segment that does not continue the one before, or a journal."""
    of = "of the journal" if before is None else f"in {before.path.name}"
    return (
        f"{segment.path}: entry {segment.first} does not follow the preceding entry {of}; "
        f"{ONE_ARCHIVE}"
    )


def not_continued(
    journal: Path, found: Sequence[Segment], base: int, has: Callable[[int, bytes], bool]
) -> str:
    """Return the sentence for an archive whose last entry is not one of a journal.

    Parameters
    ----------
    journal : Path
        The journal.
    found : sequence of Segment
        All segments of the archive.
    base : int
        The last entry that was removed from the journal.
    has : callable
        Returns whether the journal has, or had, an entry with a number and a digest.

    Raises
    ------
    JournalError
        A segment is damaged.
    """
    number = len(found) - 1
    for place, segment in enumerate(found):
        reader = SegmentReader(segment, remedy(found, place, segment.first, base))
        reader.read_ends()
        if not has(segment.first - 1, reader.before):
            # The end of the segment before, unless segments between them are missing.
            number = place - (place > 0 and found[place - 1].last == segment.first - 1)
            break
    name, last = found[number].path, found[number].last
    sentence = f"{name}: the last entry, {last}, does not match entry {last} of {journal}"
    if not number or found[number - 1].last < base:
        return f"{sentence}; choose another archive, or {ONE_ARCHIVE}"
    # The archive is then newer than the backup.
    return (
        f"{sentence}; if a backup was restored, move {name.name} and all later segments to another "
        "folder, and run `multiradar archive` again; otherwise choose another archive"
    )


def remedy(found: Sequence[Segment], number: int, first: int, base: int) -> str:
    """Return what to do about lost entries, from one on, in or before a segment.

    Parameters
    ----------
    found : sequence of Segment
        All segments of the archive.
    number : int
        The place of the damaged segment, or of that after the missing ones.
    first : int
        The first lost entry.
    base : int
        The last entry that was removed from the journal.
    """
    name = found[number].path.name
    # Without older segments, `archive` starts with entry 1.
    if first > base and (number or not base):
        return (
            f"the journal still has these entries: remove {name} and all later segments, and run "
            "`multiradar archive` again"
        )
    advice = "restore these segments from another copy of the archive"
    kept = found[number + (first == found[number].first) :]
    # Of the others, the journal must continue the oldest.
    if not kept or kept[0].first > base + 1:
        return advice
    return f"{advice}; without one, move all segments before {kept[0].path.name} to another folder"


def sealed_after(folder: Path, after: Position) -> Iterator[tuple[Segment, Position, str]]:
    """Verify the segments of an archive from an entry on, one after the other.

    Parameters
    ----------
    folder : Path
        The archive.
    after : Position
        An entry of the journal; entry 0 has the digest before the first.

    Yields
    ------
    Segment, Position, str
        A segment that is sound, on disk, and goes on behind the entry; its last entry, and the
        state of the admission after that.

    Raises
    ------
    JournalError
        The next segment is damaged or missing, or does not belong to the entry.
    """
    found, base = segments_of(folder), after.sequence
    for number, segment in enumerate(found):
        if segment.last <= after.sequence:
            continue
        if segment.first > after.sequence + 1:
            lacking = span(after.sequence + 1, segment.first - 1)
            advice = remedy(found, number, after.sequence + 1, base)
            raise JournalError(f"{folder}: {lacking} missing; {advice}")
        try:
            # Before it is read, so that what was read is on disk.
            sync(segment.path)
            sync(folder)
        except OSError as error:
            raise JournalError(f"{segment.path}: {error.strerror}") from error
        reader = SegmentReader(segment, remedy(found, number, segment.first, base))
        digest, follows = after.digest, False
        for one in reader.entries():
            if one.sequence == after.sequence + 1:
                before = reader.before if one.sequence == segment.first else digest
                follows = before == after.digest
            digest, last = one.digest, one
        if not follows:
            raise JournalError(
                f"{segment.path}: entry {after.sequence + 1} does not follow the preceding "
                f"entry of the journal; {ONE_ARCHIVE}"
            )
        after = Position(last.sequence, last.digest)
        yield segment, after, last.entry.admission


def span(first: int, last: int) -> str:
    """Return the numbers of entries as the subject of a sentence."""
    return f"entry {first} is" if first == last else f"entries {first} to {last} are"
