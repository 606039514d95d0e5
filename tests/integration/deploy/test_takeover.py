"""A pair of services loses nothing when its primary is killed or drained, nor do subscribers."""

import json
import signal
import sqlite3
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import IO

from support.processes import clients
from support.processes.commands import Command, run_command
from support.processes.served import SENSORS
from validation.service import check_takeover


def _start(arguments: Sequence[str]) -> tuple[Command, IO[str]]:
    command = Command(*arguments)
    return command, command.stdout


def test_kills_and_drains_of_the_primary_change_nothing(tmp_path: Path) -> None:
    ends = [False, True, False]
    found = check_takeover.run(tmp_path, ends, aircraft=30, start=_start)
    assert found.problems == []
    assert found.statuses == [-signal.SIGKILL, 0, -signal.SIGKILL]
    assert len(found.takeovers_s) == 3


def test_a_drained_service_ends_its_streams_and_exits(tmp_path: Path) -> None:
    sensors = tmp_path / "sensors.toml"
    sensors.write_text(SENSORS)
    options = ("--sensors", sensors, "--state", tmp_path / "state", "--port", 0, "--no-zenoh")
    process = Command("serve", *options, "--json", "--log-level", "error")
    url = json.loads(process.stdout.readline())["http"]
    opened, ended = threading.Event(), threading.Event()
    lines: list[str] = []

    def read() -> None:
        with clients.event_source(f"{url}/v1/events?after=0") as answer:
            for line in answer.iter_lines():
                lines.append(line)
                opened.set()
        ended.set()

    threading.Thread(target=read, daemon=True).start()
    assert opened.wait(check_takeover._TIMEOUT_S)
    plot = {"time_s": 1e3, "sensor_id": "41-10", "kind": "radar", "range_m": 5e4, "azimuth_deg": 1}
    with clients.client(url) as client:
        assert client.post("/v1/measurements", json=[plot]).status_code == 200
        assert client.post("/v1/drain", content=b"x").status_code == 400
        assert client.post("/v1/drain").json() == {"draining": True}
    # The response is complete: it was not cut off.
    assert ended.wait(check_takeover._TIMEOUT_S)
    assert process.wait() == 0
    process.stdout.close()
    again = run_command("verify", tmp_path / "state", "--json")
    assert json.loads(again.stdout)["accepted"] == 1


def test_a_service_whose_journal_another_has_opened_for_writing_ends(tmp_path: Path) -> None:
    """As if the file system had lost the lock: the number of the opening decides."""
    sensors = tmp_path / "sensors.toml"
    sensors.write_text(SENSORS)
    options = ("--sensors", sensors, "--state", tmp_path / "state", "--port", 0, "--no-zenoh")
    process = Command("serve", *options, "--json", "--log-level", "error")
    url = json.loads(process.stdout.readline())["http"]
    other = sqlite3.connect(tmp_path / "state" / "journal.sqlite")
    other.execute("PRAGMA user_version = 7")
    other.close()
    plot = {"time_s": 1e3, "sensor_id": "41-10", "kind": "radar", "range_m": 5e4, "azimuth_deg": 1}
    with clients.client(url) as client:
        answer = client.post("/v1/measurements", json=[plot])
    assert (answer.status_code, answer.json()["code"]) == (503, "JOURNAL_FAILED")
    assert process.wait() == 1
    process.stdout.close()
