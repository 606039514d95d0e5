"""Segments of an archive: reading and verification."""

import json
import lzma
import re
from collections.abc import Iterator
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
    return sorted(found, key=lambda one: one.first)


class SegmentReader:
    """Reads a segment once; every entry is verified.

    Parameters
    ----------
    segment : Segment
        The segment.

    Attributes
    ----------
    fingerprint, before : str, bytes
        Fingerprint of the configuration, and digest of the entry before; known once the first entry
        is read.
    skipped : dict of int to str
        Marks on its entries; known once all entries are read.
    """

    def __init__(self, segment: Segment) -> None:
        self._segment = segment
        self.fingerprint, self.before = "", b""
        self.skipped: dict[int, str] = {}
        self._sequence = segment.first

    def entries(self) -> Iterator[StoredEntry]:
        """Yield its entries; raises JournalError where it is damaged."""
        try:
            with lzma.open(self._segment.path, "rb") as stream:
                yield from self._entries(stream)
        except FileNotFoundError as error:
            raise self._damaged("the file is missing") from error
        except (OSError, EOFError, lzma.LZMAError) as error:
            raise self._damaged(f"the file cannot be read: {error}") from error
        except (AttributeError, KeyError, TypeError, UnicodeError, ValueError) as error:
            raise self._damaged("the file is not an archive segment") from error

    def _entries(self, stream: IO[bytes]) -> Iterator[StoredEntry]:
        header = json.loads(stream.readline(LINE_MAX))
        if header["format"] != SEGMENT_VERSION:
            raise JournalError(
                f"{self._segment.path}: expected a segment of format {SEGMENT_VERSION}, was "
                f"{header['format']}; use the multiradar version that wrote it"
            )
        if header["first"] != self._segment.first:
            raise self._damaged(f"the file name does not match entry {header['first']}")
        self.fingerprint, self.before = header["fingerprint"], bytes.fromhex(header["before"])
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
        return JournalError(f"{self._segment.path}: damaged at entry {self._sequence}: {how}")


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
    for segment in segments_of(folder):
        if segment.last <= after.sequence:
            continue
        if segment.first > after.sequence + 1:
            lacking = span(after.sequence + 1, segment.first - 1)
            raise JournalError(f"{folder}: {lacking} missing")
        try:
            # Before it is read, so that what was read is on disk.
            sync(segment.path)
            sync(folder)
        except OSError as error:
            raise JournalError(f"{segment.path}: {error.strerror}") from error
        reader = SegmentReader(segment)
        digest, follows = after.digest, False
        for one in reader.entries():
            if one.sequence == after.sequence + 1:
                before = reader.before if one.sequence == segment.first else digest
                follows = before == after.digest
            digest, last = one.digest, one
        if not follows:
            raise JournalError(
                f"{segment.path}: entry {after.sequence + 1} does not follow the preceding "
                "entry of the journal"
            )
        after = Position(last.sequence, last.digest)
        yield segment, after, last.entry.admission


def span(first: int, last: int) -> str:
    """Return the numbers of entries as the subject of a sentence."""
    return f"entry {first} is" if first == last else f"entries {first} to {last} are"
