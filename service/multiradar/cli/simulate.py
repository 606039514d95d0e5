"""`multiradar simulate`: measurements and truth from a scenario."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from multiradar.cli.options import JsonOption
from multiradar.cli.terminal.findings import with_findings
from multiradar.toolbox.simulation import DURATION_MAX_S, DURATION_MIN_S, SEED_MAX

if TYPE_CHECKING:
    from multiradar.toolbox.simulation import Simulation


def simulate(
    scene: Annotated[
        str | None,
        typer.Argument(
            metavar="SCENARIO",
            help="Built-in scenario (see --list), or a TOML file.",
            show_default=False,
        ),
    ] = None,
    *,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Output directory; must not exist.",
            show_default=False,
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=SEED_MAX,
            help="Random seed; default: the seed of the scenario.",
            show_default=False,
        ),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(
            "--duration",
            metavar="S",
            min=DURATION_MIN_S,
            max=DURATION_MAX_S,
            help="Duration, s; default: the duration of the scenario.",
            show_default=False,
        ),
    ] = None,
    list_wanted: Annotated[
        bool, typer.Option("--list", help="List the built-in scenarios.")
    ] = False,
    json_wanted: JsonOption = False,
) -> None:
    """Simulate a scenario: write measurements, a sensors.toml for `track`, and the truth."""
    if list_wanted:
        _print_scenes(json_wanted)
        return
    if scene is None:
        msg = "missing argument SCENARIO: a built-in scenario (see --list) or a TOML file"
        raise typer.BadParameter(msg)
    if out is None:
        msg = "missing option --out DIR"
        raise typer.BadParameter(msg)
    from multiradar.toolbox.simulation import simulate as simulate_scenario

    done, findings = with_findings(
        lambda: simulate_scenario(scene, out=out, seed=seed, duration_s=duration)
    )
    if json_wanted:
        print((out / "report.json").read_text(encoding="utf-8").rstrip())
    else:
        _print_report(done)
    if findings is not None:
        raise findings


def _print_scenes(json_wanted: bool) -> None:
    import json

    from multiradar.simulation.scenario.file import builtin_names, builtin_table

    titles = {name: builtin_table(name).title for name in builtin_names()}
    if json_wanted:
        print(json.dumps(titles, indent=2))
        return
    width = max(len(name) for name in titles)
    for name, title in titles.items():
        print(f"{name:{width}}  {title}")


def _print_report(done: "Simulation") -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False)
    figures, settings = done.report["figures"], done.report["settings"]
    console.print(
        f"[bold]{figures['measurements']} measurements[/] of {figures['aircraft']} aircraft "
        f"by {figures['sensors']} sensors in {settings['duration_s']:g} s, seed {settings['seed']}"
    )
    table = Table()
    by_sensor = figures["by_sensor"]
    assert isinstance(by_sensor, dict)
    first = next(iter(by_sensor.values()))
    assert isinstance(first, dict)
    for column in ("sensor", *first):
        table.add_column(column, justify="left" if column == "sensor" else "right")
    for sensor, counts in by_sensor.items():
        assert isinstance(counts, dict)
        table.add_row(sensor, *(str(count) for count in counts.values()))
    console.print(table)
    console.print(f"written to {done.folder}", soft_wrap=True)
