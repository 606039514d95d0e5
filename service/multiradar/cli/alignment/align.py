"""`multiradar align`: registration of radars from recordings, validated on withheld aircraft."""

import json
import os
import shlex
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from multiradar.cli.options import DateOption, JsonOption, KindsOption, SensorsOption, chosen_kinds
from multiradar.errors import FindingsError
from multiradar.toolbox.compiling import compile_kernels
from multiradar.toolbox.diagnoses import findings_of
from multiradar.toolbox.inputs import DumpChoice, check_found, load_sensor_table, read_sensors
from multiradar.toolbox.messages.progress import progress_bar

if TYPE_CHECKING:
    from multiradar.report.content import Document
    from multiradar.toolbox.alignment.registration import Registration
    from multiradar_schemas.alignment import Alignment

_WIDTH = 160
_WORKERS_MAX = 8

ALIGN_HELP = (
    "Register radars: estimate biases from recordings and validate them on withheld aircraft.\n\n"
    "RECORDING… are ASTERIX recordings, ADS-B trajectories, dumps, or output directories of "
    "`convert`; together they form one recording. The output lists the biases with their sigma, "
    "the distances between plots of different sensors before and after correction (by radar and "
    "by sensor pair), trends, and unobservable parameters. Files are written only if requested "
    "by an option."
)


def align(
    recordings: Annotated[
        list[Path],
        typer.Argument(metavar="RECORDING…", help="Recordings.", show_default=False),
    ],
    *,
    sensors: SensorsOption,
    toml: Annotated[
        Path | None,
        typer.Option(
            "--toml",
            metavar="FILE",
            help="New file: a sensors.toml with the biases as priors.",
            show_default=False,
        ),
    ] = None,
    html: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.html",
            help="New file: an HTML report with maps and trends.",
            show_default=False,
        ),
    ] = None,
    folds: Annotated[
        int, typer.Option(min=2, max=50, metavar="N", help="Number of cross-validation folds.")
    ] = 5,
    kinds: KindsOption = None,
    date: DateOption = None,
    as_json: JsonOption = False,
) -> None:
    """Register radars."""
    from multiradar.runtime.kernel_purposes import track_purposes
    from multiradar.storage.output_file import new_file
    from multiradar.toolbox.alignment.document import alignment_of
    from multiradar.toolbox.alignment.recordings import open_recordings
    from multiradar.toolbox.alignment.registration import register
    from multiradar.tracking.settings import TrackingSettings

    settings = TrackingSettings()
    table, listed = load_sensor_table(sensors), read_sensors(sensors)
    command = " ".join(
        ["multiradar align", *map(str, recordings), "--sensors", str(sensors)]
        + (["--kinds", kinds] if kinds else [])
    )
    with ExitStack() as held:
        priors = None if toml is None else held.enter_context(new_file(toml))
        page = None if html is None else held.enter_context(new_file(html))
        compile_kernels(track_purposes(settings, table, {}))
        opened = held.enter_context(
            open_recordings(recordings, listed, DumpChoice(date=date), settings.reorder_horizon_s)
        )
        recording = opened.recording
        with progress_bar("aligning", recording.rows) as on_progress:
            found = register(
                recording,
                table,
                settings,
                kinds=chosen_kinds(kinds),
                folds=folds,
                workers=min(os.cpu_count() or 1, _WORKERS_MAX),
                on_progress=on_progress,
            )
        lines = recording.rejected_by_code(chosen_kinds(kinds)).total()
        check_found(found.tracked.read - lines, chosen_kinds(kinds), recordings[0])
        span_s = recording.span_s(chosen_kinds(kinds))
        figures = alignment_of(found, opened.inputs, span_s, listed, command)
        if priors is not None:
            priors.write_text(figures.sensors_toml, encoding="utf-8")
        if page is not None:
            page.write_text(_page(found, figures, command), encoding="utf-8")
    if as_json:
        _print_json(figures)
    else:
        _print(figures, command)
        tracking = _track_command(recordings, sensors)
        print(f"to show this on a map: {tracking}, then multiradar view TRACKS")
    for sentence in dict.fromkeys(figures.warnings):
        print(f"multiradar: {sentence}", file=sys.stderr)
    diagnoses = dict.fromkeys([*opened.diagnoses, *found.tracked.diagnoses])
    if findings := findings_of(diagnoses):
        raise FindingsError(findings, figures)


def _track_command(recordings: Sequence[Path], sensors: Path) -> str:
    recording = str(recordings[0]) if len(recordings) == 1 else "RECORDING"
    return shlex.join(
        ["multiradar", "track", recording, "--sensors", str(sensors), "--out", "TRACKS"]
    )


def _page(found: "Registration", figures: "Alignment", command: str) -> str:
    from multiradar.report.page import report_page
    from multiradar.toolbox.alignment.plots import alignment_plots
    from multiradar.toolbox.alignment.tables import alignment_document

    return report_page(alignment_document(figures, command, alignment_plots(found)))


def _print_json(figures: "Alignment") -> None:
    from multiradar_schemas.rounding import rounded

    document = rounded(figures.model_dump(mode="json"))
    print(json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False))


def _print(figures: "Alignment", command: str) -> None:
    from rich.console import Console

    from multiradar.cli.terminal.report_tables import print_document
    from multiradar.toolbox.alignment.tables import alignment_document

    # Tables are not cut where they are read by a program.
    width = None if sys.stdout.isatty() else _WIDTH
    console = Console(highlight=False, markup=False, width=width)
    document: Document = alignment_document(figures, command)
    print_document(document, console)
