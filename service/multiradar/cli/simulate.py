"""`multiradar simulate`: measurements and truth from a scenario."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from multiradar.cli.options import JsonOption
from multiradar.cli.terminal.progress import progress_bar
from multiradar.errors import ConfigurationError
from multiradar_schemas.documents.names import unknown

if TYPE_CHECKING:
    from multiradar.simulation.observation.observation import Observation
    from multiradar.simulation.scenario.model import Scenario
    from multiradar.simulation.scenario.tables import ScenarioTable
    from multiradar_schemas.report import Report

_SEED_MAX = 2**63 - 1
_DURATION_MIN_S, _DURATION_MAX_S = 0.1, 604_800.0
_MEASUREMENTS_FILE = "measurements.parquet"
_TRUTH_FILE = "truth.parquet"
_TRUE_BIASES_FILE = "truth_biases.parquet"
_TRUE_DELAYS_FILE = "truth_delays.parquet"
_SENSORS_FILE = "sensors.toml"
_SCENE_FILE = "scene.toml"


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
            max=_SEED_MAX,
            help="Random seed; default: that of the scenario.",
            show_default=False,
        ),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(
            "--duration",
            metavar="S",
            min=_DURATION_MIN_S,
            max=_DURATION_MAX_S,
            help="Duration, s; default: that of the scenario.",
            show_default=False,
        ),
    ] = None,
    list_wanted: Annotated[
        bool, typer.Option("--list", help="List the built-in scenarios.")
    ] = False,
    json_wanted: JsonOption = False,
) -> None:
    """Simulate a scenario: write measurements, sensors.toml for `track`, and the truth."""
    if list_wanted:
        _print_scenes(json_wanted)
        return
    if scene is None:
        msg = "missing argument SCENARIO: a built-in scenario (see --list) or a TOML file"
        raise typer.BadParameter(msg)
    if out is None:
        msg = "missing option --out DIR"
        raise typer.BadParameter(msg)
    from multiradar.storage.output_folder import check_new, new_folder

    check_new(out)
    from multiradar.simulation.observation.observation import observe
    from multiradar.simulation.scenario.file import changed, scenario_of
    from multiradar.simulation.traffic import all_aircraft, run_generator

    table = changed(_table(scene), seed=seed, duration_s=duration)
    with new_folder(out) as folder:
        with _with_path(scene):
            described = scenario_of(table)
            with progress_bar("simulating", len(all_aircraft(described))) as on_progress:
                seen = observe(described, run_generator(described.seed), on_progress)
        report = _write(folder, scene, table, described, seen)
    if json_wanted:
        print(report.model_dump_json(indent=2))
    else:
        _print_report(report, out)
    blind = [
        sensor.identifier
        for sensor, opportunities in zip(described.sensors, seen.opportunities, strict=True)
        if not opportunities
    ]
    for name in blind:
        print(
            f"multiradar: {scene}: sensor {name}: no aircraft came within its coverage; check "
            "latitude_deg and longitude_deg (or east_m and north_m) of its site and of the plane, "
            "and range_max_m",
            file=sys.stderr,
        )
    if blind:
        raise typer.Exit(1)


@contextmanager
def _with_path(scene: str) -> Iterator[None]:
    # Errors of a scenario as a whole do not contain its name.
    try:
        yield
    except ConfigurationError as error:
        raise ConfigurationError(f"{scene}: {error}") from error


def _table(named: str) -> "ScenarioTable":
    from multiradar.simulation.scenario.file import builtin_names, builtin_table, load_table

    if named in builtin_names():
        return builtin_table(named)
    path = Path(named)
    if path.suffix == ".toml" or path.exists():
        return load_table(path)
    raise typer.BadParameter(unknown("scenario or TOML file", named, builtin_names()))


def _write(
    folder: Path, named: str, table: "ScenarioTable", scene: "Scenario", seen: "Observation"
) -> "Report":
    from multiradar.simulation.output import (
        measurements_frame,
        true_biases_frame,
        true_delays_frame,
        truth_frame,
    )
    from multiradar.simulation.scenario.file import table_text
    from multiradar.simulation.scenario.sensors_text import sensors_text

    frames = {
        _MEASUREMENTS_FILE: measurements_frame(scene, seen),
        _TRUTH_FILE: truth_frame(scene, seen),
        _TRUE_BIASES_FILE: true_biases_frame(scene, seen),
    }
    delays = true_delays_frame(seen)
    if len(delays):
        frames[_TRUE_DELAYS_FILE] = delays
    for name, frame in frames.items():
        frame.write_parquet(folder / name, compression="zstd")
    (folder / _SENSORS_FILE).write_text(sensors_text(scene), encoding="utf-8")
    (folder / _SCENE_FILE).write_text(table_text(table), encoding="utf-8")
    report = _report(named, scene, seen, {name: len(frame) for name, frame in frames.items()})
    text = report.model_dump_json(indent=2)
    (folder / "report.json").write_text(text + "\n", encoding="utf-8")
    return report


def _report(named: str, scene: "Scenario", seen: "Observation", rows: dict[str, int]) -> "Report":
    from importlib.metadata import version

    from multiradar.simulation.observation.counts import counts_by_sensor
    from multiradar.simulation.output import reported_data
    from multiradar_schemas.report import Counts, OutputFile, Report

    made = len(seen.measurements)
    data: dict[str, Any] = {
        scene.sensors[index].identifier: document
        for index, document in sorted(reported_data(scene, seen).documents.items())
    }
    return Report(
        command="simulate",
        version=version("multiradar"),
        counts=Counts(read=made, accepted=made, rejected=0),
        rejected_by_code={},
        inputs=[],
        outputs=[OutputFile(file=name, rows=count) for name, count in rows.items()],
        settings={"scene": named, "seed": scene.seed, "duration_s": scene.duration_s},
        figures={
            "aircraft": len(seen.aircraft),
            "sensors": len(scene.sensors),
            "measurements": made,
            "by_sensor": {name: dict(one) for name, one in counts_by_sensor(scene, seen).items()},
            **({"aircraft_data": data} if data else {}),
        },
    )


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


def _print_report(report: "Report", out: Path) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False)
    figures = report.figures
    console.print(
        f"[bold]{figures['measurements']} measurements[/] of {figures['aircraft']} aircraft "
        f"by {figures['sensors']} sensors in {report.settings['duration_s']:g} s, "
        f"seed {report.settings['seed']}"
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
    console.print(f"written to {out}", soft_wrap=True)
