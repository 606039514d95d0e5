"""Retention: which entries of a journal, and which segments of its archive, are removed.

Entries are removed by whole segments of the archive, oldest first, and only those that a start does
not need: up to the older of the two newest snapshots. Segments are removed only if the journal no
longer has their entries, and never before the time that legal recording requires; the last one
stays, because the archive goes on behind it.
"""

import math
import os
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from multiradar.clock import Clock
from multiradar.errors import InputError, MultiradarError
from multiradar.storage.archive import locked_archive
from multiradar.storage.segments import (
    Segment,
    SegmentReader,
    check_chain,
    sealed_after,
    segments_of,
)
from multiradar.storage.snapshots import KEPT, Position, SnapshotFolder
from multiradar.storage.sqlite.shortening import Extent, digests_of, extent_of, remove_until
from multiradar.storage.sqlite.sqlite_file import sync

#: The status has what was found at most so long ago, s: an archive may have thousands of files.
_FOUND_S = 10.0

#: Called with the last entry of each segment that was verified, and that of the journal.
Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Rules:
    """What is removed; 0 disables a rule.

    Attributes
    ----------
    age_s : float
        Entries are removed from the journal when they are older, s of data time.
    octets : int
        The oldest are removed while the journal uses more.
    archive_age_s : float
        Segments are removed from the archive when they are older, s.
    archive_octets : int
        The oldest are removed while the archive has more.
    recording_s : float
        No segment is removed that is younger: legal recording, s.
    """

    age_s: float = 0.0
    octets: int = 0
    archive_age_s: float = 0.0
    archive_octets: int = 0
    recording_s: float = 30 * 86_400.0


@dataclass(frozen=True, slots=True)
class Shortened:
    """What a run removed.

    Attributes
    ----------
    removed, first : int
        Removed entries, and the first that the journal has now.
    used_octets : int
        Octets of the journal's file that are in use; the file itself does not shrink.
    segments : tuple of str
        Removed segments of the archive.
    reason : str
        Why no more entries were removed.
    """

    removed: int
    first: int
    used_octets: int
    segments: tuple[str, ...]
    reason: str


def shorten(
    journal: Path, archive: Path, rules: Rules, *, snapshots: Sequence[Position],
    time_of: Callable[[str], float], now_s: float,
    on_progress: Progress = lambda _done, _total: None,
) -> Shortened:  # fmt: skip
    """Remove what the rules allow; a service may be running.

    Parameters
    ----------
    journal : Path
        The database file of the journal.
    archive : Path
        Its archive.
    rules : Rules
        The rules.
    snapshots : sequence of Position
        The snapshots that a start can use, the newest first.
    time_of : callable
        Returns the data time of a state of the admission, Unix time, s; not finite: unknown.
    now_s : float
        The time of the machine, UTC, s: a data time ahead of it does not make data older.
    on_progress : callable
        Called with the last entry of each segment that was verified, and that of the journal.

    Returns
    -------
    Shortened
        What was removed.

    Raises
    ------
    InputError, OutputExistsError
        There are too few snapshots, there is no archive, or another command is writing to it.
    JournalError
        The journal or a segment is damaged, or they do not belong together; what was removed before
        is in the archive.
    """
    if len(snapshots) < KEPT:
        raise InputError(
            f"{journal}: expected {KEPT} snapshots that this version can use with these settings, "
            f"found {len(snapshots)}; nothing is removed until they exist: the running service "
            "writes them (docs/howto/journal.md#snapshots)"
        )
    if not segments_of(archive):
        raise InputError(f"{archive}: no segments; run `multiradar archive` first")
    needed = min(one.sequence for one in snapshots[:KEPT])
    with locked_archive(archive):
        before = extent_of(journal)
        places = [one.first - 1 for one in segments_of(archive)]
        check_chain(archive, digests_of(journal, places), before.base.sequence)
        newest_s = time_of(before.admission) if before.admission else -math.inf
        # An unknown time makes nothing older.
        newest_s = min(newest_s, now_s) if math.isfinite(newest_s) else -math.inf

        def age_of(admission: str) -> float:
            time_s = time_of(admission)
            return newest_s - time_s if math.isfinite(time_s) else -math.inf

        reason = _shorten_journal(
            journal, archive, rules, before, needed=needed, age_of=age_of, on_progress=on_progress
        )
        after = extent_of(journal)
        removed = _shorten_archive(archive, rules, after.base.sequence, now_s, age_of)
    return Shortened(
        after.base.sequence - before.base.sequence, after.base.sequence + 1, after.used_octets,
        tuple(one.path.name for one in removed), reason,
    )  # fmt: skip


