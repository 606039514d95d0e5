"""`multiradar demo`: half an hour of recording through the real service in 15 s."""

import shutil
import signal
import tempfile
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from multiradar.cli.demonstration.service import ServiceProcess, start_service
from multiradar.cli.demonstration.view import (
    BiasLine,
    View,
    bias_table,
    live_view,
    plain_head,
    plain_line,
)
from multiradar.cli.options import TRACKING_DEFAULTS, AllowMissingOption, ProfileOption
from multiradar.cli.playback.replay import parse_speed
from multiradar.clock import SystemClock
from multiradar.errors import InputError, MultiradarError
from multiradar.toolbox.compiling import compile_kernels
from multiradar.toolbox.evaluation.dump_truth import Truth, read_truth, sample_folder
from multiradar.toolbox.inputs import DumpChoice, load_sensor_table

if TYPE_CHECKING:
    import httpx
    import polars as pl
    from rich.console import Console

    from multiradar.storage.recording import Recording

_POLL_PERIOD_S = 0.25
_PLAIN_PERIOD_S = 2.0
_BATCH_ROWS = 500
#: Generous: a service on a busy machine answers late.
_ANSWER_TIMEOUT_S = 300.0
_PAGE_ROWS = 1000


def demo(
    *,
    dump: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Dump directory.", show_default="the sample recording"),
    ] = None,
    sensors: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Sensor configuration of the dump: sensors.toml.",
            show_default="from the truth.json of the dump",
        ),
    ] = None,
    profile: ProfileOption = None,
    allow_missing: AllowMissingOption = False,
    speed: Annotated[
        float,
        typer.Option(
            metavar="NUMBER|max", parser=parse_speed, help="Playback speed (1 = real time)."
        ),
    ] = "150",  # type: ignore[assignment]  # given to the parser like any other text
    leave: Annotated[bool, typer.Option("--exit", help="Stop the service after the demo.")] = False,
) -> None:
    """Convert the sample, replay it to a service, and compare the output with the truth."""
    from rich.console import Console

    console = Console(highlight=False)
    before = {
        number: signal.signal(number, _interrupt) for number in (signal.SIGTERM, signal.SIGINT)
    }
    folder = Path(tempfile.mkdtemp(prefix="multiradar-demo-"))
    try:
        _play(
            console,
            folder,
            dump=dump or sample_folder(),
            sensors=sensors,
            choice=DumpChoice(None, profile, allow_missing),
            speed=speed,
            leave=leave,
        )
    except KeyboardInterrupt:
        console.print("stopped")
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        for number, handler in before.items():
            signal.signal(number, handler)


def _interrupt(_number: int, _frame: object) -> None:
    raise KeyboardInterrupt


def _play(
    console: "Console",
    folder: Path,
    *,
    dump: Path,
    sensors: Path | None,
    choice: DumpChoice,
    speed: float,
    leave: bool,
) -> None:
    from rich.markup import escape

    from multiradar.runtime.kernel_purposes import serve_purposes
    from multiradar.storage.recording import MEASUREMENTS_FILE, Recording

    truth = read_truth(dump)
    sensors = _sensors_file(truth, sensors, folder, dump)
    # Compiled here, where progress can be shown; the service uses the cache.
    table = load_sensor_table(sensors)
    wanted = serve_purposes(TRACKING_DEFAULTS, table, trajectories=False, asterix=False)
    compile_kernels(["convert vid", *wanted])
    choice = replace(choice, date=truth.date)
    converted = _convert(console, dump, folder / "converted", choice)
    recording = Recording(converted / MEASUREMENTS_FILE)
    with console.status("starting the service …") as shown:
        service = start_service(sensors, folder, lambda line: shown.update(escape(line)))
    console.print("[bold]2[/] started the service:", end=" ")
    try:
        endpoints = "".join(f", Zenoh at {endpoint}" for endpoint in service.zenoh)
        console.print(f"HTTP at {service.http}{endpoints}", soft_wrap=True)
        show = _Show(console, service, recording, truth, speed)
        show.run()
        if not leave:
            _stay(console, service, show.sensors)
    finally:
        service.stop()


