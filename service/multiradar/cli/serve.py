"""`multiradar serve`: the service, until it is stopped."""

import gc
import sys
import threading
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from multiradar.cli.options import (
    ClusterListenOption,
    ConfigOption,
    EngineOption,
    FilterOption,
    OverlaysOption,
)
from multiradar.cli.terminal.stop_signals import stop_on_signals
from multiradar.errors import JournalError, MultiradarError, PipelineError
from multiradar.toolbox.inputs import load_sensor_table, read_sensors

if TYPE_CHECKING:
    from multiradar.app import Application
    from multiradar.settings.service import Settings


#: Interval after which a thread yields the interpreter to another one, s. With that of Python,
#: 5 ms, the engine waits longer beside a diagnosis or an encoder, after each of its kernels.
SWITCH_INTERVAL_S = 0.001
#: Objects between collections of garbage, and collections between those of older objects.
GC_THRESHOLDS = (10_000, 10, 10)

_ON_DAMAGE = "copy the state and check it with `multiradar verify`"


class LogLevel(StrEnum):
    """Minimum log level."""

    DEBUG = "debug"
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


class LogForm(StrEnum):
    """Log format."""

    TEXT = "text"
    JSON = "json"


def serve(
    *,
    sensors: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Sensor configuration: sensors.toml.", show_default="sensors.toml"
        ),
    ] = None,
    state: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Directory of the journal.", show_default="multiradar-data"
        ),
    ] = None,
    standby: Annotated[
        bool | None,
        typer.Option(
            "--standby",
            help="If another service uses the journal, follow that service and take over when it "
            "stops.",
        ),
    ] = None,
    host: Annotated[
        str | None, typer.Option(help="Address to listen on.", show_default="127.0.0.1")
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(
            min=0, max=65_535, help="Port to listen on; 0: pick a free port.", show_default="8321"
        ),
    ] = None,
    zenoh: Annotated[
        bool | None, typer.Option(help="Enable the Zenoh interface.", show_default="zenoh")
    ] = None,
    zenoh_listen: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ENDPOINT",
            help="Endpoint on which Zenoh listens; repeatable.",
            show_default="tcp/127.0.0.1:7447",
        ),
    ] = None,
    zenoh_connect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ENDPOINT",
            help="Zenoh router or peer to connect to; repeatable.",
            show_default=False,
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(min=1, help="Number of worker threads or Ray actors.", show_default="1"),
    ] = None,
    engine: EngineOption = None,
    cluster_listen: ClusterListenOption = None,
    filter_name: FilterOption = None,
    trajectory_aircraft_max: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=0,
            max=10_000,
            help="Maximum number of tracks with trajectory reconstruction (about 1 ms of CPU time "
            "per plot).",
            show_default="0: none",
        ),
    ] = None,
    overlays: OverlaysOption = None,
    insecure: Annotated[
        bool,
        typer.Option(
            "--insecure",
            help="Listen on non-loopback addresses without authentication: every host on the "
            "network may then send and read.",
        ),
    ] = False,
    config: ConfigOption = None,
    log_level: Annotated[
        LogLevel | None, typer.Option(help="Minimum log level.", show_default="info")
    ] = None,
    log_form: Annotated[
        LogForm | None, typer.Option(help="Log format.", show_default="text")
    ] = None,
    json_wanted: Annotated[
        bool, typer.Option("--json", help="Print the listening addresses as JSON.")
    ] = False,
) -> None:
    """Ingest measurements and serve tracks, biases and predictions, by default on loopback."""
    from multiradar.settings.service import load_settings

    overrides = _overrides(
        {
            ("sensors",): sensors,
            ("journal", "path"): None if state is None else state / "journal.sqlite",
            ("journal", "standby"): standby,
            ("server", "host"): host,
            ("server", "port"): port,
            ("zenoh", "enabled"): zenoh,
            ("zenoh", "listen"): tuple(zenoh_listen) if zenoh_listen else None,
            ("zenoh", "connect"): tuple(zenoh_connect) if zenoh_connect else None,
            ("workers",): workers,
            ("engine",): None if engine is None else engine.value,
            ("cluster", "listen"): tuple(cluster_listen) if cluster_listen else None,
            ("trajectories", "aircraft_max"): trajectory_aircraft_max,
            ("tracking", "filter_name"): None if filter_name is None else filter_name.value,
            ("page", "overlays"): overlays,
            ("access", "insecure"): insecure or None,
            ("log", "level"): None if log_level is None else log_level.value,
            ("log", "form"): None if log_form is None else log_form.value,
        }
    )
    run_service(load_settings(config, overrides), json_wanted)


