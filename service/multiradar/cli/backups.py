"""`multiradar backup`, `verify` and `restore`: the state of a service, copied and checked."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from multiradar.cli.options import ConfigOption, FilterOption
from multiradar.errors import DamageError

JsonOption = Annotated[bool, typer.Option("--json", help="Print what was found as JSON.")]


def backup(
    state: Annotated[
        Path,
        typer.Argument(metavar="STATE", help="State of `serve`: its folder.", show_default=False),
    ],
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
    """Copy the state of a service, also while it runs: journal, snapshot, sensors and settings."""
    from multiradar.toolbox.backups import backup as copy
    from multiradar.toolbox.progress import counting_bar

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


def verify(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="STATE|BACKUP",
            help="State of `serve`, also while it runs, or a backup.",
            show_default=False,
        ),
    ],
    *,
    json_wanted: JsonOption = False,
) -> None:
    """Check every entry, digest and file of a state or a backup; name what is damaged."""
    from multiradar.toolbox.backups import verify as check
    from multiradar.toolbox.progress import counting_bar

    with counting_bar("verifying entries") as show:
        found = check(path, on_progress=show)
    snapshots = f"{found.snapshots} snapshot{'' if found.snapshots == 1 else 's'}"
    counted = _counted(found.entries, found.accepted, found.rejected)
    if json_wanted or not found.damage:
        _print(
            json_wanted, asdict(found),
            f"{path}: sound: {counted}, {snapshots}; digest {found.digest[:16]}",
        )  # fmt: skip
    if found.damage:
        raise DamageError(found.damage)


def restore(
    folder: Annotated[
        Path,
        typer.Argument(metavar="BACKUP", help="Output of `backup`.", show_default=False),
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
    """Create a state from a backup, which is verified before and after it is copied."""
    from multiradar.toolbox.backups import SENSORS_FILE, SETTINGS_FILE
    from multiradar.toolbox.backups import restore as copy
    from multiradar.toolbox.progress import counting_bar

    with counting_bar("verifying entries") as show:
        found = copy(folder, state, on_progress=show)
    _print(
        json_wanted, asdict(found),
        f"{state}: {_counted(found.entries, found.accepted, found.rejected)}; verified. Start it "
        f"with: multiradar serve --state {state} --sensors {state / SENSORS_FILE} "
        f"--config {state / SETTINGS_FILE}",
    )  # fmt: skip


def _counted(entries: int, accepted: int, rejected: int) -> str:
    return f"{entries:,} entries, {accepted:,} measurements, {rejected:,} rejected rows"


def _print(json_wanted: bool, document: Mapping[str, Any], line: str) -> None:
    print(json.dumps(document) if json_wanted else line)
