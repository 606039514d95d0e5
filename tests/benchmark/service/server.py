"""`multiradar serve` in a process of its own on a free loopback port, and a client that waits."""

import http.client
import json
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Lock
from typing import Any
from urllib.parse import urlsplit

from benchmark.scenes.sky import write_sensors

TIMEOUT_S = 60.0
#: Requests that wait for their answers at the same time. The made recordings are dense enough that
#: what overtakes another request is still within the reorder horizon.
IN_FLIGHT = 4
_POLL_S = 0.01
_OK = 200


class UnexpectedAnswerError(Exception):
    """The service did not do what the benchmark counts on, so its time says nothing."""


class Server:
    """A service with an empty journal; use as a context manager.

    Parameters
    ----------
    folder : Path
        Folder to make for sensors and journal.
    zenoh_endpoint : str, optional
        Where Zenoh listens; no Zenoh when absent.
    """

    def __init__(self, folder: Path, zenoh_endpoint: str | None = None) -> None:
        folder.mkdir()
        write_sensors(folder / "sensors.toml")
        options = ["--sensors", str(folder / "sensors.toml"), "--state", str(folder / "state")]
        options += ["--port", "0", "--json", "--log-level", "error"]
        options += ["--zenoh-listen", zenoh_endpoint] if zenoh_endpoint else ["--no-zenoh"]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "multiradar", "serve", *options],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        self._stdout = self._process.stdout
        line = self._stdout.readline()
        if not line:
            raise UnexpectedAnswerError("the service did not start")
        self.address = urlsplit(json.loads(line)["http"]).netloc
        self._connection = self.connect()

    def __enter__(self) -> "Server":
        return self

    def __exit__(self, *_: object) -> None:
        self._connection.close()
        self._process.terminate()
        self._process.wait(TIMEOUT_S)
        self._stdout.close()

    def connect(self) -> http.client.HTTPConnection:
        """Return a connection of its own to the service."""
        return http.client.HTTPConnection(self.address, timeout=TIMEOUT_S)

    def get(self, path: str) -> bytes:
        """Return the body of an answer; the connection is kept."""
        return ask(self._connection, "GET", path)

    def status(self) -> dict[str, Any]:
        """Return the counts of the service."""
        found: dict[str, Any] = json.loads(self.get("/v1/status"))
        return found

    def post(self, bodies: Sequence[bytes], media_type: str, in_flight: int = IN_FLIGHT) -> int:
        """Hand in messages, several at the same time; return how many rows were accepted.

        Every answer is waited for: what it counts is on disk.
        """
        turn = Lock()
        waiting = iter(bodies)

        def work() -> int:
            connection = self.connect()
            accepted = sum(
                _accepted(ask(connection, "POST", "/v1/measurements", body, media_type))
                for body in _shared(waiting, turn)
            )
            connection.close()
            return accepted

        with ThreadPoolExecutor(in_flight) as threads:
            tasks = [threads.submit(work) for _ in range(in_flight)]
            return sum(task.result() for task in tasks)

    def flush(self) -> None:
        """End the stream."""
        ask(self._connection, "POST", "/v1/flush")

    def wait_processed(self) -> None:
        """Return when everything that is on disk has gone through the tracker."""
        while (status := self.status())["processed_sequence"] < status["journal_sequence"]:
            time.sleep(_POLL_S)


def ask(
    connection: http.client.HTTPConnection,
    method: str,
    path: str,
    body: bytes | None = None,
    media_type: str | None = None,
) -> bytes:
    """Make one request and return the body of its answer, which must be a 200."""
    headers = {} if media_type is None else {"Content-Type": media_type}
    connection.request(method, path, body, headers)
    answer = connection.getresponse()
    content = answer.read()
    if answer.status != _OK:
        raise UnexpectedAnswerError(f"{method} {path}: {answer.status} {content[:200]!r}")
    return content


def _accepted(answer: bytes) -> int:
    document = json.loads(answer)
    if document["rejected"]:
        raise UnexpectedAnswerError(f"rejected: {document['rejected'][0]}")
    return int(document["accepted"])


def _shared(waiting: Iterator[bytes], turn: Lock) -> Iterator[bytes]:
    while True:
        with turn:
            body = next(waiting, None)
        if body is None:
            return
        yield body
