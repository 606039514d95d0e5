"""Tracking of a recording."""

import os
import shutil
from collections.abc import Collection, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from multiradar.clock import SystemClock
from multiradar.errors import DataWarning, FindingsError
from multiradar.toolbox.arguments import typed
from multiradar.toolbox.compiling import compile_kernels
from multiradar.toolbox.conversion.asterix_file import new_recorder
from multiradar.toolbox.conversion.measurements import dump_diagnoses, open_measurements
from multiradar.toolbox.inputs import (
    SENSORS_FILE,
    DumpChoice,
    as_sensors_file,
    check_found,
    in_future,
    load_sensor_table,
    read_sensors,
)
from multiradar.toolbox.messages.progress import progress_bar
from multiradar.toolbox.messages.warning import warn
from multiradar.toolbox.output import PathLike, new_output, remove_with
from multiradar.toolbox.run import Run
from multiradar.toolbox.settings import TRAJECTORY_AIRCRAFT_DEFAULT
from multiradar.toolbox.tracking.command_line import track_command
from multiradar.toolbox.tracking.earlier_run import biases_at_end
from multiradar.toolbox.tracking.request import TrackOptions, TrackRequest, track_request
from multiradar.toolbox.tracking.run_warnings import exhausted, missing_periods, run_findings

if TYPE_CHECKING:
    from multiradar.estimation.measurement.sensors import SensorTable
    from multiradar.runtime.asterix.recording import AsterixRecorder
    from multiradar.runtime.offline.offline_job import OfflineJob, OfflineResult
    from multiradar.runtime.offline.stage_times import StageTimes
    from multiradar.runtime.trajectories.options import TrajectoryOptions
    from multiradar.toolbox.alignment.bias_reference import BiasReference
    from multiradar.toolbox.frames import FrameOrPath
    from multiradar.toolbox.tracking.custom_filters import CustomFilter
    from multiradar.tracking.settings import TrackingSettings
    from multiradar_schemas.report import Report
    from multiradar_schemas.sensors.sensor import SensorsFile

_WORKERS_DEFAULT_MAX = 8


@typed
def track(
    measurements: "FrameOrPath",
    sensors: "PathLike | SensorsFile",
    *,
    filter: str | None = None,
    kinds: Collection[str] | None = None,
    hide: Collection[str] | None = None,
    out: PathLike | None = None,
    **options: Unpack[TrackOptions],
) -> Run:
    """Track a recording: tracks of aircraft and biases of sensors, estimated together.

    Parameters
    ----------
    measurements : table or path
        A table with the columns of `measurements.parquet` (docs/reference/fields.md: degrees,
        metres, seconds), the path of one, a folder that `convert` or `simulate` made, or a dump.
    sensors : path or SensorsFile
        A `sensors.toml`, or what `load_sensors` returns.
    filter : str, optional
        `two-stage`, `imm` (the default), `joint`, `blom`, `blom-macro`, `ci`, or a registered one.
    kinds : collection of str, optional
        Use only these kinds of measurement: radar, adsb, mlat, bearing.
    hide : collection of str, optional
        Withhold these fields from the tracker: track_number, mode_3a, mode_s_address, callsign.
    out : path, optional
        Folder to make; by default a temporary one, removed with the result.
    **options
        See `TrackOptions`.

    Returns
    -------
    Run
        `.tracks`, `.biases`, `.report`, `.plot()`. With `out`, the same bytes as
        ``multiradar track``.

    Raises
    ------
    InputError
        The measurements cannot be read, lack a column (`MissingColumnError`), or there are none.
    ConfigurationError
        The sensors or a setting cannot be used; `ArgumentError` names an argument.
    OutputExistsError
        `out` exists.
    FindingsError
        The sensors, their settings or the measurements are at fault; the run is in `.output`.

    Notes
    -----
    Memory is bounded by the size of the tables that are read.

    References
    ----------
    IMM UrO RAN report (2016), sections 1.3 to 1.5; DECISIONS.md names the source of each part.
    """
    started_s = SystemClock().monotonic_s()
    from multiradar.runtime.offline.stage_times import StageTimes
    from multiradar.toolbox.frames import as_file
    from multiradar.toolbox.tracking.custom_filters import host_of

    host, custom = host_of(filter)
    request = track_request(host, kinds, hide, options)
    folder = new_output(out)
    with (
        as_file(measurements, "measurements") as measured,
        as_sensors_file(sensors) as listed,
        _page_file(request.path("report")) as page,
    ):
        stages, given = StageTimes(SystemClock(), started_s), _Given(*measured, *listed, folder)
        done = _run(request, given, stages, custom)
        run = Run(folder, stages.seconds(), done.span_s, stages.beside_seconds())
        if out is None:
            remove_with(run, folder)
        # The folder is complete: a page that cannot be made does not cost the run.
        if page is not None:
            name = str(done.report.settings["filter_name"])
            names = given.measurements_name, given.sensors_name, name
            command = track_command(*names, kinds=kinds, hide=hide, out=out, options=options)
            with stages.measure("report"):
                _write_page(page, given, done.report, command)
            run.seconds = stages.seconds()
    for sentence in done.warnings:
        warn(sentence, DataWarning)
    if done.findings:
        raise FindingsError(done.findings, run)
    return run


@dataclass(frozen=True, slots=True)
class _Done:
    report: "Report"
    span_s: tuple[float, float] | None
    warnings: list[str]
    findings: list[str]


@dataclass(frozen=True, slots=True)
class _Given:
    # Files, with their names in errors, and the folder to make.
    measurements: Path
    measurements_name: str
    sensors: Path
    sensors_name: str
    out: Path


