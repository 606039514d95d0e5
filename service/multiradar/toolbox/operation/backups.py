"""Backup, archive, verification and restoration of the state of a service."""

import json
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from multiradar.errors import ConfigurationError, DamageError

if TYPE_CHECKING:
    from multiradar.settings.service import Settings
    from multiradar.storage.archive import Archived
    from multiradar.storage.backup import Backup
    from multiradar.storage.entries import StoredEntry
    from multiradar.storage.segments import Segment
    from multiradar.storage.verification import Progress, Verification

#: Files of the configuration in a backup.
SENSORS_FILE, SETTINGS_FILE = "sensors.toml", "settings.toml"
#: Sections of the settings on which the output, or the use of snapshots, depends.
_SECTIONS = ("tracking", "runtime", "region")
# Addresses, which belong to the host.
_ADDRESSES = frozenset({"listen", "endpoint"})


def backup(
    state: Path, out: Path, *, sensors: Path | None = None,
    config: Path | None = None, filter_name: str | None = None,
    on_progress: "Progress" = lambda _done, _total: None,
) -> "Backup":  # fmt: skip
    """Copy the state of a service, which may be running.

    Parameters
    ----------
    state : Path
        Folder of the state, or the journal in it.
    out : Path
        The folder to create.
    sensors, config : Path, optional
        The sensors file and the settings file of the service.
    filter_name : str, optional
        The filter of the service, if it differs from that of the settings.
    on_progress : callable
        Called with the number of verified entries and that of all.

    Returns
    -------
    Backup
        What it contains.

    Raises
    ------
    ConfigurationError
        The journal was created with other sensors or settings; the service could not continue it
        with those in the backup.
    DamageError
        The state is damaged; nothing is kept.
    InputError, OutputExistsError
        There is no such state, or the output cannot be written.
    """
    from importlib.metadata import version

    from multiradar.clock import SystemClock
    from multiradar.settings.service import load_settings
    from multiradar.storage.backup import DATABASE, write_backup
    from multiradar.storage.output_folder import new_folder, remove_abandoned
    from multiradar.storage.sqlite.opening import require_journal

    overrides: dict[str, Any] = {} if sensors is None else {"sensors": sensors}
    if filter_name is not None:
        overrides["tracking"] = {"filter_name": filter_name}
    settings = load_settings(config, overrides)
    journal = journal_of(state)
    # Before its sensors file, which is not that of another folder.
    require_journal(journal)
    # Daily backups have names of their own: none would remove what a killed one has left.
    remove_abandoned(out.absolute().parent, DATABASE)
    with new_folder(out, durable=True) as folder:
        check_configuration(journal, settings)
        extra = {
            SENSORS_FILE: settings.sensors.read_bytes(),
            SETTINGS_FILE: _settings_text(settings).encode(),
        }
        return write_backup(
            journal, folder, extra, time_s=SystemClock().now_s(), version=version("multiradar"),
            on_progress=on_progress,
        )  # fmt: skip


def archive(
    state: Path, folder: Path, *, on_progress: "Progress" = lambda _done, _total: None
) -> "list[Segment]":
    """Seal the entries of a state, which may be in use, that are not yet in an archive.

    Parameters
    ----------
    state : Path
        Folder of the state, or the journal in it.
    folder : Path
        The archive; created when absent.
    on_progress : callable
        Called with the number of the last sealed entry and that of all.

    Returns
    -------
    list of Segment
        The new segments.

    Raises
    ------
    InputError, OutputExistsError
        There is no such state, or the archive cannot be written.
    JournalError, ConfigurationError
        The journal is damaged, of another format, or not that of the archive.
    """
    from multiradar.storage.archive import archive_journal

    return archive_journal(journal_of(state), folder, on_progress=on_progress)


def verify(
    path: Path, *, on_progress: "Progress" = lambda _done, _total: None
) -> "Verification | Archived":
    """Verify a state, which may be in use, or a backup; nothing is changed.

    Parameters
    ----------
    path : Path
        Folder of a state or of a backup, or a journal.
    on_progress : callable
        Called with the number of verified entries and that of all.

    Returns
    -------
    Verification
        What was found; `damage` is empty if all is intact.

    Raises
    ------
    InputError
        There is neither.
    JournalError, ConfigurationError
        It is not a journal, or has another format.
    """
    from multiradar.storage.archive import verify_archive
    from multiradar.storage.backup import MANIFEST, verify_backup
    from multiradar.storage.segments import segments_of
    from multiradar.storage.verification import verify_journal

    if (path / MANIFEST).is_file():
        return verify_backup(path, on_progress)
    if segments_of(path):
        return verify_archive(path, on_progress)
    return verify_journal(journal_of(path), on_progress)


