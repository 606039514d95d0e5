"""A service in a process of its own, fed through pipes, so that a test can kill it.

Each message on standard input is a line of JSON (`key`, `bytes`) and so many bytes of Arrow IPC;
the key `end` ends the stream. Each answer on standard output is a line of JSON.
"""

import json
import math
import os
import threading
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO, TextIO

from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.engine.fingerprint import configuration_fingerprint
from multiradar.runtime.live.payload import decode_rows
from multiradar.runtime.live.receipt import Receipt
from multiradar.runtime.live.service import Service
from multiradar.runtime.live.snapshots import SnapshotRules
from multiradar.storage.snapshots import SnapshotFolder
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.settings import TrackingSettings
from support.processes.commands import ended, fork
from support.scenarios.live_scene import sensors


def live_service(journal: Path, workers: int = 1, snapshot_rows: int = 0) -> Service:
    """Return a service with the real engine and a journal on disk; 0 for no snapshots."""
    table, tracking = sensors(), TrackingSettings()
    fingerprint = configuration_fingerprint(table, tracking)
    rules = SnapshotRules(SnapshotFolder(journal), math.inf, snapshot_rows, fingerprint)
    return Service(
        open_journal=lambda: SqliteJournal(journal, fingerprint),
        open_engine=lambda: Engine(table, tracking, workers, sampling=Sampling.DRAWN),
        sensors=table,
        tracking=tracking,
        snapshots=rules if snapshot_rows else None,
    )


class LiveProcess:
    """The service as its parent sees it."""

    def __init__(self, journal: Path, workers: int = 1, snapshot_rows: int = 0) -> None:
        reading, to = os.pipe()
        said, writing = os.pipe()
        self._process = fork(
            main, journal, workers, snapshot_rows, streams={0: reading, 1: writing, 2: 2}
        )
        os.close(reading)
        os.close(writing)
        self._stdin, self._stdout = open(to, "wb"), open(said, "rb")  # noqa: SIM115

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
        # Something may be left in the buffer for a process that is dead, as intended.
        with suppress(BrokenPipeError):
            self._stdin.close()
        status = ended(self._process)
        self._stdout.close()
        return status


def main(journal: Path, workers: int, snapshot_rows: int) -> None:
    """Serve until the end of the stream."""
    with open(0, "rb", closefd=False) as heard, open(1, "w", closefd=False) as said:
        _serve(live_service(journal, workers, snapshot_rows), heard, said)


def _serve(service: Service, heard: BinaryIO, said: TextIO) -> None:
    answering = threading.Lock()

    def answer(**fields: object) -> None:
        with answering:
            said.write(json.dumps(fields) + "\n")
            said.flush()

    def acknowledge(key: str, future: Future[Receipt]) -> None:
        receipt = future.result()
        answer(key=key, accepted=receipt.accepted, duplicate=receipt.duplicate)

    service.start()
    answer(ready=True)
    for key, payload in _messages(heard):
        future = service.submit(decode_rows(payload), source="pipe", idempotency_key=key)
        future.add_done_callback(lambda done, key=key: acknowledge(key, done))  # type: ignore[misc]
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
