"""Kills or drains the primary of a pair again and again, while plots arrive and tracks are read.

::

    python -m validation.service.check_takeover --kills 200
    python -m validation.service.check_takeover --kills 0 --drains 20

One client sends messages to whichever service accepts them, each until it is acknowledged; another
reads the events of whichever answers, and a third subscribes to the tracks over Zenoh. At the end
nothing may be lost: all rows once, each event once and in order, each update over Zenoh, and the
output that one undisturbed run gives. The time of a takeover is that
between the end of the primary, or the request to drain it, and the first acknowledgement of the
other service, as the client sees it.
"""

import argparse
import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, Protocol

import httpx
import numpy as np
import polars as pl

from multiradar.clock import SystemClock
from multiradar.report.content import Table
from multiradar.report.markdown import markdown_table
from multiradar_schemas.measurements.columns import complete
from validation.service.subscribers.takeover_subscriber import Subscriber, free_endpoint
from validation.service.traffic import Sky, sensors_text

CLOCK = SystemClock()
#: Data time of a message, and the pause after it, s.
MESSAGE_S, PAUSE_S = 1.0, 0.1
#: Data time between two takeovers, s.
BETWEEN_S = 20.0
#: Takeovers after which the progress is shown.
_SHOWN = 20
#: Half of the messages that are left at most when the primary ends.
AFTER = 5
_PAST_S = 1e6
_ARROW = {"content-type": "application/vnd.apache.arrow.stream"}
_TIMEOUT_S, _RETRY_S = 60.0, 0.005
_LIMIT_S = 1.0


class Process(Protocol):
    """A running command."""

    @property
    def pid(self) -> int:
        """Its number."""
        ...

    def wait(self) -> int:
        """Return its exit status at its end."""
        ...


Start = Callable[[Sequence[str]], tuple[Process, IO[str]]]


