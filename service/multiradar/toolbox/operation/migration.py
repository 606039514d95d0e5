"""Migration: the entries of a journal in a new one, for other sensors, settings or rules."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from multiradar.errors import ConfigurationError, InputError
from multiradar.storage.entries import Entry, EntryKind, StoredEntry, in_pieces

if TYPE_CHECKING:
    from multiradar.estimation.measurement.sensors import SensorTable
    from multiradar.runtime.admission.admission_by_time import Admission
    from multiradar.runtime.admission.sensors_in_force import SensorsInForce
    from multiradar.runtime.live.intake import Submission
    from multiradar.settings.service import Settings
    from multiradar.storage.verification import Progress
    from multiradar_schemas.sensors.sensor import Sensor, SensorsFile


@dataclass
class Migration:
    """What a migration did.

    Attributes
    ----------
    first, entries : int
        The first entry that the old journal has, and the number of entries written.
    accepted_before, accepted : int
        Measurements that were accepted then, and that are now.
    rejected_now : dict of str to int
        Measurements that were accepted then and are rejected now, by code.
    changed_sensors : dict of str to int
        Changes of sensors that were made while the service ran, by sensor. They apply after the
        sensors that are given, unless `override_changes`.
    figures : dict
        What the new service made of them.
    """

    first: int = 1
    entries: int = 0
    accepted_before: int = 0
    accepted: int = 0
    rejected_now: dict[str, int] = field(default_factory=dict)
    changed_sensors: dict[str, int] = field(default_factory=dict)
    figures: dict[str, Any] = field(default_factory=dict)

    def count(self, before: Entry, now: Entry) -> None:
        """Count an entry of the old journal, and the one that it became."""
        self.entries += 1
        self.accepted_before += before.accepted
        self.accepted += now.accepted
        if before.kind is EntryKind.SENSOR:
            from multiradar.runtime.admission.sensors_in_force import changed_sensor

            sensor_id = changed_sensor(before.payload)
            self.changed_sensors[sensor_id] = self.changed_sensors.get(sensor_id, 0) + 1
        if now.accepted < before.accepted:
            known = {row.index for row in before.rejects}
            for row in now.rejects:
                if row.index not in known:
                    self.rejected_now[row.code] = self.rejected_now.get(row.code, 0) + 1


def migrate(
    source: Path, out: Path, settings: "Settings",
    run: "Callable[[Settings, SensorTable, SensorsFile], dict[str, Any]]",
    on_progress: "Progress" = lambda _done, _total: None, *, override_changes: bool = False,
) -> Migration:  # fmt: skip
    """Write the entries of a state or an archive into a new state.

    All measurements are admitted again, by the present rules and the sensors and settings that are
    given. The data clock is that of the old journal: it depends on times of reception, which the
    journal does not contain. Rejected rows stay rejected; keys of messages and changes of sensors
    are kept.

    Parameters
    ----------
    source : Path
        State of a service, backup or archive, which is not changed.
    out : Path
        Folder of the state to create.
    settings : Settings
        The settings of the new service, with its sensors file.
    run : callable
        Called with the settings of the new state and its sensors: replays its journal, writes a
        snapshot, and returns `figures`.
    on_progress : callable
        Called with the number of entries done, and that of all.
    override_changes : bool
        Whether the sensors that are given override changes of them in the journal.

    Returns
    -------
    Migration
        What was done.

    Raises
    ------
    InputError, OutputExistsError
        There is no such source, it has no entries, or `out` exists.
    JournalError
        The source is damaged.
    ConfigurationError
        The journal is of another format, a change of a sensor does not apply to these sensors, or
        changes before the first entry of an archive are unknown.
    """
    from multiradar.runtime.admission.past_admission import PastAdmission
    from multiradar.runtime.admission.sensors_in_force import SensorsInForce
    from multiradar.runtime.engine.fingerprint import configuration_fingerprint, configuration_text
    from multiradar.storage.backup import DATABASE
    from multiradar.storage.output_folder import new_folder
    from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
    from multiradar.toolbox.inputs import load_sensor_table, read_sensors
    from multiradar.toolbox.operation.backups import entries_of

    described = read_sensors(settings.sensors)
    table, tracking = load_sensor_table(settings.sensors, described), settings.tracking_settings()
    sensors = SensorsInForce.of(table, described)
    admission = PastAdmission.for_sensors(sensors.table, tracking.reorder_horizon_s)
    done = Migration()
    with new_folder(out, durable=True) as folder:
        path = folder / DATABASE
        text = configuration_text(described, tracking)
        written = SqliteJournal(path, configuration_fingerprint(table, tracking), text)
        try:
            with entries_of(source) as (first, last, entries):
                done.first = first
                given = {one.id: one for one in described.sensor} if override_changes else {}
                changes = _earlier_changes(source, first, given)
                admitted = _all_admitted(
                    changes, entries, sensors, admission, given=given, done=done
                )
                for piece in in_pieces(admitted):
                    written.append(piece)
                    on_progress(done.entries - len(changes), last - first + 1)
        finally:
            written.close()
        if not done.entries:
            raise InputError(f"{source}: no entries")
        journal = settings.journal.model_copy(update={"path": path})
        done.figures = run(settings.model_copy(update={"journal": journal}), table, described)
    return done


# The entries of the new journal; each is counted.
def _all_admitted(
    changes: "Sequence[bytes]", entries: "Iterable[StoredEntry]", sensors: "SensorsInForce",
    admission: "Admission", *, given: "Mapping[str, Sensor]", done: Migration,
) -> "Iterator[Entry]":  # fmt: skip
    for change in changes:
        sensors = _with_change(change, sensors, admission)
        entry = _change_entry(change, admission)
        done.count(entry, entry)
        yield entry
    for stored in entries:
        entry, sensors = _admitted(stored.entry, sensors, admission, given)
        done.count(stored.entry, entry)
        yield entry


def _admitted(
    entry: Entry, sensors: "SensorsInForce", admission: "Admission", given: "Mapping[str, Sensor]"
) -> "tuple[Entry, SensorsInForce]":
    from multiradar.runtime.admission.sensors_in_force import change_to, changed_sensor
    from multiradar.runtime.live.preparation import prepare

    submission = _submission(entry)
    if submission.kind is EntryKind.SENSOR:
        sensor_id = changed_sensor(entry.payload)
        if sensor_id in given:
            # The entry stays, so that all have their numbers, and changes nothing.
            submission = replace(submission, change=change_to(given[sensor_id]))
        sensors = _with_change(submission.change, sensors, admission)
    prepared = prepare([submission], sensors.table, admission)[0]
    if isinstance(prepared, Exception):
        raise prepared
    admission.use_clock_of(entry.admission)
    return replace(prepared.entry, admission=admission.state()), sensors


def _with_change(
    change: bytes, sensors: "SensorsInForce", admission: "Admission"
) -> "SensorsInForce":
    from multiradar.runtime.admission.sensors_in_force import changed_sensor

    try:
        sensors, _ = sensors.changed(change)
    except ConfigurationError as error:
        raise ConfigurationError(
            f"a change of {changed_sensor(change)} in the journal does not apply to the sensors "
            f"file; use --override-changes to migrate with the sensors file alone ({error})"
        ) from error
    admission.use(sensors.table)
    return sensors


# The last change of each sensor before the first entry, of those that are not given.
def _earlier_changes(source: Path, first: int, given: "Mapping[str, Sensor]") -> list[bytes]:
    from multiradar.runtime.admission.sensors_in_force import changed_sensor
    from multiradar.storage.segments import segments_of
    from multiradar.storage.sqlite.reading import removed_changes
    from multiradar.toolbox.operation.backups import journal_of

    if first == 1:
        return []
    if not (source.is_dir() and segments_of(source)):
        last = {changed_sensor(one): one for one in removed_changes(journal_of(source))}
        return [one for sensor_id, one in last.items() if sensor_id not in given]
    if given:
        return []
    raise ConfigurationError(
        f"{source}: entries before {first} were removed, so sensor changes made with PUT before it "
        "are unknown; use --override-changes to migrate with the sensors file alone"
    )


def _change_entry(change: bytes, admission: "Admission") -> Entry:
    return Entry(EntryKind.SENSOR, "migrate", None, change, 0, (), admission.state())


# The message of an entry, whose accepted rows stood between the rejected ones.
def _submission(entry: Entry) -> "Submission":
    from multiradar.runtime.admission.admission_by_time import data_clock_of
    from multiradar.runtime.live.intake import Submission
    from multiradar.runtime.live.payload import decode_rows
    from multiradar.runtime.live.preparation import INDEX_COLUMN

    frame, change, clock_s = pl.DataFrame(), b"", np.inf
    if entry.kind in (EntryKind.SENSOR, EntryKind.HANDOVER):
        change = entry.payload
    elif entry.kind is EntryKind.CLOCK:
        clock_s = data_clock_of(entry.admission)
    elif entry.payload:
        rows = np.arange(entry.accepted + len(entry.rejects))
        index = np.setdiff1d(rows, [row.index for row in entry.rejects])
        frame = decode_rows(entry.payload).with_columns(
            pl.Series(INDEX_COLUMN, index[: entry.accepted])
        )
    return Submission(
        entry.kind, frame, entry.source, entry.idempotency_key, entry.rejects,
        change=change, clock_s=clock_s,
    )  # fmt: skip
