"""Checks of the state of a service: folders, disk, journal, snapshots, archive and clock."""

import math
import os
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from multiradar.clock import Clock
from multiradar.errors import InputError, MultiradarError
from multiradar.storage.full_disk import size_text
from multiradar.storage.snapshots import SnapshotFolder
from multiradar.storage.sqlite.growth import Growth, growth_of
from multiradar.storage.sqlite.shortening import digests_of
from multiradar.toolbox.operation.findings import Finding, error, ok, unwritable, warning

if TYPE_CHECKING:
    from multiradar.settings.limits import RuntimeLimits
    from multiradar.storage.verification import Progress, Verification

_GIB = 1 << 30
_DAY_S = 86_400.0
#: A rate of less data than this is none, s.
_SPAN_MIN_S = 60.0
#: A disk that lasts shorter is a warning, days.
_LASTS_MIN_DAYS = 30.0
#: Newest live data may be so old, s.
_LIVE_MAX_S = 60.0
#: No clock is right that is before this program was written: 2026-01-01, s.
_WRITTEN_S = 1_767_225_600.0
_RECOVERY = "see docs/howto/backup.md and docs/howto/journal.md"
_ARCHIVE_ADVICE = (
    "keep only the segments of one archive in the folder; if the journal still has the entries of "
    "a damaged or missing segment, remove this segment and all later ones and run `multiradar "
    "archive` again, otherwise restore it from another copy of the archive"
)

_OTHER_ARCHIVE = (
    "the archive belongs to another journal, or the journal was restored from a backup: "
    "`multiradar archive` names the segments to move (docs/howto/backup.md)"
)


def check_folders(journal: Path, *others: Path | None) -> Finding:
    """Check that folders can be written: those of the journal and of temporary files.

    Parameters
    ----------
    journal : Path
        The journal.
    *others : Path or None
        Folders that are only read.
    """
    temporary = Path(tempfile.gettempdir())
    written = [(journal.parent, "the journal"), (temporary, "temporary files")]
    for folder, use in written:
        place = next(one for one in (folder, *folder.absolute().parents) if one.exists())
        why = unwritable(place)
        if why is not None:
            return error("folders", f"{place}: {why.text}", f"it is needed for {use}: {why.advice}")
    unreadable = [str(one) for one in others if one is not None and not os.access(one, os.R_OK)]
    if unreadable:
        return error("folders", f"{', '.join(unreadable)}: not readable", "correct the settings")
    made = "" if journal.parent.exists() else " (created at the first start)"
    return ok("folders", f"writable: {journal.parent}{made}, {temporary}")


def check_disk(journal: Path, limits: "RuntimeLimits", growth: Growth | None) -> Finding:
    """Check the space on the disk of the journal, and how long it lasts at the rate of its end.

    Parameters
    ----------
    journal : Path
        The journal.
    limits : RuntimeLimits
        The least free space, and the used shares that raise alarms.
    growth : Growth or None
        The last entries.
    """
    place = next(one for one in journal.absolute().parents if one.exists())
    disk = shutil.disk_usage(place)
    share = 1.0 - disk.free / disk.total
    rate = _octets_per_day(growth)
    # Below the least free space it is not ready.
    days = (disk.free - limits.disk_free_bytes_min) / rate if rate else None
    text = f"{size_text(disk.free)} free, {share:.0%} used; " + (
        "data rate still unknown" if rate is None or days is None
        else f"{rate / _GIB:.3g} GiB per day: sufficient for {max(days, 0.0):,.1f} days"
    )  # fmt: skip
    advice = "archive the journal, free some space, or use a larger disk (docs/howto/backup.md)"
    if disk.free < limits.disk_free_bytes_min:
        return error(
            "disk",
            f"{text}; at least {size_text(limits.disk_free_bytes_min)} must be free",
            advice,
        )
    if share >= limits.disk_filling_share or (days is not None and days < _LASTS_MIN_DAYS):
        return warning("disk", text, advice)
    return ok("disk", text)


def verified(
    journal: Path, on_progress: "Progress", *, no_snapshots: Sequence[str] = ()
) -> "tuple[Verification | None, list[Finding]]":
    """Verify a journal with its snapshots.

    Parameters
    ----------
    journal : Path
        The journal.
    on_progress : callable
        Called with the number of verified entries and that of all.
    no_snapshots : sequence of str
        Why the service writes no snapshots; empty if it does.

    Returns
    -------
    Verification or None, list of Finding
        What was found; without a journal None.
    """
    from multiradar.storage.verification import verify_journal

    try:
        found = verify_journal(journal, on_progress)
    except MultiradarError as failure:
        if isinstance(failure, InputError) and not journal.exists():
            text = f"{journal}: not created yet; the service creates it at the first start"
            return None, [ok("journal", text)]
        return None, [error("journal", str(failure), f"restore a backup; {_RECOVERY}")]
    folder = SnapshotFolder(journal).path
    damage = [one for one in found.damage if one.startswith(f"{folder}: ")]
    own = [one for one in found.damage if one not in damage]
    why = unwritable(folder) if folder.exists() and not no_snapshots else None
    snapshots = _snapshots(found, damage, no_snapshots)
    if why is not None:
        text = f"{folder}: {why.text}: no snapshot can be written"
        snapshots = warning("snapshots", "; ".join([text, *damage[:1]]), why.advice)
    return found, [_journal(journal, found, own), snapshots]


