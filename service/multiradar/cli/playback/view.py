"""`multiradar view`: runs of `track` on the page of the air picture, without a service."""

import sys
import threading
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from multiradar.cli.options import OverlaysOption
from multiradar.cli.terminal.stop_signals import stop_on_signals
from multiradar.errors import InputError, PipelineError
from multiradar.toolbox.inputs import SENSORS_FILE, load_sensor_table
from multiradar_schemas.documents.contents import no_such

if TYPE_CHECKING:
    from multiradar.estimation.measurement.sensors import SensorTable
    from multiradar.runtime.recorded.run import RecordedRun, RunFiles
    from multiradar.storage.overlays import Overlays

_RUNS_MAX = 2

VIEW_HELP = (
    "Show runs of `track` on a map in the browser, at any time of the recording.\n\n"
    "TRACKS is the output directory of `track` or its tracks.parquet, or the history of a service "
    "(`history.folder`) or one hour of it. Two runs are shown as two layers. The page is the air "
    "picture of the service, accessible from this computer only; press Ctrl-C to stop."
)


def view(
    tracks: Annotated[
        list[Path],
        typer.Argument(metavar="TRACKS...", help="One or two runs to show.", show_default=False),
    ],
    *,
    measurements: Annotated[
        Path | None,
        typer.Option(
            metavar="MEASUREMENTS",
            help="Measurements of the runs (a measurements.parquet or an output directory of "
            "`convert`), to show plots with and without the estimated biases.",
            show_default="measurements.parquet in TRACKS",
        ),
    ] = None,
    overlays: OverlaysOption = None,
    port: Annotated[
        int,
        typer.Option(min=0, max=65_535, help="Port to listen on.", show_default="any free port"),
    ] = 0,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")
    ] = True,
) -> None:
    """Show runs."""
    if len(tracks) > _RUNS_MAX:
        msg = f"expected one or two runs, found {len(tracks)}"
        raise typer.BadParameter(msg)
    from multiradar.app import view_server
    from multiradar.runtime.recorded.run import RecordedRun
    from multiradar_converters.leftovers import temporary_folder

    # Before anything slow: an error of an argument is an error at once.
    files = [run_files(path, measurements, tracks) for path in tracks]
    shapes = _overlays(overlays)
    with temporary_folder("multiradar-view-") as folder:
        runs = [RecordedRun(one, _subfolder(folder, number)) for number, one in enumerate(files)]
        _check_times(runs, measurements)
        failed = threading.Event()
        with stop_on_signals() as stop:
            stop.started()

            def on_failure() -> None:
                failed.set()
                stop.set()

            server = view_server(runs, shapes, port, on_failure)
            server.start()
            names = " and ".join(run.name for run in runs)
            print(f"multiradar shows {names} at {server.url}; press Ctrl-C to stop", flush=True)
            if browser:
                webbrowser.open(server.url)
            stop.wait()
            server.stop()
    if failed.is_set():
        msg = "the HTTP server stopped unexpectedly"
        raise PipelineError(msg)


def run_files(given: Path, measurements: Path | None, all_given: Sequence[Path]) -> "RunFiles":
    """Return where a run is.

    Parameters
    ----------
    given : Path
        Output directory of `track`, or its tracks.parquet; the history of a service, or an hour.
    measurements : Path or None
        Its measurements; those beside the tracks, if there are any, when absent.
    all_given : sequence of Path
        All runs, for names that differ.

    Raises
    ------
    InputError
        There is no such run, or there are no such measurements.
    ConfigurationError
        Its sensors cannot be read.
    """
    from multiradar.runtime.offline.offline_job import TRACKS_FILE
    from multiradar.runtime.offline.offline_report import REPORT_FILE
    from multiradar.runtime.recorded.history_files import history_tables, last_hour, run_tables
    from multiradar.runtime.recorded.run import RunFiles
    from multiradar.storage.recording import MEASUREMENTS_FILE, measurements_path

    path = given / TRACKS_FILE if given.is_dir() else given
    tables = history_tables(given) or run_tables(path)
    if not tables.get(TRACKS_FILE) or path.suffix != ".parquet":
        raise InputError(no_such(given, "the output of `track`, or its tracks.parquet"))
    folder = last_hour(given) or path.parent
    if measurements is not None:
        measured = measurements_path(measurements)
        if not measured.is_file():
            raise InputError(no_such(measurements, "the output of `convert`"))
        tables[MEASUREMENTS_FILE] = (measured,)
    sensors = _sensors(folder / SENSORS_FILE, required=measurements is not None)
    if not len(sensors):
        tables.pop(MEASUREMENTS_FILE, None)
    unique = len({one.resolve().name for one in all_given}) == len(all_given)
    name = path.resolve().parent.name if path.name == TRACKS_FILE else path.stem
    return RunFiles(name if unique else str(given), tables, sensors, folder / REPORT_FILE)


def _sensors(path: Path, *, required: bool) -> "SensorTable":
    from multiradar import wire
    from multiradar_schemas.sensors.sensor import SensorsFile

    if path.is_file():
        return load_sensor_table(path)
    if required:
        msg = (
            f"{path}: no such file; --measurements requires the sensors.toml of the run next to "
            "its tracks"
        )
        raise InputError(msg)
    print(f"multiradar: {path}: no such file; sensors are not shown", file=sys.stderr)
    return wire.sensor_table(SensorsFile.model_construct(sensor=()))


def _overlays(folder: Path | None) -> "Overlays":
    from multiradar.storage.overlays import read_overlays

    overlays = () if folder is None else read_overlays(folder)
    for one in overlays:
        if one.problem:
            print(f"multiradar: overlay {one.name} is not shown: {one.problem}", file=sys.stderr)
    return overlays


def _subfolder(folder: Path, number: int) -> Path:
    own = folder / str(number)
    own.mkdir()
    return own


def _check_times(runs: "Sequence[RecordedRun]", measurements: Path | None) -> None:
    from multiradar.report.times import time_text
    from multiradar.storage.recording import MEASUREMENTS_FILE

    def span_text(span_s: tuple[float, float]) -> str:
        return f"{time_text(span_s[0])} to {time_text(span_s[1])}"

    for run in runs:
        measured = run.measured_span_s()
        if measured is not None and not _meet(run.span_s(), measured):
            given = measurements or run.files.tables[MEASUREMENTS_FILE][0]
            msg = (
                f"{given}: covers {span_text(measured)}, but {run.name} covers "
                f"{span_text(run.span_s())}; specify the measurements of this run"
            )
            raise InputError(msg)
    if len(runs) == _RUNS_MAX and not _meet(runs[0].span_s(), runs[1].span_s()):
        each = " and ".join(f"{run.name} ({span_text(run.span_s())})" for run in runs)
        msg = f"{each} do not overlap in time; show them separately"
        raise InputError(msg)


def _meet(first: tuple[float, float], second: tuple[float, float]) -> bool:
    return first[0] <= second[1] and second[0] <= first[1]
