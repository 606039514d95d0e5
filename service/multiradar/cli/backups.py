"""`multiradar backup`, `archive`, `shorten`, `verify` and `restore`: the state of a service."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from multiradar.cli.options import ConfigOption, FilterOption
from multiradar.errors import DamageError

if TYPE_CHECKING:
    from multiradar.estimation.measurement.sensors import SensorTable
    from multiradar.settings.service import Settings
    from multiradar_schemas.sensors.sensor import SensorsFile

StateArgument = Annotated[
    Path,
    typer.Argument(metavar="STATE", help="State directory of `serve`.", show_default=False),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]


def backup(
    state: StateArgument,
    out: Annotated[
        Path,
        typer.Argument(
            metavar="OUT", help="Directory to create; must not exist.", show_default=False
        ),
    ],
    *,
    sensors: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Sensor configuration of the service.", show_default="sensors.toml"
        ),
    ] = None,
    filter_name: FilterOption = None,
    config: ConfigOption = None,
    json_wanted: JsonOption = False,
) -> None:
    """Copy the state of a service, which may be running: journal, snapshot, sensors, settings."""
    from multiradar.toolbox.messages.progress import counting_bar
    from multiradar.toolbox.operation.backups import backup as copy

    chosen = None if filter_name is None else filter_name.value
    with counting_bar("verifying entries") as show:
        made = copy(
            state, out, sensors=sensors, config=config, filter_name=chosen, on_progress=show
        )
    octets = sum(file.octets for file in made.files.values())
    _print(
        json_wanted,
        asdict(made),
        f"{out}: {_counted(made.entries, made.accepted, made.rejected)}, {octets / 1e6:.1f} MB, "
        f"{made.snapshot or 'no snapshot'}; verified",
    )


def archive(
    state: StateArgument,
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="ARCHIVE",
            help="Directory of the archive; created if absent.",
            show_default=False,
        ),
    ],
    *,
    json_wanted: JsonOption = False,
) -> None:
    """Append new journal entries to an archive, as sealed and compressed segments."""
    from multiradar.toolbox.messages.progress import counting_bar
    from multiradar.toolbox.operation.backups import archive as seal

    with counting_bar("sealing entries") as show:
        new = seal(state, folder, on_progress=show)
    names = [one.path.name for one in new]
    octets = sum(one.path.stat().st_size for one in new)
    entries = sum(one.last - one.first + 1 for one in new)
    _print(
        json_wanted, {"segments": names, "entries": entries, "octets": octets},
        f"{folder}: {_entries(entries)} sealed in {_segments(len(new))}, {octets / 1e6:.1f} MB",
    )  # fmt: skip


def shorten(
    state: StateArgument,
    *,
    archive: Annotated[
        Path | None,
        typer.Option(
            metavar="ARCHIVE",
            help="Archive of this state, created by `archive`.",
            show_default="retention.archive",
        ),
    ] = None,
    sensors: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Sensor configuration of the service.", show_default="sensors.toml"
        ),
    ] = None,
    filter_name: FilterOption = None,
    config: ConfigOption = None,
    json_wanted: JsonOption = False,
) -> None:
    """Remove archived entries from a journal according to the `retention` rules in --config."""
    from multiradar.toolbox.messages.progress import counting_bar
    from multiradar.toolbox.operation.shortening import shorten as remove

    chosen = None if filter_name is None else filter_name.value
    with counting_bar("verifying segments") as show:
        found = remove(
            state, archive=archive, config=config, sensors=sensors, filter_name=chosen,
            on_progress=show,
        )  # fmt: skip
    _print(
        json_wanted, asdict(found),
        f"{state}: {_entries(found.removed)} removed, first entry is now {found.first:,}, "
        f"{found.used_octets / 1e6:.1f} MB in use; {_segments(len(found.segments))} removed; "
        f"{found.reason}",
    )  # fmt: skip


def verify(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="STATE|BACKUP|ARCHIVE",
            help="State directory of `serve` (the service may be running), a backup, or an "
            "archive.",
            show_default=False,
        ),
    ],
    *,
    json_wanted: JsonOption = False,
) -> None:
    """Verify every entry, digest and file of a state, backup or archive; report any damage."""
    from multiradar.storage.verification import Verification
    from multiradar.toolbox.messages.progress import counting_bar
    from multiradar.toolbox.operation.backups import verify as check

    with counting_bar("verifying entries") as show:
        found = check(path, on_progress=show)
    if isinstance(found, Verification):
        entries, kept = found.entries, _number(found.snapshots, "snapshot", "snapshots")
        kept += f", first entry {found.first:,}" if found.first > 1 else ""
    else:
        entries = found.last - found.first + 1
        kept = (
            f"{_segments(found.segments)} from entry {found.first} on, {found.octets / 1e6:.1f} MB"
        )
    counted = _counted(entries, found.accepted, found.rejected)
    if json_wanted or not found.damage:
        _print(
            json_wanted, asdict(found),
            f"{path}: intact: {counted}, {kept}; digest {found.digest[:16]}",
        )  # fmt: skip
    if found.damage:
        raise DamageError(found.damage)


def restore(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="BACKUP|ARCHIVE", help="Output of `backup` or `archive`.", show_default=False
        ),
    ],
    state: Annotated[
        Path,
        typer.Argument(
            metavar="STATE", help="Directory to create; must not exist.", show_default=False
        ),
    ],
    *,
    json_wanted: JsonOption = False,
) -> None:
    """Create a state from a backup or an archive, which is verified first."""
    from multiradar.storage.backup import Backup
    from multiradar.toolbox.messages.progress import counting_bar
    from multiradar.toolbox.operation.backups import SENSORS_FILE, SETTINGS_FILE
    from multiradar.toolbox.operation.backups import restore as copy

    with counting_bar("verifying entries") as show:
        found = copy(folder, state, on_progress=show)
    configured = " --sensors …"
    if isinstance(found, Backup):
        counted = _counted(found.entries, found.accepted, found.rejected)
        configured = f" --sensors {state / SENSORS_FILE} --config {state / SETTINGS_FILE}"
    else:
        counted = _counted(found.last, found.accepted, found.rejected)
    _print(
        json_wanted, asdict(found),
        f"{state}: {counted}; verified. Start the service with: multiradar serve "
        f"--state {state}{configured}, and the other options of the former service (address, "
        "history, credentials, standby), which a backup does not contain",
    )  # fmt: skip


def migrate(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="STATE|BACKUP|ARCHIVE",
            help="State, backup or archive to migrate; it is not changed.",
            show_default=False,
        ),
    ],
    state: Annotated[
        Path,
        typer.Argument(
            metavar="NEW_STATE", help="Directory to create; must not exist.", show_default=False
        ),
    ],
    *,
    sensors: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Sensor configuration of the new service.",
            show_default="sensors.toml",
        ),
    ] = None,
    override_changes: Annotated[
        bool,
        typer.Option(
            "--override-changes",
            help="Use the sensor configuration instead of the changes made with PUT, for the "
            "sensors it contains.",
        ),
    ] = False,
    filter_name: FilterOption = None,
    config: ConfigOption = None,
    json_wanted: JsonOption = False,
) -> None:
    """Migrate a state to other sensors, other settings, or another version or type of processor.

    All measurements are validated again and reprocessed, so the new service starts with the tracks
    and biases that result from these sensors and settings. Track numbers may differ.
    """
    from multiradar.settings.service import load_settings
    from multiradar.toolbox.messages.progress import counting_bar
    from multiradar.toolbox.operation.migration import migrate as carry

    overrides: dict[str, Any] = {} if sensors is None else {"sensors": sensors}
    if filter_name is not None:
        overrides["tracking"] = {"filter_name": filter_name.value}
    settings = load_settings(config, overrides)
    with counting_bar("migrating entries") as show:
        found = carry(source, state, settings, _replayed, show, override_changes=override_changes)
    lost = ", ".join(f"{code} {count:,}" for code, count in sorted(found.rejected_now.items()))
    lost = f" (now rejected: {lost})" if lost else ""
    begin = f" from entry {found.first:,} on" if found.first > 1 else ""
    changed = ", ".join(sorted(found.changed_sensors))
    if changed and not override_changes:
        typer.echo(
            f"multiradar: changes of {changed} that were made with PUT are reapplied and override "
            "the sensors file; --override-changes uses the sensors file instead",
            err=True,
        )
    _print(
        json_wanted, asdict(found),
        f"{state}: {_entries(found.entries)}{begin}, {found.accepted:,} of "
        f"{found.accepted_before:,} measurements accepted{lost}; "
        f"{_number(found.figures['tracks'], 'live track', 'live tracks')}; output digest "
        f"{found.figures['output_sha256'][:16]}. Start the service with: multiradar serve "
        f"--state {state}, and the sensors and settings specified here",
    )  # fmt: skip


# What a service does at its start, and at its end.
def _replayed(
    settings: "Settings", table: "SensorTable", described: "SensorsFile"
) -> dict[str, Any]:
    from multiradar.app import build_service
    from multiradar.runtime.kernel_purposes import serve_purposes
    from multiradar.toolbox.compiling import compile_kernels

    compile_kernels(
        serve_purposes(
            settings.tracking_settings(), table, trajectories=False, asterix=False, feeds=False
        )
    )
    service = build_service(settings, table, described=described)
    service.start()
    try:
        status = service.view.status()
    finally:
        service.stop()
    return {name: status[name] for name in ("tracks", "output_sequence", "output_sha256")}


def _counted(entries: int, accepted: int, rejected: int) -> str:
    return f"{entries:,} entries, {accepted:,} measurements, {rejected:,} rejected rows"


def _print(json_wanted: bool, document: Mapping[str, Any], line: str) -> None:
    print(json.dumps(document) if json_wanted else line)


def _number(count: int, one: str, several: str) -> str:
    return f"{count:,} {one if count == 1 else several}"


def _entries(count: int) -> str:
    return _number(count, "entry", "entries")


def _segments(count: int) -> str:
    return _number(count, "segment", "segments")
