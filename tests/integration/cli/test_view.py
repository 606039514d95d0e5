"""`multiradar view` as a user calls it, and its frames against the tables that it reads."""

import json
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from numpy.typing import NDArray

from multiradar.cli.main import EXIT_DONE, EXIT_FAILED, EXIT_USAGE, run
from multiradar.cli.playback.view import run_files
from multiradar.runtime.picture.frames import TYPES
from multiradar.runtime.picture.past import PastAsked
from multiradar.runtime.recorded.run import RecordedRun
from multiradar.runtime.recorded.view import RecordedView
from support.inputs.picture_frames import decoded
from support.processes import clients
from support.processes.commands import Command
from support.scenarios.recorded_scene import environment, write_scene


@pytest.fixture(scope="module")
def tracked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("view")
    measurements, sensors = write_scene(folder, 3000)
    for out in ("tracks", "others"):
        command = ["track", str(measurements), "--sensors", str(sensors)]
        assert run([*command, "--out", str(folder / out)]) == EXIT_DONE
    return folder


def view(*arguments: object) -> int:
    return run(["view", *map(str, arguments), "--no-browser"])


def failure(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """Return the one line that a failing command prints."""
    assert view(*arguments) == EXIT_FAILED
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(captured.err.splitlines()) == 1
    return captured.err


def test_wrong_folders_and_files_are_named(
    tracked: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    run_, converted = tracked / "tracks", tracked / "measurements.parquet"
    assert "no such file or folder" in failure(capsys, tmp_path / "nosuch")
    assert "was the output of `convert`" in failure(capsys, tracked)
    assert "expected the output of `track`" in failure(capsys, run_ / "report.json")
    assert "missing columns track_id, state" in failure(capsys, converted)
    assert "was the output of `track`" in failure(capsys, run_, "--measurements", run_)
    alone = tmp_path / "tracks.parquet"
    shutil.copyfile(run_ / "tracks.parquet", alone)
    said = failure(capsys, alone, "--measurements", converted)
    assert "--measurements requires the sensors" in said
    assert "cannot read the overlay folder" in failure(capsys, run_, "--overlays", tmp_path / "no")
    assert run(["view", str(run_), str(run_), str(run_)]) == EXIT_USAGE
    assert "expected one or two runs, found 3" in capsys.readouterr().err


def test_times_that_do_not_meet_are_named(
    tracked: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    later = tmp_path / "later"
    shutil.copytree(tracked / "tracks", later)
    for path in (later / "tracks.parquet", tmp_path / "measurements.parquet"):
        source = later / path.name if path.parent == later else tracked / path.name
        pl.read_parquet(source).with_columns(pl.col("time_s") + 1e6).write_parquet(path)
    capsys.readouterr()
    said = failure(capsys, tracked / "tracks", later)
    assert "tracks (" in said
    assert "and later (" in said
    assert "do not overlap in time" in said
    given = tmp_path / "measurements.parquet"
    said = failure(capsys, tracked / "tracks", "--measurements", given)
    assert "but tracks covers" in said


@pytest.fixture(scope="module")
def shown(tracked: Path) -> Iterator[tuple[str, Command]]:
    runs = [tracked / "tracks", tracked / "others"]
    measured = ["--measurements", tracked / "measurements.parquet"]
    command = Command("view", *runs, *measured, "--no-browser", env=environment())
    try:
        line = command.stdout.readline()
        assert line.startswith("multiradar shows tracks and others at http://127.0.0.1:")
        yield line.split(" at ")[1].split(";")[0], command
    finally:
        command.signal(signal.SIGTERM)
        command.wait()
        command.stdout.close()


def frame(url: str, **given: object) -> tuple[dict[str, Any], dict[str, dict[str, NDArray[Any]]]]:
    asked = "&".join(f"{name}={value}" for name, value in given.items())
    content = clients.get(f"{url}/v1/picture?{asked}").raise_for_status().content
    length = int.from_bytes(content[4:8], "little")
    header = json.loads(content[8 : 8 + length])
    return header, {
        name: {
            column: np.frombuffer(content, TYPES[kind], table["rows"], 8 + length + offset)
            for column, (kind, offset) in table["columns"].items()
        }
        for name, table in header["tables"].items()
    }


def test_frames_are_the_last_updates_of_the_tables(
    tracked: Path, shown: tuple[str, Command]
) -> None:
    url, _ = shown
    table = pl.read_parquet(tracked / "tracks" / "tracks.parquet")
    ended = pl.read_parquet(tracked / "tracks" / "transitions.parquet").filter(transition="ended")
    first_s, last_s = table["time_s"].min(), table["time_s"].max()
    assert isinstance(first_s, float)
    assert isinstance(last_s, float)
    for at_s in np.linspace(first_s - 1.0, last_s, 7).tolist():
        header, tables = frame(url, at=at_s)
        gone = ended.filter(pl.col("time_s") <= at_s)["track_id"]
        wanted = (
            table.filter(pl.col("time_s") <= at_s, ~pl.col("track_id").is_in(gone.to_list()))
            .sort("time_s", maintain_order=True)
            .unique("track_id", keep="last")
            .sort("track_id")
        )
        assert (header["recorded"], header["layers"]) == (True, ["tracks", "others"])
        assert header["span_s"] == [first_s, last_s]
        found = tables["tracks"]
        if not len(wanted):
            assert header["tables"]["tracks"]["rows"] == 0
            continue
        np.testing.assert_array_equal(found["track_id"], wanted["track_id"])
        np.testing.assert_array_equal(found["time_s"], wanted["time_s"])
        for column in ("latitude_deg", "longitude_deg"):
            np.testing.assert_allclose(found[column], wanted[column], rtol=1e-14)
        np.testing.assert_allclose(found["age_s"], at_s - wanted["time_s"], atol=1e-3)
        addresses = [-1 if one is None else int(one, 16) for one in wanted["mode_s_address"]]
        assert found["mode_s_address"].tolist() == addresses
        past = table.filter(pl.col("time_s") > at_s - 120.0, pl.col("time_s") <= at_s)
        assert set(tables["path"]["time_s"]) <= set(past["time_s"])
        assert set(tables["path"]["track_id"]) == set(wanted["track_id"]) & set(past["track_id"])


def test_plots_are_the_measurements_of_their_tracks(
    tracked: Path, shown: tuple[str, Command]
) -> None:
    url, _ = shown
    table = pl.read_parquet(tracked / "tracks" / "tracks.parquet")
    last_s = table["time_s"].max()
    assert isinstance(last_s, float)
    header, tables = frame(url, at=last_s)
    plots = tables["plots"]
    names = np.array(header["sensors"])[plots["sensor"]]
    found = {*zip(plots["time_s"], names, plots["track_id"], strict=True)}
    recent = table.filter(pl.col("time_s") > last_s - 30.0)
    assert set(recent.select("time_s", "sensor_id", "track_id").iter_rows()) <= found
    own = {track: row for row, track in enumerate(tables["tracks"]["track_id"].tolist())}
    far = [
        abs(plots["corrected_latitude_deg"][row] - tables["tracks"]["latitude_deg"][own[track]])
        for row, track in enumerate(plots["track_id"].tolist())
        if track in own and abs(plots["time_s"][row] - last_s) < 5.0
    ]
    assert far
    assert np.median(far) < 0.05
    # Only what is new for a reader that has the frame of a second before.
    _, later = frame(url, at=last_s, since=last_s - 1.0)
    assert (later["plots"]["time_s"] > last_s - 1.0).all()
    assert (later["path"]["time_s"] > last_s - 1.0).all()


def test_without_measurements_the_sensors_of_tracks_are_those_of_their_updates(
    tracked: Path, tmp_path: Path
) -> None:
    run_ = tracked / "tracks"
    viewed = RecordedView([RecordedRun(run_files(run_, None, [run_]), tmp_path)])
    table = pl.read_parquet(run_ / "tracks.parquet")
    first_s, last_s = table["time_s"].min(), table["time_s"].max()
    assert isinstance(first_s, float)
    assert isinstance(last_s, float)
    for at_s, since_s, window_s in [(last_s, None, 120.0), (last_s, last_s - 1.0, 30.0)]:
        header, tables = decoded(viewed.past_picture(PastAsked(at_s, since_s)))
        heard = tables["heard"]
        names = np.array(header["sensors"])[heard["sensor"]]
        found = {*zip(heard["track_id"].tolist(), names, heard["time_s"].tolist(), strict=True)}
        recent = table.filter(
            pl.col("track_id").is_in(tables["tracks"]["track_id"].astype(np.int64).tolist()),
            pl.col("time_s") > at_s - window_s,
        )
        wanted = recent.group_by("track_id", "sensor_id").agg(pl.col("time_s").max())
        assert found == {*wanted.iter_rows()}
        assert len({name for _, name, _ in found}) > 1
    # Before the first update there are neither tracks nor sensors of them.
    _, tables = decoded(viewed.past_picture(PastAsked(first_s - 1.0)))
    assert len(tables["heard"]["track_id"]) == 0


def test_histories_and_sensors_are_those_of_the_tables(
    tracked: Path, shown: tuple[str, Command]
) -> None:
    url, _ = shown
    table = pl.read_parquet(tracked / "tracks" / "tracks.parquet")
    track = int(table["track_id"].mode()[0])
    own = table.filter(track_id=track)["time_s"]
    for given, wanted in [
        ({"limit": 20}, own.head(20)),
        ({"since": own[5], "limit": 10}, own[5:15]),
        ({"since": own[5], "limit": 5000}, own[5:]),
    ]:
        asked = "&".join(f"{name}={value}" for name, value in given.items())
        answer = clients.get(f"{url}/v1/tracks/{track}/history?{asked}").raise_for_status()
        assert [one["time_s"] for one in answer.json()["updates"]] == wanted.to_list()
    biases = pl.read_parquet(tracked / "tracks" / "biases.parquet")
    for sensor in clients.get(f"{url}/v1/sensors").json()["sensors"]:
        last = biases.filter(sensor_id=sensor["id"]).group_by("parameter").last()
        found = {one["parameter"]: one["estimate"] for one in sensor["biases"]}
        assert found == dict(last.select("parameter", "estimate").iter_rows())
    missing = clients.get(f"{url}/v1/tracks/{track}/forecast")
    assert (missing.status_code, missing.json()["code"]) == (404, "NOT_RECORDED")
    assert clients.get(f"{url}/v1/picture?at=0&layer=2").json()["code"] == "LAYER_NOT_FOUND"
    assert clients.get(f"{url}/v1/measurements").status_code == 404


def test_it_ends_with_ctrl_c(shown: tuple[str, Command]) -> None:
    _, command = shown
    command.signal(signal.SIGINT)
    assert command.wait() == EXIT_DONE
