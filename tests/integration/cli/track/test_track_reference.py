"""`multiradar track --reference`: biases of a radar from system tracks of another processor."""

import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, EXIT_FAILED, EXIT_USAGE, run

OFFSET_M, AZIMUTH_DEG = 90.0, -0.15
RADAR = """
[[sensor]]
id = "20-{number}"
{east}_m = {place}
{other}_m = 0
height_m = 500
rotation_period_s = 5
range_sigma_m = 25
azimuth_sigma_deg = 0.06
range_max_m = 200e3
bias.range_offset_m = {range}
bias.azimuth_offset_deg = {azimuth}
"""
SCENE = """
duration_s = 600
start_time_s = 1778057000.0
seed = 3
[plane]
latitude_deg = 47.0
longitude_deg = 8.0
[[traffic]]
count = 12
east_m = [-60e3, 60e3]
north_m = [-60e3, 60e3]
speed_mps = [150, 250]
""" + "".join(
    RADAR.format(number=number, east=east, other=other, place=place, range=offset, azimuth=azimuth)
    for number, east, other, place, offset, azimuth in (
        (1, "east", "north", 0, OFFSET_M, AZIMUTH_DEG),
        (2, "east", "north", 90e3, -60, 0.1),
        (3, "north", "east", -80e3, 30, 0.05),
    )
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make tracks of two radars, also in category 062, and plots of a third radar alone."""
    made = tmp_path_factory.mktemp("made")
    (made / "scene.toml").write_text(SCENE)
    assert run(["simulate", str(made / "scene.toml"), "--out", str(made / "scene")]) == EXIT_DONE
    plots = pl.read_parquet(made / "scene" / "measurements.parquet")
    for name, chosen in (("one", ["20-1"]), ("others", ["20-2", "20-3"])):
        own = plots.filter(pl.col("sensor_id").is_in(chosen))
        own.with_columns(track_number=None).write_parquet(made / f"{name}.parquet")
    _, one, *others = (made / "scene" / "sensors.toml").read_text().split("[[sensor]]")
    (made / "one.toml").write_text("[[sensor]]" + one)
    (made / "others.toml").write_text("".join("[[sensor]]" + other for other in others))
    command = ["track", str(made / "others.parquet"), "--out", str(made / "others")]
    command += ["--sensors", str(made / "others.toml")]
    assert run([*command, "--asterix", str(made / "others.ast")]) == EXIT_DONE
    command = ["convert", "asterix", str(made / "others.ast"), "--date", "2026-05-06"]
    assert run([*command, "--out", str(made / "system")]) == EXIT_DONE
    return made


def tracked(folder: Path, out: Path, *options: str, status: int = EXIT_DONE) -> dict[str, Any]:
    command = ["track", str(folder / "one.parquet"), "--sensors", str(folder / "one.toml")]
    assert run([*command, "--out", str(out), *options]) == status
    if status != EXIT_DONE:
        return {}
    figures: dict[str, Any] = json.loads((out / "report.json").read_text())["figures"]
    return figures


@pytest.mark.parametrize("reference", ["system", "system/system_tracks.parquet", "others"])
def test_system_tracks_make_the_biases_of_one_radar_observable(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], reference: str
) -> None:
    given = str(folder / reference)
    figures = tracked(folder, tmp_path / "out", "--reference", given, "--kinds", "radar")
    for parameter, true, most in (
        ("range_offset_m", OFFSET_M, 10.0),
        ("azimuth_offset_deg", AZIMUTH_DEG, 0.02),
    ):
        found = figures["final_biases"]["20-1"][parameter]
        assert found["sigma"] < most
        # The reference has biases of its own, of the order of its sigma.
        assert abs(found["estimate"] - true) < 4.0 * found["sigma"] + 0.5 * most
    clock = figures["final_biases"]["reference"]["time_offset_s"]
    assert abs(clock["estimate"]) < 4.0 * clock["sigma"] < 0.5
    counts = figures["reference"]
    reasons = ("used", "turning", "dependent", "not_measured")
    assert counts["read"] == sum(counts[name] for name in reasons)
    said = capsys.readouterr().err
    assert f"reference {given}: {counts['used']} of {counts['read']}" in said
    # Its positions have none by design.
    assert "heights may be lost" not in said
    updates = pl.read_parquet(tmp_path / "out" / "tracks.parquet")
    assert set(updates["sensor_id"].unique()) == {"20-1", "reference"}
    # The tracks can be evaluated with the sensors of the run.
    command = ["evaluate", str(tmp_path / "out"), "--truth", str(folder / "scene")]
    assert run([*command, "--json"]) == EXIT_DONE


def test_late_times_of_the_reference_are_estimated(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    late = tmp_path / "late.parquet"
    tracks = pl.read_parquet(folder / "system" / "system_tracks.parquet")
    tracks.with_columns(pl.col("time_s") + 1.0).write_parquet(late)
    found = tracked(folder, tmp_path / "imm", "--reference", str(late))["final_biases"]
    clock = found["reference"]["time_offset_s"]
    assert abs(clock["estimate"] - 1.0) < 4.0 * clock["sigma"] < 0.5
    assert abs(found["20-1"]["range_offset_m"]["estimate"] - OFFSET_M) < 15.0
    # Other filters estimate no offsets of times, and a late clock is reported.
    options = ("--reference", str(late), "--filter", "joint")
    tracked(folder, tmp_path / "joint", *options, status=EXIT_FAILED)
    assert "its clock is probably 1.0 s behind" in capsys.readouterr().err


def test_the_accuracy_of_the_reference_is_that_of_the_sensors_file(
    folder: Path, tmp_path: Path
) -> None:
    text = (folder / "one.toml").read_text()
    sigma = {}
    for metres in (20, 200):
        sensor = f'\n[[sensor]]\nid = "reference"\nkind = "mlat"\nposition_sigma_m = {metres}\n'
        own = tmp_path / f"sensors-{metres}.toml"
        own.write_text(text + sensor)
        out = tmp_path / str(metres)
        command = ["track", str(folder / "one.parquet"), "--sensors", str(own), "--out", str(out)]
        assert run([*command, "--reference", str(folder / "system")]) == EXIT_DONE
        figures = json.loads((out / "report.json").read_text())["figures"]
        sigma[metres] = figures["final_biases"]["20-1"]["range_offset_m"]["sigma"]
        assert (out / "sensors.toml").read_text().count('"reference"') == 1
    assert sigma[20] < 0.5 * sigma[200]


def test_radars_that_the_processor_reports_are_named(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    system = tmp_path / "system"
    system.mkdir()
    (system / "system_tracks.parquet").write_bytes(
        (folder / "system" / "system_tracks.parquet").read_bytes()
    )
    pl.DataFrame({"sensor_id": ["20-1", "20-9"]}).write_parquet(system / "reported_biases.parquet")
    figures = tracked(folder, tmp_path / "out", "--reference", str(system))
    assert figures["reference"]["processor_uses"] == ["20-1"]
    assert "its processor uses 20-1, whose registration errors" in capsys.readouterr().err


def test_one_of_several_processors_is_chosen(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tracks = pl.read_parquet(folder / "system" / "system_tracks.parquet")
    other = tracks.with_columns(sensor_id=pl.lit("20-9"))
    pl.concat([tracks, other]).write_parquet(tmp_path / "both.parquet")
    given = ("--reference", str(tmp_path / "both.parquet"))
    tracked(folder, tmp_path / "out", *given, status=EXIT_FAILED)
    assert "several processors (0-0, 20-9); select one with --processor" in capsys.readouterr().err
    tracked(folder, tmp_path / "out", "--processor", "20-9", status=EXIT_USAGE)
    chosen = tracked(folder, tmp_path / "out", *given, "--processor", "20-9")
    assert chosen["reference"]["read"] < len(tracks)


def test_a_reference_that_cannot_be_used_is_an_error(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    later = tmp_path / "later.parquet"
    tracks = pl.read_parquet(folder / "system" / "system_tracks.parquet")
    tracks.with_columns(pl.col("time_s") + 86_400.0).write_parquet(later)
    for reference, sentence in (
        (later, "updates can be used as a bias reference"),
        (folder / "one.parquet", "missing column state"),
        (tmp_path / "nothing", "no such"),
    ):
        out = tmp_path / "out"
        tracked(folder, out, "--reference", str(reference), status=EXIT_FAILED)
        assert sentence in capsys.readouterr().err
        assert not out.exists()
