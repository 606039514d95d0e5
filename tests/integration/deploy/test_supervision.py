"""The service reports to systemd, and ends after an I/O error, so that it is started again."""

import json
import os
import resource
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from multiradar.observability.supervisor import Supervisor
from support.processes import clients
from support.processes.commands import Command, run_command
from support.processes.served import SENSORS
from support.processes.waiting import join, wait_until

_PLOT = {"sensor_id": "41-10", "kind": "radar", "range_m": 5e4, "azimuth_deg": 1.0}
_END = b"end of the test"


@contextmanager
def _supervisor(path: Path) -> Iterator[list[str]]:
    """Yield what is reported to a socket, read as systemd reads it."""
    heard: list[str] = []
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(path))

        def read() -> None:
            while (said := listener.recv(1000)) != _END:
                heard.append(said.decode())

        thread = threading.Thread(target=read)
        thread.start()
        yield heard
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as last:
            last.sendto(_END, str(path))
        join(thread)


def _post(url: str, time_s: float, rows: int) -> int:
    plots = [_PLOT | {"time_s": time_s + 0.001 * row} for row in range(rows)]
    with clients.client(url) as client:
        return client.post("/v1/measurements", json=plots).status_code


@pytest.mark.fault(21, 28)
def test_a_process_that_cannot_write_ends_and_the_next_one_continues(tmp_path: Path) -> None:
    sensors, state, notify = tmp_path / "sensors.toml", tmp_path / "state", tmp_path / "notify"
    sensors.write_text(SENSORS)
    options = ("--sensors", sensors, "--state", state, "--port", 0, "--no-zenoh", "--json")
    environment = os.environ | {"NOTIFY_SOCKET": str(notify), "WATCHDOG_USEC": "200000"}
    with _supervisor(notify) as heard:
        process = Command("serve", *options, env=environment)
        url = json.loads(process.stdout.readline())["http"]
        wait_until(lambda: "WATCHDOG=1" in heard, "the watchdog")
        ready = heard.index("READY=1")
        assert set(heard[:ready]) == {"EXTEND_TIMEOUT_USEC=600000"}
        assert _post(url, 1000.0, 10) == 200
        # The write-ahead log may not grow any more.
        limit = (state / "journal.sqlite-wal").stat().st_size
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (limit, limit))
        assert _post(url, 1001.0, 500) == 503
        assert process.wait() == 1
    assert set(heard[ready + 1 : -1]) == {"WATCHDOG=1"}
    assert heard[-1] == "STOPPING=1"
    process.stdout.close()
    again = Command("serve", *options)
    url = json.loads(again.stdout.readline())["http"]
    assert clients.get(f"{url}/v1/status").json()["accepted"] in (10, 510)
    assert _post(url, 1002.0, 10) == 200
    again.signal(15)
    assert again.wait() == 0
    again.stdout.close()


def test_a_process_whose_journal_is_removed_ends(tmp_path: Path) -> None:
    sensors, state = tmp_path / "sensors.toml", tmp_path / "state"
    sensors.write_text(SENSORS)
    options = ("--sensors", sensors, "--state", state, "--port", 0, "--no-zenoh", "--json")
    process = Command("serve", *options)
    url = json.loads(process.stdout.readline())["http"]
    assert _post(url, 1000.0, 10) == 200
    (state / "journal.sqlite").unlink()
    assert _post(url, 1001.0, 10) == 503
    assert process.wait() == 1
    process.stdout.close()
    again = run_command("serve", *options)
    assert again.returncode == 1
    assert (
        "journal.sqlite: missing or empty, although other files of this journal exist"
        in again.stderr
    )


@pytest.mark.fault(26)
def test_a_process_that_is_stuck_reports_nothing(tmp_path: Path) -> None:
    notify, asked, why = tmp_path / "notify", [0], [""]

    def stalled() -> str:
        asked[0] += 1
        return why[0]

    with _supervisor(notify) as heard:
        environment = {"NOTIFY_SOCKET": str(notify), "WATCHDOG_USEC": "2000"}
        supervisor = Supervisor(environment, stalled)
        supervisor.start()
        supervisor.ready()
        wait_until(lambda: "WATCHDOG=1" in heard, "the watchdog")
        why[0] = "the engine has made no progress for 61 s"
        before = asked[0]
        wait_until(lambda: asked[0] > before + 2, "two more intervals")
        supervisor.stop()
    # At most one was being sent when it got stuck.
    assert heard.count("WATCHDOG=1") <= before + 1
    assert heard[-1] == "STOPPING=1"


def test_without_a_supervisor_nothing_is_reported() -> None:
    supervisor = Supervisor({}, lambda: "")
    supervisor.start()
    supervisor.ready()
    supervisor.stop()
