"""A service in a process of its own, fed through pipes, so that a test can kill it.

Each message on standard input is a line of JSON (`key`, `bytes`) and so many bytes of Arrow IPC;
the key `end` ends the stream. Each answer on standard output is a line of JSON.
"""

import json
import subprocess
import sys
import threading
from concurrent.futures import Future
from pathlib import Path
from typing import Any, BinaryIO

from multiradar.runtime.engine import Engine
from multiradar.runtime.fingerprint import configuration_fingerprint
from multiradar.runtime.payload import decode_rows
from multiradar.runtime.receipt import Receipt
from multiradar.runtime.service import Service
from multiradar.storage.sqlite_journal import SqliteJournal
from multiradar.tracking.settings import TrackingSettings
from multiradar.tracking.state_samples import Sampling
from support.live_scene import sensors
from support.waiting import WAIT_TIMEOUT_S

TESTS = Path(__file__).parents[1]


def live_service(journal: Path, workers: int = 1) -> Service:
    """Return a service with the real engine and a journal on disk."""
    table, tracking = sensors(), TrackingSettings()
    fingerprint = configuration_fingerprint(table, tracking)
    return Service(
        open_journal=lambda: SqliteJournal(journal, fingerprint),
        open_engine=lambda: Engine(table, tracking, workers, sampling=Sampling.DRAWN),
        sensors=table,
        tracking=tracking,
    )


class LiveProcess:
    """The service as its parent sees it."""

    def __init__(self, journal: Path, workers: int = 1) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "support.live_process", str(journal), str(workers)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=TESTS,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._stdin, self._stdout = self._process.stdin, self._process.stdout

    def send(self, key: str, payload: bytes) -> None:
        """Send a message; raises BrokenPipeError when the process is dead."""
        self._stdin.write(json.dumps({"key": key, "bytes": len(payload)}).encode() + b"\n")
        self._stdin.write(payload)
        self._stdin.flush()

    def answers(self) -> list[dict[str, Any]]:
        """Return the next answer, or nothing at the end of the process."""
        line = self._stdout.readline()
        # A line that the kill cut off was never read by anybody as an answer.
        return [json.loads(line)] if line.endswith(b"\n") else []

    def kill(self) -> None:
        """Kill it as the kernel does, without a farewell."""
        self._process.kill()

    def wait(self) -> int:
        """Wait for its end, and close the pipes."""
        try:
            self._stdin.close()
        except BrokenPipeError:
            # Something was left in the buffer for a process that is dead, as intended.
            self._stdin = self._stdout
        status = self._process.wait(WAIT_TIMEOUT_S)
        self._stdout.close()
        return status


def main(journal: Path, workers: int) -> None:
    """Serve until the end of the stream."""
    answering = threading.Lock()

    def answer(**fields: object) -> None:
        with answering:
            sys.stdout.write(json.dumps(fields) + "\n")
            sys.stdout.flush()

    def taken(key: str, future: Future[Receipt]) -> None:
        receipt = future.result()
        answer(key=key, accepted=receipt.accepted, duplicate=receipt.duplicate)

    service = live_service(journal, workers)
    service.start()
    answer(ready=True)
    for key, payload in _messages(sys.stdin.buffer):
        future = service.submit(decode_rows(payload), source="pipe", idempotency_key=key)
        future.add_done_callback(lambda done, key=key: taken(key, done))  # type: ignore[misc]
    service.flush(source="pipe", idempotency_key="end").result()
    service.settled().result()
    status = service.view.status()
    service.stop()
    answer(ended=True, sha256=status["output_sha256"], accepted=status["accepted"])


def _messages(stream: BinaryIO) -> Any:
    while line := stream.readline():
        message = json.loads(line)
        if message["key"] == "end":
            return
        yield message["key"], stream.read(message["bytes"])


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
