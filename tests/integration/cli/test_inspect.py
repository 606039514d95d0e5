"""`multiradar inspect` as a user calls it: output, files and exit status."""

import itertools
import json
import math
import re
from collections import Counter
from pathlib import Path

import pytest

from multiradar.cli.main import EXIT_DONE, EXIT_FAILED, EXIT_USAGE, run
from multiradar.diagnosis.cross_sensor.agreement import seen_from
from multiradar.geodesy.wgs84 import geodetic_to_ecef
from multiradar_schemas.inspection import Inspection
from multiradar_schemas.report import Report
from multiradar_schemas.sensors.sensor import load_sensors
from support.asterix.octets import block, gps, plot_048
from support.asterix.old_edition import old_system_tracks
from support.asterix.surface_records import mlat_020, reference_019, surface_010

BEGIN_S = 28_800.0
DATE_S = 1_533_081_600.0


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "radar.ast"
    plots = [plot_048(BEGIN_S + k, azimuth_deg=90.0 * (k % 4)) for k in range(200)]
    path.write_bytes(b"".join(block(48, one) for one in plots))
    return path


def test_json_is_the_documented_model(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["inspect", str(recording), "--json"]) == EXIT_DONE
    found = Inspection.model_validate_json(capsys.readouterr().out)
    assert found.counts.read == found.counts.accepted == 200
    (sensor,) = found.sensors
    assert (sensor.sensor_id, sensor.kind, sensor.mode_s_fraction) == ("20-130", "radar", 1.0)
    assert sensor.scan_period_s == pytest.approx(4.0, abs=0.01)
    assert 'id = "20-130"' in found.sensors_toml


def test_the_text_names_sensor_category_and_site(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["inspect", str(recording)]) == EXIT_DONE
    text = capsys.readouterr().out
    for words in ("20-130", "048", "08:00:00 to 08:03:19", "The site is unknown for 20-130"):
        assert words in text


def test_the_suggestion_is_written_once(recording: Path, tmp_path: Path) -> None:
    suggestion = tmp_path / "sensors.toml"
    assert run(["inspect", str(recording), "--toml", str(suggestion)]) == EXIT_DONE
    assert "sac = 20" in suggestion.read_text(encoding="utf-8")
    assert run(["inspect", str(recording), "--toml", str(suggestion)]) == EXIT_FAILED


def test_a_table_of_sites_completes_the_suggestion(recording: Path, tmp_path: Path) -> None:
    table, suggestion = tmp_path / "sites.csv", tmp_path / "sensors.toml"
    table.write_text("sac,sic,lat_deg,lon_deg,height_m\n20,130,39.5,-0.5,250\n", encoding="utf-8")
    command = ["inspect", str(recording), "--sites", str(table), "--toml", str(suggestion)]
    assert run(command) == EXIT_DONE
    (sensor,) = load_sensors(suggestion).sensor
    assert (sensor.latitude_deg, sensor.longitude_deg, sensor.height_m) == (39.5, -0.5, 250.0)


