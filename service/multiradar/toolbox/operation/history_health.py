"""Checks of the history of a service: its folder, the space for it, and its journal."""

import os
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from multiradar.errors import MultiradarError
from multiradar.storage.full_disk import size_text
from multiradar.storage.sqlite.shortening import digests_of, extent_of
from multiradar.toolbox.operation.findings import Finding, error, ok, unwritable, warning

if TYPE_CHECKING:
    from multiradar.settings.limits import RuntimeLimits

_NAME = "history"
_FREE_SPACE = "free some space, use a larger disk, or lower history.octets"


def check_history(folder: Path, journal: Path, limits: "RuntimeLimits") -> Finding:
    """Check that the service can write a history, as the service itself does.

    Parameters
    ----------
    folder : Path
        The history.
    journal : Path
        The journal.
    limits : RuntimeLimits
        The free space that the journal needs, and the used shares that raise alarms.

    Raises
    ------
    InputError
        The folder is not a history.
    """
    # The service creates the folder itself, but not its parent.
    exists = folder.exists()
    place = folder if exists else folder.absolute().parent
    if not place.exists():
        advice = "create this folder, or correct history.folder"
        return error(_NAME, f"{place}: no such folder", advice)
    why = unwritable(place)
    if why is not None:
        return error(_NAME, f"{place}: {why.text}", why.advice)
    state = "created at the first start"
    if exists:
        state, advice = _written(folder, journal)
        if advice:
            return error(_NAME, f"{folder}: {state}", advice)
    return _space(folder, place, journal, limits, state)


# Up to where it was written, and what to do if it cannot be continued.
def _written(folder: Path, journal: Path) -> tuple[str, str]:
    from multiradar.runtime.recorded.history_files import read_state
    from multiradar.runtime.recorded.history_writer import before, foreign

    found = read_state(folder)
    if not found.sequence:
        return "no entries yet", ""
    base = last = 0
    digest = b""
    if journal.exists():
        try:
            extent = extent_of(journal)
            digest = digests_of(journal, [found.sequence]).get(found.sequence, b"")
        except MultiradarError:
            # The check of the journal says why.
            return "not compared with the journal, which cannot be read", ""
        base, last = extent.base.sequence, extent.last
    if found.sequence < base:
        return before(found.sequence, base)
    if digest.hex() != found.digest:
        return foreign(found.sequence, last)
    return f"covers entries up to {found.sequence:,}", ""


def _space(
    folder: Path, place: Path, journal: Path, limits: "RuntimeLimits", state: str
) -> Finding:
    from multiradar.runtime.recorded.history_writer import FREE_FACTOR

    disk = shutil.disk_usage(place)
    share = 1.0 - disk.free / disk.total
    text = f"{folder}: {state}; {size_text(disk.free)} free, {share:.0%} used"
    least = FREE_FACTOR * limits.disk_free_bytes_min
    if disk.free < least:
        return error(_NAME, f"{text}; at least {size_text(least)} must be free", _FREE_SPACE)
    if share >= limits.disk_filling_share and not _on_one_disk(place, journal):
        return warning(_NAME, text, _FREE_SPACE)
    return ok(_NAME, text)


def _on_one_disk(folder: Path, journal: Path) -> bool:
    other = next(one for one in journal.absolute().parents if one.exists())
    return os.stat(folder).st_dev == os.stat(other).st_dev