def _shorten_journal(
    journal: Path, archive: Path, rules: Rules, extent: Extent, *, needed: int,
    age_of: Callable[[str], float], on_progress: Progress,
) -> str:  # fmt: skip
    begin = Position(extent.base.sequence, extent.base.digest)
    used = extent.used_octets
    for segment, end, admission in sealed_after(archive, begin):
        on_progress(end.sequence, extent.last)
        is_old = bool(rules.age_s) and age_of(admission) >= rules.age_s
        if not (is_old or (rules.octets and used > rules.octets)):
            return (
                f"{segment.path.name} remains in the journal: its last entry, {end.sequence}, is "
                "within the configured age and size, and only whole segments are removed"
            )
        if end.sequence > needed:
            return (
                f"entries after {needed} are needed to start from the snapshots, and the next "
                f"segment, {segment.path.name}, ends with entry {end.sequence}"
            )
        remove_until(journal, end)
        used = extent_of(journal).used_octets
    return "the archive has no further entries"


def _shorten_archive(
    archive: Path, rules: Rules, base: int, now_s: float, age_of: Callable[[str], float]
) -> list[Segment]:  # fmt: skip
    removed: list[Segment] = []
    if not (rules.archive_age_s or rules.archive_octets):
        return removed
    found = segments_of(archive)
    octets = sum(one.path.stat().st_size for one in found)
    for segment in found[:-1]:
        if segment.last > base:
            break
        state = segment.path.stat()
        # The time of the file: a wrong clock of the data must not end the recording.
        age_s = now_s - state.st_mtime
        if age_s >= rules.recording_s:
            *_, last = SegmentReader(segment).entries()
            age_s = min(age_s, age_of(last.entry.admission))
        is_due = (rules.archive_age_s and age_s >= rules.archive_age_s) or (
            rules.archive_octets and octets > rules.archive_octets
        )
        if not is_due or age_s < rules.recording_s:
            break
        os.unlink(segment.path)
        sync(archive)
        removed.append(segment)
        octets -= state.st_size
    return removed


class Retained:
    """What a service retains, for its status.

    Parameters
    ----------
    journal : Path
        The database file of the journal.
    archive : Path or None
        Its archive, if it has one.
    time_of : callable
        Returns the data time of a state of the admission, Unix time, s; not finite: unknown.
    clock : Clock
        Its state is read again after 10 s.
    """

    def __init__(
        self, journal: Path, archive: Path | None, time_of: Callable[[str], float], clock: Clock
    ) -> None:
        self._journal, self._archive = journal, archive
        self._time_of, self._clock = time_of, clock
        self._lock = threading.Lock()
        self._found: tuple[float, dict[str, Any]] | None = None

    def document(self) -> dict[str, Any]:
        """Return what is retained.

        Returns
        -------
        dict
            `first_entry`, `first_time_s` and `used_bytes` of the journal: its first entry, the data
            time after it, and the octets in use; `snapshots`: the last entry of each, the newest
            first; `archive`: None without one, else `first_entry`, `last_entry`, `segments` and
            `used_bytes`. What cannot be read is None.
        """
        with self._lock:
            now_s = self._clock.monotonic_s()
            if self._found is None or now_s - self._found[0] >= _FOUND_S:
                files = SnapshotFolder(self._journal).files()
                snapshots = [int(one.stem) for one in files if one.stem.isdecimal()]
                document = {**self._in_journal(), "snapshots": snapshots}
                self._found = now_s, document | {"archive": self._in_archive()}
            return self._found[1]

    def _in_journal(self) -> dict[str, Any]:
        names = ("first_entry", "first_time_s", "used_bytes")
        try:
            found = extent_of(self._journal)
        except (OSError, MultiradarError):
            # Before the first start; of a damaged one the service itself says why.
            return dict.fromkeys(names)
        time_s = self._time_of(found.first_admission) if found.first_admission else math.nan
        first_s = time_s if math.isfinite(time_s) else None
        return dict(zip(names, (found.base.sequence + 1, first_s, found.used_octets), strict=True))

    def _in_archive(self) -> dict[str, Any] | None:
        found = [] if self._archive is None else segments_of(self._archive)
        try:
            octets = sum(one.path.stat().st_size for one in found)
        except OSError:
            # Removed meanwhile.
            return None
        return None if not found else {
            "first_entry": found[0].first, "last_entry": found[-1].last, "segments": len(found),
            "used_bytes": octets,
        }  # fmt: skip
