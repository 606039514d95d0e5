"""Surface radar and multilateration with local coordinates, and the accuracy of positions."""

import json
import math
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import polars as pl
import pyproj
import pytest

from multiradar.cli.main import EXIT_DONE, EXIT_FAILED, run
from multiradar_converters.inspection.recordings import InspectionOptions, inspect
from multiradar_schemas.sensors.sensor import load_sensors
from support.asterix.octets import block, plot_001, plot_048
from support.asterix.surface_records import (
    ADSB,
    MAGNETIC_LOOP,
    MODE_S_MLAT,
    MULTILATERATION,
    adsb_021,
    adsb_021_old,
    mlat_020,
    reference_019,
    surface_010,
    update_cycle_010,
)

POINT = (41.297, 2.078)
REFERENCE = f"0-107={POINT[0]},{POINT[1]}"
SITE = f"""
[[sensor]]
kind = "mlat"
sac = 0
sic = 107
latitude_deg = {POINT[0]}
longitude_deg = {POINT[1]}
"""
Convert = Callable[..., Any]


@pytest.fixture
def convert(tmp_path: Path) -> Convert:
    """Convert files of the given contents; the result is the table and the report."""

    def converted(*contents: bytes, options: tuple[str, ...] = (), status: int = EXIT_DONE) -> Any:
        files = []
        for number, content in enumerate(contents):
            files.append(tmp_path / f"recording-{number}.ast")
            files[-1].write_bytes(content)
        out = tmp_path / "out"
        command = ["convert", "asterix", *map(str, files), "--out", str(out), *options]
        assert run(command) == status
        report = json.loads((out / "report.json").read_text())
        return pl.read_parquet(out / "measurements.parquet"), report, out

    return converted


def expected(x: float, y: float) -> tuple[float, float]:
    plane = pyproj.Proj(proj="sterea", lat_0=POINT[0], lon_0=POINT[1], ellps="WGS84")
    longitude, latitude = plane(x, y, inverse=True)
    return latitude, longitude


def position(table: pl.DataFrame, row: int = 0) -> tuple[float, float]:
    return table["latitude_deg"][row], table["longitude_deg"][row]


def test_a_surface_radar_measures_range_and_azimuth_on_the_ground(convert: Convert) -> None:
    reports = [
        surface_010(1.0, polar=(1063, 219.375), local=(-673, -823)),
        update_cycle_010(1.5),
        # Local coordinates of a radar are at its antenna.
        surface_010(2.0, local=(300, -400)),
        surface_010(3.0, status="02"),
    ]
    table, report, out = convert(block(10, *reports))
    assert table["kind"].to_list() == ["radar", "radar"]
    assert table["range_m"].to_list() == [1063.0, 500.0]
    assert table["azimuth_deg"].to_list() == pytest.approx([219.375, 143.130102])
    assert table["on_ground"].to_list() == [True, True]
    assert table["detection"].to_list() == ["psr", "psr"]
    assert report["figures"]["left_out"]["no_position"] == 1
    text = (out / "sensors.toml").read_text()
    assert "range_sigma_m = 10.0            # typical of a surface movement radar" in text


@pytest.mark.parametrize("source", ["option", "sensors", "recording"])
def test_multilateration_is_located_by_its_reference_point(
    convert: Convert, tmp_path: Path, source: str
) -> None:
    reports = block(20, mlat_020(1.0, local=(-1360.5, 804.0)))
    options: tuple[str, ...] = ()
    if source == "option":
        options = ("--reference", REFERENCE)
    elif source == "sensors":
        (tmp_path / "site.toml").write_text(SITE)
        options = ("--sensors", str(tmp_path / "site.toml"))
    else:
        reports += block(19, reference_019(0.5, *POINT))
    table, report, out = convert(reports, options=options)
    assert table["kind"].to_list() == ["mlat"]
    assert position(table) == pytest.approx(expected(-1360.5, 804.0), abs=2e-7)
    assert report["counts"]["rejected"] == 0
    sensor = load_sensors(out / "sensors.toml").sensor[0]
    assert (sensor.latitude_deg, sensor.longitude_deg) == pytest.approx(POINT, abs=1e-6)


def test_the_option_takes_precedence_over_sensors_and_recording(
    convert: Convert, tmp_path: Path
) -> None:
    (tmp_path / "site.toml").write_text(SITE.replace("41.297", "40.0"))
    reports = block(19, reference_019(0.5, 39.0, 2.0)) + block(20, mlat_020(1.0, local=(0, 0)))
    options = ("--sensors", str(tmp_path / "site.toml"), "--reference", REFERENCE)
    table, _, _ = convert(reports, options=options)
    assert position(table) == pytest.approx(POINT, abs=1e-9)


def test_a_position_of_its_own_needs_no_reference_point(convert: Convert) -> None:
    table, _, _ = convert(block(20, mlat_020(1.0, local=(9000, 9000), position=(41.5, 2.25))))
    assert position(table) == pytest.approx((41.5, 2.25), abs=1e-5)


