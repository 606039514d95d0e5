"""What the demo shows: truth, trend, and distances between reports and tracks."""

import json
import math
from pathlib import Path

import polars as pl
import pytest

from multiradar.cli.demo_accuracy import EARTH_RADIUS_M, position_accuracy
from multiradar.cli.demo_truth import read_truth, sample_folder
from multiradar.cli.demo_view import BiasLine, Scene, bias_table, plain_head, plain_line, trend
from multiradar.errors import InputError
from multiradar_schemas.sensor import parse_sensors


def test_the_truth_of_the_sample_makes_a_sensors_file_without_the_biases() -> None:
    truth = read_truth(sample_folder())
    assert truth.date == "2018-08-01"
    assert truth.biases["26-10", "range_offset_m"] == 185.0
    assert truth.sensors_toml is not None
    assert "185" not in truth.sensors_toml
    ids = [sensor.id for sensor in parse_sensors(truth.sensors_toml).sensor]
    assert ids == ["26-10", "35-10", "41-10", "41-1", "adsb"]


def test_a_dump_without_truth_has_none_and_a_broken_one_is_told(tmp_path: Path) -> None:
    assert read_truth(tmp_path).biases == {}
    (tmp_path / "truth.json").write_text(json.dumps({"radars": [{"source": 1}]}))
    with pytest.raises(InputError, match=r"truth\.json: expected the truth"):
        read_truth(tmp_path)


def _update(time_s: float, north_m: float = 0.0) -> dict[str, float]:
    return {
        "time_s": time_s,
        "track_number": 7,
        "latitude_deg": 50.0 + math.degrees(north_m / EARTH_RADIUS_M),
        "longitude_deg": 10.0,
        "speed_mps": 200.0,
        "heading_deg": 90.0,
    }


def _report(time_s: float, east_m: float, north_m: float) -> dict[str, float]:
    east = math.degrees(east_m / (EARTH_RADIUS_M * math.cos(math.radians(50.0))))
    north = math.degrees(north_m / EARTH_RADIUS_M)
    return {
        "time_s": time_s,
        "track_number": 7,
        "latitude_deg": 50.0 + north,
        "longitude_deg": 10.0 + east,
    }


def test_a_track_is_moved_on_to_the_time_of_the_report() -> None:
    updates = pl.DataFrame([_update(0.0), _update(100.0)])
    # 5 s at 200 m/s to the east, then 30 m east and 40 m north of that.
    accuracy = position_accuracy(pl.DataFrame([_report(105.0, 1030.0, 40.0)]), updates)
    assert accuracy is not None
    assert accuracy.compared == 1
    assert accuracy.median_m == pytest.approx(50.0, abs=0.01)
    assert accuracy.rms_m == pytest.approx(50.0, abs=0.01)


@pytest.mark.parametrize("time_s", [30.0, 120.0])
def test_a_young_or_an_old_track_is_not_compared(time_s: float) -> None:
    updates = pl.DataFrame([_update(0.0), _update(29.0), _update(100.0)])
    assert position_accuracy(pl.DataFrame([_report(time_s, 0.0, 0.0)]), updates) is None


def test_the_trend_falls_with_its_values_and_fits_its_width() -> None:
    assert trend([]) == ""
    assert trend([2.0, 2.0]) == "▁▁"
    falling = trend([1000.0 * 0.9**n for n in range(100)], width=20)
    assert len(falling) <= 20
    assert falling[0] == "█"
    assert falling[-1] == "▁"
    assert list(falling) == sorted(falling, reverse=True)


def test_lines_show_the_estimate_with_its_sigma_and_the_table_its_error() -> None:
    line = BiasLine("26-10", "range_offset_m", 185.0)
    unknown = BiasLine("26-10", "azimuth_offset_deg", None)
    scene = Scene(total=10, lines=[line, unknown])
    assert plain_line(scene).startswith("--:--:--")
    line.look(183.5, 2.0)
    scene.data_time_s = 1533110700.0
    assert "08:05:00" in plain_line(scene)
    assert "+183.5 ± 2.0" in plain_line(scene)
    assert "+185.0" in plain_head(scene.lines)[1]
    assert line.error == -1.5
    assert unknown.error is None
    assert bias_table(scene.lines).row_count == 2


def test_without_reports_or_without_tracks_there_is_nothing_to_compare() -> None:
    columns = ["time_s", "track_number", "latitude_deg", "longitude_deg"]
    reports = pl.DataFrame({name: [1.0] for name in columns})
    updates = reports.with_columns(speed_mps=pl.lit(0.0), heading_deg=pl.lit(0.0))
    assert position_accuracy(reports, pl.DataFrame()) is None
    assert position_accuracy(reports.clear(), updates) is None
