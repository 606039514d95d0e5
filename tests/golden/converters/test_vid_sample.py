"""The sample recording, converted, against plain Python readings of the same files."""

import datetime as dt
import re
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar_schemas.measurements.directions import PLAIN_SCHEMA
from multiradar_schemas.report import Report
from support.inputs import dumps
from support.paths import SAMPLE

DAY = dt.date(2018, 8, 1)
DAY_BEGINS = 1533081600.0


@pytest.fixture(scope="module")
def converted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("vid") / "new"
    dumps.run(SAMPLE, out, date=DAY)
    return out


@pytest.fixture(scope="module")
def rows() -> dict[str, list[dumps.Row]]:
    return dumps.good_rows(SAMPLE, dumps.broken_lines(blank=True))


def test_exactly_the_broken_lines_are_rejected_with_number_and_raw_text(converted: Path) -> None:
    found: dict[str, set[int]] = {name: set() for name in dumps.FILES}
    for reject in dumps.rejects(converted):
        lines = (SAMPLE / reject["file"]).read_bytes().split(b"\r\n")
        assert reject["raw"] == lines[reject["line"] - 1].decode()
        found[reject["file"]].add(reject["line"])
    assert found == dumps.broken_lines(blank=False)


def test_each_kind_of_defect_has_its_code(converted: Path) -> None:
    codes = {
        (reject["file"], reject["line"]): reject["code"] for reject in dumps.rejects(converted)
    }
    expected = {
        "truncated": "WRONG_FIELD_COUNT",
        "text in a number": "NOT_A_NUMBER",
        "nan": "NON_FINITE",
        "latitude out of range": "OUT_OF_RANGE",
        "extra field": "WRONG_FIELD_COUNT",
    }
    for name, defects in dumps.truth()["defects"].items():
        for defect in defects:
            if defect["kind"] != "empty":
                assert codes[name, defect["line"]] == expected[defect["kind"]], defect


def test_every_line_and_byte_is_accounted_for(converted: Path) -> None:
    report = Report.model_validate_json((converted / "report.json").read_bytes())
    files: Any = report.figures["files"]
    for name in dumps.FILES:
        data = (SAMPLE / name).read_bytes()
        account = files[name]
        assert account["bytes"] == len(data)
        assert account["lines"] == data.count(b"\n")
        assert account["blank"] == 2
        assert account["header"] == 1
        assert account["lines"] == 3 + account["accepted"] + account["rejected"]
        assert account["rejected"] == len(dumps.broken_lines(blank=False)[name])


def test_every_new4_holds_the_points_of_a_plain_join_by_time(
    converted: Path, rows: dict[str, list[dumps.Row]]
) -> None:
    expected = dumps.expected_tracks(rows)
    written = {
        str(path.relative_to(converted))[: -len(".new4")] for path in converted.rglob("*.new4")
    }
    assert written == set(expected)
    for name, points in expected.items():
        assert dumps.same_points(dumps.read_new4(converted / f"{name}.new4"), points), name


def test_plt_files_read_back_as_the_same_points(converted: Path) -> None:
    paths = sorted(converted.rglob("*.plt"))
    assert len(paths) == len(list(converted.rglob("*.new4")))
    for path in paths:
        points = dumps.read_new4(path.with_suffix(".new4"))
        header, lines = dumps.read_plt(path)
        assert header[:4] == [
            "OziExplorer Track Point File Version 2.1",
            "WGS 84",
            "Altitude is in Feet",
            "Reserved 3",
        ]
        assert header[4].split(",")[3] == f"{path.parent.name} {path.stem}"
        assert int(header[5]) == len(lines) == len(points)
        assert lines[0][2] == "1"
        for (time, latitude, longitude, height), line in zip(points, lines, strict=True):
            assert float(line[0]) == pytest.approx(latitude, abs=5.1e-7)
            assert float(line[1]) == pytest.approx(longitude, abs=5.1e-7)
            assert float(line[3]) * 0.3048 == pytest.approx(height, abs=0.02)
            # Seven decimals of a day are 9 ms.
            unix = (float(line[4]) - 25569.0) * 86400.0
            assert unix == pytest.approx(DAY_BEGINS + time, abs=0.005)
            clock = dt.datetime.fromtimestamp(DAY_BEGINS + time, tz=dt.UTC)
            assert line[5:] == ["01-Aug-18", clock.strftime("%H:%M:%S")]


def test_the_table_holds_every_plot_and_report_with_its_own_identity(
    converted: Path, rows: dict[str, list[dumps.Row]]
) -> None:
    table = pl.read_parquet(converted / "measurements.parquet")
    assert table.schema == PLAIN_SCHEMA
    assert table["time_s"].is_sorted()
    named = {
        (id(plot)): int(aircraft)
        for (aircraft, _), plots in dumps.named_plots(rows).items()
        for plot in plots
    }
    expected = [
        (
            DAY_BEGINS + float(plot["time"]),
            f"{plot['source']}-{plot['sensor']}",
            "radar",
            float(plot["range"]),
            float(plot["azimuth"]),
            float(plot["lat"]),
            float(plot["lon"]),
            float(plot["h"]),
            plot["code"],
            None,
            named.get(id(plot)),
            None,
        )
        for plot in rows["plots.txt"]
    ]
    reports = [
        (
            DAY_BEGINS + float(report["time"]),
            "adsb",
            "adsb",
            None,
            None,
            float(report["lat"]),
            float(report["lon"]),
            float(report["h"]),
            None,
            report["address"],
            int(report["global"]),
            None,
        )
        for report in rows["plots_ads.txt"]
    ]
    assert table.rows() == sorted([*expected, *reports], key=lambda row: row[0])


def test_the_skeleton_loads_once_positions_are_filled_in(converted: Path) -> None:
    from multiradar_schemas.sensors.sensor import load_sensors

    text = (converted / "sensors.toml").read_text(encoding="utf-8")
    filled = (
        text.replace("latitude_deg = nan", "latitude_deg = 46.5")
        .replace("longitude_deg = nan", "longitude_deg = 8.5")
        .replace("height_m = nan", "height_m = 500.0")
    )
    path = converted.parent / "filled.toml"
    path.write_text(filled, encoding="utf-8")
    sensors = load_sensors(path)
    assert [sensor.id for sensor in sensors.sensor] == ["26-10", "35-10", "41-1", "41-10", "adsb"]
    # The periods of truth.json, and ranges within which all plots lie.
    radars = sensors.sensor[:4]
    assert [one.rotation_period_s for one in radars] == [4.9, 4.0, 6.0, 6.0]
    assert [one.range_max_m for one in radars] == [301e3, 261e3, 120e3, 250e3]
    # Every default in a comment is one.
    commented = re.sub(
        r"^# ((?:range|azimuth|position)_sigma\w* = |bias\.)", r"\1", filled, flags=re.M
    )
    path.write_text(commented, encoding="utf-8")
    assert commented != filled
    reported = load_sensors(path).sensor
    for one, other in zip(reported, sensors.sensor, strict=True):
        assert one.estimated_biases() == other.estimated_biases()
        assert one.model_copy(update={"bias": other.bias}) == other
