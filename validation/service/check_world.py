"""The sky of the world, live: rate, latency and memory of services that follow it.

    python -m validation.service.check_world [--aircraft 15000] [--radars 400] [--rate 100000]

Measurements are made first and kept on disk, so that making them does not compete with the
services. Then every region gets a service of its own (`--continent`: one service for all), its
measurements over HTTP on loopback at the chosen rate, and subscribers. A message is due when the
clock of the scenario reaches the end of its data time, however long earlier messages took.

Latency of an update: from the time at which the message was due that has the data time of its plot
plus the reorder horizon until a subscriber received it. The reorder buffer releases whole windows
of the association: the same from the message that has the end of the window plus the horizon.
"""

import argparse
import http.client
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from numpy.typing import NDArray

from multiradar.clock import SystemClock
from multiradar.tracking.input.order import RELEASE_STEP_S
from validation.service.traffic import processor_s, started
from validation.service.world_scene import BLOCK_S, START_S, WORLD, Region, World, continent

CLOCK = SystemClock()
HORIZON_S = 6.0
# Of a message: times are multiples of its duration but for rounding.
_TINY = 1e-9
_ARROW = {"Content-Type": "application/vnd.apache.arrow.stream"}
_OK = 200
_SAMPLE_S = 1.0
_TIMEOUT_S = 120.0
_MIB = 2.0**20


@dataclass(frozen=True, slots=True)
class Body:
    """A message on disk: its region, its last data time from the start (s), and its rows."""

    region: int
    end_s: float
    rows: int
    path: Path


@dataclass(slots=True)
class Fed:
    """What feeding came to."""

    accepted: int = 0
    rejected: int = 0
    retries: int = 0
    behind_s: float = 0.0
    faults: list[str] = field(default_factory=list)


def prepared(world: World, duration_s: float, part_s: float, folder: Path) -> list[Body]:
    """Write the messages of a scenario, each of `part_s` of data time, and return them in order."""
    bodies = []
    for number, frames in enumerate(world.blocks(duration_s)):
        edges = number * BLOCK_S + np.arange(part_s, BLOCK_S + part_s / 2.0, part_s)
        for region, frame in enumerate(frames):
            cuts = np.searchsorted(frame["time_s"].to_numpy() - START_S, edges)
            begin = 0
            for edge, end in zip(edges.tolist(), cuts.tolist(), strict=True):
                path = folder / f"{region}-{edge:.2f}.arrow"
                frame[begin:end].write_ipc_stream(path, compression="uncompressed")
                bodies.append(Body(region, edge, end - begin, path))
                begin = end
    return sorted(bodies, key=lambda one: (one.end_s, one.region))


