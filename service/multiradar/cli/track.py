"""`multiradar track`: tracks and biases from a recording."""

import os
import shutil
import sys
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from multiradar.cli.alignment.bias_reference import read_reference, with_reference
from multiradar.cli.compiling import compile_kernels
from multiradar.cli.conversion.outcome import times_line
from multiradar.cli.inputs import (
    SENSORS_FILE,
    DumpChoice,
    check_found,
    counts_by_code,
    load_sensor_table,
    open_measurements,
    read_sensors,
)
from multiradar.cli.options import (
    TRACKING_DEFAULTS,
    TRAJECTORY_AIRCRAFT_DEFAULT,
    AllowMissingOption,
    ConfigOption,
    DateOption,
    EncounterDistanceOption,
    EncounterHeightOption,
    EncountersOption,
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
from multiradar.cli.outputs.asterix_file import new_recorder, print_asterix
from multiradar.cli.terminal.diagnoses import fail_when_diagnosed, print_diagnoses
from multiradar.cli.terminal.health_table import print_health
from multiradar.cli.terminal.progress import progress_bar
from multiradar.cli.terminal.stage_line import print_stages
from multiradar.cli.terminal.view_hint import view_hint
from multiradar.clock import SystemClock
from multiradar.errors import InputError

if TYPE_CHECKING:
    from multiradar.cli.alignment.bias_reference import BiasReference
    from multiradar.estimation.measurement.sensors import SensorTable
    from multiradar.runtime.asterix.recording import AsterixRecorder
    from multiradar.runtime.offline.offline import OfflineJob, OfflineResult
    from multiradar.runtime.offline.stage_times import StageTimes
    from multiradar.runtime.queries.encounter_query import EncounterQuery
    from multiradar.runtime.trajectories.options import TrajectoryOptions
    from multiradar.settings.service import Settings
    from multiradar.storage.recording import Recording
    from multiradar.tracking.settings import TrackingSettings
    from multiradar_schemas.report import Report
    from multiradar_schemas.sensors.sensor import SensorsFile

_WORKERS_DEFAULT_MAX = 8


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
            help="Reordering window, seconds of data time: later measurements are rejected.",
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
            min=1, help="Worker threads; the output does not depend on it.", show_default="cores"
        ),
    ] = None,
    batch: Annotated[
        int, typer.Option(min=1, help="Batch size; the output does not depend on it.")
    ] = 8192,
    manoeuvre_planes: PlanesOption = None,
    observability: ObservabilityOption = None,
    encounters: EncountersOption = None,
    encounter_distance_m: EncounterDistanceOption = None,
    encounter_height_m: EncounterHeightOption = None,
    trajectories: TrajectoriesOption = False,
    trajectory_aircraft_max: TrajectoryAircraftOption = None,
    forecasts: ForecastsOption = None,
    reference: Annotated[
        Path | None,
        typer.Option(
            metavar="TRACKS",
            help="System tracks of another processor as a bias reference: output directory of "
            "`convert` or `track`, or a table of it.",
            show_default=False,
        ),
    ] = None,
    processor: Annotated[
        str | None,
        typer.Option(
            metavar="SAC-SIC",
            help="For --reference: the processor, where the recording has several.",
            show_default=False,
        ),
    ] = None,
    asterix: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Also write system tracks and biases in ASTERIX (062, 063, 065), by the first "
            r"`\[\[asterix.output]]` of the settings. Costs 0.04 ms CPU per plot.",
            show_default=False,
        ),
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option(
            "--report",
            metavar="FILE.html",
            help="Also write an HTML report: map, counts, health and biases by time; must not "
            "exist.",
            show_default=False,
        ),
    ] = None,
    config: ConfigOption = None,
    json_wanted: JsonOption = False,
) -> None:
    """Track a recording: write tracks, biases with their sigma, rejects and a report.

    Costs are those of the sample recording; without options 3 s CPU for 24,000 plots.
    """
    clock, started_s = SystemClock(), SystemClock().monotonic_s()
    from multiradar.runtime.offline.offline import OfflineJob
    from multiradar.runtime.offline.stage_times import READING, StageTimes
    from multiradar.storage.output_folder import check_new, new_folder

    stages = StageTimes(clock, started_s)
    check_new(out)
    query = _encounters(encounters, encounter_distance_m, encounter_height_m)
    if not trajectories:
        _require_none("--trajectories", {"--trajectory-aircraft-max": trajectory_aircraft_max})
    given = {
        "filter_name": None if filter_name is None else filter_name.value,
        "epoch_s": epoch_s,
        "reorder_horizon_s": reorder_horizon_s,
        "acceleration_density": acceleration_density,
        "motion": None if motion is None else motion.value,
        "hidden_fields": None if hide is None else hidden_fields(hide),
    }
    whole = _settings(config, given)
    settings = whole.tracking_settings()
    outputs = {
        "--encounters": encounters,
        "--forecasts": forecasts,
        "--trajectories": trajectories or None,
        "--manoeuvre-planes": manoeuvre_planes,
        "--observability": observability,
    }
    known, tracks, table = _sensors(sensors, reference, processor, settings.filter_name)
    _compile(stages, settings, table, outputs)
    opened = open_measurements(
        measurements, DumpChoice(date, profile, allow_missing), settings.reorder_horizon_s
    )
    recording_file = new_recorder(asterix, whole, table)
    with (
        stages.listening(), stages.enter(READING, opened) as measured,
        with_reference(measured, tracks, known, chosen_kinds(kinds)) as referenced,
        recording_file as recorder, _page_file(page) as partial, new_folder(out) as folder,
        _with_path(out),
    ):  # fmt: skip
        job = OfflineJob(
            recording=referenced.recording,
            sensors=table,
            settings=settings,
            kinds=chosen_kinds(kinds) if tracks is None else None,
            workers=workers or min(os.cpu_count() or 1, _WORKERS_DEFAULT_MAX),
            batch_rows=batch,
            plane_window_s=manoeuvre_planes,
            observability_window_s=observability,
            encounters=query,
            trajectories=_trajectories(whole, trajectory_aircraft_max) if trajectories else None,
            forecasts_every_s=forecasts,
        )
        result = _track(job, folder, recorder, stages)
        result.warnings += _missing_periods(job.recording, table) + referenced.sentences(tracks)
        result.reference = referenced.figures()
        check_found(result.read, kinds, measurements)
        times = times_line(*(job.recording.span_s(job.kinds) or (None, None)))
        if recorder is not None:
            result.asterix = recorder.finish()
        report = _write_report(job, result, folder)
        # For `evaluate`: coverage and differences need the sites of this run.
        shutil.copyfile(sensors, folder / SENSORS_FILE)
        if tracks is not None:
            tracks.append_to(folder / SENSORS_FILE)
        _write_page(partial, folder, report, (measurements, sensors), stages)
    _warn(result, settings.filter_name)
    if json_wanted:
        print(report.model_dump_json(indent=2))
    else:
        _print_report(report, times, (measurements, out))
        print_asterix(result.asterix, asterix)
        print_stages(stages.seconds())
    _fail_without_measurements(report, result, out)


