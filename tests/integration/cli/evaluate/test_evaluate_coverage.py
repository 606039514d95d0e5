"""A reference with more coverage than the sensors, differences by radar, plots without identity."""

import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, run


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scene")
    made = folder / "made"
    options = ["--duration", "300", "--seed", "4"]
    assert run(["simulate", "one-radar-adsb", "--out", str(made), *options]) == EXIT_DONE
    shown = ["--sensors", str(made / "sensors.toml"), "--kinds", "radar"]
    assert run(["track", str(made), *shown, "--out", str(folder / "tracks")]) == EXIT_DONE
    return folder


def evaluated(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, Any]:
    capsys.readouterr()
    assert run(["evaluate", *map(str, arguments), "--json"]) == EXIT_DONE
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def wider(truth: pl.DataFrame) -> pl.DataFrame:
    """Add aircraft beyond the range, on the ground far away, and an hour later."""
    known = truth.drop_nulls("track_number")
    number = pl.col("track_number")
    far = known.with_columns(latitude_deg=pl.col("latitude_deg") + 5.0, track_number=number + 1000)
    first = known.filter(track_number=known["track_number"][0])
    ground = first.with_columns(
        latitude_deg=pl.col("latitude_deg").first() + 1.3, height_m=pl.lit(0.0),
        speed_mps=pl.lit(0.0), longitude_deg=pl.col("longitude_deg").first(),
        track_number=number + 2000,
    )  # fmt: skip
    late = known.with_columns(time_s=pl.col("time_s") + 3600.0)
    return pl.concat([truth, far, ground, late])


def test_a_wider_reference_gives_the_same_scorecard(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    truth = pl.read_parquet(scene / "made" / "truth.parquet")
    more = wider(truth)
    more.write_parquet(tmp_path / "truth.parquet")
    before = evaluated(capsys, scene / "tracks", "--truth", scene / "made")
    after = evaluated(capsys, scene / "tracks", "--truth", tmp_path / "truth.parquet")
    for name in ("aircraft", "updates_compared", "reference_positions"):
        assert after["compared"][name] == before["compared"][name]
    assert after["siap"]["completeness"] == before["siap"]["completeness"]
    assert after["errors"]["position_m"] == before["errors"]["position_m"]
    rows = after["reference"]["rows"]
    known = truth.drop_nulls("track_number")
    assert rows["outside_time"] == len(known)
    assert rows["outside_range"] + rows["below_horizon"] == len(more) - len(truth) - len(known)
    assert rows["below_horizon"] > 0
    assert rows["accepted"] == after["compared"]["reference_positions"] + sum(
        rows[name] for name in ("outside_time", "outside_range", "below_horizon")
    )
    whole = evaluated(
        capsys, scene / "tracks", "--truth", tmp_path / "truth.parquet", "--whole-reference"
    )
    assert whole["compared"]["aircraft"] == 2 * before["compared"]["aircraft"] + 1
    assert whole["siap"]["completeness"] < 0.5 * before["siap"]["completeness"]


def test_the_text_says_how_much_of_the_reference_is_outside(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    more = wider(pl.read_parquet(scene / "made" / "truth.parquet"))
    more.write_parquet(tmp_path / "truth.parquet")
    line = ["evaluate", str(scene / "tracks"), "--truth", str(tmp_path / "truth.parquet")]
    capsys.readouterr()
    assert run(line) == EXIT_DONE
    shown = capsys.readouterr()
    for text in (shown.out.replace("\n", " "), shown.err):
        assert "reference positions lie outside the coverage of the sensors (" in text
        assert "--whole-reference (Python: whole_reference=True)" in text


def test_tracks_without_sensors_are_compared_with_all(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = scene / "tracks" / "tracks.parquet"
    wider(pl.read_parquet(scene / "made" / "truth.parquet")).write_parquet(tmp_path / "t.parquet")
    alone = evaluated(capsys, table, "--truth", tmp_path / "t.parquet")
    assert alone["reference"]["rows"]["outside_time"] == 0
    assert alone["differences"] == []
    shown = ["--sensors", scene / "made" / "sensors.toml", "--measurements", scene / "made"]
    given = evaluated(capsys, table, "--truth", tmp_path / "t.parquet", *shown)
    assert given["reference"]["rows"]["outside_time"] > 0
    assert len(given["differences"]) == 2


def test_the_differences_of_a_radar_are_its_biases(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    biases = pl.read_parquet(scene / "made" / "truth_biases.parquet").sort("time_s")
    true = {
        row["parameter"]: row["value"]
        for row in biases.filter(pl.col("sensor_id") == biases["sensor_id"][0]).to_dicts()
    }
    # A single radar observes no bias: what is left is all of it.
    found = {
        one["quantity"]: one
        for one in evaluated(capsys, scene / "tracks", "--truth", scene / "made")["differences"]
    }
    for name, parameter in (("range_m", "range_offset_m"), ("azimuth_deg", "azimuth_offset_deg")):
        one = found[name]
        assert one["plots"] > 1000
        assert one["aircraft"] == 25
        assert abs(one["mean"] - true[parameter]) < 5.0 * one["sigma"]
        assert one["sigma"] < 0.1 * one["spread"]
        assert one["left"] == pytest.approx(one["mean"] - one["estimate"], abs=1e-5)


def test_a_smoothed_reference_of_plots_without_identity(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frame = pl.read_parquet(scene / "made" / "measurements.parquet").filter(kind="radar")
    names = ("track_number", "mode_s_address", "mode_3a", "callsign")
    nameless = frame.with_columns(
        pl.lit(None, frame.schema[name]).alias(name) for name in names if name in frame.columns
    )
    nameless.write_parquet(tmp_path / "measurements.parquet")
    sensors = ["--sensors", str(scene / "made" / "sensors.toml")]
    out = tmp_path / "tracks"
    assert run(["track", str(tmp_path), *sensors, "--out", str(out)]) == EXIT_DONE
    found = evaluated(capsys, out, "--smoothed", tmp_path)
    assert found["reference"]["identity"] == "tracks"
    assert found["compared"]["aircraft"] == pytest.approx(25, abs=2)
    assert found["errors"]["position_m"]["rms"] < 200.0
    assert run(["evaluate", str(out), "--smoothed", str(tmp_path)]) == EXIT_DONE
    assert "measurements have no identity" in capsys.readouterr().out
