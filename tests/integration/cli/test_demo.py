"""`multiradar demo` runs to its end, prints its results, and removes its files."""

import json
import os
import re
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import polars as pl
import pytest

from multiradar.toolbox.evaluation.dump_truth import read_truth
from support.paths import SAMPLE
from support.processes.commands import Command, run_command
from support.processes.waiting import wait_until
from support.scenarios.recorded_scene import command, environment

#: Fraction of the lines of each file: about the first five minutes.
SHARE = 0.16


@pytest.fixture
def short_dump(tmp_path: Path) -> Path:
    dump = tmp_path / "dump"
    dump.mkdir()
    for name in ("tracks.txt", "plots.txt", "plots_ads.txt"):
        lines = (SAMPLE / name).read_bytes().splitlines(keepends=True)
        (dump / name).write_bytes(b"".join(lines[: round(SHARE * len(lines))]))
    truth = json.loads((SAMPLE / "truth.json").read_text())
    (dump / "truth.json").write_text(json.dumps({key: truth[key] for key in ("radars", "date")}))
    return dump


@pytest.mark.slow
def test_the_demo_ends_with_biases_near_the_truth_and_leaves_nothing(
    short_dump: Path, tmp_path: Path
) -> None:
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    own = {**environment(), "TMPDIR": str(temporary)}
    done = run_command("demo", "--dump", short_dump, "--speed", "max", "--exit", env=own)
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    assert not list(temporary.iterdir())
    assert "[" not in done.stdout.replace("[0", "")
    row = re.search(r"26-10 +range +\+185\.0 m +(\S+) m +(\S+) m", done.stdout)
    assert row is not None, done.stdout
    # Four sigma, for any realisation of the noise.
    assert abs(float(row[1]) - 185.0) <= 4.0 * float(row[2])
    assert "from ADS-B, which was withheld from the tracker" in done.stdout
    output = re.search(r"output_sha256 (\w+)", done.stdout)
    assert output is not None
    tracks = _tracks(short_dump, tmp_path)
    assert output[1] == json.loads((tracks / "report.json").read_text())["output_sha256"]
    # The counts of the demo are those of the files of an offline run.
    rows = pl.read_parquet(tracks / "tracks.parquet")
    confirmed = rows.filter(pl.col("state") != "tentative")["track_id"].n_unique()
    counts = f"{confirmed} confirmed tracks ({rows['track_id'].n_unique()} initiated) from "
    assert counts in done.stdout


def _tracks(dump: Path, folder: Path) -> Path:
    sensors = folder / "sensors.toml"
    sensors.write_text(str(read_truth(dump).sensors_toml), encoding="utf-8")
    done = command(
        "track", dump, "--date", "2018-08-01", "--sensors", sensors, "--kinds", "radar",
        "--out", folder / "tracks",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder / "tracks"


def _processes_that_name(folder: Path) -> list[int]:
    # Only the service of the demo under test has a path below this folder among its arguments.
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            line = (entry / "cmdline").read_bytes()
        except OSError:
            # It has ended since.
            continue
        if os.fsencode(folder) in line and b"serve" in line.split(b"\0"):
            found.append(int(entry.name))
    return found


@contextmanager
def _demo(dump: Path, temporary: Path) -> Iterator[Command]:
    # Terminates the processes it started, including the service, however the test ends.
    temporary.mkdir()
    own = {**environment(), "TMPDIR": str(temporary)}
    process = Command("demo", "--dump", dump, "--speed", "max", env=own)
    try:
        yield process
    finally:
        process.signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        for service in _processes_that_name(temporary):
            os.kill(service, signal.SIGKILL)


def _read_until(process: Command, wanted: str) -> str:
    seen = ""
    for output in process.stdout:
        seen += output
        if wanted in output:
            break
    return seen


@pytest.mark.slow
def test_ctrl_c_stops_the_service_and_removes_everything(short_dump: Path, tmp_path: Path) -> None:
    temporary = tmp_path / "tmp"
    with _demo(short_dump, temporary) as process:
        assert "stays up" in _read_until(process, "/v1/status")
        assert _processes_that_name(temporary)
        process.signal(signal.SIGINT)
        assert process.wait() == 0
        assert not _processes_that_name(temporary)
    assert not list(temporary.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_demo_interrupted_while_its_service_starts_leaves_no_process(
    short_dump: Path, tmp_path: Path, number: signal.Signals
) -> None:
    temporary = tmp_path / "tmp"
    with _demo(short_dump, temporary) as process:
        # As soon as the service process exists, long before it prints its addresses.
        wait_until(
            lambda: process.poll() is not None or _processes_that_name(temporary),
            "the service of the demo",
        )
        assert process.poll() is None
        process.signal(number)
        assert process.wait() == 0
        assert not _processes_that_name(temporary)
    assert not list(temporary.iterdir())


def test_a_dump_without_truth_or_sensors_is_one_sentence(short_dump: Path) -> None:
    (short_dump / "truth.json").unlink()
    done = command("demo", "--dump", short_dump, "--exit")
    assert done.returncode == 1
    assert f"no truth.json in {short_dump}; specify a sensors file with --sensors" in done.stderr
    assert done.stderr.count("\n") == 1
