"""`multiradar track`: measurements in, tracks and biases out."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from multiradar.cli.inputs import load_sensor_table, open_measurements
from multiradar.cli.options import (
    ConfigOption,
    DateOption,
    FilterOption,
    JsonOption,
    KindsOption,
    MeasurementsArgument,
    SensorsOption,
    chosen_kinds,
)
from multiradar.cli.progress import progress_bar

if TYPE_CHECKING:
    from multiradar.tracking.settings import TrackingSettings
    from multiradar_schemas.report import Report

_WORKERS_DEFAULT_MAX = 8


def track(
    measurements: MeasurementsArgument,
    *,
    sensors: SensorsOption,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder to make; it must not exist yet.")
    ],
    filter_name: FilterOption = None,
    kinds: KindsOption = None,
    date: DateOption = None,
    epoch_s: Annotated[
        float | None,
        typer.Option(help="Data time between two publications of the biases.", show_default="4"),
    ] = None,
    reorder_horizon_s: Annotated[
        float | None,
        typer.Option(help="Measurements are sorted within this much data time.", show_default="6"),
    ] = None,
    acceleration_density: Annotated[
        float | None,
        typer.Option(
            help="Spectral density of an aircraft's acceleration, m²/s³.", show_default="1"
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(min=1, help="Threads; the output is the same.", show_default="cores"),
    ] = None,
    batch: Annotated[
        int, typer.Option(min=1, help="Measurements handed on at once; the output is the same.")
    ] = 8192,
    config: ConfigOption = None,
    json_wanted: JsonOption = False,
) -> None:
    """Track a recording: write tracks, biases with their sigma, rejects and a report."""
    from multiradar.runtime.offline import OfflineJob, track_recording
    from multiradar.runtime.offline_report import REPORT_FILE, offline_report
    from multiradar.storage.output_folder import check_new, new_folder

    check_new(out)
    table = load_sensor_table(sensors)
    given = {
        "filter_name": None if filter_name is None else filter_name.value,
        "epoch_s": epoch_s,
        "reorder_horizon_s": reorder_horizon_s,
        "acceleration_density": acceleration_density,
    }
    settings = _settings(config, given)
    with open_measurements(measurements, date) as recording, new_folder(out) as folder:
        job = OfflineJob(
            recording=recording,
            sensors=table,
            settings=settings,
            kinds=chosen_kinds(kinds),
            workers=workers or min(os.cpu_count() or 1, _WORKERS_DEFAULT_MAX),
            batch_rows=batch,
        )
        with progress_bar("tracking", recording.rows) as on_progress:
            result = track_recording(job, folder, on_progress)
        report = offline_report(job, result)
        text = report.model_dump_json(indent=2)
        (folder / REPORT_FILE).write_text(text + "\n", encoding="utf-8")
    if json_wanted:
        print(text)
    else:
        _print_report(report, out)


def _settings(config: Path | None, given: dict[str, Any]) -> "TrackingSettings":
    from multiradar.settings import load_settings

    chosen = {name: value for name, value in given.items() if value is not None}
    return load_settings(config, {"tracking": chosen}).tracking_settings()


def _print_report(report: "Report", out: Path) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False)
    counts, figures = report.counts, report.figures
    console.print(
        f"[bold]{figures['tracks']} tracks[/] from {counts.read} measurements: "
        f"{counts.accepted} accepted, {counts.rejected} rejected, {counts.duplicate} duplicate"
    )
    table = Table(title="Biases at the end (measured minus true)", title_justify="left")
    for column in ("sensor", "parameter"):
        table.add_column(column)
    for column in ("estimate", "sigma"):
        table.add_column(column, justify="right")
    biases = figures["final_biases"]
    assert isinstance(biases, dict)
    for sensor, parameters in biases.items():
        assert isinstance(parameters, dict)
        for name, value in parameters.items():
            assert isinstance(value, dict)
            table.add_row(sensor, name, f"{value['estimate']:.4f}", f"{value['sigma']:.4f}")
    if biases:
        console.print(table)
    outcomes = figures["measurements_by_outcome"]
    assert isinstance(outcomes, dict)
    console.print(", ".join(f"{n} {name}" for name, n in outcomes.items() if n), soft_wrap=True)
    console.print(f"written to {out} (output_sha256 {report.output_sha256})", soft_wrap=True)
