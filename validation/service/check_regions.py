"""Four services around one point hand over tracks; one of them is killed and starts again.

::

    python -m validation.service.check_regions
    python -m validation.service.check_regions --aircraft 200 --seconds 300

Each service gets the plots of two of three radars, which cover all regions. A client reads the
tracks of all services every quarter of a second. It prints the longest data time in which an
aircraft had no responsible track, and in which it had several; the status is 1 if either is longer
than a scan.
"""

import argparse
import json
import os
import signal
import sys
import tempfile
import threading
from collections import defaultdict
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import polars as pl

from multiradar.clock import SystemClock
from multiradar.report.content import Table
from multiradar.report.markdown import markdown_table
from validation.service.subscribers.takeover_subscriber import free_endpoint
from validation.service.traffic import PERIOD_S, Sky, sensors_text, started

CLOCK = SystemClock()
#: Centres of the regions, degrees, and the radars of each.
REGIONS = {
    "north-east": (51.1, 11.5, ("R1", "R3")),
    "north-west": (51.1, 8.5, ("R1", "R3")),
    "south-east": (49.1, 11.5, ("R2", "R3")),
    "south-west": (49.1, 8.5, ("R1", "R2")),
}
KILLED = "north-east"
#: Data time of a message, and wall time between two readings, s.
_MESSAGE_S, _LOOK_S = 1.0, 0.25
#: Data before the first look, so that all aircraft have tracks, s.
_WARM_S = 24.0
_PAST_S, _TIMEOUT_S = 7200.0, 60.0
_FIELDS = "track_id,mode_s_address,region,responsible,continues"


class Unit:
    """The service of a region, and the thread that sends its plots."""

    def __init__(self, folder: Path, name: str, endpoints: Mapping[str, str], speed: float) -> None:
        self._folder, self._name = folder / name, name
        self._folder.mkdir()
        self.radars = REGIONS[name][2]
        self._sensors = sensors_text(self.radars)
        self._settings = self._folder / "settings.toml"
        self._settings.write_text(_settings(name, endpoints, speed))
        self.waiting: list[bytes] = []
        self.url = ""
        self._running = threading.Event()
        self._ended = False
        self._client = httpx.Client(timeout=_TIMEOUT_S, trust_env=False)
        self.start()
        self._thread = threading.Thread(target=self._send, daemon=True)
        self._thread.start()

    def start(self) -> None:
        """Start the service, again on its journal."""
        self._process = started(self._folder, self._sensors, "--config", str(self._settings))
        said = self._process.stdout
        assert said is not None, "it is a pipe"
        self.url = json.loads(said.readline())["http"]
        self._running.set()

    def kill(self) -> None:
        """End the service as a crash would."""
        self._running.clear()
        os.kill(self._process.pid, signal.SIGKILL)
        self._process.wait()

    def stop(self) -> None:
        """End the service and the thread."""
        self._ended = True
        self._process.terminate()
        self._process.wait()
        self._running.set()
        self._thread.join()

    def tracks(self) -> list[dict[str, Any]]:
        """Return the live tracks; none while the service does not run."""
        if not self._running.is_set():
            return []
        try:
            answer = self._client.get(f"{self.url}/v1/tracks?limit=1000&fields={_FIELDS}")
        except httpx.TransportError:
            return []
        found: list[dict[str, Any]] = answer.raise_for_status().json()["tracks"]
        return found

    # In order, each until it is acknowledged: the number of the message is its key.
    def _send(self) -> None:
        number = 0
        with httpx.Client(timeout=_TIMEOUT_S, trust_env=False) as client:
            while not self._ended:
                self._running.wait()
                if number >= len(self.waiting):
                    threading.Event().wait(0.02)
                    continue
                try:
                    headers = {"content-type": "application/vnd.apache.arrow.stream",
                               "idempotency-key": f"{number}"}  # fmt: skip
                    body = self.waiting[number]
                    answer = client.post(
                        f"{self.url}/v1/measurements", content=body, headers=headers
                    )
                    number += answer.is_success
                except httpx.TransportError:
                    threading.Event().wait(0.1)


