"""`serve` and `replay` as real processes: addresses, encodings, ends, and what goes wrong."""

import json
import signal
import socket
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from support.processes.commands import Command, run_forked
from support.processes.served import free_port
from support.processes.stopped_command import serve_deaf
from support.processes.waiting import wait_until
from support.scenarios.recorded_scene import command, environment, serving, write_scene

ROWS = 1500


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return write_scene(tmp_path_factory.mktemp("scene"), ROWS)


@pytest.fixture(scope="module")
def expected(scene: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> str:
    out = tmp_path_factory.mktemp("track") / "out"
    done = command("track", scene[0], "--sensors", scene[1], "--out", out, "--json")
    assert done.returncode == 0, done.stderr
    sha256: str = json.loads(done.stdout)["output_sha256"]
    return sha256


def _replay(*options: object) -> dict[str, Any]:
    done = command("replay", *options, "--speed", "max", "--json")
    assert done.returncode == 0, done.stderr
    counts: dict[str, Any] = json.loads(done.stdout)
    return counts


def _options(sensors: Path, state: Path) -> list[object]:
    return ["--sensors", sensors, "--state", state, "--port", 0, "--log-level", "warning"]


def test_zenoh_and_every_encoding_of_http_give_the_output_of_track(
    scene: tuple[Path, Path], expected: str, tmp_path: Path
) -> None:
    measurements, sensors = scene
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    for encoding in ("arrow", "json", "ndjson"):
        state = tmp_path / encoding
        with serving(*_options(sensors, state), "--zenoh-listen", endpoint) as served:
            assert served.zenoh == [endpoint]
            to = f"zenoh:{endpoint}" if encoding == "arrow" else served.http
            counts = _replay(measurements, "--to", to, "--encoding", encoding, "--batch", 400)
            assert (counts["read"], counts["accepted"]) == (ROWS, ROWS)
            assert served.status()["output_sha256"] == expected


def test_the_same_recording_is_ingested_once_and_a_restart_changes_nothing(
    scene: tuple[Path, Path], expected: str, tmp_path: Path
) -> None:
    measurements, sensors = scene
    options = [*_options(sensors, tmp_path / "state"), "--no-zenoh"]
    with serving(*options) as served:
        _replay(measurements, "--to", served.http)
        again = _replay(measurements, "--to", served.http)
        assert (again["accepted"], again["duplicate"]) == (0, ROWS)
        # Other messages have other keys, and their times are past.
        other = command(
            "replay", measurements, "--to", served.http, "--speed", "max", "--batch", 333
        )
        assert "rejected as TIME_LATE: " in other.stderr
        assert "the service already has these measurements" in other.stderr
        served.process.signal(signal.SIGINT)
        assert served.process.wait() == 0
    with serving(*options) as served:
        assert served.status()["output_sha256"] == expected
        served.process.signal(signal.SIGTERM)
        assert served.process.wait() == 0


def test_data_time_passes_at_the_speed_asked_for(scene: tuple[Path, Path], tmp_path: Path) -> None:
    measurements, sensors = scene
    with serving(*_options(sensors, tmp_path / "state"), "--no-zenoh") as served:
        done = command("replay", measurements, "--to", served.http, "--speed", 100, "--no-flush")
        assert done.returncode == 0, done.stderr
        # 75 s of data time at 100 a second, a message for each 25 s at most.
        assert f"{ROWS} measurements in 3 messages" in done.stdout
        assert served.status()["journal_sequence"] == 3


def test_replay_gives_up_without_a_service_and_says_what_to_do(
    scene: tuple[Path, Path],
) -> None:
    to = f"http://127.0.0.1:{free_port()}"
    done = command("replay", scene[0], "--to", to, "--wait", 0.2)
    assert done.returncode == 1
    assert done.stderr.splitlines() == [
        f"multiradar: {to}: no response (Connection refused); retrying for 0.2 s",
        f"multiradar: {to}: no response (Connection refused); gave up after 0.2 s; start the "
        "service with `multiradar serve`, or specify its address with --to",
    ]


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_service_stopped_during_start_up_exits_at_once(
    name: str, scene: tuple[Path, Path], tmp_path: Path
) -> None:
    options = ["--sensors", str(scene[1]), "--state", str(tmp_path / "state"), "--no-zenoh"]
    done = run_forked(serve_deaf, name, [*options, "--port", "0"])
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_port_in_use_is_one_sentence(scene: tuple[Path, Path], tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        options = ["--sensors", scene[1], "--state", tmp_path / "state", "--no-zenoh"]
        done = command("serve", *options, "--port", port)
    assert done.returncode == 1
    assert f"127.0.0.1:{port}: cannot listen" in done.stderr
    assert "or choose another port with --port" in done.stderr
    assert "stopped" not in done.stderr
    assert "Traceback" not in done.stderr
    assert not done.stdout


def test_a_journal_of_other_sensors_is_rejected_with_a_message(
    scene: tuple[Path, Path], tmp_path: Path
) -> None:
    measurements, sensors = scene
    with serving(*_options(sensors, tmp_path / "state"), "--no-zenoh") as served:
        _replay(measurements, "--to", served.http)
    moved = tmp_path / "moved.toml"
    moved.write_text(sensors.read_text().replace("50.0", "50.1"))
    # All that is logged: a service that never started does not say that it stopped.
    options = [*_options(moved, tmp_path / "state")[:-2], "--no-zenoh", "--log-level", "info"]
    done = command("serve", *options)
    assert done.returncode == 1
    assert done.stderr.startswith("multiradar: ")
    assert done.stderr.count("\n") == 1
    assert not done.stdout


def test_an_unknown_address_is_a_usage_error(scene: tuple[Path, Path]) -> None:
    done = command("replay", scene[0], "--to", "ftp://127.0.0.1")
    assert done.returncode == 2
    assert "expected http://ADDRESS, zenoh:ENDPOINT or udp:ADDRESS:PORT" in done.stderr


def test_replay_sorts_a_recording_and_reports_unknown_sensors(
    scene: tuple[Path, Path], expected: str, tmp_path: Path
) -> None:
    frame = pl.read_parquet(scene[0])
    backwards, unknown = tmp_path / "backwards.parquet", tmp_path / "unknown.parquet"
    # Stable in time: rows of the same time stay in their order, and so does the output.
    frame.sort("time_s", descending=True, maintain_order=True).write_parquet(backwards)
    frame.with_columns(sensor_id=pl.lit("77-7")).write_parquet(unknown)
    with serving(*_options(scene[1], tmp_path / "state"), "--no-zenoh") as served:
        rejected = command("replay", unknown, "--to", served.http, "--speed", "max", "--no-flush")
        assert rejected.returncode == 1
        assert f"rejected: {ROWS} UNKNOWN_SENSOR" in rejected.stdout
        assert rejected.stderr.startswith(
            "multiradar: the recording contains sensors that are not configured in the service, "
            "which has "
        )
        assert rejected.stderr.endswith(
            f": 77-7 ({ROWS:,}); their measurements were rejected; start the service with the "
            "sensors file of the recording\n".replace(",", " ")
        )
        times = tmp_path / "milliseconds.parquet"
        frame.with_columns(pl.col("time_s") * 1e3 + 1e12).write_parquet(times)
        rejected = command("replay", times, "--to", served.http, "--speed", "max", "--no-flush")
        assert rejected.returncode == 1
        assert "; the first: time_s: expected " in rejected.stderr
        assert "(milliseconds?)" in rejected.stderr
        counts = _replay(backwards, "--to", served.http)
        assert (counts["accepted"], counts["rejected"]) == (ROWS, 0)
        assert served.status()["output_sha256"] == expected


def test_a_kill_in_a_replay_over_zenoh_leaves_no_trace(
    scene: tuple[Path, Path], expected: str, tmp_path: Path
) -> None:
    measurements, sensors = scene
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    options = [*_options(sensors, tmp_path / "state"), "--zenoh-listen", endpoint]
    line = ["replay", measurements, "--to", f"zenoh:{endpoint}"]
    line += ["--speed", "max", "--batch", 5, "--json"]
    with serving(*options) as served:
        replay = Command(*line, env=environment())
        wait_until(
            lambda: replay.poll() is not None or served.status()["accepted"] >= 100,
            "100 accepted measurements",
        )
        assert replay.poll() is None
        served.process.signal(signal.SIGKILL)
    assert replay.poll() is None, "the replay ended before the kill"
    with serving(*options) as served:
        out = replay.read_to_end()
        assert replay.wait() == 0
        counts = json.loads(out)
        assert counts["accepted"] + counts["duplicate"] == ROWS
        assert counts["retries"] > 0
        assert served.status()["output_sha256"] == expected
