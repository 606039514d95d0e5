"""`multiradar track`: tracks and biases from a recording."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from multiradar.cli.conversion.outcome import times_line
from multiradar.cli.options import (
    TRACKING_DEFAULTS,
    AllowMissingOption,
    ClusterListenOption,
    ConfigOption,
    DateOption,
    EncounterDistanceOption,
    EncounterHeightOption,
    EncountersOption,
    EngineOption,
    FilterOption,
    ForecastsOption,
    HideOption,
    JsonOption,
    KindsOption,
    MeasurementsArgument,
    MotionChoice,
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
from multiradar.cli.terminal.health_table import print_health
from multiradar.cli.terminal.stage_line import print_stages
from multiradar.cli.terminal.view_hint import view_hint

if TYPE_CHECKING:
    from multiradar.toolbox.run import Run


def track(
    measurements: MeasurementsArgument,
    *,
    sensors: SensorsOption,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Output directory; must not exist.")
    ],
    filter_name: FilterOption = None,
    kinds: KindsOption = None,
    hide: HideOption = None,
    date: DateOption = None,
    profile: ProfileOption = None,
    allow_missing: AllowMissingOption = False,
    epoch_s: Annotated[
        float | None,
        typer.Option(
            help="Bias update interval, seconds of data time.",
            show_default=f"{TRACKING_DEFAULTS.epoch_s:g}",
        ),
    ] = None,
    reorder_horizon_s: Annotated[
        float | None,
        typer.Option(
            help="Reordering window, seconds of data time: measurements that arrive later are "
            "rejected.",
            show_default=f"{TRACKING_DEFAULTS.reorder_horizon_s:g}",
        ),
    ] = None,
    acceleration_density: Annotated[
        float | None,
        typer.Option(
            help="Spectral density of an aircraft's acceleration, m²/s³.",
            show_default=f"{TRACKING_DEFAULTS.acceleration_density:g}",
        ),
    ] = None,
    motion: Annotated[
        MotionChoice | None,
        typer.Option(
            help="Process noise: isotropic, or along and across the velocity.",
            show_default=TRACKING_DEFAULTS.motion,
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Number of worker threads or Ray actors; does not affect the output.",
            show_default="cores",
        ),
    ] = None,
    engine: EngineOption = None,
    cluster_listen: ClusterListenOption = None,
    batch: Annotated[
        int, typer.Option(min=1, help="Batch size; does not affect the output.")
    ] = 8192,
    manoeuvre_planes: PlanesOption = None,
    observability: ObservabilityOption = None,
    encounters: EncountersOption = None,
    encounter_distance_m: EncounterDistanceOption = None,
    encounter_height_m: EncounterHeightOption = None,
    trajectories: TrajectoriesOption = False,
    trajectory_aircraft_max: TrajectoryAircraftOption = None,
    forecasts: ForecastsOption = None,
    biases_from: Annotated[
        Path | None,
        typer.Option(
            metavar="TRACKS",
            help="Output directory of an earlier `track` run: start from its final biases, with "
            "their covariance and the drift since then, instead of from the priors.",
            show_default=False,
        ),
    ] = None,
    reference: Annotated[
        Path | None,
        typer.Option(
            metavar="TRACKS",
            help="System tracks of another processor as a bias reference: output directory of "
            "`convert` or `track`, or one of its tables.",
            show_default=False,
        ),
    ] = None,
    processor: Annotated[
        str | None,
        typer.Option(
            metavar="SAC-SIC",
            help="For --reference: the processor to use if the recording contains several.",
            show_default=False,
        ),
    ] = None,
    asterix: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Also write system tracks and biases as ASTERIX (062, 063, 065), as specified by "
            r"the first `\[\[asterix.output]]` in the settings. Costs 0.04 ms of CPU time per "
            "plot.",
            show_default=False,
        ),
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option(
            "--report",
            metavar="FILE.html",
            help="New file: an HTML report with a map, counts, radar health, and biases over time.",
            show_default=False,
        ),
    ] = None,
    config: ConfigOption = None,
    json_wanted: JsonOption = False,
) -> None:
    """Track a recording: write tracks, biases with their sigma, rejects and a report.

    CPU times were measured on the sample recording; without options, 24,000 plots take 3 s of CPU
    time.
    """
    from multiradar.toolbox.tracking.track import track as track_recording

    run, findings = with_findings(
        lambda: track_recording(
            measurements,
            sensors,
            filter=None if filter_name is None else filter_name.value,
            kinds=chosen_kinds(kinds),
            hide=None if hide is None else hidden_fields(hide),
            out=out,
            date=date,
            profile=profile,
            allow_missing=allow_missing,
            epoch_s=epoch_s,
            reorder_horizon_s=reorder_horizon_s,
            acceleration_density=acceleration_density,
            motion=None if motion is None else motion.value,
            workers=workers,
            engine=None if engine is None else engine.value,
            cluster_listen=cluster_listen or None,
            batch=batch,
            manoeuvre_planes=manoeuvre_planes,
            observability=observability,
            encounters=encounters,
            encounter_distance_m=encounter_distance_m,
            encounter_height_m=encounter_height_m,
            trajectories=trajectories,
            trajectory_aircraft_max=trajectory_aircraft_max,
            forecasts=forecasts,
            biases_from=biases_from,
            reference=reference,
            processor=processor,
            asterix=asterix,
            report=page,
            config=config,
        )
    )
    if json_wanted:
        print((out / "report.json").read_text(encoding="utf-8").rstrip())
    else:
        _print_report(run, measurements)
        _print_asterix(run, asterix)
        print_stages(run.seconds, run.beside_seconds)
    if findings is not None:
        raise findings


def _print_asterix(run: "Run", path: Path | None) -> None:
    if path is None:
        return
    records = run.report["figures"].get("asterix_records", {})
    counts = ", ".join(f"{count} {name}" for name, count in sorted(records.items()))
    print(f"ASTERIX records: {counts}; written to {path}")


def _print_report(run: "Run", measurements: Path) -> None:
    from rich.console import Console
    from rich.table import Table

    from multiradar.report.cells import estimate_texts
    from multiradar.toolbox.inputs import counts_by_code
    from multiradar_schemas.report import Report

    out = run.folder
    report = Report.model_validate_json((out / "report.json").read_text(encoding="utf-8"))
    console = Console(highlight=False)
    counts, figures = report.counts, report.figures
    console.print(
        f"[bold]{figures['tracks_confirmed']} confirmed tracks[/] ({figures['tracks']} initiated) "
        f"from {counts.read} measurements: {counts.accepted} accepted, {counts.rejected} rejected, "
        f"{counts.duplicate} duplicate",
        soft_wrap=True,
    )
    console.print(times_line(*(run.span_s or (None, None))), soft_wrap=True)
    if report.rejected_by_code:
        codes = {str(code): n for code, n in report.rejected_by_code.items()}
        console.print(f"rejected: {counts_by_code(codes)}", soft_wrap=True)
    table = Table(title="Final bias estimates (measured − true)", title_justify="left")
    for column in ("sensor", "parameter"):
        table.add_column(column)
    for column in ("estimate", "sigma", "sigma / prior sigma"):
        table.add_column(column, justify="right")
    biases = figures["final_biases"]
    assert isinstance(biases, dict)
    for sensor, parameters in biases.items():
        assert isinstance(parameters, dict)
        for name, value in parameters.items():
            assert isinstance(value, dict)
            estimate, sigma, ratio = (value[one] for one in ("estimate", "sigma", "prior_ratio"))
            assert isinstance(estimate, float)
            assert isinstance(sigma, float)
            table.add_row(sensor, name, *estimate_texts(estimate, sigma), f"{ratio:.1%}")
    if biases:
        console.print(table)
    print_health(report, console)
    unobservable = figures["unobservable_biases"]
    assert isinstance(unobservable, list)
    for one in unobservable:
        assert isinstance(one, dict)
        console.print(
            f"not observable: {one['what']} (sigma still {one['prior_ratio']:.0%} of the prior)"
            + (f": {one['reason']}" if one["reason"] else ""),
            soft_wrap=True,
        )
    outcomes = figures["measurements_by_outcome"]
    assert isinstance(outcomes, dict)
    console.print(", ".join(f"{n} {name}" for name, n in outcomes.items() if n), soft_wrap=True)
    console.print(f"written to {out} (output_sha256 {report.output_sha256})", soft_wrap=True)
    console.print(view_hint(out, measurements), soft_wrap=True, markup=False)
