"""Mistakes of every kind end `track` and `convert` with status 1 and a diagnosis by sensor."""

import json
import math
import shutil
from pathlib import Path

import polars as pl
import pytest

from multiradar.cli.main import run
from multiradar.cli.playback.view import run_files
from multiradar.runtime.recorded.run import RecordedRun
from multiradar.runtime.recorded.view import RecordedView
from multiradar.simulation.scenario.toml_text import toml_text
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from support.inputs.mistaken import RADARS, START_S, Edit, Recording, recording
from support.paths import SAMPLE

NAME = "1-10"
RANGE, AZIMUTH = pl.col("range_m"), pl.col("azimuth_deg")


def tracked(one: Recording, folder: Path) -> tuple[int, list[dict[str, str]]]:
    """Track a recording; return the status and the diagnoses of its report."""
    missing = [
        pl.lit(None, kind).alias(name)
        for name, kind in MEASUREMENT_SCHEMA.items()
        if name not in one.frame.columns
    ]
    frame = one.frame.with_columns(missing).select(MEASUREMENT_SCHEMA.names())
    frame.write_parquet(folder / "measurements.parquet")
    tables = [sensor.model_dump(exclude_none=True, exclude={"bias"}) for sensor in one.sensors]
    (folder / "sensors.toml").write_text(toml_text({"sensor": tables}))
    out = folder / "out"
    status = run(
        [
            "track", str(folder / "measurements.parquet"), "--sensors",
            str(folder / "sensors.toml"), "--out", str(out), "--workers", "1",
        ]
    )  # fmt: skip
    report = json.loads((out / "report.json").read_text())
    assert (out / "tracks.parquet").is_file()
    return status, report["figures"]["diagnoses"]


@pytest.mark.parametrize("named", [True, False])
def test_a_correct_recording_ends_with_status_0(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], *, named: bool
) -> None:
    assert tracked(recording(named=named), tmp_path) == (0, [])
    # With a cold cache the progress of the compilation is shown, too.
    said = capsys.readouterr().err.splitlines()
    assert [line for line in said if "compiling kernels (first use):" not in line] == []


def test_the_diagnosis_of_a_run_is_viewed_at_every_time(tmp_path: Path) -> None:
    status, found = tracked(recording().changed(NAME, range_m=RANGE / 1e3), tmp_path)
    assert (status, [one["code"] for one in found]) == (1, ["range_unit"])
    files = run_files(tmp_path / "out", tmp_path / "measurements.parquet", [tmp_path / "out"])
    viewed = RecordedView([RecordedRun(files, tmp_path)])
    assert viewed.status()["diagnoses"] == found
    for at_s in (None, START_S + 60.0):
        diagnoses = {one["id"]: one["diagnoses"] for one in viewed.sensors(at_s)}
        assert diagnoses == {NAME: found, "2-10": [], "3-10": []}