def _sensors(
    path: Path, reference: Path | None, processor: str | None, filter_name: str
) -> "tuple[SensorsFile, BiasReference | None, SensorTable]":
    if reference is None and processor is not None:
        raise typer.BadParameter("--processor is for --reference only")
    from multiradar.estimation.filters.bank import find_filter

    known = read_sensors(path)
    late = find_filter(filter_name).estimates_time_offsets
    tracks = read_reference(reference, known, processor, late=late)
    return known, tracks, load_sensor_table(path, known if tracks is None else tracks.among(known))


def _page_file(page: Path | None) -> AbstractContextManager[Path | None]:
    from multiradar.storage.output_file import new_file

    return nullcontext() if page is None else new_file(page)


def _write_page(
    page: Path | None,
    folder: Path,
    report: "Report",
    given: tuple[Path, Path],
    stages: "StageTimes",
) -> None:
    if page is None:
        return
    from multiradar.cli.outputs.track_page import TrackRun, track_page

    with stages.measure("report"):
        table = load_sensor_table(folder / SENSORS_FILE)
        command = f"multiradar track {given[0]} --sensors {given[1]}"
        run = TrackRun(folder, report, table, given[0].name, command)
        page.write_text(track_page(run), encoding="utf-8")


def _compile(
    stages: "StageTimes",
    settings: "TrackingSettings",
    sensors: "SensorTable",
    outputs: Mapping[str, object],
) -> None:
    from multiradar.runtime.kernel_purposes import track_purposes
    from multiradar.runtime.offline.stage_times import COMPILING

    with stages.measure(COMPILING):
        compile_kernels(track_purposes(settings, sensors, outputs))


def _track(
    job: "OfflineJob", folder: Path, recorder: "AsterixRecorder | None", stages: "StageTimes"
) -> "OfflineResult":
    from multiradar.runtime.offline.offline import track_recording

    on_output = None if recorder is None else stages.timed("ASTERIX", recorder.write)
    with progress_bar("tracking", job.recording.rows) as on_progress:
        return track_recording(job, folder, on_progress, on_output, stages)


def _write_report(job: "OfflineJob", result: "OfflineResult", folder: Path) -> "Report":
    from multiradar.runtime.offline.offline_report import REPORT_FILE, offline_report

    report = offline_report(job, result)
    text = report.model_dump_json(indent=2)
    (folder / REPORT_FILE).write_text(text + "\n", encoding="utf-8")
    return report


