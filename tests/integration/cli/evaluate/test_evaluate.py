"""`multiradar evaluate` on simulated scenarios and on the sample recording."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.evaluation.evaluate import PresetChoice
from multiradar.cli.main import run
from multiradar.evaluation.presets import PRESETS
from support.paths import ROOT


def evaluated(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, Any]:
    assert run(["evaluate", *map(str, arguments), "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scene")
    made, tracks = folder / "made", folder / "tracks"
    options = ["--duration", "240", "--seed", "4"]
    assert run(["simulate", "one-radar-adsb", "--out", str(made), *options]) == 0
    shown = ["--sensors", str(made / "sensors.toml"), "--out", str(tracks), "--kinds", "radar"]
    assert run(["track", str(made), *shown, "--forecasts", "8"]) == 0
    return folder


def test_forecasts_are_evaluated_by_horizon(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = evaluated(capsys, scene / "tracks", "--truth", scene / "made")["forecasts"]
    # Four minutes: there is no truth for 300 s ahead.
    assert [one["horizon_s"] for one in found] == [10.0, 30.0, 60.0, 120.0]
    assert all(one["by"] == "filter" and one["probability"] == 0.95 for one in found)
    samples = [one["samples"] for one in found]
    assert samples == sorted(samples, reverse=True)
    assert all(one["inside"] > 0.9 for one in found)
    assert [one["rms_m"] for one in found] == sorted(one["rms_m"] for one in found)
    written = pl.read_parquet(scene / "tracks" / "forecasts.parquet")
    report = json.loads((scene / "tracks" / "report.json").read_text(encoding="utf-8"))
    rows = {one["file"]: one["rows"] for one in report["outputs"]}
    assert rows["forecasts.parquet"] == len(written) > samples[0]
    alone = evaluated(capsys, scene / "tracks" / "tracks.parquet", "--truth", scene / "made")
    assert alone["forecasts"] == []


def test_bundle_forecasts_are_evaluated_too(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(scene / "tracks" / "tracks.parquet", tmp_path)
    written = pl.read_parquet(scene / "tracks" / "forecasts.parquet")
    written.write_parquet(tmp_path / "forecasts.parquet")
    every_third = written.with_columns(by=pl.lit("bundle", written.schema["by"]))[::3]
    every_third.write_parquet(tmp_path / "bundle_forecasts.parquet")
    found = evaluated(capsys, tmp_path, "--truth", scene / "made")["forecasts"]
    samples = {
        by: sum(one["samples"] for one in found if one["by"] == by) for by in ("filter", "bundle")
    }
    assert len(found) == 8
    assert samples["bundle"] == pytest.approx(samples["filter"] / 3, rel=0.05)


def test_a_report_named_as_a_radar_of_the_tracks_is_another_sensor(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Regression: ADS-B converted alone has the name SAC-SIC of a radar with the same codes."""
    radar = pl.read_parquet(scene / "tracks" / "tracks.parquet")["sensor_id"].unique().to_list()[0]
    reports = pl.read_parquet(scene / "made" / "measurements.parquet").filter(kind="adsb")
    path = tmp_path / "measurements.parquet"
    reports.with_columns(pl.lit(radar).alias("sensor_id")).write_parquet(path)
    evaluated(capsys, scene / "tracks", "--adsb", path)
    assert run(["evaluate", str(scene / "tracks"), "--adsb", str(path)]) == 0
    assert "is also the reference" not in capsys.readouterr().err


