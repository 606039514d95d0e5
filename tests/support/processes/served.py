"""`multiradar serve` in a process of its own, over HTTP, so that a test can kill it."""

import json
import signal
import socket
from pathlib import Path
from typing import Any

from support.processes import clients
from support.processes.commands import Command, run_command

SENSORS = """
[[sensor]]
id = "41-10"
kind = "radar"
latitude_deg = 50.0
longitude_deg = 14.0
height_m = 400.0

[[sensor]]
id = "41-20"
kind = "radar"
latitude_deg = 49.2
longitude_deg = 16.5
height_m = 300.0

[[sensor]]
id = "adsb"
kind = "adsb"
"""


def free_port() -> int:
    """Return a port of loopback that was free a moment ago."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


class Served:
    """A running `multiradar serve`.

    Parameters
    ----------
    sensors, state : Path
        Sensors file and folder of the journal.
    port : int
        Port of loopback; a free one in a test that starts the service again.
    workers : int
        Threads of the tracker.
    """

    def __init__(self, sensors: Path, state: Path, port: int = 0, workers: int = 1) -> None:
        options = ["--sensors", str(sensors), "--state", str(state), "--port", str(port)]
        options += ["--workers", str(workers), "--no-zenoh", "--json", "--log-level", "error"]
        self._process = Command("serve", *options)
        line = self._process.stdout.readline()
        self.url: str = json.loads(line)["http"] if line else ""

    def status(self) -> dict[str, Any]:
        """Return `GET /v1/status`."""
        answer = clients.get(f"{self.url}/v1/status")
        found: dict[str, Any] = answer.raise_for_status().json()
        return found

    def kill(self) -> None:
        """Kill it as the kernel does, without a farewell."""
        self._end(signal.SIGKILL)

    def stop(self) -> int:
        """Ask it to stop and return its exit status."""
        return self._end(signal.SIGTERM)

    def _end(self, number: int) -> int:
        self._process.signal(number)
        status = self._process.wait()
        self._process.stdout.close()
        return status


def run(*arguments: object) -> dict[str, Any]:
    """Run a command of `multiradar` and return what it prints with `--json`."""
    done = run_command(*arguments, "--json")
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found
