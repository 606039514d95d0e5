"""The small scene as files, and the command `multiradar` as a real process."""

import json
import os
import signal
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from support.processes import clients
from support.processes.commands import Command, run_command
from support.processes.served import SENSORS
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.scenarios import live_scene


def write_scene(folder: Path, rows: int) -> tuple[Path, Path]:
    """Write a recording and its sensors; return their paths."""
    measurements, sensors = folder / "measurements.parquet", folder / "sensors.toml"
    live_scene.recording(rows).write_parquet(measurements)
    sensors.write_text(SENSORS)
    return measurements, sensors


def command(*arguments: object) -> "subprocess.CompletedProcess[str]":
    """Run a command to its end."""
    return run_command(*arguments, env=environment())


def environment() -> dict[str, str]:
    """Return the environment without settings of this project."""
    return {name: value for name, value in os.environ.items() if "MULTIRADAR_" not in name}


@dataclass(frozen=True, slots=True)
class Served:
    """A running `multiradar serve`."""

    process: Command
    http: str
    zenoh: list[str]

    def status(self) -> dict[str, Any]:
        """Return `/v1/status` once everything in the journal is processed."""
        found: dict[str, Any] = {}

        def processed() -> bool:
            found.update(clients.get(f"{self.http}/v1/status").raise_for_status().json())
            return bool(found["processed_sequence"] == found["journal_sequence"])

        wait_until(processed, "the service to process its journal")
        return found


@contextmanager
def serving(*options: object) -> Iterator[Served]:
    """Serve until the end of the block; the process ends gracefully if it is still there."""
    process = Command("serve", "--json", *options, env=environment())
    watchdog = threading.Timer(WAIT_TIMEOUT_S, process.signal, (signal.SIGKILL,))
    watchdog.start()
    try:
        ready: dict[str, Any] = json.loads(process.stdout.readline())
        watchdog.cancel()
        yield Served(process, ready["http"], ready["zenoh"])
    finally:
        watchdog.cancel()
        process.signal(signal.SIGTERM)
        process.wait()
        process.stdout.close()