def test_a_missing_reference_point_is_named_with_what_to_do(
    convert: Convert, capsys: pytest.CaptureFixture[str]
) -> None:
    reports = block(20, mlat_020(1.0, local=(0, 0)), mlat_020(2.0, position=(41.5, 2.25)))
    table, report, out = convert(reports, status=EXIT_FAILED)
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert "1 reports of 0-107 have local coordinates only" in error
    assert "--reference 0-107=LATITUDE,LONGITUDE" in error
    assert (table.height, report["counts"]["rejected"]) == (1, 1)
    assert report["figures"]["unreferenced"] == {"0-107": 1}
    assert report["counts"]["read"] == report["counts"]["accepted"] + report["counts"]["rejected"]
    reject = json.loads((out / "rejects.ndjson").read_text())
    assert (reject["code"], reject["reason"][:22]) == ("MISSING_FIELD", "local coordinates only")


def test_a_reported_site_of_zero_is_no_reference_point(convert: Convert) -> None:
    """Regression: positions beside 0, 0 were measurements, and 0, 0 was the site of the sensor."""
    reports = block(19, reference_019(0.5, 0.0, 0.0)) + block(20, mlat_020(1.0, local=(1000, 2000)))
    table, report, out = convert(reports, status=EXIT_FAILED)
    assert table.height == 0
    assert report["figures"]["unreferenced"] == {"0-107": 1}
    sensor = tomllib.loads((out / "sensors.toml").read_text())["sensor"][0]
    assert math.isnan(sensor["latitude_deg"])
    survey = inspect([out.parent / "recording-0.ast"], InspectionOptions(), lambda _: None)
    assert (survey.antennas["0-107"].site, survey.references) == (None, {})


def test_a_site_beside_those_of_zero_is_the_reference_point(convert: Convert) -> None:
    unset = block(19, reference_019(0.5, 0.0, 0.0))
    reports = block(19, reference_019(1.5, *POINT)) + unset + block(20, mlat_020(2.0, local=(0, 0)))
    table, _, out = convert(unset, reports)
    assert position(table) == pytest.approx(POINT, abs=1e-6)
    assert load_sensors(out / "sensors.toml").sensor[0].latitude_deg == pytest.approx(POINT[0])
    files = [out.parent / f"recording-{k}.ast" for k in range(2)]
    survey = inspect(files, InspectionOptions(), lambda _: None)
    assert survey.antennas["0-107"].site == pytest.approx((*POINT, 40.0))
    assert survey.references[107] == pytest.approx(POINT)