class Service:
    """A service in a process of its own.

    Parameters
    ----------
    folder : Path
        For its journal and configuration.
    sensors : str
        Its `sensors.toml`.
    options : list of str
        Further options of `serve`.
    module : str
        The module that is the command.
    """

    def __init__(
        self, folder: Path, sensors: str, options: list[str], module: str = "multiradar"
    ) -> None:
        folder.mkdir(parents=True)
        self.folder = folder
        self._log = (folder / "log.txt").open("w", encoding="utf-8")
        self._process = started(folder, sensors, *options, errors=self._log, module=module)
        self.pid = self._process.pid

    def listen(self) -> None:
        """Wait until it listens and is ready."""
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise SystemExit(f"a service did not start; see {self.folder / 'log.txt'}")
        self.url = str(json.loads(line)["http"])
        self.address = urlsplit(self.url).netloc
        end_s = CLOCK.monotonic_s() + _TIMEOUT_S
        while self.get("/readyz")[0] != _OK:
            if CLOCK.monotonic_s() > end_s:
                raise SystemExit(f"a service was not ready after {_TIMEOUT_S:.0f} s")
            time.sleep(0.1)

    def get(self, path: str) -> tuple[int, bytes]:
        """Return status and content of an answer."""
        connection = http.client.HTTPConnection(self.address, timeout=_TIMEOUT_S)
        connection.request("GET", path)
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer.status, content

    def status(self) -> dict[str, Any]:
        """Return the status."""
        found: dict[str, Any] = json.loads(self.get("/v1/status")[1])
        return found

    def send(self, connection: http.client.HTTPConnection, content: bytes, fed: Fed) -> None:
        """Send measurements in the Arrow format, again if they are not accepted now."""
        end_s = CLOCK.monotonic_s() + _TIMEOUT_S
        while CLOCK.monotonic_s() < end_s:
            connection.request("POST", "/v1/measurements", content, _ARROW)
            answer = connection.getresponse()
            found = answer.read()
            if answer.status == _OK:
                document = json.loads(found)
                fed.accepted += document["accepted"]
                fed.rejected += len(document["rejected"])
                if document["rejected"] and len(fed.faults) < 3:
                    fed.faults.append(str(document["rejected"][0])[:200])
                return
            fed.retries += 1
            fed.faults = fed.faults or [found[:200].decode()]
            time.sleep(0.2)

    def settled(self) -> dict[str, Any]:
        """Return the status once everything is processed, or after two minutes."""
        end_s = CLOCK.monotonic_s() + _TIMEOUT_S
        while True:
            status = self.status()
            left = status["journal_sequence"] - status["processed_sequence"]
            if left == 0 or CLOCK.monotonic_s() > end_s:
                return status
            time.sleep(0.1)

    def resident(self) -> int:
        """Return its resident memory, octets."""
        fields = Path(f"/proc/{self.pid}/statm").read_text(encoding="utf-8").split()
        return int(fields[1]) * os.sysconf("SC_PAGE_SIZE")

    def stop(self) -> None:
        """End it."""
        self._process.terminate()
        try:
            self._process.wait(_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            print(f"{self.folder.name}: killed, it did not stop", file=sys.stderr)
        self._log.close()


class Feeder:
    """Sends the messages of one region when they are due, on one connection.

    Parameters
    ----------
    service : Service
        Of the region.
    bodies : list of Body
        Its messages.
    speed : float
        Seconds of data time in one second.
    """

    def __init__(self, service: Service, bodies: list[Body], speed: float) -> None:
        self._service, self._bodies, self._speed = service, bodies, speed
        self.fed = Fed()

    def run(self, begin_s: float) -> None:
        """Send all."""
        connection = http.client.HTTPConnection(self._service.address, timeout=_TIMEOUT_S)
        for body in self._bodies:
            due_s = begin_s + body.end_s / self._speed
            wait_s = due_s - CLOCK.monotonic_s()
            if wait_s > 0.0:
                time.sleep(wait_s)
            if body.rows:
                self._service.send(connection, body.path.read_bytes(), self.fed)
            body.path.unlink()
            self.fed.behind_s = max(self.fed.behind_s, CLOCK.monotonic_s() - due_s)
        connection.close()


def main() -> int:
    """Run and print the figures; the exit status is 1 if anything was lost."""
    options = _options()
    regions: tuple[Region, ...] = WORLD
    if options.continent:
        regions = (continent(*map(float, options.continent.split(","))),)
    with tempfile.TemporaryDirectory(dir=options.folder) as name:
        return _run(options, World(options.aircraft, options.radars, regions, options.adsb_period),
                    Path(name))  # fmt: skip


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m validation.service.check_world")
    parser.add_argument("--aircraft", type=int, default=15_000, help="in flight at any time")
    parser.add_argument("--radars", type=int, default=400)
    parser.add_argument("--adsb-period", type=float, default=0.5, help="s between two reports")
    parser.add_argument(
        "--rate", type=float, default=100_000.0, help="measurements/s; 0: real time"
    )
    parser.add_argument("--seconds", type=float, default=60.0, help="duration of the feed")
    parser.add_argument("--warm", type=float, default=20.0, help="s not counted at the start")
    parser.add_argument("--subscribers", type=int, default=10, help="of each service")
    parser.add_argument("--kind", choices=("picture", "stream"), default="picture")
    parser.add_argument(
        "--continent", metavar="LAT,LON", help="all traffic around one place, in one service"
    )
    parser.add_argument("--folder", type=Path, help="for messages, journals and logs")
    parser.add_argument("--keep-logs", type=Path, help="folder for logs and status at the end")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("serve", nargs="*", help="after --: further options of serve")
    return parser.parse_args()


def _natural_rate(world: World) -> float:
    return sum(len(one) for one in next(iter(world.blocks(BLOCK_S)))) / BLOCK_S


def _run(options: argparse.Namespace, world: World, folder: Path) -> int:
    natural = _natural_rate(World(options.aircraft, options.radars, world.regions,
                                  options.adsb_period))  # fmt: skip
    speed = options.rate / natural if options.rate else 1.0
    # A message for each quarter of a second of the clock, a whole number in each block.
    part_s = BLOCK_S / max(1.0, round(BLOCK_S / (0.25 * speed)))
    duration_s = np.ceil(options.seconds * speed / BLOCK_S) * BLOCK_S
    (folder / "bodies").mkdir()
    bodies = prepared(world, duration_s, part_s, folder / "bodies")
    services = [
        Service(folder / region.name, world.sensors_text(number), options.serve)
        for number, region in enumerate(world.regions)
    ]
    try:
        for one in services:
            one.listen()
        options.speed, options.part_s = speed, part_s
        figures = _fed(options, services, bodies, folder)
    finally:
        if options.keep_logs:
            _keep(options.keep_logs, services)
        for one in services:
            one.stop()
    figures |= {"natural": natural, "speed": speed, "message_s": part_s / speed}
    print(json.dumps(figures)) if options.json else _print(options, figures)
    return int(figures["rejected"] > 0 or figures["unprocessed"] > 0)


def _fed(
    options: argparse.Namespace, services: list[Service], bodies: list[Body], folder: Path
) -> dict[str, Any]:
    speed, part_s = options.speed, options.part_s
    arrivals = folder / "arrivals.npy"
    subscribers = subprocess.Popen(
        [sys.executable, "-m", "validation.service.subscribers.world_subscribers", str(arrivals),
         str(options.subscribers), options.kind, *(one.url for one in services)],
        stdin=subprocess.PIPE, text=True,
    )  # fmt: skip
    time.sleep(3.0)
    feeders = [
        Feeder(one, [body for body in bodies if body.region == number], speed)
        for number, one in enumerate(services)
    ]
    begin_s = CLOCK.monotonic_s() + 0.5
    threads = [threading.Thread(target=one.run, args=(begin_s,)) for one in feeders]
    used_s = [processor_s(one.pid) for one in services]
    for thread in threads:
        thread.start()
    memory = []
    while any(thread.is_alive() for thread in threads):
        memory.append((CLOCK.monotonic_s(), sum(one.resident() for one in services)))
        time.sleep(_SAMPLE_S)
    fed_s = CLOCK.monotonic_s() - begin_s
    used_s = [processor_s(one.pid) - was for one, was in zip(services, used_s, strict=True)]
    time.sleep(2.0)
    subscribers.communicate("end\n", timeout=_TIMEOUT_S)
    status = [one.status() for one in services]
    accepted = sum(one.fed.accepted for one in feeders)
    return {
        "seconds": fed_s,
        "rate": accepted / fed_s,
        "accepted": accepted,
        "rejected": sum(one.fed.rejected for one in feeders),
        "retries": sum(one.fed.retries for one in feeders),
        "faults": [fault for one in feeders for fault in one.fed.faults][:3],
        "behind_s": max(one.fed.behind_s for one in feeders),
        "unprocessed": sum(one["journal_sequence"] - one["processed_sequence"] for one in status),
        "tracks": sum(one["tracks"] for one in status if isinstance(one["tracks"], int)),
        "processor": sum(used_s) / fed_s,
        "load": os.getloadavg()[0],
        **_memory(np.array(memory), begin_s + options.warm),
        **_latency(np.load(arrivals), begin_s, options.warm, speed, part_s),
    }


def _memory(samples: NDArray[np.float64], from_s: float) -> dict[str, float]:
    late = samples[samples[:, 0] >= from_s]
    slope = float(np.polyfit(late[:, 0], late[:, 1], 1)[0]) if len(late) > 2 else np.nan
    return {"memory_mib": float(samples[-1, 1]) / _MIB, "memory_mib_per_min": slope * 60.0 / _MIB}


def _latency(
    rows: NDArray[np.void], begin_s: float, warm_s: float, speed: float, part_s: float
) -> dict[str, float]:
    counted = rows[rows["at_s"] >= begin_s + warm_s]
    if not len(counted):
        names = ("p50_ms", "p99_ms", "p50_released_ms", "p99_released_ms")
        return dict.fromkeys(names, np.nan) | {"octets_per_s": 0.0, "events_lost": 0}
    oldest_s = counted["oldest_s"] - START_S
    windows_s = (np.floor(oldest_s / RELEASE_STEP_S) + 1.0) * RELEASE_STEP_S
    late_s = []
    for from_s in (oldest_s, windows_s):
        # The message with this data time; a time that is the end of one is not in the next.
        due_s = np.ceil((from_s + HORIZON_S) / part_s - _TINY) * part_s / speed
        late_s.append(np.quantile(counted["at_s"] - begin_s - due_s, (0.5, 0.99)).tolist())
    span_s = float(np.ptp(counted["at_s"])) or 1.0
    return {
        "p50_ms": 1e3 * late_s[0][0],
        "p99_ms": 1e3 * late_s[0][1],
        "p50_released_ms": 1e3 * late_s[1][0],
        "p99_released_ms": 1e3 * late_s[1][1],
        "octets_per_s": float(counted["octets"].sum()) / span_s,
        "events_lost": int(counted["lost"].sum()),
    }


def _keep(folder: Path, services: list[Service]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for one in services:
        name = one.folder.name
        (folder / f"{name}.log").write_bytes((one.folder / "log.txt").read_bytes())
        (folder / f"{name}-status.json").write_bytes(one.get("/v1/status")[1])
        (folder / f"{name}-metrics.txt").write_bytes(one.get("/metrics")[1])


def _print(options: argparse.Namespace, figures: dict[str, Any]) -> None:
    print(f"{options.aircraft:,} aircraft, {options.radars} radars, "
          f"{options.subscribers} subscribers ({options.kind})")  # fmt: skip
    for name, form in (
        ("rate", "{:,.0f} measurements/s"), ("speed", "{:.2f} times real time"),
        ("seconds", "{:.0f} s"), ("behind_s", "{:.2f} s behind at most"),
        ("p50_ms", "{:.0f} ms latency beyond the reorder horizon, median"),
        ("p99_ms", "{:.0f} ms, 99th percentile"),
        ("p50_released_ms", "{:.0f} ms latency beyond the release of the window, median"),
        ("p99_released_ms", "{:.0f} ms, 99th percentile"),
        ("octets_per_s", "{:,.0f} octets/s received"),
        ("events_lost", "{:,} events lost by subscribers"), ("memory_mib", "{:,.0f} MiB resident"),
        ("memory_mib_per_min", "{:+.1f} MiB/min"), ("processor", "{:.2f} cores used by services"),
        ("tracks", "{:,} tracks at the end"), ("accepted", "{:,} accepted"),
        ("rejected", "{:,} rejected"), ("retries", "{:,} requests repeated"),
        ("unprocessed", "{:,} messages not processed at the end"), ("load", "{:.1f} load average"),
    ):  # fmt: skip
        print("  " + form.format(figures[name]))
    for fault in figures["faults"]:
        print("  fault: " + fault)


if __name__ == "__main__":
    raise SystemExit(main())
