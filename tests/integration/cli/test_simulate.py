"""`multiradar simulate`, and `track` on its output: the truth lies within the sigmas."""

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from multiradar.cli.main import run
from multiradar_schemas.report import Report

FILES = [
    "measurements.parquet", "report.json", "scene.toml", "sensors.toml", "truth.parquet",
    "truth_biases.parquet",
]  # fmt: skip

AWAY = """
duration_s = 7200
[plane]
latitude_deg = 50
longitude_deg = 10
[[aircraft]]
track_number = 7
east_m = 3e4
north_m = 3e4
speed_mps = SPEED
heading_deg = 10
[[sensor]]
id = "a"
east_m = 0
north_m = 0
range_max_m = RANGE
"""


def _simulate(*arguments: object) -> int:
    return run(["simulate", *map(str, arguments)])


def _bytes(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("simulated") / "out"
    assert _simulate("rotating-gaps", "--out", out, "--duration", 400, "--seed", 11) == 0
    return out


def test_a_run_writes_its_files_and_prints_a_summary(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert _simulate("one-radar-adsb", "--out", out, "--duration", 60) == 0
    shown = capsys.readouterr()
    assert sorted(path.name for path in out.iterdir()) == FILES
    assert "25 aircraft by 2 sensors in 60 s, seed 5" in " ".join(shown.out.split())
    assert not shown.err
    report = Report.model_validate_json((out / "report.json").read_text(encoding="utf-8"))
    assert report.counts.read == len(pl.read_parquet(out / "measurements.parquet"))


def test_json_is_one_object_and_the_same_as_the_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert _simulate("report-1-6", "--out", out, "--duration", 5, "--json") == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown == json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert shown["figures"]["by_sensor"]["radar-2"]["measurements"] == 75
    assert shown["settings"] == {"scene": "report-1-6", "seed": 16, "duration_s": 5.0}


def test_the_same_seed_gives_the_same_bytes_also_from_its_own_scene_file(
    simulated: Path, tmp_path: Path
) -> None:
    assert _simulate("rotating-gaps", "--out", tmp_path / "a", "--duration", 400, "--seed", 11) == 0
    assert _bytes(tmp_path / "a") == _bytes(simulated)
    assert _simulate(simulated / "scene.toml", "--out", tmp_path / "b") == 0
    first, again = _bytes(simulated), _bytes(tmp_path / "b")
    assert {name for name in FILES if first[name] != again[name]} == {"report.json"}
    assert _simulate(simulated / "scene.toml", "--out", tmp_path / "c", "--seed", 12) == 0
    assert _bytes(tmp_path / "c")["measurements.parquet"] != first["measurements.parquet"]


def test_a_simulation_is_tracked_within_its_sigmas(simulated: Path, tmp_path: Path) -> None:
    out = tmp_path / "tracks"
    sensors = simulated / "sensors.toml"
    arguments = [str(simulated), "--sensors", str(sensors), "--out", str(out)]
    assert run(["track", *arguments, "--filter", "two-stage", "--acceleration-density", "0.2"]) == 0
    biases, true = (
        pl.read_parquet(file)
        for file in (out / "biases.parquet", simulated / "truth_biases.parquet")
    )
    keys = ["sensor_id", "parameter"]
    last = biases.filter(pl.col("epoch") == pl.col("epoch").max())
    both = last.join(true.filter(time_s=400.0), on=keys)
    assert len(both) == 6
    ratio = ((both["estimate"] - both["value"]) / both["sigma"]).to_numpy()
    # Six numbers: beyond 4.5 sigma once in 25 000 runs.
    assert np.max(np.abs(ratio)) < 4.5
    sigma_m = both.filter(parameter="range_offset_m")["sigma"].to_numpy()
    assert np.max(sigma_m) < 10.0
    tracks, truth = (
        pl.read_parquet(file) for file in (out / "tracks.parquet", simulated / "truth.parquet")
    )
    assert set(tracks["track_number"]) <= set(truth["track_number"])
    rows = tracks.filter(pl.col("time_s") > 200.0).join(
        truth, on=["time_s", "track_number", "sensor_id"], suffix="_true"
    )
    assert len(rows) > 2000
    north = (rows["latitude_deg"] - rows["latitude_deg_true"]).to_numpy() * 111_300.0
    east = (rows["longitude_deg"] - rows["longitude_deg_true"]).to_numpy() * 111_300.0
    east *= np.cos(np.radians(rows["latitude_deg"].to_numpy()))
    nees = (north**2 + east**2) / rows["position_sigma_m"].to_numpy() ** 2
    assert 0.6 < np.mean(nees) < 1.3


def test_scenarios_are_listed_with_their_titles(capsys: pytest.CaptureFixture[str]) -> None:
    assert _simulate("--list") == 0
    shown = capsys.readouterr().out
    assert "report-1-6        " in shown
    assert len(shown.splitlines()) >= 9
    assert _simulate("--list", "--json") == 0
    assert "report-1-6-drift" in json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(
    ("arguments", "status", "sentence"),
    [
        (
            ["nope", "--out", "OUT"],
            2,
            "unknown scenario or TOML file 'nope'; known: aircraft-data, bearings-only,",
        ),
        ([], 2, "missing argument SCENARIO: a built-in scenario (see --list) or a T"),
        (["report-1-6"], 2, "missing option --out DIR"),
        (["report-1-6", "--out", "OUT", "--seed", "-1"], 2, "--seed: expected a whole number from"),
        (
            ["report-1-6", "--out", "OUT", "--duration", "0"],
            2,
            "--duration: expected a number from 0.1",
        ),
        (["report-1-6", "--out", "OUT", "--duration", "nan"], 2, "--duration: expected"),
        (["no.toml", "--out", "OUT"], 1, "no.toml: no such file"),
        (["report-1-6", "--out", "OUT/deep"], 1, "no such folder; create it before writing deep"),
        (["report-1-6", "--out", "HERE"], 1, "already exists; choose another output directory"),
    ],
)
def test_an_error_is_one_sentence_and_leaves_nothing(
    arguments: list[str],
    status: int,
    sentence: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    places = {"OUT": str(tmp_path / "out"), "HERE": str(tmp_path), "OUT/deep": "/nowhere/deep"}
    assert _simulate(*(places.get(one, one) for one in arguments)) == status
    shown = capsys.readouterr()
    assert not shown.out
    assert shown.err.startswith("multiradar: ")
    assert sentence in shown.err
    assert shown.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_scenario_that_leaves_the_plane_leaves_no_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "far.toml"
    scene.write_text(
        "duration_s = 90000\n[plane]\nlatitude_deg = 50\nlongitude_deg = 10\n"
        "[[aircraft]]\neast_m = 0\nnorth_m = 0\nspeed_mps = 300\nheading_deg = 45\n"
        '[[sensor]]\nid = "A"\neast_m = 0\nnorth_m = 1000\nrotation_period_s = 10\n',
        encoding="utf-8",
    )
    assert _simulate(scene, "--out", tmp_path / "out") == 1
    assert "the flight goes more than 60 degrees away from" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["far.toml"]


def test_a_sensor_without_any_aircraft_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "blind.toml"
    path.write_text(AWAY.replace("SPEED", "20").replace("RANGE", "500"), encoding="utf-8")
    assert _simulate(path, "--out", tmp_path / "out") == 1
    shown = capsys.readouterr().err
    assert f"{path}: sensor a: no aircraft enters its coverage; check latitude_deg" in shown
    # The results are kept.
    assert (tmp_path / "out" / "report.json").exists()


def test_an_aircraft_that_leaves_the_plane_is_named_with_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "away.toml"
    path.write_text(AWAY.replace("SPEED", "2000").replace("RANGE", "4e5"), encoding="utf-8")
    assert _simulate(path, "--out", tmp_path / "out") == 1
    shown = capsys.readouterr().err
    assert f"{path}: aircraft 7: the flight goes more than 60 degrees away from" in shown
    assert "speed_mps" in shown


def test_a_position_off_the_plane_is_named_with_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "far.toml"
    far = AWAY.replace("east_m = 3e4\nnorth_m = 3e4", "latitude_deg = -50.0\nlongitude_deg = 10.0")
    path.write_text(far.replace("SPEED", "20").replace("RANGE", "4e5"), encoding="utf-8")
    assert _simulate(path, "--out", tmp_path / "out") == 1
    assert (
        f"{path}: aircraft[0]: expected latitude_deg and longitude_deg" in capsys.readouterr().err
    )


def test_a_scene_of_reported_positions_alone_can_be_tracked(tmp_path: Path) -> None:
    """Regression: `track` rejected its sensors file, which had no position."""
    (tmp_path / "scene.toml").write_text(
        "duration_s = 60\n[plane]\nlatitude_deg = 56.7\nlongitude_deg = 60.8\n"
        "[[traffic]]\ncount = 3\neast_m = [-2e4, 2e4]\nnorth_m = [-2e4, 2e4]\n"
        '[[sensor]]\nid = "adsb"\nkind = "adsb"\n'
    )
    made = tmp_path / "made"
    assert _simulate(tmp_path / "scene.toml", "--out", made) == 0
    given = [str(made), "--sensors", str(made / "sensors.toml"), "--out", str(tmp_path / "out")]
    assert run(["track", *given]) == 0
