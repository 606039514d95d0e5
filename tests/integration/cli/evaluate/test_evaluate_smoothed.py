"""A smoothed reference is closer to the truth than the tracks, and reports its accuracy."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.cli.main import run
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.evaluation.trajectories import Floats, positions_at
from multiradar.toolbox.evaluation.inputs import read_smoothed, read_truth
from multiradar.toolbox.evaluation.known import Known

SETTINGS = EvaluationSettings()


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("smoothed")
    made = str(folder / "made")
    # Rotating radars with gaps, missed detections and outliers.
    options = ["--duration", "400", "--seed", "3"]
    assert run(["simulate", "rotating-gaps", "--out", made, *options]) == 0
    sensors = ["--sensors", f"{made}/sensors.toml"]
    assert run(["track", made, *sensors, "--out", str(folder / "tracks")]) == 0
    return folder


def distances(smoothed: Known, truth: Known) -> Floats:
    """Return the distances of the smoothed positions from the true ones, m."""
    one, other = smoothed.reference, truth.reference
    number = {name: index for index, name in enumerate(other.names)}
    aircraft_index = np.array([number[name] for name in one.names])[one.aircraft]
    positions = positions_at(other, aircraft_index, one.time_s).position_m
    known = np.isfinite(positions[:, 0])
    east, north = one.plane.to_plane(*other.plane.to_geodetic(*positions[known].T))
    found: Floats = np.hypot(one.position_m[known, 0] - east, one.position_m[known, 1] - north)
    return found


def evaluated(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, Any]:
    capsys.readouterr()
    assert run(["evaluate", *map(str, arguments), "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def test_it_is_closer_to_the_truth_than_the_tracks_and_reports_its_accuracy(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made, sensors = scene / "made", scene / "made" / "sensors.toml"
    truth = read_truth(made, SETTINGS)
    smoothed = read_smoothed(made, sensors, scene / "tracks", SETTINGS)
    off = distances(smoothed, truth)
    tracks = evaluated(capsys, scene / "tracks", "--truth", made)
    rms = float(np.sqrt(np.mean(off**2)))
    assert len(off) > 3000
    assert rms < 0.8 * tracks["errors"]["position_m"]["rms"]
    sigma = smoothed.claimed["sigma_m"]
    assert isinstance(sigma, float)
    # The density that suits turns is too large for straight flights.
    assert 0.5 * sigma < rms < 1.3 * sigma
    measured = pl.read_parquet(made / "truth.parquet")
    assert smoothed.claimed["outliers"] == pytest.approx(measured["outlier"].sum(), abs=5)


def test_tracks_are_evaluated_against_it(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = scene / "made"
    by_truth = evaluated(capsys, scene / "tracks", "--truth", made)
    found = evaluated(
        capsys, scene / "tracks", "--smoothed", made, "--sensors", made / "sensors.toml"
    )
    assert found["reference"]["kind"] == "smoothed"
    assert found["compared"]["aircraft"] == by_truth["compared"]["aircraft"]
    assert found["identity"]["swaps"] == found["tracks"]["false"] == 0
    # It uses the same plots as the tracks: their errors appear smaller than they are.
    one, other = (card["errors"]["position_m"]["rms"] for card in (found, by_truth))
    assert 0.4 * other < one < 1.1 * other


def test_interacting_modes_are_more_accurate_and_report_it(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made, sensors = scene / "made", scene / "made" / "sensors.toml"
    truth = read_truth(made, SETTINGS)
    plain = read_smoothed(made, sensors, scene / "tracks", SETTINGS)
    modes = read_smoothed(made, sensors, scene / "tracks", SETTINGS, "imm")
    off = distances(modes, truth)
    rms, before = (float(np.sqrt(np.mean(one**2))) for one in (off, distances(plain, truth)))
    assert len(off) == len(distances(plain, truth))
    assert rms < 0.9 * before
    sigma = modes.claimed["sigma_m"]
    assert isinstance(sigma, float)
    assert 0.6 * sigma < rms < 1.4 * sigma
    found = evaluated(
        capsys, scene / "tracks", "--smoothed", made, "--sensors", sensors, "--smoother", "imm"
    )
    assert found["reference"]["smoother"] == "imm"
    assert found["reference"]["sigma_m"] == pytest.approx(sigma, rel=1e-4)


def test_uncorrected_biases_shift_it(scene: Path) -> None:
    made, sensors = scene / "made", scene / "made" / "sensors.toml"
    truth = read_truth(made, SETTINGS)
    known = distances(read_smoothed(made, sensors, scene / "tracks", SETTINGS), truth)
    # A file of tracks alone has no biases beside it.
    alone = scene / "tracks" / "tracks.parquet"
    blind = distances(read_smoothed(made, sensors, alone, SETTINGS), truth)
    assert np.median(blind) > 3.0 * np.median(known)


def test_other_names_of_a_sensor_are_those_of_the_sensor(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Regression: rows by another name had no part in the reference, and joined no update."""
    made = scene / "made"
    text = (made / "sensors.toml").read_text(encoding="utf-8")
    renamed = re.sub(r'(id = "([^"]+)")', r'\1\nalso = ["second-\2"]', text)
    (tmp_path / "sensors.toml").write_text(renamed, encoding="utf-8")
    measured = pl.read_parquet(made / "measurements.parquet")
    names = "second-" + pl.col("sensor_id")
    measured.with_columns(sensor_id=names).write_parquet(tmp_path / "measurements.parquet")
    sensors = "--sensors", tmp_path / "sensors.toml"
    found, by_id = (
        evaluated(capsys, scene / "tracks", "--smoothed", folder, *sensors)
        for folder in (tmp_path, made)
    )
    for one in (found, by_id):
        del one["reference"]
    assert found == by_id


def test_unusable_input_is_reported(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = scene / "made"
    tracks = str(scene / "tracks")
    nameless = pl.read_parquet(made / "measurements.parquet").with_columns(
        pl.col("time_s") + 0.003,
        track_number=pl.lit(None, pl.Int64),
        mode_s_address=pl.lit(None, pl.String),
    )
    nameless.write_parquet(tmp_path / "measurements.parquet")
    smoothed = ["evaluate", tracks, "--smoothed"]
    sensors = ["--sensors", str(made / "sensors.toml")]
    assert run([*smoothed, str(tmp_path), *sensors]) == 1
    assert "--smoothed requires measurements with identity: none has" in capsys.readouterr().err
    assert run([*smoothed, str(made), "--sensors", str(tmp_path / "none.toml")]) == 1
    assert "none.toml" in capsys.readouterr().err
    alone = ["evaluate", str(scene / "tracks" / "tracks.parquet"), "--smoothed", str(made)]
    assert run(alone) == 2
    assert "missing --sensors, which --smoothed requires" in capsys.readouterr().err
    text = (made / "sensors.toml").read_text(encoding="utf-8")
    one = re.findall(r'id = "([^"]+)"', text)[0]
    (tmp_path / "renamed.toml").write_text(text.replace(f'"{one}"', '"other"'), encoding="utf-8")
    run([*smoothed, str(made), "--sensors", str(tmp_path / "renamed.toml")])
    output = capsys.readouterr().err
    assert re.search(
        rf"{one} \(\d+ measurements\) is not in \S+renamed.toml and was not used", output
    )
    assert run(["evaluate", tracks, "--truth", str(made), "--smoother", "imm"]) == 2
    assert "--smoother applies to --smoothed only" in capsys.readouterr().err
    assert run(["evaluate", tracks, "--truth", str(made), "--density", "20"]) == 2
    assert "--density applies to --smoothed only" in capsys.readouterr().err
