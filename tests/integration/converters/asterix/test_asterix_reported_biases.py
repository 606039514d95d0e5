"""Biases that another processor reports (063): a table, figures, and priors for `sensors.toml`."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, run
from multiradar_schemas.sensors.sensor import parse_sensors
from support.asterix.octets import block, plot_048, record, time_of_day

BEGIN_S = 86_400.0 - 8.0
RANGE_BIT_M, AZIMUTH_BIT_DEG = 1852 / 128, 360 / 65536


def status(
    seconds: float, sensor: str, range_bits: int, azimuth_bits: int, **others: tuple[int, str]
) -> bytes:
    """Write a status of category 063 with a gain of 0 and the biases of secondary plots."""
    items = [
        (1, "14fa"),
        (3, time_of_day(seconds % 86_400)),
        (4, sensor),
        (7, f"0000 {range_bits & 0xFFFF:04x}"),
        (8, f"{azimuth_bits & 0xFFFF:04x}"),
    ]
    return record(*sorted([*items, *others.values()]))


def block_of_status(k: int) -> bytes:
    """Write statuses of the radars 20/130 and 20/131."""
    return block(
        63,
        status(BEGIN_S + 4.0 * k, "1482", 6 - (k < 2), -28),
        status(BEGIN_S + 4.0 * k, "1483", -4, 9, clock=(6, "0032"), primary=(9, "00140002")),
    )


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Write plots of the radar 20/130, and statuses of it and of 20/131 over midnight."""
    rows = [block_of_status(k) for k in range(4)]
    plots = [
        block(48, plot_048((BEGIN_S + 4.0 * k) % 86_400, azimuth_deg=90.0 + k)) for k in range(4)
    ]
    path = tmp_path / "recording.ast"
    path.write_bytes(b"".join(rows + plots))
    return path


def converted(recording: Path, capsys: pytest.CaptureFixture[str]) -> tuple[Path, str]:
    out = recording.parent / "converted"
    assert run(["convert", "asterix", str(recording), "--out", str(out)]) == EXIT_DONE
    return out, capsys.readouterr().out


def of(reported: list[dict[str, Any]], sensor: str) -> dict[str, dict[str, Any]]:
    return {one["parameter"]: one for one in reported if one["sensor_id"] == sensor}


def test_reported_biases_are_a_table_in_our_parameters(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, text = converted(recording, capsys)
    table = pl.read_parquet(out / "reported_biases.parquet")
    ranges = table.filter(sensor_id="20-130", parameter="range_offset_m")
    assert ranges["time_s"].to_list() == [BEGIN_S + 4.0 * k for k in range(4)]
    assert ranges["estimate"].to_list() == [k * RANGE_BIT_M for k in (5, 5, 6, 6)]
    assert table["processor_id"].unique().to_list() == ["20-250"]
    clock = table.filter(parameter="time_offset_s")["estimate"].unique().to_list()
    assert clock == [pytest.approx(0.05)]
    assert "20-130: range_offset_m +86.81, azimuth_offset_deg -0.1538" in text
    # A gain of 0 is not estimated.
    assert ", range_gain" not in text


def test_reported_biases_are_figures_of_the_report_and_of_an_inspection(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, _ = converted(recording, capsys)
    report = json.loads((out / "report.json").read_text())
    assert {"file": "reported_biases.parquet", "rows": 36} in report["outputs"]
    found = report["figures"]["reported_biases"]
    own = of(found, "20-130")["range_offset_m"]
    assert (own["estimate"], own["reports"]) == (6 * RANGE_BIT_M, 4)
    assert own["spread"] == pytest.approx(RANGE_BIT_M * 0.5**0.5, rel=1e-5)
    assert own["prior_sigma"] == pytest.approx(22.9, abs=0.1)
    assert of(found, "20-131")["psr_range_gain"]["prior_sigma"] is None
    assert run(["inspect", str(recording), "--json"]) == EXIT_DONE
    inspected = json.loads(capsys.readouterr().out)["reported_biases"]
    assert of(inspected, "20-130")["range_offset_m"]["estimate"] == own["estimate"]
    assert run(["inspect", str(recording)]) == EXIT_DONE
    assert "Biases reported by another tracker (063)" in capsys.readouterr().out


def test_biases_in_the_files_of_two_recorders_count_once_in_order_of_time(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The second file contains the first two reports of the first one."""
    second = recording.with_name("second.ast")
    second.write_bytes(recording.read_bytes()[: recording.read_bytes().find(block_of_status(2))])
    out, files = recording.parent / "converted", [str(recording), str(second)]
    assert run(["convert", "asterix", *files, "--out", str(out)]) == EXIT_DONE
    capsys.readouterr()
    assert run(["inspect", *files, "--json"]) == EXIT_DONE
    for found in (
        json.loads((out / "report.json").read_text())["figures"]["reported_biases"],
        json.loads(capsys.readouterr().out)["reported_biases"],
    ):
        own = of(found, "20-130")["range_offset_m"]
        assert (own["estimate"], own["reports"]) == (6 * RANGE_BIT_M, 4)
    table = pl.read_parquet(out / "reported_biases.parquet")
    assert table.height == 36
    assert table["time_s"].is_sorted()


def test_reported_biases_are_offered_as_priors(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, _ = converted(recording, capsys)
    text = (out / "sensors.toml").read_text()
    radar, other = text.split("# 20-131: no measurements in this recording")
    assert other.count("prior_sigma") == 3
    given = re.sub(r"^# (bias\.\w+ = \{ prior = )", r"\1", radar, flags=re.MULTILINE)
    for name in ("latitude_deg", "longitude_deg", "height_m"):
        given = given.replace(f"{name} = nan", f"{name} = 40.0")
    (sensor,) = parse_sensors(given).sensor
    biases = {one.parameter: one for one in sensor.estimated_biases()}
    assert biases["range_offset_m"].prior == pytest.approx(6 * RANGE_BIT_M, abs=0.1)
    assert biases["range_offset_m"].prior_sigma == pytest.approx(22.9, abs=0.1)
    assert biases["azimuth_offset_deg"].prior == pytest.approx(-28 * AZIMUTH_BIT_DEG, abs=1e-4)


def test_system_tracks_alone_have_times(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [
        record((1, "14fa"), (4, time_of_day(28_800.0 + 4.0 * k)), (5, "00" * 8), (12, "0001"))
        for k in range(3)
    ]
    (tmp_path / "recording.ast").write_bytes(block(62, *rows))
    out, text = converted(tmp_path / "recording.ast", capsys)
    assert "times: 08:00:00 to 08:00:08" in text
    assert not (out / "reported_biases.parquet").exists()


def test_biases_reported_after_midnight_are_on_the_day_of_the_plots(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Plots of each minute from 20:00 on, statuses from 0:30 on."""
    times = 72_000.0 + 60.0 * np.arange(300)
    path = tmp_path / "recording.ast"
    path.write_bytes(
        b"".join(
            block(48, plot_048(time % 86_400, azimuth_deg=90.0))
            + (block(63, status(time % 86_400, "1482", 6, -28)) if time >= 88_200.0 else b"")
            for time in times.tolist()
        )
    )
    out, _ = converted(path, capsys)
    table = pl.read_parquet(out / "reported_biases.parquet")
    assert table["time_s"].min() == 88_200.0
    assert table["time_s"].max() == times[-1]