def test_late_data_are_an_alarm(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "late.gps"
    plots = ((BEGIN_S + k + 2.0, block(48, plot_048(BEGIN_S + k))) for k in range(50))
    path.write_bytes(gps(plots))
    assert run(["inspect", str(path), "--json"]) == EXIT_DONE
    (sensor,) = Inspection.model_validate_json(capsys.readouterr().out).sensors
    assert sensor.clock is not None
    assert sensor.clock.latency_median_s == pytest.approx(2.0, abs=0.01)
    assert sensor.clock.alarm == "clock"


def test_the_page_has_a_map_and_loads_nothing(recording: Path, tmp_path: Path) -> None:
    table, page = tmp_path / "sites.csv", tmp_path / "page.html"
    table.write_text("sac,sic,lat_deg,lon_deg\n20,130,39.5,-0.5\n", encoding="utf-8")
    command = ["inspect", str(recording), "--sites", str(table), "--html", str(page)]
    assert run(command) == EXIT_DONE
    text = page.read_text(encoding="utf-8")
    for words in ("<h2>Map</h2>", "<h2>Reports over time</h2>", "20-130", "default-src 'none'"):
        assert words in text
    assert not re.search(r"<script|<link|<img|src=|@import|url\((?!#)", text)
    assert run(command) == EXIT_FAILED


def test_a_page_without_positions_has_no_map(recording: Path, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    assert run(["inspect", str(recording), "--html", str(page)]) == EXIT_DONE
    assert "<h2>Map</h2>" not in page.read_text(encoding="utf-8")


def test_counts_are_those_of_the_conversion(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = tmp_path / "radar.ast", tmp_path / "out"
    plots = [block(48, plot_048(BEGIN_S + k, azimuth_deg=90.0 * (k % 4))) for k in range(60)]
    impossible = block(48, plot_048(90_000.0))
    path.write_bytes(b"".join([*plots, plots[-1], bytes(30), impossible]))
    assert run(["convert", "asterix", str(path), "--out", str(out), "--json"]) == EXIT_DONE
    converted = Report.model_validate_json(capsys.readouterr().out)
    assert run(["inspect", str(path), "--json"]) == EXIT_DONE
    found = Inspection.model_validate_json(capsys.readouterr().out)
    assert found.counts == converted.counts
    assert found.counts.duplicate == 1
    by_code = Counter[str]()
    for one in found.rejects:
        by_code[one.code] += one.count
    assert dict(by_code) == converted.rejected_by_code


def test_a_site_is_solved_beside_dated_adsb(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    radar, flights = tmp_path / "radar.ast", tmp_path / "flights.json"
    page = tmp_path / "page.html"
    site = (math.radians(47.0), math.radians(8.0), 300.0)
    plots, rows = [], []
    for number, second in itertools.product(range(12), range(0, 240, 4)):
        address = f"4b00{number:02x}"
        latitude = 46.2 + 0.14 * number + 0.0015 * second
        longitude = 7.0 + 0.17 * (number * 7 % 12)
        height_m = 35_000 * 0.3048
        place = geodetic_to_ecef(math.radians(latitude), math.radians(longitude), height_m)
        range_m, azimuth = seen_from(site, place[None, :])
        plots.append(
            (
                second + 0.1 * number,
                plot_048(
                    BEGIN_S + second,
                    range_nm=float(range_m[0]) / 1852.0,
                    azimuth_deg=math.degrees(float(azimuth[0])) % 360.0,
                    address=address,
                ),
            )
        )
        rows.append(
            {
                "timestamp": (DATE_S + BEGIN_S + second + 1.5) * 1000,
                "icao24": address,
                "latitude": latitude + 0.0015 * 1.5,
                "longitude": longitude,
                "altitude": 35_000,
            }
        )
    radar.write_bytes(b"".join(block(48, one) for _, one in sorted(plots)))
    flights.write_text(json.dumps(rows), encoding="utf-8")
    command = ["inspect", str(radar), str(flights), "--html", str(page), "--json"]
    assert run(command) == EXIT_DONE
    found = Inspection.model_validate_json(capsys.readouterr().out)
    assert found.first_s is not None
    assert found.first_s >= DATE_S
    solved = found.sensors[0].site
    assert solved is not None
    assert solved.sigma_m is not None
    assert solved.sigma_m < 100.0
    assert solved.latitude_deg == pytest.approx(47.0, abs=0.002)
    assert solved.longitude_deg == pytest.approx(8.0, abs=0.003)


def test_the_end_of_a_recording_after_midnight_is_on_its_second_day(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "night.ast"
    times_s = (86_340.0 + 4.0 * turn for turn in range(30))
    path.write_bytes(b"".join(block(48, plot_048(time_s % 86_400.0)) for time_s in times_s))
    assert run(["inspect", str(path)]) == EXIT_DONE
    # Of the table of sensors.
    said = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert "23:59:00 00:00:56 (day 2)" in said


def test_several_files_are_one_recording(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    second = tmp_path / "later.ast"
    second.write_bytes(block(48, plot_048(BEGIN_S + 300.0)))
    assert run(["inspect", str(recording), str(second), "--json"]) == EXIT_DONE
    found = Inspection.model_validate_json(capsys.readouterr().out)
    assert len(found.files) == 2
    assert [one.reports for one in found.sensors] == [201]
    assert found.sensors[0].gaps == 1


def test_a_mostly_unreadable_recording_fails_with_the_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "old.ast"
    path.write_bytes(b"".join(old_system_tracks(60)))
    assert run(["inspect", str(path)]) == EXIT_FAILED
    error = capsys.readouterr().err
    assert "old.ast: 100% of its octets could not be read" in error
    assert "no known edition" in error


@pytest.mark.parametrize("content", [b"", bytes(4000), b"PAR1" + bytes(90), b"\x1f\x8b\x08abc"])
def test_what_is_no_recording_fails_in_one_sentence(
    content: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "file"
    path.write_bytes(content)
    assert run(["inspect", str(path)]) == EXIT_FAILED
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("multiradar: ")


def test_wrong_usage() -> None:
    assert run(["inspect", "--edition", "nonsense", "file"]) == EXIT_USAGE


def test_a_missing_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["inspect", str(tmp_path / "nothing")]) == EXIT_FAILED
    assert "No such file" in capsys.readouterr().err


def test_local_coordinates_need_a_reference_point(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mlat.ast"
    path.write_bytes(block(20, *(mlat_020(BEGIN_S + k, local=(100.0 * k, 0)) for k in range(20))))
    assert run(["inspect", str(path)]) == EXIT_DONE
    assert "0-107: 100% of its reports have local coordinates only" in capsys.readouterr().out
    assert run(["inspect", str(path), "--json"]) == EXIT_DONE
    (sensor,) = (found := Inspection.model_validate_json(capsys.readouterr().out)).sensors
    assert (sensor.local_fraction, sensor.located_fraction, sensor.site) == (1.0, 0.0, None)
    assert "latitude_deg = nan              # to fill in: reference point" in found.sensors_toml
    command = ["inspect", str(path), "--reference", "0-107=41.297,2.078", "--json"]
    assert run(command) == EXIT_DONE
    (sensor,) = (found := Inspection.model_validate_json(capsys.readouterr().out)).sensors
    assert (sensor.located_fraction, found.counts.rejected) == (1.0, 0)
    assert sensor.site is not None
    assert (sensor.site.latitude_deg, sensor.site.longitude_deg) == (41.297, 2.078)
    assert run([*command[:3], "0-107=41.297"]) == EXIT_USAGE


def test_a_reported_reference_point_and_a_surface_radar_are_suggested(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "airport.ast"
    path.write_bytes(
        block(19, reference_019(BEGIN_S, 41.297, 2.078))
        + block(20, mlat_020(BEGIN_S, local=(0.0, 0.0)))
        + block(10, surface_010(BEGIN_S, polar=(900, 20.0)))
    )
    assert run(["inspect", str(path), "--json"]) == EXIT_DONE
    found = Inspection.model_validate_json(capsys.readouterr().out)
    sites = {one.sensor_id: one.site for one in found.sensors}
    assert sites["0-7"] is None
    assert sites["0-107"] is not None
    assert sites["0-107"].source.startswith("items 019/600")
    assert "latitude_deg = 41.297000" in found.sensors_toml
    assert "range_sigma_m = 10.0" in found.sensors_toml


def positions(path: Path, start_s: float) -> Path:
    """Write ADS-B positions of a minute."""
    rows = [f"{start_s + 5 * k},4b1805,{46.0 + 0.01 * k},7.0,10000" for k in range(12)]
    header = "timestamp,icao24,latitude,longitude,altitude"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


def test_recordings_of_different_days_are_named(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = positions(tmp_path / "a.csv", DATE_S)
    again = positions(tmp_path / "b.csv", DATE_S + 366.0 * 86_400.0)
    assert run(["inspect", str(first), str(again)]) == EXIT_DONE
    assert "times probably jump by 366 days" in capsys.readouterr().err
    assert run(["inspect", str(recording), str(first)]) == EXIT_DONE
    assert capsys.readouterr().err == ""


def test_repeated_positions_are_not_unreadable(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A receiver that repeats the last position with a new time, as some feeds do."""
    header = "timestamp,icao24,latitude,longitude,altitude,groundspeed"
    rows = [f"{DATE_S + k},4b1805,{46.0 + 0.002 * (k // 4 * 4)},7.0,10000,450" for k in range(120)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    assert run(["inspect", str(path), "--json"]) == EXIT_DONE
    found = Inspection.model_validate_json(capsys.readouterr().out)
    assert [one.code for one in found.rejects] == ["DUPLICATE"]
    assert 2 * found.rejects[0].count > found.counts.read
    assert run(["convert", "adsb", str(path), "--out", str(tmp_path / "out")]) == EXIT_DONE