def run_service(settings: "Settings", json_wanted: bool) -> None:
    """Serve until SIGTERM or SIGINT.

    Parameters
    ----------
    settings : Settings
        All settings.
    json_wanted : bool
        Whether the line with the listening addresses is JSON.

    Raises
    ------
    ConfigurationError
        If the sensors or settings cannot be used, or it cannot listen on a configured address.
    JournalError
        If the journal cannot be opened.
    PipelineError
        If it stopped unexpectedly.
    """
    from multiradar.clock import SystemClock
    from multiradar.observability.logs import configure_logs
    from multiradar.runtime.heap import release_heap

    configure_logs(settings.log.level, settings.log.form, SystemClock())
    sensors = read_sensors(settings.sensors)
    _check_start(settings)
    # It takes seconds to import, many on a loaded machine.
    from multiradar.app import Application

    table = load_sensor_table(settings.sensors, sensors)
    failed = threading.Event()
    with stop_on_signals() as stop:

        def on_failure() -> None:
            failed.set()
            stop.set()

        application = Application(settings, table, on_failure, sensors, stop.set)
        try:
            _start(application)
            # What the start made remains: without this each collection of garbage looks at all of
            # it, and everything stands still for 0.2 s.
            gc.collect()
            gc.freeze()
            gc.set_threshold(*GC_THRESHOLDS)
            sys.setswitchinterval(SWITCH_INTERVAL_S)
            stop.started()
            _print_addresses(application, json_wanted)
            # Large messages leave unused memory behind.
            stop.wait(meanwhile=release_heap)
        finally:
            stop.started()
            application.stop()
    if failed.is_set():
        failure = application.service.failure or "the HTTP server stopped unexpectedly; see the log"
        raise PipelineError(f"{failure}{advice_after(failure)}")


def advice_after(failure: MultiradarError | str) -> str:
    """Return what to do after a failure, to append to its message; empty if that says it."""
    if isinstance(failure, JournalError):
        return "" if _has_advice(failure) else f"; before a restart, {_ON_DAMAGE}"
    return "; restart the service (acknowledged data are safe on disk)"


def _start(application: "Application") -> None:
    try:
        application.start()
    except JournalError as error:
        if _has_advice(error):
            raise
        raise JournalError(f"{error}; {_ON_DAMAGE}, or restore a backup") from error


# What is found damaged in reading is named without advice.
def _has_advice(error: JournalError) -> bool:
    return ";" in str(error)


# What the start would report later.
def _check_start(settings: "Settings") -> None:
    from multiradar.access.authentication import Authentication, with_default_file
    from multiradar.access.exposure import check_exposed
    from multiradar.storage.snapshots import SnapshotFolder
    from multiradar.storage.sqlite.opening import make_folder

    check_exposed(settings, Authentication(with_default_file(settings.access)).required)
    journal = settings.journal.path
    make_folder(journal)
    SnapshotFolder(journal).read_ahead()


def _print_addresses(application: "Application", json_wanted: bool) -> None:
    endpoints, asterix = application.zenoh_endpoints, application.asterix_endpoints
    feeds = application.feed_endpoints
    if json_wanted:
        import json

        addresses = {"ready": True, "http": application.http_url, "zenoh": list(endpoints)}
        if application.following:
            addresses["role"] = "standby"
        if asterix:
            addresses["asterix"] = list(asterix)
        if feeds:
            addresses["feeds"] = list(feeds)
        line = json.dumps(addresses)
    else:
        line = f"multiradar serves {application.http_url}"
        line += f" and Zenoh at {', '.join(endpoints)}" if endpoints else " (no Zenoh)"
        line += f", receives ASTERIX on {', '.join(asterix)}" if asterix else ""
        line += f", and receives feeds from {', '.join(feeds)}" if feeds else ""
        if application.following:
            line = "multiradar is the standby and follows the primary; read-only at "
            line += application.http_url
    print(line, flush=True)


def _overrides(given: dict[tuple[str, ...], Any]) -> dict[str, Any]:
    overrides: dict[str, Any] = {}
    for path, value in given.items():
        if value is not None:
            section = overrides if len(path) == 1 else overrides.setdefault(path[0], {})
            section[path[-1]] = value
    return overrides