def _run(
    request: TrackRequest, given: _Given, stages: "StageTimes", custom: "CustomFilter | None"
) -> _Done:
    from multiradar.cluster.ray_steps import steps_of
    from multiradar.runtime.offline.offline_job import BATCH_ROWS, OfflineJob
    from multiradar.runtime.offline.stage_times import READING
    from multiradar.storage.output_folder import check_new, new_folder
    from multiradar.toolbox.alignment.bias_reference import with_reference

    options, out = request.options, given.out
    check_new(out)
    settings = request.settings.tracking_settings()
    workers = options.get("workers") or min(os.cpu_count() or 1, _WORKERS_DEFAULT_MAX)
    open_steps = steps_of(request.settings, workers)
    known, tracks, table = _sensors(given, request, settings.filter_name)
    earlier = request.path("biases_from")
    before = None if earlier is None else Run(earlier)
    _compile(stages, settings, table, request.outputs())
    profile = request.path("profile")
    dump = DumpChoice(options.get("date"), profile, options.get("allow_missing", False))
    opened = open_measurements(
        given.measurements, dump, settings.reorder_horizon_s, given.measurements_name
    )
    recording_file = new_recorder(request.path("asterix"), request.settings, table)
    with (
        stages.listening(), stages.enter(READING, opened) as recorded,
        with_reference(recorded, tracks, known, request.kinds) as referenced,
        recording_file as recorder, new_folder(out) as folder,
    ):  # fmt: skip
        recording = referenced.recording
        span_s = recording.span_s(request.kinds if tracks is None else None)
        job = OfflineJob(
            recording=recording,
            sensors=table,
            settings=settings,
            kinds=request.kinds if tracks is None else None,
            workers=workers,
            open_steps=open_steps,
            batch_rows=options.get("batch", BATCH_ROWS),
            plane_window_s=options.get("manoeuvre_planes"),
            observability_window_s=options.get("observability"),
            encounters=request.encounters,
            trajectories=_trajectories(request),
            forecasts_every_s=options.get("forecasts"),
            start=None if before is None else biases_at_end(before, table, span_s and span_s[0]),
        )
        result = _track(job, folder, recorder, stages, custom)
        result.warnings += missing_periods(job.recording, table) + referenced.sentences(tracks)
        result.reference = referenced.figures()
        if tracks is not None:
            result.diagnoses = tracks.without_heights(result.diagnoses)
        found = result.read - recording.rejected_by_code(job.kinds).total()
        check_found(found, request.kinds, given.measurements_name)
        result.diagnoses += dump_diagnoses(recording, job.kinds, result.diagnoses)
        if recorder is not None:
            result.asterix = recorder.finish()
        report = _write_report(job, result, folder, custom, before)
        # For `evaluate`: coverage and differences need the sites of this run.
        shutil.copyfile(given.sensors, folder / SENSORS_FILE)
        if tracks is not None:
            tracks.append_to(folder / SENSORS_FILE)
    warnings = result.warnings + exhausted(result, settings.filter_name) + in_future(span_s)
    findings = run_findings(report, result, out)
    return _Done(report, span_s, warnings, findings)


def _sensors(
    given: _Given, request: TrackRequest, filter_name: str
) -> "tuple[SensorsFile, BiasReference | None, SensorTable]":
    from multiradar.estimation.filters.bank import find_filter
    from multiradar.toolbox.alignment.bias_reference import read_reference

    path, name = given.sensors, given.sensors_name
    reference, processor = request.path("reference"), request.options.get("processor")
    known = read_sensors(path)
    late = find_filter(filter_name).estimates_time_offsets
    tracks = read_reference(reference, known, processor, late=late)
    whole = known if tracks is None else tracks.among(known)
    return known, tracks, load_sensor_table(path, whole, name)


def _page_file(page: Path | None) -> AbstractContextManager[Path | None]:
    from multiradar.storage.output_file import new_file

    return nullcontext() if page is None else new_file(page)


def _write_page(page: Path, given: _Given, report: "Report", command: str) -> None:
    from multiradar.toolbox.pages.track_page import TrackRun, track_page

    table = load_sensor_table(given.out / SENSORS_FILE)
    run = TrackRun(given.out, report, table, given.measurements.name, command)
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
    job: "OfflineJob",
    folder: Path,
    recorder: "AsterixRecorder | None",
    stages: "StageTimes",
    custom: "CustomFilter | None",
) -> "OfflineResult":
    from multiradar.runtime.offline.offline_run import track_recording

    on_output = None if recorder is None else stages.timed("ASTERIX", recorder.write)
    refine = None if custom is None else custom.start(job.sensors, job.settings)
    with progress_bar("tracking", job.recording.rows) as on_progress:
        return track_recording(job, folder, on_progress, on_output, stages, refine=refine)


def _write_report(
    job: "OfflineJob",
    result: "OfflineResult",
    folder: Path,
    custom: "CustomFilter | None",
    before: Run | None,
) -> "Report":
    from multiradar.runtime.offline.offline_report import REPORT_FILE, offline_report

    report = offline_report(job, result)
    if custom is not None:
        report.settings.update(filter_name=custom.name, host_filter=job.settings.filter_name)
    if before is not None:
        report.settings.update(biases_from=before.report["output_sha256"])
    text = report.model_dump_json(indent=2)
    (folder / REPORT_FILE).write_text(text + "\n", encoding="utf-8")
    return report


def _trajectories(request: TrackRequest) -> "TrajectoryOptions | None":
    from multiradar.runtime.trajectories.options import trajectory_options

    if not request.options.get("trajectories"):
        return None
    wanted = request.settings.trajectories
    given = request.options.get("trajectory_aircraft_max")
    most = given or wanted.aircraft_max or TRAJECTORY_AIRCRAFT_DEFAULT
    return trajectory_options(**wanted.model_dump() | {"aircraft_max": most})
