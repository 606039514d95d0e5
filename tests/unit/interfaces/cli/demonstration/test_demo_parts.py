"""The display of the demo: truth, trend, and distances between reports and tracks."""

import io
import json
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import polars as pl
import pytest

from multiradar.cli.demonstration import service as demo_service
from multiradar.cli.demonstration.view import (
    BiasLine,
    View,
    bias_table,
    plain_head,
    plain_line,
    trend,
)
from multiradar.errors import InputError
from multiradar.toolbox.evaluation.accuracy import position_accuracy
from multiradar.toolbox.evaluation.dump_truth import read_truth, sample_folder
from multiradar_schemas.sensors.sensor import parse_sensors


def test_the_truth_of_the_sample_makes_a_sensors_file_without_the_biases() -> None:
    truth = read_truth(sample_folder())
    assert truth.date == "2018-08-01"
    assert truth.biases["26-10", "range_offset_m"] == 185.0
    assert truth.sensors_toml is not None
    assert "185" not in truth.sensors_toml
    ids = [sensor.id for sensor in parse_sensors(truth.sensors_toml).sensor]
    assert ids == ["26-10", "35-10", "41-10", "41-1", "adsb"]


def test_a_dump_may_lack_truth_and_an_invalid_one_is_rejected(tmp_path: Path) -> None:
    assert read_truth(tmp_path).biases == {}
    (tmp_path / "truth.json").write_text(json.dumps({"radars": [{"source": 1}]}))
    with pytest.raises(InputError, match=r"truth\.json: not a valid truth file: missing"):
        read_truth(tmp_path)


@pytest.mark.parametrize(
    ("output", "document"),
    [
        ('{"http": "http://127.0.0.1:1"}\n{"other": 2}\n', {"http": "http://127.0.0.1:1"}),
        ("", None),
        ("a warning\n", None),
        ("[1]\n", None),
    ],
)
def test_a_service_prints_its_addresses_in_its_first_line(
    output: str, document: dict[str, str] | None
) -> None:
    process = cast("subprocess.Popen[str]", SimpleNamespace(stdout=io.StringIO(output)))
    assert demo_service._first_line(process, lambda: None) == document


@pytest.mark.parametrize(("log", "last"), [("", ""), ("\n", ""), ("one\ntwo\n\n", "two")])
def test_the_last_line_of_the_log_says_what_is_waited_for(
    tmp_path: Path, log: str, last: str
) -> None:
    (tmp_path / "log").write_text(log)
    assert demo_service._last_line(tmp_path / "log") == last


#: Metres per degree of latitude and of longitude at 50° north on WGS 84.
NORTH_M, EAST_M = 111_229.0, 71_696.0


def _updates(times: list[float], north_m: float = 0.0) -> pl.DataFrame:
    """Return an aircraft that flies east at 200 m/s, offset to the north."""
    return pl.DataFrame(
        {
            "time_s": times,
            "track_id": 1,
            "latitude_deg": 50.0 + north_m / NORTH_M,
            "longitude_deg": [10.0 + 200.0 * t / EAST_M for t in times],
            "height_m": 0.0,
            "speed_mps": 200.0,
            "heading_deg": 90.0,
            "position_sigma_m": 50.0,
            "velocity_sigma_mps": 5.0,
            "state": "confirmed",
            "sensor_id": "radar",
        }
    )


def _reports(times: list[float]) -> pl.DataFrame:
    places = _updates(times).select("time_s", "latitude_deg", "longitude_deg", "height_m")
    return places.with_columns(track_number=7, mode_s_address=pl.lit(None, pl.String))


def test_settled_updates_are_compared_between_reports() -> None:
    reports = _reports([10.0 * n for n in range(20)])
    updates = _updates([4.0 * n for n in range(40)], north_m=50.0)
    accuracy = position_accuracy(reports, updates)
    assert accuracy is not None
    # From 60 s to 156 s.
    assert accuracy.compared == 25
    assert accuracy.median_m == pytest.approx(50.0, abs=0.1)
    assert accuracy.rms_m == pytest.approx(50.0, abs=0.1)


def test_a_young_track_is_not_compared() -> None:
    reports = _reports([10.0 * n for n in range(20)])
    assert position_accuracy(reports, _updates([4.0 * n for n in range(14)])) is None


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
    view = View(total=10, lines=[line, unknown])
    assert plain_line(view).startswith("--:--:--")
    line.update(183.5, 2.0)
    view.data_time_s = 1533110700.0
    assert "08:05:00" in plain_line(view)
    assert "+183.5 ± 2.0" in plain_line(view)
    assert plain_head(view.lines, dated=True)[0].startswith("UTC       tracks ")
    assert plain_head(view.lines, dated=False)[0].startswith("time      tracks ")
    assert "+185.0" in plain_head(view.lines, dated=True)[1]
    assert line.error == -1.5
    assert unknown.error is None
    assert bias_table(view.lines).row_count == 2


@pytest.mark.parametrize(
    ("estimate", "colour"),
    [(189.0, "green"), (181.0, "green"), (189.1, "yellow"), (180.9, "yellow")],
)
def test_an_error_within_two_sigmas_is_green(estimate: float, colour: str) -> None:
    line = BiasLine("26-10", "range_offset_m", 185.0)
    line.update(estimate, 2.0)
    assert [*bias_table([line]).columns[5].cells] == [f"[{colour}]{estimate - 185.0:+.1f} m[/]"]


def test_without_reports_identities_or_confirmed_tracks_nothing_is_compared() -> None:
    reports, updates = _reports([0.0, 10.0]), _updates([0.0, 4.0])
    assert position_accuracy(reports, pl.DataFrame()) is None
    assert position_accuracy(reports.clear(), updates) is None
    nameless = reports.with_columns(track_number=pl.lit(None, pl.Int64))
    assert position_accuracy(nameless, updates) is None
    assert position_accuracy(reports, updates.with_columns(state=pl.lit("tentative"))) is None