def _sensors_file(truth: Truth, given: Path | None, folder: Path, dump: Path) -> Path:
    if given is not None:
        return given
    if truth.sensors_toml is None:
        msg = f"no truth.json in {dump}; specify a sensors file with --sensors"
        if not dump.is_dir():
            msg = f"{dump}: expected a folder with the text files of a dump"
        raise InputError(msg)
    path = folder / "sensors.toml"
    path.write_text(truth.sensors_toml, encoding="utf-8")
    return path


def _convert(console: "Console", dump: Path, out: Path, choice: DumpChoice) -> Path:
    from multiradar.toolbox.conversion.convert import convert_dump

    report = convert_dump(dump, out, choice.options())
    counts = report["counts"]
    console.print(
        f"[bold]1[/] converted {dump.name}: {counts['read']:,} lines read = "
        f"{counts['accepted']:,} accepted + {counts['rejected']} rejected (kept in rejects.ndjson)",
        soft_wrap=True,
    )
    return out


class _Show:
    # Replays in a thread of its own and polls the service from this one.
    def __init__(
        self,
        console: "Console",
        service: ServiceProcess,
        recording: "Recording",
        truth: Truth,
        speed: float,
    ) -> None:
        import httpx

        self._clock = SystemClock()
        self._console = console
        self._service = service
        self._recording = recording
        self._truth = truth
        self._speed = speed
        self._client = httpx.Client(
            base_url=service.http, timeout=_ANSWER_TIMEOUT_S, trust_env=False
        )
        self._failure: BaseException | None = None
        self._stopping = threading.Event()
        self._view = View(total=self._plots(), lines=self._bias_lines())

    def run(self) -> None:
        self._console.print(
            "[bold]3[/] replaying the radar plots; ADS-B is withheld and used as the reference\n"
        )
        thread = threading.Thread(target=self._replay, name="demo-replay", daemon=True)
        started_s = self._clock.monotonic_s()
        thread.start()
        try:
            self._watch(thread)
        finally:
            self._stopping.set()
            thread.join()
        if self._failure is not None:
            raise self._failure
        self._wait_until_processed()
        self._summary(self._clock.monotonic_s() - started_s)
        self._client.close()

    @property
    def sensors(self) -> list[str]:
        return list(dict.fromkeys(line.sensor for line in self._view.lines))

    def _replay(self) -> None:
        from multiradar.clock import SystemClock
        from multiradar.ingest.replay.http import Encoding, HttpDestination
        from multiradar.ingest.replay.replaying import Replay, ReplayPlan

        plan = ReplayPlan(batch_rows=_BATCH_ROWS, speed=self._speed, kinds={"radar"})
        destination = HttpDestination(self._service.http, Encoding.ARROW)

        def count(counts: Any) -> None:
            self._view.sent = counts.read
            if self._stopping.is_set():
                raise KeyboardInterrupt

        def pause(duration_s: float) -> None:
            self._stopping.wait(duration_s)

        try:
            Replay(self._recording, destination, plan, SystemClock(), pause, count).run()
        except BaseException as error:
            self._failure = error
        finally:
            destination.close()

    def _watch(self, thread: threading.Thread) -> None:
        if not self._console.is_terminal:
            print(
                "\n".join(plain_head(self._view.lines, dated=self._truth.date is not None)),
                flush=True,
            )
            while thread.is_alive():
                thread.join(_PLAIN_PERIOD_S)
                self._poll()
                print(plain_line(self._view), flush=True)
            return
        from rich.live import Live

        with Live(live_view(self._view), console=self._console, transient=True) as live:
            while thread.is_alive():
                thread.join(_POLL_PERIOD_S)
                self._poll()
                live.update(live_view(self._view))

    def _poll(self) -> None:
        status = self._get("/v1/status")
        view = self._view
        view.data_time_s = status["data_time_s"]
        view.tracks = status["tracks_confirmed_live"]
        view.tracks_confirmed = status["tracks_confirmed"]
        view.tracks_initiated = status["tracks_initiated"]
        known = {
            (bias["sensor_id"], bias["parameter"]): bias
            for sensor in self.sensors
            for bias in self._get(f"/v1/sensors/{sensor}/bias")["biases"]
        }
        for line in view.lines:
            bias = known.get((line.sensor, line.parameter))
            if bias is not None:
                line.update(bias["estimate"], bias["sigma"])

    def _wait_until_processed(self) -> None:
        while True:
            status = self._get("/v1/status")
            if status["failure"]:
                raise MultiradarError(f"the service failed: {status['failure']}")
            if status["processed_sequence"] == status["journal_sequence"]:
                break
            time.sleep(_POLL_PERIOD_S)
        self._poll()

    def _summary(self, elapsed_s: float) -> None:
        from multiradar.toolbox.evaluation.accuracy import position_accuracy

        status, view, console = self._get("/v1/status"), self._view, self._console
        for line in view.lines:
            line.sigmas = self._sigmas(line)
        console.print(bias_table(view.lines))
        console.print(
            f"{view.tracks_confirmed} confirmed tracks ({view.tracks_initiated} initiated) from "
            f"{status['accepted']:,} plots in {elapsed_s:.1f} s ({status['read']:,} read = "
            f"{status['accepted']:,} accepted + {status['rejected']} rejected + "
            f"{status['duplicate']} duplicate)",
            soft_wrap=True,
        )
        accuracy = position_accuracy(self._reports(), self._updates(view.tracks_initiated))
        if accuracy is not None:
            console.print(
                f"{accuracy.compared:,} track positions (without the first minute of each track) "
                f"differ by "
                f"[bold green]{accuracy.median_m:.0f} m[/] (median) and "
                f"[bold green]{accuracy.rms_m:.0f} m[/] (RMS) from ADS-B, "
                "which was withheld from the tracker",
                soft_wrap=True,
            )
        console.print(f"output_sha256 {status['output_sha256']}", soft_wrap=True)

    def _sigmas(self, line: BiasLine) -> list[float]:
        path = f"/v1/sensors/{line.sensor}/bias"
        history = self._pages(path, "biases", {"history": "true"})
        return [row["sigma"] for row in history if row["parameter"] == line.parameter]

    def _updates(self, tracks: int) -> "pl.DataFrame":
        import polars as pl

        updates: list[dict[str, Any]] = []
        found = 0
        # Identifiers have gaps; each plot takes one at most.
        for track in range(1, self._plots() + 1):
            if found == tracks:
                break
            if rows := self._history(track):
                updates += rows
                found += 1
        return pl.DataFrame(updates, infer_schema_length=None)

    def _history(self, track: int) -> list[dict[str, Any]]:
        import httpx

        try:
            return self._pages(f"/v1/tracks/{track}/history", "updates", {})
        except httpx.HTTPStatusError as error:
            if error.response.status_code != httpx.codes.NOT_FOUND:
                raise
            return []

    def _reports(self) -> "pl.DataFrame":
        import polars as pl

        return pl.concat(self._recording.blocks({"adsb"}))

    def _plots(self) -> int:
        return sum(len(block) for block in self._recording.blocks({"radar"}))

    def _bias_lines(self) -> list[BiasLine]:
        sensors = [one["id"] for one in self._get("/v1/sensors")["sensors"]]
        return [
            BiasLine(sensor, parameter, self._truth.biases.get((sensor, parameter)))
            for sensor in sensors
            for parameter in ("range_offset_m", "azimuth_offset_deg")
            if sensor != "adsb"
        ]

    def _pages(self, path: str, name: str, query: dict[str, str]) -> list[dict[str, Any]]:
        # Without `since`, a history is limited to its last rows.
        query = {**query, "since": "0", "limit": str(_PAGE_ROWS)}
        rows: list[dict[str, Any]] = []
        while True:
            page = self._get(path, query)
            rows += page[name]
            if page["next_cursor"] is None:
                return rows
            query["cursor"] = page["next_cursor"]

    def _get(self, path: str, query: dict[str, str] | None = None) -> Any:
        response: httpx.Response = self._client.get(path, params=query)
        response.raise_for_status()
        return response.json()


def _stay(console: "Console", service: ServiceProcess, sensors: list[str]) -> None:
    console.print(
        f"\nOpen {service.http} in a browser for the air picture "
        "(press b to toggle the bias correction)."
    )
    console.print("The service stays up; press Ctrl-C to stop it:")
    biases = [f"/v1/sensors/{sensor}/bias" for sensor in sensors[:1]]
    for path in ("/docs", "/v1/tracks", *biases, "/v1/status"):
        console.print(f"  {service.http}{path}", soft_wrap=True)
    # In short waits: a library may have set signals so that a wait continues after one.
    while (status := service.process.poll()) is None:
        time.sleep(_POLL_PERIOD_S)
    msg = f"the service stopped unexpectedly with status {status}"
    raise MultiradarError(msg)
