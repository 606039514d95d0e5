"""`multiradar reprocess`: days of archives tracked one by one, and their biases compared."""

import json
import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from multiradar.cli.options import (
    AllowMissingOption,
    ClusterListenOption,
    ConfigOption,
    EncounterDistanceOption,
    EncounterHeightOption,
    EncountersOption,
    EngineOption,
    FilterOption,
    ForecastsOption,
    HideOption,
    JsonOption,
    KindsOption,
    ObservabilityOption,
    PlanesOption,
    ProfileOption,
    SensorsOption,
    TrajectoriesOption,
    TrajectoryAircraftOption,
    chosen_kinds,
    hidden_fields,
)
from multiradar.cli.terminal.findings import with_findings

if TYPE_CHECKING:
    from multiradar.toolbox.tracking.reprocessing.schedule import Outcome

_WIDTH = 160

REPROCESS_HELP = (
    "Run the tracker on archived recordings day by day, several days in parallel, and compare the "
    "biases.\n\n"
    "FOLDER contains one folder per day, named after its date (2026-11-20), or one folder per "
    "region that contains such folders; each day is an output directory of `convert` or a dump. "
    "The output directory contains the output of `track` for each day, and tables of the "
    "biases by day, of their steps between days with χ², and of the biases over the whole period. "
    "Completed days with unchanged inputs and settings are kept, so an interrupted run resumes "
    "where it stopped."
)


class DaysChoice(StrEnum):
    """How the biases of days depend on each other."""

    INDEPENDENT = "independent"
    CHAINED = "chained"
    MERGED = "merged"


def reprocess(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Recordings by day.", show_default=False)
    ],
    *,
    sensors: SensorsOption,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Output directory, outside FOLDER; if it exists, the earlier run is continued.",
        ),
    ],
    days: Annotated[
        DaysChoice,
        typer.Option(
            help="independent: each day starts from the priors; chained: from the biases of the "
            "previous day, with the drift since then; merged: as independent, and the combined "
            "biases of all days are written to sensors_merged.toml as priors.",
        ),
    ] = DaysChoice.INDEPENDENT,
    jobs: Annotated[
        int | None,
        typer.Option(
            min=1, metavar="N", help="Number of days processed in parallel.", show_default="cores"
        ),
    ] = None,
    again: Annotated[
        bool,
        typer.Option("--again", help="Reprocess days that were processed with other settings."),
    ] = False,
    filter_name: FilterOption = None,
    kinds: KindsOption = None,
    hide: HideOption = None,
    profile: ProfileOption = None,
    allow_missing: AllowMissingOption = False,
    engine: EngineOption = None,
    cluster_listen: ClusterListenOption = None,
    manoeuvre_planes: PlanesOption = None,
    observability: ObservabilityOption = None,
    encounters: EncountersOption = None,
    encounter_distance_m: EncounterDistanceOption = None,
    encounter_height_m: EncounterHeightOption = None,
    trajectories: TrajectoriesOption = False,
    trajectory_aircraft_max: TrajectoryAircraftOption = None,
    forecasts: ForecastsOption = None,
    config: ConfigOption = None,
    json_wanted: JsonOption = False,
) -> None:
    """Run the tracker on archived recordings day by day."""
    from multiradar.toolbox.tracking.reprocessing.reprocess import reprocess as reprocess_days

    found, findings = with_findings(
        lambda: reprocess_days(
            folder,
            sensors,
            out=out,
            days=days.value,
            jobs=jobs,
            again=again,
            on_end=_print_day,
            filter=None if filter_name is None else filter_name.value,
            kinds=chosen_kinds(kinds),
            hide=None if hide is None else hidden_fields(hide),
            profile=profile,
            allow_missing=allow_missing,
            engine=None if engine is None else engine.value,
            cluster_listen=cluster_listen or None,
            manoeuvre_planes=manoeuvre_planes,
            observability=observability,
            encounters=encounters,
            encounter_distance_m=encounter_distance_m,
            encounter_height_m=encounter_height_m,
            trajectories=trajectories,
            trajectory_aircraft_max=trajectory_aircraft_max,
            forecasts=forecasts,
            config=config,
        )
    )
    if json_wanted:
        print(json.dumps(found.report, indent=2, ensure_ascii=False))
    else:
        _print(found.folder)
    if findings is not None:
        raise findings


# A line for each day when it ends, also where there is no progress bar.
def _print_day(outcome: "Outcome") -> None:
    print(f"multiradar: {outcome.day.name}: {outcome.status}", file=sys.stderr)
    for sentence in outcome.record.warnings if outcome.record is not None else ():
        print(f"multiradar: {outcome.day.name}: {sentence}", file=sys.stderr)


def _print(out: Path) -> None:
    from rich.console import Console

    from multiradar.cli.terminal.report_tables import print_document
    from multiradar.toolbox.tracking.reprocessing.summary import summary_of

    # Tables are not cut where they are read by a program.
    width = None if sys.stdout.isatty() else _WIDTH
    console = Console(highlight=False, markup=False, width=width)
    print_document(summary_of(out), console)