def test_an_evaluation_without_a_compared_update_is_reported(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = ["evaluate", str(scene / "tracks"), "--adsb", str(scene / "made")]
    line += ["--settling", "100000"]
    assert run(line) == 1
    assert "no update was compared with the reference after the first" in capsys.readouterr().err


def test_the_names_of_presets_are_those_of_the_catalogue() -> None:
    assert [choice.value for choice in PresetChoice] == list(PRESETS)


def test_a_scenario_is_evaluated_against_its_truth(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = evaluated(capsys, scene / "tracks", "--truth", scene / "made", "--scan-period", 4)
    assert found["reference"]["kind"] == "truth"
    assert found["compared"]["aircraft"] == 25
    assert found["identity"]["swaps"] == 0
    assert found["tracks"]["false"] == 0
    assert found["identity"]["plots_on_right_track"] == 1.0
    assert found["siap"]["completeness"] > 0.95
    assert found["initiation"]["never_tracked"] == 0
    assert found["initiation"]["median_scans"] < 4.0
    # The biases of a single radar are unobservable, which is reported.
    assert 100.0 < found["errors"]["position_m"]["rms"] < 1500.0
    assert found["nees"]["position"]["mean"] < 1.5
    assert {one["parameter"] for one in found["biases"]} == {
        "range_offset_m", "azimuth_offset_deg",
    }  # fmt: skip
    assert all(one["true"] is not None for one in found["biases"])
    assert len(found["aircraft"]) == 25
    assert found["gospa"]["localisation_share"] + found["gospa"]["missed_share"] + found["gospa"][
        "false_share"
    ] == pytest.approx(1.0, abs=2e-6)  # three figures of six digits


def test_the_figures_end_after_six_digits(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = evaluated(capsys, scene / "tracks", "--truth", scene / "made")
    errors = list(found["errors"]["position_m"].values())
    assert len(errors) > 4
    for value in errors + list(found["siap"].values()):
        assert value == float(f"{value:.6g}") or value == round(value), value


def test_an_adsb_reference_contains_only_aircraft_that_report(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = evaluated(capsys, scene / "tracks", "--adsb", scene / "made")
    partial = evaluated(
        capsys, scene / "tracks", "--adsb", scene / "made" / "measurements.parquet", "--partial"
    )
    equipped = whole["compared"]["aircraft"]
    assert 10 <= equipped < 25
    assert whole["tracks"]["of_aircraft"] == partial["tracks"]["of_aircraft"] == equipped
    assert whole["tracks"]["false"] + whole["tracks"]["duplicate"] == 25 - equipped
    assert partial["tracks"]["false"] == 0
    assert len(partial["biases"]) == len(whole["biases"]) > 0
    assert all(one["true"] is None for one in partial["biases"])


def test_the_terminal_and_the_page_show_the_same_scorecard(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "card.html"
    arguments = ["evaluate", str(scene / "tracks"), "--truth", str(scene / "made")]
    assert run([*arguments, "--html", str(page)]) == 0
    shown = capsys.readouterr().out
    for heading in (
        "Presets",
        "Errors",
        "Air picture (SIAP)",
        "Tracks",
        "Covariance consistency (NEES)",
        "The 8 worst aircraft",
    ):
        assert f"\n{heading}" in shown
    assert f"to show this on a map: multiradar view {scene / 'tracks'}" in shown
    text = page.read_text(encoding="utf-8")
    assert "<script" not in text
    for heading in ("Tracks and reference", "Biases", "Position errors over time", "Aircraft"):
        assert f">{heading}</h2>" in text
    assert run([*arguments, "--html", str(page)]) == 1
    assert "already exists; choose another file" in capsys.readouterr().err


def test_strict_is_status_1_where_a_requirement_is_not_met(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["evaluate", str(scene / "tracks"), "--truth", str(scene / "made")]
    # The biases of a single radar are unobservable: its tracks are off by hundreds of metres.
    assert run([*arguments, "--preset", "ed142-tma"]) == 0
    assert "fail" in capsys.readouterr().out
    assert run([*arguments, "--preset", "ed142-tma", "--strict"]) == 1
    assert run([*arguments, "--preset", "ed142-enroute", "--gate", "5000", "--json"]) == 0
    lines = json.loads(capsys.readouterr().out.splitlines()[-1])["presets"]
    assert [one["preset"] for one in lines] == ["ed142-enroute"] * 3


def test_two_tracks_with_exchanged_identities_are_two_swaps(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frame = pl.read_parquet(scene / "tracks" / "tracks.parquet")
    one, other = frame["track_id"].unique().sort()[:2]
    middle = (frame["time_s"].min() + frame["time_s"].max()) / 2.0  # type: ignore[operator]
    swapped = pl.col("track_id").replace({one: other, other: one})
    late = pl.col("time_s") > middle
    path = tmp_path / "tracks.parquet"
    frame.with_columns(
        pl.when(late).then(swapped).otherwise("track_id").alias("track_id")
    ).write_parquet(path)
    found = evaluated(capsys, path, "--truth", scene / "made")
    assert found["identity"]["swaps"] == 2
    assert found["identity"]["number_changes"] == 2
    assert found["biases"] == []
    before = evaluated(capsys, scene / "tracks", "--truth", scene / "made")
    for name, one in found["errors"].items():
        assert one == pytest.approx(before["errors"][name])


# Each makes a file invalid and returns the expected message.
def _remove(path: Path) -> str:
    path.unlink()
    return "expected the output of"


def _spoil(path: Path) -> str:
    path.write_text("no Parquet", encoding="utf-8")
    return "in Parquet"


def _later(path: Path) -> str:
    pl.read_parquet(path).with_columns(pl.col("time_s") + 1e6).write_parquet(path)
    return "tracks and reference do not overlap in time: tracks "


def _narrow(path: Path) -> str:
    pl.read_parquet(path).drop("latitude_deg").write_parquet(path)
    return "missing column latitude_deg; found: time_s"


def _empty(path: Path) -> str:
    pl.read_parquet(path).clear().write_parquet(path)
    return ": contains no "


@pytest.mark.parametrize("name", ["tracks/tracks.parquet", "made/truth.parquet"])
@pytest.mark.parametrize("change", [_remove, _spoil, _later, _narrow, _empty])
def test_unusable_input_is_one_sentence(
    scene: Path,
    tmp_path: Path,
    name: str,
    change: Callable[[Path], str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    for source in ("tracks/tracks.parquet", "made/truth.parquet"):
        (tmp_path / source).parent.mkdir()
        (tmp_path / source).write_bytes((scene / source).read_bytes())
    shown = change(tmp_path / name)
    assert run(["evaluate", str(tmp_path / "tracks"), "--truth", str(tmp_path / "made")]) == 1
    error = capsys.readouterr().err
    assert error.startswith("multiradar: ")
    assert shown in error
    assert "internal error" not in error


@pytest.mark.parametrize("option", ["--adsb", "--truth", "--smoothed"])
@pytest.mark.parametrize("files", [False, True])
def test_exchanged_tracks_and_reference_are_named(
    scene: Path, capsys: pytest.CaptureFixture[str], option: str, *, files: bool
) -> None:
    made, tracks = scene / "made", scene / "tracks"
    if files:
        made, tracks = made / "measurements.parquet", tracks / "tracks.parquet"
    assert run(["evaluate", str(made), option, str(tracks)]) == 1
    said = capsys.readouterr().err
    assert said.startswith(f"multiradar: tracks and reference are swapped: {made} is the output")
    assert said.endswith(
        f"{tracks} is the output of `track`; specify the tracks first, and the measurements as the "
        "reference\n"
    )


def test_own_tracks_are_no_system_tracks(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tracks = scene / "tracks" / "tracks.parquet"
    assert run(["evaluate", str(tracks), "--system-tracks", str(tracks)]) == 1
    said = capsys.readouterr().err
    assert f"{tracks}: expected system tracks (of `convert asterix` or" in said
    assert said.endswith("was the output of `track`\n")


def test_a_recording_without_adsb_is_no_reference(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frame = pl.read_parquet(scene / "made" / "measurements.parquet")
    frame.filter(kind="radar").write_parquet(tmp_path / "measurements.parquet")
    assert run(["evaluate", str(scene / "tracks"), "--adsb", str(tmp_path)]) == 1
    assert "no ADS-B reports, which --adsb requires" in capsys.readouterr().err


def test_the_sample_meets_its_presets(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    converted, tracks = tmp_path / "converted", tmp_path / "tracks"
    dump = ["convert", "vid", str(ROOT / "examples" / "vid-sample"), str(converted)]
    assert run([*dump, "--date", "2018-08-01"]) == 0
    sensors = str(ROOT / "examples" / "sensors-vid-sample.toml")
    options = ["--sensors", sensors, "--kinds", "radar", "--out", str(tracks)]
    assert run(["track", str(converted), *options]) == 0
    capsys.readouterr()
    found = evaluated(capsys, tracks, "--adsb", converted)
    assert found["compared"]["aircraft"] == 68
    assert {one["verdict"] for one in found["presets"]} == {"pass"}
    assert found["identity"]["swaps"] == found["tracks"]["false"] == 0
    assert 30.0 < found["errors"]["position_m"]["median"] < 45.0
    assert found["errors"]["position_m"]["rms"] < 80.0
    assert found["errors"]["height_m"]["rms"] < 5.0
    assert all(one["true"] is None for one in found["biases"])
    own = evaluated(capsys, tracks, "--system-tracks", converted)
    assert own["reference"]["kind"] == "system-tracks"
    assert own["compared"]["aircraft"] == 68
    assert 20.0 < own["errors"]["position_m"]["median"] < 70.0
    one = next(converted.glob("*/240_mr.new4"))
    alone = evaluated(capsys, tracks, "--system-tracks", one, "--partial")
    assert alone["compared"]["aircraft"] == 1
    assert alone["tracks"]["false"] == 0
    sample = ROOT / "examples" / "vid-sample"
    known = evaluated(capsys, tracks, "--adsb", converted, "--truth", sample / "truth.json")
    assert known["reference"] == found["reference"] | {"truth": str(sample / "truth.json")}
    assert len(known["biases"]) == 8
    assert all(abs(one["error"]) < 4.0 * one["sigma"] for one in known["biases"])
    by_itself = evaluated(capsys, tracks, "--truth", sample)
    assert by_itself["biases"] == known["biases"]
    assert by_itself["errors"] == found["errors"]
    assert by_itself["reference"]["kind"] == "recorded"
    assert run(["evaluate", str(converted), "--adsb", str(tracks)]) == 1
    assert capsys.readouterr().err.startswith("multiradar: tracks and reference are swapped: ")
    assert run(["evaluate", str(tracks), "--adsb", str(tracks)]) == 1
    assert capsys.readouterr().err == (
        f"multiradar: {tracks}: expected the output of `convert` or `simulate`, was the output of "
        "`track`\n"
    )
    assert run(["evaluate", str(converted), "--adsb", str(converted)]) == 1
    assert capsys.readouterr().err == (
        f"multiradar: {converted}: expected the output of `track`, was the output of `convert`\n"
    )


def test_a_reference_of_another_area_or_time_is_reported(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    truth = pl.read_parquet(scene / "made" / "truth.parquet")
    begin_s = pl.col("time_s").min()
    for name, changed in (
        ("area", pl.col("longitude_deg") + 8.0),
        ("other side", pl.col("longitude_deg") * 0.0 - 120.0),
        ("time", begin_s + 220.0 + 4.0 * (pl.col("time_s") - begin_s)),
    ):
        truth.with_columns(changed).write_parquet(tmp_path / f"{name}.parquet")
    line = ["evaluate", str(scene / "tracks"), "--truth"]
    assert run([*line, str(tmp_path / "area.parquet")]) == 1
    assert "no track comes within 2000 m (--gate)" in capsys.readouterr().err
    assert run([*line, str(tmp_path / "other side.parquet")]) == 1
    assert "on different sides of the Earth" in capsys.readouterr().err
    late = [*line, str(tmp_path / "time.parquet"), "--gate", "500000"]
    assert run(late) == 0
    assert "outside the time span of the plots) and are not compared" in capsys.readouterr().err
    assert run([*late, "--whole-reference"]) == 0
    assert (
        "of the reference lies outside the time span of the tracks: tracks 0"
        in capsys.readouterr().err
    )


def test_files_of_another_recording_beside_a_reference_are_reported(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The measurements and the sensors that were given beside a truth, and a truth of others."""
    line = ["evaluate", str(scene / "tracks"), "--truth", str(scene / "made")]
    assert run([*line, "--measurements", str(scene / "made")]) == 0
    other = tmp_path / "measurements.parquet"
    frame = pl.read_parquet(scene / "made" / "measurements.parquet")
    frame.with_columns(pl.col("time_s") + 0.4).write_parquet(other)
    capsys.readouterr()
    assert run([*line, "--measurements", str(other)]) == 1
    assert "0% of the updates of the tracks by its sensors" in capsys.readouterr().err
    smoothed = ["evaluate", str(scene / "tracks"), "--smoothed"]
    assert run([*smoothed, str(other)]) == 1
    assert "probably another recording" in capsys.readouterr().err
    assert run([*smoothed, str(scene / "made")]) == 0
    sensors = (scene / "made" / "sensors.toml").read_text()
    listed = tmp_path / "sensors.toml"
    listed.write_text(re.sub(r'id = "', 'id = "other-', sensors))
    assert run([*line, "--sensors", str(listed)]) == 1
    assert "none of the sensors of the tracks" in capsys.readouterr().err
    truth = pl.read_parquet(scene / "made" / "truth.parquet")
    moved = pl.col("latitude_deg") + 0.2
    truth.with_columns(moved).write_parquet(tmp_path / "truth.parquet")
    found = run(["evaluate", str(scene / "tracks"), "--truth", str(tmp_path / "truth.parquet")])
    assert found == 1


@pytest.mark.parametrize(
    ("option", "status", "words"),
    [
        ("--step=5000", 1, "step 5000 s: longer than the reference"),
        ("--scan-period=4000", 2, "--scan-period: expected a number from 0.1 to 3 600 s, was 4000"),
        ("--gate=900000", 0, "gate 900000 m: half of the aircraft are within"),
    ],
)
def test_options_beyond_the_reference_are_reported(
    scene: Path,
    capsys: pytest.CaptureFixture[str],
    option: str,
    status: int,
    words: str,
) -> None:
    arguments = ["evaluate", str(scene / "tracks"), "--truth", str(scene / "made")]
    assert run([*arguments, option]) == status
    assert words in " ".join(capsys.readouterr().err.split())