def restore(
    folder: Path, state: Path, *, on_progress: "Progress" = lambda _done, _total: None
) -> "Backup | Archived":
    """Restore a backup or an archive into a new folder; it is verified before and after.

    Parameters
    ----------
    folder : Path
        The backup or archive.
    state : Path
        The folder to create, for `serve --state`.
    on_progress : callable
        Called with the number of verified entries and that of all.

    Returns
    -------
    Backup
        What was restored.

    Raises
    ------
    DamageError
        The backup is damaged; nothing is created.
    InputError, OutputExistsError
        There is no backup, or the folder exists or cannot be written.
    """
    from multiradar.storage.archive import restore_archive
    from multiradar.storage.backup import DATABASE, copy_backup, read_backup, verify_backup
    from multiradar.storage.output_folder import check_new, new_folder
    from multiradar.storage.segments import segments_of

    check_new(state)
    if segments_of(folder):
        with new_folder(state, durable=True) as made:
            return restore_archive(folder, made / DATABASE, on_progress)
    listed = read_backup(folder)
    damage = verify_backup(folder, on_progress).damage
    if damage:
        raise DamageError(damage)
    with new_folder(state, durable=True) as made:
        copy_backup(folder, made)
    return listed


def is_journal(path: Path) -> bool:
    """Return whether a path is the state of a service, a backup, a journal or an archive."""
    from multiradar.storage.segments import segments_of
    from multiradar_schemas.documents.contents import content

    if path.is_dir():
        return journal_of(path).is_file() or bool(segments_of(path))
    return content(path) == "an SQLite database"


def entries_of(
    source: Path,
) -> "AbstractContextManager[tuple[int, int, Iterator[StoredEntry]]]":
    """Open a state, which may be in use, a backup or an archive for reading.

    Parameters
    ----------
    source : Path
        Its folder, or the journal in it.

    Returns
    -------
    context manager
        Of the numbers of its first and last entry, and its entries, each verified when it is read.

    Raises
    ------
    InputError
        There is none.
    JournalError, ConfigurationError
        It is damaged, or of another format.
    """
    from multiradar.storage.archive import archive_entries
    from multiradar.storage.segments import segments_of
    from multiradar.storage.sqlite.reading import journal_entries

    if source.is_dir() and segments_of(source):
        return archive_entries(source)
    return journal_entries(journal_of(source))


def journal_of(state: Path) -> Path:
    """Return the journal of a state: a file that is given itself, or that in its folder."""
    from multiradar.storage.backup import DATABASE

    return state if state.is_file() else state / DATABASE


def check_configuration(journal: Path, settings: "Settings") -> None:
    """Check that a journal can be continued: only with its original sensors and settings.

    See `configuration_difference` for the parameters.

    Raises
    ------
    ConfigurationError
        It was created with others.
    """
    difference = configuration_difference(journal, settings)
    if difference:
        raise ConfigurationError(
            f"{difference}; run this command with the options of the service (--sensors, "
            "--config, --filter)"
        )


def configuration_difference(journal: Path, settings: "Settings") -> str:
    """Return why a journal cannot be continued with sensors and settings; empty if it can.

    Parameters
    ----------
    journal : Path
        The journal.
    settings : Settings
        The settings, with the path of the sensors file.
    """
    from multiradar.runtime.engine.fingerprint import (
        configuration_fingerprint,
        configuration_text,
        differences,
    )
    from multiradar.storage.backup import journal_configuration
    from multiradar.toolbox.inputs import load_sensor_table, read_sensors

    described, tracking = read_sensors(settings.sensors), settings.tracking_settings()
    table = load_sensor_table(settings.sensors, described)
    fingerprint, text = journal_configuration(journal)
    if fingerprint == configuration_fingerprint(table, tracking):
        return ""
    other = differences(text, configuration_text(described, tracking)) or (
        f"sensors other than {settings.sensors}, with other tracking settings, or on another type "
        "of processor"
    )
    return f"{journal}: the journal was created with {other}"


# The settings that differ from their defaults, as TOML.
def _settings_text(settings: "Settings") -> str:
    lines = []
    for name in _SECTIONS:
        section = getattr(settings, name)
        defaults = type(section)().model_dump()
        given = {
            key: value
            for key, value in section.model_dump().items()
            if value != defaults[key] and key not in _ADDRESSES
        }
        if given:
            lines += [f"[{name}]", *(f"{key} = {_toml(one)}" for key, one in given.items())]
    return "".join(f"{line}\n" for line in lines)


# A value as TOML on one line; JSON values except objects are TOML values.
def _toml(value: Any) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, dict):
        given = (
            f"{key} = {_toml(one)}"
            for key, one in value.items()
            if one is not None and key not in _ADDRESSES
        )
        return f"{{{', '.join(given)}}}"
    return json.dumps(value)
