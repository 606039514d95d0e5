"""`serve` and `replay` as real processes give the bytes of `track`, whatever happens between."""

import json
import os
from functools import partial
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from support.processes.commands import Command
from support.processes.served import SENSORS, Served, free_port, run
from support.processes.waiting import pause, wait_until
from support.scenarios.live_scene import START_S, recording

#: `TEST_KILLS=50` for the long run.
KILLS = max(int(os.environ.get("TEST_KILLS", "3")), 1)
ROWS_A_KILL = 500
ROWS = 300


def _scene(folder: Path, rows: int) -> tuple[Path, Path, str]:
    # Sensors, measurements, and the hash of their output by `track`.
    sensors, measurements = folder / "sensors.toml", folder / "measurements.parquet"
    sensors.write_text(SENSORS)
    recording(rows, aircraft=30, step_s=0.02).write_parquet(measurements)
    run("track", measurements, "--sensors", sensors, "--out", folder / "tracks")
    report = json.loads((folder / "tracks" / "report.json").read_text())
    assert report["counts"]["accepted"] == rows
    return sensors, measurements, report["output_sha256"]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, str]:
    return _scene(tmp_path_factory.mktemp("scene"), ROWS)


@pytest.mark.parametrize(("batch", "workers"), [(1, 4), (7, 1), (1000, 2), (65536, 4)])
def test_the_output_is_that_of_track(
    tmp_path: Path, scene: tuple[Path, Path, str], batch: int, workers: int
) -> None:
    sensors, measurements, expected = scene
    served = Served(sensors, tmp_path / "state", workers=workers)
    answer = run("replay", measurements, "--to", served.url, "--speed", "max", "--batch", batch)
    status = served.status()
    assert served.stop() == 0
    assert answer["accepted"] == ROWS
    assert status["accepted"] == ROWS
    assert status["output_sha256"] == expected
    figures = json.loads((measurements.parent / "tracks" / "report.json").read_text())["figures"]
    assert status["tracks_initiated"] == figures["tracks"] > 0
    assert status["tracks_confirmed"] == figures["tracks_confirmed"] > 0


def test_times_before_zero_are_served_as_any(tmp_path: Path) -> None:
    sensors, measurements = tmp_path / "sensors.toml", tmp_path / "measurements.parquet"
    sensors.write_text(SENSORS)
    rows = recording(ROWS_A_KILL, aircraft=5, step_s=0.2)
    rows.with_columns(pl.col("time_s") - START_S - 300.0).write_parquet(measurements)
    served = Served(sensors, tmp_path / "state")
    run("replay", measurements, "--to", served.url, "--speed", "max")
    status = served.status()
    assert served.stop() == 0
    assert status["accepted"] == ROWS_A_KILL
    assert status["tracks_confirmed"] > 0


def _goes_on(served: Served, accepted: int, replay: Command) -> bool:
    return replay.poll() is not None or served.status()["accepted"] >= accepted


def test_kills_of_the_service_in_a_replay_do_not_change_the_output(tmp_path: Path) -> None:
    rows = (KILLS + 1) * ROWS_A_KILL
    sensors, measurements, expected = _scene(tmp_path, rows)
    random, port = np.random.default_rng(KILLS), free_port()
    replay = Command(
        "replay", measurements, "--to", f"http://127.0.0.1:{port}", "--speed", "max",
        "--batch", 5, "--json",
    )  # fmt: skip
    killed = 0
    while killed < KILLS and replay.poll() is None:
        served = Served(sensors, tmp_path / "state", port, workers=1 + killed % 2)
        before = served.status()["accepted"]
        # Not before the replay has reconnected and been accepted.
        wait_until(partial(_goes_on, served, before + 50, replay), "50 more measurements")
        pause(float(random.uniform(0.0, 0.2)))
        served.kill()
        killed += 1
    assert killed == KILLS
    assert replay.poll() is None, "the replay ended before the kills did"
    served = Served(sensors, tmp_path / "state", port)
    out = replay.read_to_end()
    assert replay.wait() == 0
    status = served.status()
    assert served.stop() == 0
    answer = json.loads(out)
    # Messages accepted but not answered before a kill are answered again.
    assert answer["accepted"] + answer["duplicate"] == rows
    assert status["accepted"] == rows
    assert status["output_sha256"] == expected