class Readings:
    """How many responsible tracks each aircraft had, by data time."""

    def __init__(self) -> None:
        self.longest_s = {"none": 0.0, "several": 0.0}
        self._since: dict[tuple[str, str], float] = {}
        self._regions: dict[str, set[str]] = defaultdict(set)
        self._names: dict[str, set[str]] = defaultdict(set)

    def note(self, time_s: float, tracks: list[dict[str, Any]]) -> None:
        """Note the tracks of all services at a data time."""
        found: dict[str, list[str]] = defaultdict(list)
        for one in tracks:
            if one["responsible"] and one["mode_s_address"] is not None:
                address, region = one["mode_s_address"], one["region"]
                found[address].append(region)
                self._names[address].add(one["continues"] or f"{region}/{one['track_id']}")
        for address in {*found, *self._regions}:
            count = len(found[address])
            for what, wrong in (("none", count == 0), ("several", count > 1)):
                if not wrong:
                    self._since.pop((what, address), None)
                    continue
                since_s = self._since.setdefault((what, address), time_s)
                self.longest_s[what] = max(self.longest_s[what], time_s - since_s)
            self._regions[address] |= set(found[address])

    @property
    def crossed(self) -> int:
        """Aircraft that several regions were responsible for, one after the other."""
        return sum(len(regions) > 1 for regions in self._regions.values())

    @property
    def renamed(self) -> int:
        """Aircraft with several names."""
        return sum(len(names) > 1 for names in self._names.values())


def run(folder: Path, *, aircraft: int, seconds: float, speed: float) -> Readings:
    """Run the services for some data time, and return what was seen."""
    endpoints = {name: free_endpoint() for name in REGIONS}
    with ThreadPoolExecutor(len(REGIONS)) as pool:
        made = pool.map(lambda name: Unit(folder, name, endpoints, speed), REGIONS)
        units = dict(zip(REGIONS, made, strict=True))
    readings, killed = Readings(), units[KILLED]
    starting = threading.Thread(target=killed.start)
    due = [(0.4 * seconds, killed.kill), (0.5 * seconds, starting.start)]
    try:
        for time_s in _fed(units, Sky(aircraft), seconds, speed):
            if due and time_s >= due[0][0]:
                due.pop(0)[1]()
            if time_s >= _WARM_S:
                readings.note(time_s, _tracks(units))
    finally:
        if starting.ident is not None:
            starting.join()
        for unit in units.values():
            unit.stop()
    return readings


def _fed(units: Mapping[str, Unit], sky: Sky, seconds: float, speed: float) -> Iterator[float]:
    # Feeds the services in time, and yields the data time of each look.
    origin_s, begin_s, sent_s = CLOCK.now_s() // 1.0 - _PAST_S, CLOCK.monotonic_s(), 0.0
    while sent_s < seconds:
        time_s = (CLOCK.monotonic_s() - begin_s) * speed
        while sent_s + _MESSAGE_S <= time_s:
            frame = sky.measured(sent_s, sent_s + _MESSAGE_S, origin_s)
            for unit in units.values():
                unit.waiting.append(_body(frame, unit.radars))
            sent_s += _MESSAGE_S
        yield time_s
        threading.Event().wait(_LOOK_S)


def _tracks(units: Mapping[str, Unit]) -> list[dict[str, Any]]:
    with ThreadPoolExecutor(len(units)) as pool:
        pages = pool.map(Unit.tracks, units.values())
        return [track for page in pages for track in page]


def _body(frame: pl.DataFrame, radars: tuple[str, ...]) -> bytes:
    return frame.filter(pl.col("sensor_id").is_in(list(radars))).write_ipc_stream(None).getvalue()


def _settings(name: str, endpoints: Mapping[str, str], speed: float) -> str:
    latitude_deg, longitude_deg, _ = REGIONS[name]
    lines = [
        "[tracking]", "reorder_horizon_s = 1.0", "[region]",
        f'name = "{name}"', f"latitude_deg = {latitude_deg}", f"longitude_deg = {longitude_deg}",
        f"period_s = {1.0 / speed}", f'listen = ["{endpoints[name]}"]',
    ]  # fmt: skip
    for other, (latitude_deg, longitude_deg, _) in REGIONS.items():
        if other != name:
            lines += [
                "[[region.neighbours]]", f'name = "{other}"', f"latitude_deg = {latitude_deg}",
                f"longitude_deg = {longitude_deg}", f'endpoint = "{endpoints[other]}"',
            ]  # fmt: skip
    return "\n".join([*lines, ""])


def main() -> int:
    """Run and print; the status is 1 if an aircraft was lost or doubled for longer than a scan."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--aircraft", type=int, default=60)
    parser.add_argument("--seconds", type=float, default=80.0, help="data time")
    parser.add_argument("--speed", type=float, default=1.0, help="data time by wall time")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        readings = run(Path(folder), **vars(options))
    none_s, several_s = readings.longest_s.values()
    row = (
        f"{options.aircraft}", f"{readings.crossed}", f"{readings.renamed}", f"{none_s:.1f}",
        f"{several_s:.1f}", f"{os.getloadavg()[0]:.1f}",
    )  # fmt: skip
    columns = (
        "aircraft", "with several regions", "renamed", "longest without a responsible track, s",
        "longest with several, s", "load",
    )  # fmt: skip
    print(markdown_table(Table("Regions", columns, (row,))))
    return int(max(none_s, several_s) > PERIOD_S or not readings.crossed)


if __name__ == "__main__":
    sys.exit(main())
