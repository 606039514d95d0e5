"""`multiradar doctor`: checks of an installation, with advice."""

import json
from pathlib import Path
from typing import Annotated

import typer

from multiradar.cli.options import ConfigOption, FilterOption


def doctor(
    *,
    state: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Directory of the journal.", show_default="multiradar-data"
        ),
    ] = None,
    sensors: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Sensor configuration: sensors.toml.", show_default="sensors.toml"
        ),
    ] = None,
    filter_name: FilterOption = None,
    archive: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Archive to verify (output of `archive`).",
            show_default="retention.archive",
        ),
    ] = None,
    config: ConfigOption = None,
    json_wanted: Annotated[
        bool, typer.Option("--json", help="Print the findings as JSON.")
    ] = False,
) -> None:
    """Check an installation, with the options of `serve`: one line per check, with advice.

    Changes nothing; the service may be running. The exit status is 1 if any check fails.
    """
    from multiradar.toolbox.messages.progress import counting_bar
    from multiradar.toolbox.operation.doctor import examine
    from multiradar.toolbox.operation.findings import Level

    with counting_bar("verifying entries") as show:
        findings = examine(
            state=state, config=config, sensors=sensors, archive=archive,
            filter_name=None if filter_name is None else filter_name.value, on_progress=show,
        )  # fmt: skip
    failed = any(one.level is Level.ERROR for one in findings)
    if json_wanted:
        print(json.dumps({"sound": not failed, "checks": [one._asdict() for one in findings]}))
    else:
        for one in findings:
            advice = f"; {one.advice}" if one.advice else ""
            print(f"{one.level:<8} {one.check}: {one.text}{advice}")
    if failed:
        raise typer.Exit(1)