def test_a_warning_ends_with_status_0(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, found = tracked(recording().configured(NAME, range_sigma_m=160.0), tmp_path)
    assert status == 0
    assert [(one["code"], one["severity"]) for one in found] == [("noise", "warning")]
    assert "1-10: range_sigma_m is probably too large" in capsys.readouterr().err


# Plots without identity form separate tracks, none of which is lost.
@pytest.mark.parametrize("named", [True, False])
@pytest.mark.parametrize(
    ("edit", "code", "words"),
    [
        (lambda one: one.changed(NAME, range_m=RANGE / 1e3), "range_unit", "in kilometres"),
        (
            lambda one: one.changed(NAME, azimuth_deg=(AZIMUTH + 90.0) % 360.0),
            "azimuth_offset", "off by +89",
        ),
        (
            lambda one: one.configured(NAME, latitude_deg=RADARS[NAME][0][0] + 0.045),
            "site", "of the configured site",
        ),
    ],
)  # fmt: skip
def test_a_mistake_is_reported_and_ends_with_status_1(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    edit: Edit,
    code: str,
    words: str,
    *,
    named: bool,
) -> None:
    status, found = tracked(edit(recording(named=named)), tmp_path)
    assert status == 1
    assert [(one["sensor_id"], one["code"]) for one in found] == [(NAME, code)]
    assert words in found[0]["sentence"]
    assert capsys.readouterr().err == f"multiradar: {found[0]['sentence']}\n"


def test_noise_far_below_its_sigma_raises_an_alarm_and_is_reported(tmp_path: Path) -> None:
    status, found = tracked(recording().configured(NAME, range_sigma_m=4000.0), tmp_path)
    assert status == 1
    assert [(one["sensor_id"], one["code"]) for one in found] == [(NAME, "noise")]
    health = pl.read_parquet(tmp_path / "out" / "health.parquet").filter(sensor_id=NAME)
    assert health["alarms"].str.contains("noise").any()


def test_sensors_of_another_recording_are_reported_before_rejects(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one = recording()
    for number, name in enumerate(RADARS):
        one = one.configured(name, id=f"9{number}-1")
    status, found = tracked(one, tmp_path)
    assert status == 1
    assert found[0]["code"] == "sensors_of_another_recording"
    first, second = capsys.readouterr().err.splitlines()
    assert first == f"multiradar: {found[0]['sentence']}"
    assert "UNKNOWN_SENSOR" in second


def test_a_site_on_another_continent_is_rejected_with_its_sensor(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sensors = (SAMPLE.parent / "sensors-vid-sample.toml").read_text()
    (tmp_path / "sensors.toml").write_text(sensors.replace("46.4247", "-46.4247"))
    given = [str(SAMPLE), "--sensors", str(tmp_path / "sensors.toml")]
    assert run(["track", *given, "--out", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().err
    assert "26-10: its site (-46.4247, 6.0994) is 9138 km from the site of any other sensor" in said
    assert "latitude_deg of its site probably has the wrong sign" in said


def dump_with(folder: Path, column: str, factor: float) -> Path:
    """Write the sample into a folder with another unit in a column of its plots."""
    dump = folder / "dump"
    shutil.copytree(SAMPLE, dump)
    rows = [line.split("\t") for line in (dump / "plots.txt").read_text().splitlines()]
    place = rows[0].index(column)
    for row in rows[1:]:
        if len(row) == len(rows[0]) and row[place].replace(".", "").isdigit():
            row[place] = f"{float(row[place]) * factor:.6f}"
    (dump / "plots.txt").write_text("".join("\t".join(row) + "\n" for row in rows))
    return dump


# In these units most of a circle is rejected: azimuths end at 360.
@pytest.mark.parametrize(
    ("per_circle", "unit"),
    [
        (6400.0, "mils (6400 to a circle), with a maximum of 6"),
        (2000.0 * math.pi, "milliradians, with a maximum of 62"),
        (4096.0, "counts of 4096 per revolution, with a maximum of 40"),
        (400.0, "gradians"),
    ],
)
def test_convert_reports_the_unit_of_azimuths_in_a_dump(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], per_circle: float, unit: str
) -> None:
    dump, out = dump_with(tmp_path, "azimuth", per_circle / 360.0), tmp_path / "out"
    assert run(["convert", "vid", str(dump), str(out), "--kinds", "plots"]) == 1
    said = [line for line in capsys.readouterr().err.splitlines() if "azimuths" in line]
    assert [line.split()[1] for line in said] == ["26-10:", "35-10:", "41-1:", "41-10:"]
    assert f"its azimuths are probably in {unit}" in said[0]
    assert len({line.partition("probably in ")[2][:8] for line in said}) == 1


def test_convert_reports_ranges_in_kilometres_in_a_dump(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dump, out = dump_with(tmp_path, "range", 1e-3), tmp_path / "out"
    assert run(["convert", "vid", str(dump), str(out), "--kinds", "plots"]) == 1
    said = capsys.readouterr().err.splitlines()
    assert {line.split()[1] for line in said} == {"26-10:", "35-10:", "41-1:", "41-10:"}
    assert all("ranges are probably in kilometres" in line for line in said)
    assert (out / "measurements.parquet").is_file()


@pytest.mark.parametrize(
    ("name", "other"), [("plots.txt", "tracks.txt"), ("tracks.txt", "plots.txt")]
)
def test_convert_reports_the_truncated_file_of_a_dump(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, other: str
) -> None:
    dump, out = tmp_path / "dump", tmp_path / "out"
    shutil.copytree(SAMPLE, dump)
    text = (dump / name).read_bytes()
    (dump / name).write_bytes(text[: len(text) // 2])
    assert run(["convert", "vid", str(dump), str(out), "--kinds", "plots"]) == 1
    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith(f"multiradar: {name}: probably truncated: it ends at 8:1")
    assert f"but {other} continues until 8:" in said
    assert (out / "measurements.parquet").is_file()
