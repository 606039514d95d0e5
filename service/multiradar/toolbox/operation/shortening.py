"""Shortening of a journal: removal of entries that are in its archive, by rules."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from multiradar.errors import ConfigurationError
from multiradar.toolbox.operation.backups import check_configuration, journal_of

if TYPE_CHECKING:
    from multiradar.settings.service import Settings
    from multiradar.storage.retention import Rules, Shortened
    from multiradar.storage.snapshots import Position
    from multiradar.storage.verification import Progress

_DAY_S = 86_400.0


def shorten(
    state: Path, *, archive: Path | None = None, config: Path | None = None,
    sensors: Path | None = None, filter_name: str | None = None,
    on_progress: "Progress" = lambda _done, _total: None,
) -> "Shortened":  # fmt: skip
    """Remove entries of a state, which may be in use, by the rules of its settings.

    Parameters
    ----------
    state : Path
        Folder of the state, or the journal in it.
    archive : Path, optional
        The archive of the journal; that of the settings by default.
    config, sensors : Path, optional
        The settings file and the sensors file of the service.
    filter_name : str, optional
        The filter of the service, if it differs from that of the settings.
    on_progress : callable
        Called with the last entry of each segment that was verified, and that of the journal.

    Returns
    -------
    Shortened
        What was removed.

    Raises
    ------
    ConfigurationError
        No rule or archive is set, the service needs its whole journal with these settings, or the
        journal was created with others.
    InputError, OutputExistsError
        There is no such state or archive, there are too few snapshots, or another command is
        writing to the archive.
    JournalError
        The journal or its archive is damaged, or they do not belong together.
    """
    from multiradar.clock import SystemClock
    from multiradar.runtime.admission.admission_by_time import data_clock_of
    from multiradar.settings.service import load_settings
    from multiradar.storage import retention
    from multiradar.storage.backup import journal_configuration

    overrides: dict[str, Any] = {} if sensors is None else {"sensors": sensors}
    if filter_name is not None:
        overrides["tracking"] = {"filter_name": filter_name}
    if archive is not None:
        overrides["retention"] = {"archive": archive}
    settings, journal = load_settings(config, overrides), journal_of(state)
    rules, folder = _rules(settings), settings.retention.archive
    if folder is None:
        raise ConfigurationError(
            "retention.archive: not set; specify the output of `multiradar archive` here or with "
            "--archive"
        )
    journal = journal.resolve() if journal.is_symlink() else journal
    fingerprint, _ = journal_configuration(journal)
    check_configuration(journal, settings)
    return retention.shorten(
        journal, folder, rules, snapshots=_snapshots(journal, fingerprint, settings),
        time_of=data_clock_of, now_s=SystemClock().now_s(), on_progress=on_progress,
    )  # fmt: skip


def _rules(settings: "Settings") -> "Rules":
    from multiradar.storage.retention import Rules

    given = settings.retention
    if not (given.journal_days or given.journal_octets):
        raise ConfigurationError(
            "retention: no rule for the journal; set journal_days or journal_octets in [retention]"
        )
    return Rules(
        given.journal_days * _DAY_S, given.journal_octets, given.archive_days * _DAY_S,
        given.archive_octets, given.recording_days * _DAY_S,
    )  # fmt: skip


# The snapshots from which a service with these settings starts.
def _snapshots(journal: Path, fingerprint: str, settings: "Settings") -> "list[Position]":
    from multiradar.runtime.engine.epoch_engine import Engine
    from multiradar.runtime.live.processor import Processor
    from multiradar.runtime.live.publication import Publication
    from multiradar.runtime.live.snapshots import SnapshotRules, usable_snapshots, why_none
    from multiradar.runtime.memory.regions.board import RegionBoard
    from multiradar.storage.snapshots import SnapshotFolder
    from multiradar.storage.sqlite.shortening import digests_of, marks_of

    wanted, limits = settings.journal, settings.runtime_limits()
    parts = {
        "trajectories": settings.trajectories.aircraft_max,
        "asterix.output": settings.asterix.output,
    }
    reasons = why_none(limits, [name for name, used in parts.items() if used])
    if not wanted.snapshot_interval_s:
        reasons.append("journal.snapshot_interval_s is 0")
    if reasons:
        raise ConfigurationError(
            f"{journal}: cannot be shortened because the service writes no snapshots, so each "
            f"start needs the whole journal: {'; '.join(reasons)}"
        )
    rules = SnapshotRules(
        SnapshotFolder(journal), wanted.snapshot_interval_s, wanted.snapshot_rows, fingerprint
    )
    kinds: dict[str, type] = {
        "engine": Engine, "processor": Processor, "publication": Publication
    }  # fmt: skip
    if settings.region.name is not None:
        kinds["regions"] = RegionBoard
    return usable_snapshots(
        rules, limits, kinds, marks_of(journal), lambda numbers: digests_of(journal, numbers)
    )