# Without its scan period a radar is tracked with a default, and its near duplicates stay.
def _missing_periods(recording: "Recording", sensors: "SensorTable") -> list[str]:
    import numpy as np
    import polars as pl

    from multiradar.estimation.measurement.kinds import KIND_RADAR
    from multiradar_converters.scan_period import PLOTS_MAX, scan_period_s

    lacking = np.flatnonzero((sensors.kinds == KIND_RADAR) & np.isnan(sensors.rotation_period_s))
    plots = {sensors.ids[number]: pl.DataFrame() for number in lacking.tolist()}
    for block in recording.blocks({"radar"}):
        open_ = [name for name, own in plots.items() if len(own) < PLOTS_MAX]
        if not open_:
            break
        known = block.select("sensor_id", "time_s", "azimuth_deg").drop_nulls()
        for name in open_:
            plots[name] = pl.concat([plots[name], known.filter(sensor_id=name)], how="diagonal")
    found = []
    for name, own in plots.items():
        columns = [own[column].to_numpy() for column in own.columns if column != "sensor_id"]
        period_s = scan_period_s(columns[0], columns[1]) if columns else np.nan
        if np.isfinite(period_s):
            found.append(
                f"{name}: rotation_period_s is missing in the sensors file; its plots show "
                f"{period_s:.3f} s: add it (5 s is assumed)"
            )
    return found


def _fail_without_measurements(report: "Report", result: "OfflineResult", out: Path) -> None:
    from multiradar.runtime.offline.offline import REJECTS_FILE

    if report.counts.accepted == 0:
        codes = counts_by_code({str(code): n for code, n in report.rejected_by_code.items()})
        msg = (
            f"none of {report.counts.read} measurements accepted: {codes}; see {out / REJECTS_FILE}"
        )
        print_diagnoses(result.diagnoses)
        raise InputError(msg)
    fail_when_diagnosed(result.diagnoses)


def _encounters(
    horizon_s: float | None, distance_m: float | None, height_m: float | None
) -> "EncounterQuery | None":
    from multiradar.runtime.queries.encounter_query import EncounterQuery
    from multiradar.runtime.queries.parameters import ENCOUNTER_DISTANCE_M

    if horizon_s is None:
        given = {"--encounter-distance-m": distance_m, "--encounter-height-m": height_m}
        _require_none("--encounters", given)
        return None
    near_m = ENCOUNTER_DISTANCE_M if distance_m is None else distance_m
    return EncounterQuery(horizon_s, near_m, height_m, limit=None)


# An option without effect is an error.
def _require_none(without: str, options: dict[str, float | None]) -> None:
    for name, option in options.items():
        if option is not None:
            raise typer.BadParameter(f"{name} requires {without}")


def _trajectories(settings: "Settings", aircraft_max: int | None) -> "TrajectoryOptions":
    from multiradar.runtime.trajectories.options import trajectory_options

    wanted = settings.trajectories
    most = aircraft_max or wanted.aircraft_max or TRAJECTORY_AIRCRAFT_DEFAULT
    return trajectory_options(**wanted.model_dump() | {"aircraft_max": most})


@contextmanager
def _with_path(out: Path) -> Iterator[None]:
    # An error of the disk without a file name concerns the output: input files have one.
    try:
        yield
    except OSError as error:
        if error.filename is not None:
            raise
        msg = f"{out}: cannot write: {error.strerror or error}; no output was kept"
        raise InputError(msg) from error


def _warn(result: "OfflineResult", filter_name: str) -> None:
    from multiradar.estimation.filters.bank import find_filter
    from multiradar.tracking.pool import CAPACITY_MAX

    for warning in result.warnings:
        print(f"multiradar: {warning}", file=sys.stderr)
    if untracked := result.tracker["no_room"]:
        most = find_filter(filter_name).aircraft_max or CAPACITY_MAX
        print(
            f"multiradar: track capacity exhausted: {filter_name} tracks at most {most} aircraft; "
            f"{untracked} measurements were not used (no_room)",
            file=sys.stderr,
        )


def _settings(config: Path | None, given: dict[str, Any]) -> "Settings":
    # Errors of command-line options are usage errors; others are errors of the configuration.
    from pydantic import ValidationError

    from multiradar.settings.service import TrackingSection, load_settings
    from multiradar_schemas.documents.mistakes import mistakes_in

    chosen = {name: value for name, value in given.items() if value is not None}
    try:
        TrackingSection.model_validate(chosen)
    except ValidationError as error:
        name, _, reason = mistakes_in(error, TrackingSection, chosen, {})[0].partition(": ")
        raise typer.BadParameter(f"--{name.replace('_', '-')}: {reason}") from error
    return load_settings(config, {"tracking": chosen})


def _print_report(report: "Report", times: str, paths: tuple[Path, Path]) -> None:
    from rich.console import Console
    from rich.table import Table

    from multiradar.report.cells import estimate_texts

    measurements, out = paths
    console = Console(highlight=False)
    counts, figures = report.counts, report.figures
    console.print(
        f"[bold]{figures['tracks_confirmed']} confirmed tracks[/] ({figures['tracks']} initiated) "
        f"from {counts.read} measurements: {counts.accepted} accepted, {counts.rejected} rejected, "
        f"{counts.duplicate} duplicate",
        soft_wrap=True,
    )
    console.print(times, soft_wrap=True)
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
