"""The service of the demo: a real child process on free loopback ports."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from multiradar.errors import PeerError

STOP_TIMEOUT_S = 30.0
_POLL_PERIOD_S = 0.5


@dataclass(frozen=True, slots=True)
class ServiceProcess:
    """A running service.

    Attributes
    ----------
    process : Popen
        The child process.
    http : str
        HTTP address.
    zenoh : list of str
        Zenoh endpoints.
    log : Path
        Its log file.
    """

    process: "subprocess.Popen[str]"
    http: str
    zenoh: list[str]
    log: Path

    def stop(self) -> None:
        """Stop it gracefully; kill it on time-out or on an interrupt."""
        try:
            self.process.terminate()
            self.process.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            _end(self.process)
        except BaseException:
            _end(self.process)
            raise
        if self.process.stdout is not None:
            self.process.stdout.close()


def start_service(sensors: Path, folder: Path, on_wait: Callable[[str], None]) -> ServiceProcess:
    """Start `multiradar serve` and wait until it prints its addresses or exits.

    Parameters
    ----------
    sensors : Path
        Sensors file.
    folder : Path
        Folder of its journal and log.
    on_wait : callable
        Called twice a second meanwhile with the last line of its log.

    Raises
    ------
    PeerError
        If it exits before then.
    """
    log = folder / "service.log"
    command = [
        sys.executable, "-P", "-m", "multiradar", "serve", "--sensors", str(sensors),
        "--state", str(folder / "state"), "--port", "0",
        "--zenoh-listen", f"tcp/127.0.0.1:{_free_port()}", "--json",
    ]  # fmt: skip
    process: subprocess.Popen[str] | None = None
    try:
        # A signal between fork and return would leave an orphan process.
        with _signals_deferred():
            process = _launch(command, log)
        ready = _first_line(process, lambda: on_wait(_last_line(log)))
    except BaseException:
        if process is not None:
            _end(process)
        raise
    if ready is None:
        # Its output is closed: it is about to exit.
        process.wait()
        status, line = process.returncode, _last_line(log) or "the log is empty"
        msg = f"the service stopped during start-up with status {status}: {line}"
        raise PeerError(msg)
    return ServiceProcess(process, str(ready["http"]), list(ready["zenoh"]), log)


def _launch(command: list[str], log: Path) -> "subprocess.Popen[str]":
    with log.open("w", encoding="utf-8") as stream:
        return subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=stream,
            text=True,
            # Settings in the environment are for another service.
            env={name: value for name, value in os.environ.items() if "MULTIRADAR_" not in name},
            # Ctrl-C goes to the demo, which stops the child itself.
            start_new_session=True,
        )


def _end(process: "subprocess.Popen[str]") -> None:
    process.kill()
    process.wait()


@contextmanager
def _signals_deferred() -> Iterator[None]:
    deferred: list[int] = []
    before = {
        number: signal.signal(number, lambda number, _frame: deferred.append(number))
        for number in (signal.SIGTERM, signal.SIGINT)
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    for late in deferred:
        signal.raise_signal(late)


def _first_line(
    process: "subprocess.Popen[str]", on_wait: Callable[[], None]
) -> dict[str, Any] | None:
    stream, lines = process.stdout, list[str]()
    assert stream is not None
    # Without a time-out while the process lives: a busy machine may need minutes.
    reader = threading.Thread(target=lambda: lines.append(stream.readline()), daemon=True)
    reader.start()
    while reader.is_alive():
        reader.join(_POLL_PERIOD_S)
        on_wait()
    line = lines[0] if lines else ""
    document = json.loads(line) if line.startswith("{") else None
    return document if isinstance(document, dict) else None


def _last_line(log: Path) -> str:
    lines = log.read_text(encoding="utf-8").strip().splitlines()
    return lines[-1] if lines else ""


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])