def test_a_sensor_without_a_reference_point_is_to_be_completed(
    convert: Convert, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = block(20, mlat_020(1.0, local=(0, 0)))
    _, _, out = convert(content, status=EXIT_FAILED)
    again = ["convert", "asterix", str(tmp_path / "recording-0.ast"), "--out", str(out) + "-2"]
    assert run([*again, "--sensors", str(out / "sensors.toml")]) == EXIT_FAILED
    assert "2 fields to fill in: 0-107 latitude_deg" in capsys.readouterr().err


def test_the_type_of_a_surface_report_is_what_measured_it(convert: Convert) -> None:
    def report(seconds: float, descriptor: str) -> bytes:
        return surface_010(
            seconds, source=MULTILATERATION, descriptor=descriptor, local=(10, 20), address="3c660c"
        )

    reports = [
        report(1.0, MODE_S_MLAT),
        report(2.0, "24"),
        report(3.0, ADSB),
        report(4.0, MAGNETIC_LOOP),
    ]
    table, found, _ = convert(block(10, *reports), options=("--reference", REFERENCE))
    assert table["kind"].to_list() == ["mlat", "mlat", "adsb"]
    assert table["on_ground"].to_list() == [False, True, False]
    assert table["sensor_id"].to_list() == ["0-107", "0-107", "0-107-adsb"]
    assert found["figures"]["left_out"]["other_technology"] == 1


def test_coordinates_at_the_end_of_their_range_are_no_position(convert: Convert) -> None:
    mlat = {"source": MULTILATERATION, "descriptor": MODE_S_MLAT}
    reports = [
        surface_010(float(k), local=place, **mlat)  # type: ignore[arg-type]
        for k, place in enumerate([(32_766, 0), (32_767, 0), (0, -32_768), (-32_767, 5)])
    ]
    table, report, _ = convert(block(10, *reports), options=("--reference", REFERENCE))
    assert table["time_s"].to_list() == [0.0]
    assert report["figures"]["left_out"]["no_position"] == 3


def test_extrapolated_positions_are_no_measurements(convert: Convert) -> None:
    place = {"position": (41.5, 2.25)}
    table, report, _ = convert(
        block(20, mlat_020(1.0, **place), mlat_020(2.0, extrapolated=True, **place))  # type: ignore[arg-type]
        + block(
            10,
            surface_010(1.0, polar=(900, 10.0)),
            surface_010(2.0, polar=(900, 10.0), status="10"),
        )
    )
    assert table["time_s"].to_list() == [1.0, 1.0]
    assert report["figures"]["left_out"]["no_detection"] == 2


def test_a_report_in_two_categories_counts_once(convert: Convert) -> None:
    address, place = "3c660c", (-1360, 804)
    surface = [
        surface_010(
            seconds, source=MULTILATERATION, descriptor=MODE_S_MLAT, local=place, address=address
        )
        for seconds in (1.0, 2.0)
    ]
    table, report, _ = convert(
        block(10, *surface) + block(20, mlat_020(1.0, local=(-1360.5, 804.0), deviations=(3, 4))),
        options=("--reference", REFERENCE),
    )
    assert table["time_s"].to_list() == [1.0, 2.0]
    assert table["position_sigma_m"].to_list() == [pytest.approx(12.5**0.5), None]
    assert report["counts"]["duplicate"] == 1


def test_times_continue_past_midnight(convert: Convert) -> None:
    seconds = [86_398.0, 86_399.5, 0.5, 2.0]
    reports = [surface_010(one, polar=(900, 10.0)) for one in seconds]
    table, _, _ = convert(block(10, *reports))
    assert table["time_s"].to_list() == [86_398.0, 86_399.5, 86_400.5, 86_402.0]


def test_a_fine_time_of_reception_continues_past_midnight(convert: Convert) -> None:
    """Regression: the next second of 86 399 was rejected, as a time of 24 h."""
    reports = [
        adsb_021(86_390.5, None),
        adsb_021(86_399.992, None, fine=(1, 0.001)),
        adsb_021(0.0, None, fine=(2, 0.998)),
        adsb_021(0.25, None, fine=(0, 0.251)),
        # A reception time of 24 h and more is none, whatever its fraction.
        adsb_021(86_401.0, None, fine=(0, 0.001)),
    ]
    table, report, _ = convert(block(21, *reports), options=("--edition", "021=2.4"))
    assert table["time_s"].to_list() == pytest.approx(
        [86_390.5, 86_400.001, 86_399.998, 86_400.251]
    )
    assert report["counts"]["rejected"] == 1


def test_deviations_are_the_accuracy_of_a_position(convert: Convert) -> None:
    mlat = {"source": MULTILATERATION, "descriptor": MODE_S_MLAT, "local": (0, 0)}
    reports = [
        surface_010(1.0, deviations=(3.0, 4.0), **mlat),  # type: ignore[arg-type]
        # Zero is no accuracy.
        surface_010(2.0, deviations=(0.0, 0.0), **mlat),  # type: ignore[arg-type]
        surface_010(3.0, **mlat),  # type: ignore[arg-type]
    ]
    table, _, _ = convert(block(10, *reports), options=("--reference", REFERENCE))
    assert table["position_sigma_m"].to_list() == [pytest.approx(12.5**0.5), None, None]


def test_the_accuracy_of_adsb_is_by_its_category(convert: Convert) -> None:
    within_95, within_integrity = 2.4477, 5.6777
    cases = [
        # First subfield NUCp or NIC 7; NACp 8, 10, 0; PIC 12: 75 m. Versions 0, 2 and none.
        (adsb_021(1.0, "0f 10", "00"), 92.6 / within_95),
        (adsb_021(2.0, "0f 10", "10"), 92.6 / within_95),
        (adsb_021(3.0, "0f 14", "10"), 10.0 / within_95),
        (adsb_021(4.0, "0f 01 01 c0", "10"), 75.0 / within_integrity),
        (adsb_021(5.0, "0e", "10"), 370.4 / within_integrity),
        (adsb_021(6.0, "0e"), 370.4 / within_integrity),
        (adsb_021(7.0, "00", "10"), None),
        (adsb_021(8.0, None), None),
    ]
    table, _, _ = convert(block(21, *(one for one, _ in cases)), options=("--edition", "021=2.4"))
    found = table["position_sigma_m"].to_list()
    assert found == [None if one is None else pytest.approx(one, rel=1e-4) for _, one in cases]


def test_the_figure_of_merit_of_old_editions_is_an_accuracy(convert: Convert) -> None:
    reports = [adsb_021_old(1.0, "00 07"), adsb_021_old(2.0, "00 06"), adsb_021_old(3.0, "00 00")]
    table, _, _ = convert(block(21, *reports), options=("--edition", "021=0.23"))
    found = table["position_sigma_m"].to_list()
    assert found == [pytest.approx(37.83, abs=0.01), pytest.approx(75.66, abs=0.01), None]


def test_the_type_of_a_plot_is_its_detection(convert: Convert) -> None:
    types = ["20", "40", "60", "80", "a0", "c0", "e0"]
    plots = [plot_048(float(k), descriptor=one) for k, one in enumerate(types)]
    table, _, _ = convert(block(48, *plots))
    expected_types = ["psr", "ssr", "psr_ssr", "mode_s", "mode_s", "psr_mode_s", "psr_mode_s"]
    assert table["detection"].to_list() == expected_types
    assert "position_sigma_m" not in table.columns


def test_secondary_plots_of_category_001_are_ssr(convert: Convert) -> None:
    table, _, _ = convert(block(48, plot_048(1.0)) + block(1, plot_001(1.5)))
    assert table["detection"].to_list() == ["ssr", "ssr"]