def _journal(journal: Path, found: "Verification", own: Sequence[str]) -> Finding:
    if own:
        return error("journal", _shown(own), f"restore a backup; {_RECOVERY}")
    return ok("journal", f"{journal}: {found.entries:,} entries, {found.accepted:,} measurements")


def _snapshots(
    found: "Verification", damage: Sequence[str], no_snapshots: Sequence[str]
) -> Finding:
    if no_snapshots:
        reasons = "; ".join(no_snapshots)
        return ok("snapshots", f"none, so each start replays the whole journal: {reasons}")
    if damage:
        return warning(
            "snapshots", _shown(damage), "the next start uses an older snapshot or the whole "
            "journal; remove the damaged snapshot, and check the disk",
        )  # fmt: skip
    if found.entries and not found.snapshots:
        return warning(
            "snapshots", "no snapshot: the next start replays the whole journal",
            "stop the service with SIGTERM, which writes a snapshot; see "
            "docs/howto/journal.md#snapshots",
        )  # fmt: skip
    return ok("snapshots", f"{found.snapshots} intact")


def check_archive(folder: Path, journal: Path, entries: int, on_progress: "Progress") -> Finding:
    """Verify an archive, and compare its last entry with that of a journal.

    Parameters
    ----------
    folder : Path
        The archive.
    journal : Path
        The journal.
    entries : int
        Number of its last entry; 0: none, or it cannot be read.
    on_progress : callable
        Called with the number of verified entries and that of all.

    Raises
    ------
    InputError
        There is no archive.
    """
    from multiradar.storage.archive import verify_archive

    found = verify_archive(folder, on_progress)
    if found.damage:
        advice = f"{_ARCHIVE_ADVICE}; {_RECOVERY}"
        return error("archive", _shown(found.damage), advice)
    text = f"{folder}: entries {found.first:,} to {found.last:,} in {found.segments} segments"
    if found.last > entries:
        return error("archive", f"{text}, but the journal has only {entries:,}", _OTHER_ARCHIVE)
    # An archive without the last removed entries has none to compare.
    digest = digests_of(journal, [found.last]).get(found.last)
    if digest is not None and digest.hex() != found.digest:
        text += f", but entry {found.last:,} of the journal is another one"
        return error("archive", text, _OTHER_ARCHIVE)
    return ok("archive", text)


def check_clock(clock: Clock, ahead_max_s: float, growth: Growth | None, running: bool) -> Finding:
    """Compare the clock of the machine with the newest measurement.

    Parameters
    ----------
    clock : Clock
        The clock.
    ahead_max_s : float
        Measurements farther ahead of it are rejected, s.
    growth : Growth or None
        The last entries.
    running : bool
        Whether a service is running, and should have live data.
    """
    now_s = clock.now_s()
    advice = "synchronise the clock (NTP or PTP)"
    if now_s < _WRITTEN_S:
        return error("clock", "the clock of this computer is set to a date before 2026", advice)
    newest_s = None if growth is None else _data_time_s(growth.last)
    if newest_s is None:
        return ok("clock", "plausible; no measurements for comparison")
    behind_s = now_s - newest_s
    if behind_s < -ahead_max_s:
        return error(
            "clock", f"the newest measurement is {-behind_s:,.0f} s ahead of the clock; "
            f"measurements more than {ahead_max_s:g} s ahead are rejected", advice,
        )  # fmt: skip
    text = f"the newest measurement is {_ago(behind_s)} old"
    if running and behind_s > _LIVE_MAX_S:
        text += ", although the service is running"
        return warning("clock", text, f"check the feeds; {advice}")
    return ok("clock", text)


def using_process(journal: Path) -> int | None:
    """Return the process that has locked a journal; None if there is none, or it is unknown.

    The lock itself is not tried: a service that starts at this moment would find it locked.
    """
    try:
        number = journal.stat().st_ino
        lines = Path("/proc/locks").read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    for line in lines:
        # 3: FLOCK  ADVISORY  WRITE 1234 08:02:5678 0 EOF
        part = line.split()
        if part[1] == "FLOCK" and part[5].rpartition(":")[2] == str(number):
            return int(part[4])
    return None


def recent(journal: Path) -> Growth | None:
    """Return the last entries of a journal; None if there are none, or they cannot be read."""
    try:
        return growth_of(journal) if journal.exists() else None
    except MultiradarError:
        # The check of the journal says why.
        return None


def _octets_per_day(growth: Growth | None) -> float | None:
    if growth is None:
        return None
    first_s, last_s = _data_time_s(growth.first), _data_time_s(growth.last)
    if first_s is None or last_s is None or last_s - first_s < _SPAN_MIN_S:
        return None
    return growth.octets / (last_s - first_s) * _DAY_S


def _data_time_s(admission: str) -> float | None:
    from multiradar.runtime.admission.admission_by_time import data_clock_of

    try:
        time_s = data_clock_of(admission)
    except (IndexError, KeyError, TypeError, ValueError):
        # Of a damaged entry, which the check of the journal names.
        return None
    return time_s if math.isfinite(time_s) else None


def _ago(seconds: float) -> str:
    for unit, length_s in (("days", _DAY_S), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * length_s:
            return f"{seconds / length_s:,.0f} {unit}"
    return f"{max(seconds, 0.0):.0f} s"


def _shown(damage: Sequence[str]) -> str:
    more = f" ({len(damage) - 1} more: run `multiradar verify`)" if len(damage) > 1 else ""
    return f"{damage[0]}{more}"