def start_command(arguments: Sequence[str]) -> tuple[Process, IO[str]]:
    """Start a command of multiradar; return it, and what it prints."""
    process = subprocess.Popen(
        [sys.executable, "-m", "multiradar", *arguments], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None, "it is a pipe"
    return process, process.stdout


@dataclass(slots=True)
class Found:
    """What a run has found.

    Attributes
    ----------
    takeovers_s : list of float
        Time of each takeover, s.
    statuses : list of int
        Exit status of each primary.
    problems : list of str
        What was lost or differs; empty if nothing.
    duplicates : int
        Measurements that were sent again, and recognised.
    queried : int
        Track updates that the Zenoh subscriber had to query.
    """

    takeovers_s: list[float] = field(default_factory=list)
    statuses: list[int] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    duplicates: int = 0
    queried: int = 0


class Pair:
    """Two services on one state, each started as `serve --standby` on an address of its own."""

    def __init__(self, folder: Path, start: Start) -> None:
        self._folder, self._start = folder, start
        #: The Zenoh endpoint of whichever is the primary.
        self.endpoint = free_endpoint()
        self.urls: list[str] = []
        self._processes: list[Process] = []
        self.primary = 0
        for place in range(2):
            process, url, role = self._started(0)
            self.urls.append(url)
            self._processes.append(process)
            assert role == ("standby" if place else "primary"), role

    def end_primary(self, *, drained: bool) -> int:
        """End the primary and return its exit status."""
        process = self._processes[self.primary]
        if drained:
            httpx.post(f"{self.urls[self.primary]}/v1/drain", timeout=_TIMEOUT_S).raise_for_status()
        else:
            os.kill(process.pid, signal.SIGKILL)
        self.primary = 1 - self.primary
        return process.wait()

    def restore(self) -> None:
        """Start the service that was ended again, as the standby."""
        ended = 1 - self.primary
        port = int(self.urls[ended].rpartition(":")[2])
        self._processes[ended], _, role = self._started(port)
        assert role == "standby", role

    def stop(self) -> None:
        """Stop both, the standby first."""
        for place in (1 - self.primary, self.primary):
            os.kill(self._processes[place].pid, signal.SIGTERM)
            self._processes[place].wait()

    def _started(self, port: int) -> tuple[Process, str, str]:
        process, said = self._start(
            ["serve", "--standby", "--sensors", str(self._folder / "sensors.toml"), "--state",
             str(self._folder / "state"), "--port", str(port), "--zenoh-listen", self.endpoint,
             "--json", "--log-level", "error"]
        )  # fmt: skip
        with said:
            found: dict[str, Any] = json.loads(said.readline())
        return process, found["http"], found.get("role", "primary")


class Sender:
    """Sends messages in order to a pair, each until it is acknowledged."""

    def __init__(self, pair: Pair, messages: Sequence[bytes]) -> None:
        self._pair, self._messages = pair, messages
        self._urls = list(pair.urls)
        self.acknowledged = self.accepted = self.duplicates = 0
        #: Where and when the last message was acknowledged.
        self.last: tuple[str, float] = ("", 0.0)
        #: Messages to send so far, and whether to send them without a pause.
        self.until, self.hurry = 0, threading.Event()
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def _run(self) -> None:
        with httpx.Client(timeout=_TIMEOUT_S, trust_env=False) as client:
            for number, message in enumerate(self._messages):
                while number >= self.until:
                    threading.Event().wait(PAUSE_S)
                answer = self._sent(client, "measurements", f"{number}", message)
                self.accepted += answer["accepted"]
                self.duplicates += answer["accepted"] if answer["duplicate"] else 0
                self.acknowledged += 1
                self.hurry.wait(PAUSE_S)
            self._sent(client, "flush", "end", b"")

    def _sent(self, client: httpx.Client, path: str, key: str, body: bytes) -> dict[str, Any]:
        headers = {"idempotency-key": key} | (_ARROW if body else {})
        while True:
            url = self._urls[0]
            try:
                answer = client.post(f"{url}/v1/{path}", content=body, headers=headers)
            except httpx.TransportError:
                answer = None
            if answer is not None and answer.status_code == httpx.codes.OK:
                self.last = (url, CLOCK.monotonic_s())
                found: dict[str, Any] = answer.json()
                return found
            if answer is not None and answer.status_code != httpx.codes.SERVICE_UNAVAILABLE:
                raise SystemExit(f"{url}: {answer.status_code} {answer.text}")
            self._urls.reverse()
            threading.Event().wait(_RETRY_S)


class Reader:
    """Reads all events of a pair, from whichever service answers, and resumes by their numbers."""

    def __init__(self, pair: Pair) -> None:
        self._urls = list(pair.urls)
        self.last = 0
        self.problems: list[str] = []
        #: The digest of each event by number.
        self.digests: dict[int, bytes] = {}
        self.ended = False

    def start(self) -> None:
        """Read in a thread until `ended` is set."""
        threading.Thread(target=self._run, daemon=True).start()

    def read(self, url: str, until: int | None = None) -> None:
        """Read events until the stream ends, or up to one."""
        headers = {"last-event-id": f"{self.last}"}
        timeout = httpx.Timeout(_TIMEOUT_S)
        with httpx.stream("GET", f"{url}/v1/events", headers=headers, timeout=timeout) as answer:
            number, kind = 0, ""
            for line in answer.iter_lines():
                name, _, value = line.partition(": ")
                if name == "id":
                    number = int(value)
                elif name == "event":
                    kind = value
                elif name == "data":
                    self._note(number, kind, value)
                if self.ended or self.last == until:
                    return

    def _note(self, number: int, kind: str, data: str) -> None:
        if kind == "gap" or number != self.last + 1:
            self.problems.append(f"event {number} ({kind}) after {self.last}: {data[:80]}")
        self.last = number
        if kind != "gap":
            self.digests[number] = hashlib.sha256(f"{kind} {data}".encode()).digest()[:8]

    def _run(self) -> None:
        while not self.ended:
            try:
                self.read(self._urls[0])
            except httpx.TransportError:
                self._urls.reverse()
                threading.Event().wait(_RETRY_S)


def run(
    folder: Path, ends: Sequence[bool], *, aircraft: int = 200, seed: int = 0,
    start: Start = start_command,
) -> Found:  # fmt: skip
    """Send measurements to a pair whose primary ends again and again.

    Parameters
    ----------
    folder : Path
        An empty folder.
    ends : sequence of bool
        How the primary ends each time: drained, else killed.
    aircraft, seed : int
        Number of aircraft, and seed of the moments.
    start : callable
        Starts a command of multiradar.
    """
    draw, found = random.Random(seed), Found()
    text = sensors_text()
    (folder / "sensors.toml").write_text(text, encoding="utf-8")
    frames = _frames(aircraft, BETWEEN_S * (len(ends) + 1))
    messages = [one.write_ipc_stream(None).getvalue() for one in frames]
    pair = Pair(folder, start)
    try:
        sender, reader = Sender(pair, messages), Reader(pair)
        subscriber = Subscriber(pair.endpoint)
        reader.start()
        for number, drained in enumerate(ends):
            subscriber.connect()
            sender.until = (number + 1) * round(BETWEEN_S / MESSAGE_S)
            while sender.acknowledged < sender.until - 2 * draw.randrange(1, AFTER):
                threading.Event().wait(_RETRY_S)
            subscriber.receive()
            threading.Event().wait(draw.uniform(0.0, 2.0 * PAUSE_S))
            before, ended_s = pair.urls[pair.primary], CLOCK.monotonic_s()
            sender.hurry.set()
            found.statuses.append(pair.end_primary(drained=drained))
            while sender.last[0] == before:
                threading.Event().wait(_RETRY_S)
            found.takeovers_s.append(sender.last[1] - ended_s)
            sender.hurry.clear()
            pair.restore()
            _show(found.takeovers_s, len(ends))
        subscriber.connect()
        sender.until = len(messages)
        sender.thread.join()
        subscriber.receive()
        subscriber.stop(_status(pair)["output_sequence"])
        found.queried = subscriber.queried
        found.problems += _differences_of_updates(pair, subscriber)
        found.problems += _differences(pair, sender, reader, frames)
        found.problems += _differences_alone(pair, pl.concat(frames), folder, start)
        found.duplicates = sender.duplicates
    finally:
        pair.stop()
    return found


def _show(takeovers_s: Sequence[float], count: int) -> None:
    if len(takeovers_s) % _SHOWN == 0:
        text = f"{len(takeovers_s)} of {count}: {takeovers_s[-1]:.2f} s"
        print(text, file=sys.stderr, flush=True)


def _frames(aircraft: int, duration_s: float) -> list[pl.DataFrame]:
    sky, origin_s = Sky(aircraft), CLOCK.now_s() // 1.0 - _PAST_S
    begins = np.arange(0.0, duration_s, MESSAGE_S)
    frames = [sky.measured(begin, begin + MESSAGE_S, origin_s) for begin in begins]
    return [one for one in frames if len(one)]


# What of the rows and events was lost.
def _differences(
    pair: Pair, sender: Sender, reader: Reader, frames: Sequence[pl.DataFrame]
) -> list[str]:
    status, rows = _status(pair), sum(map(len, frames))
    while reader.last < status["event_sequence"]:
        threading.Event().wait(PAUSE_S)
    reader.ended = True
    # The last primary still has the latest ones.
    retained = Reader(pair)
    retained.read(pair.urls[pair.primary], status["event_sequence"])
    found = [*reader.problems]
    if not retained.digests or not retained.digests.items() <= reader.digests.items():
        found.append("the events that the reader has are not those of the service")
    if sender.accepted != rows:
        found.append(f"{sender.accepted} rows acknowledged, {rows} sent")
    expected = {"accepted": rows, "rejected": 0, "journal_sequence": len(frames) + 1}
    found += [
        f"{name}: expected {value}, was {status[name]}"
        for name, value in expected.items() if status[name] != value
    ]  # fmt: skip
    return found


# The subscriber has all; those that the last primary still has are the same.
def _differences_of_updates(pair: Pair, subscriber: Subscriber) -> list[str]:
    retained = Subscriber(pair.endpoint).retained(_status(pair)["output_sequence"])
    has = subscriber.updates
    if retained and all(has.get(number) == update for number, update in retained.items()):
        return []
    return ["the updates over Zenoh differ"]


def _differences_alone(pair: Pair, frame: pl.DataFrame, folder: Path, start: Start) -> list[str]:
    complete(frame).write_parquet(folder / "measurements.parquet")
    found, expected = _status(pair)["output_sha256"], _undisturbed(folder, start)["output_sha256"]
    return [] if found == expected else [f"output: expected {expected}, was {found}"]


def _status(pair: Pair) -> dict[str, Any]:
    answer = httpx.get(f"{pair.urls[pair.primary]}/v1/status", timeout=_TIMEOUT_S)
    found: dict[str, Any] = answer.raise_for_status().json()
    return found


def _undisturbed(folder: Path, start: Start) -> dict[str, Any]:
    process, said = start(
        ["track", str(folder / "measurements.parquet"), "--sensors", str(folder / "sensors.toml"),
         "--out", str(folder / "undisturbed"), "--json"]
    )  # fmt: skip
    with said:
        found: dict[str, Any] = json.loads(said.read())
    process.wait()
    return found


def main() -> int:
    """Run and print; the status is 1 if anything was lost, or a takeover took too long."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--drains", type=int, default=0)
    parser.add_argument("--aircraft", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        ends = [False] * options.kills + [True] * options.drains
        random.Random(options.seed).shuffle(ends)
        found = run(Path(folder), ends, aircraft=options.aircraft, seed=options.seed)
    p50, p99, most = np.percentile(found.takeovers_s, [50, 99, 100]).tolist()
    load = os.getloadavg()[0]
    row = (
        f"{options.kills}", f"{options.drains}", f"{p50:.2f}", f"{p99:.2f}", f"{most:.2f}",
        f"{found.duplicates}", f"{found.queried}", f"{load:.1f}",
    )  # fmt: skip
    columns = (
        "kills", "drains", "p50, s", "p99, s", "longest, s", "rows sent again",
        "updates queried over Zenoh", "load",
    )  # fmt: skip
    print(markdown_table(Table("Takeovers", columns, (row,))))
    for one in found.problems:
        print(one)
    print(f"{len(found.problems)} problems")
    return int(bool(found.problems) or p99 > _LIMIT_S)


if __name__ == "__main__":
    sys.exit(main())
