"""`inspect` names units and columns that the recording itself shows to be wrong."""

import shutil
from pathlib import Path

import pytest

from multiradar.cli.main import run
from support.paths import SAMPLE
from validation.mistakes.mistake import column_times

NAUTICAL_MILE_M = 1852.0


def edited(folder: Path, file: str, rows: list[list[str]]) -> Path:
    """Write the sample with other rows of a file."""
    dump = folder / "dump"
    shutil.copytree(SAMPLE, dump)
    (dump / file).write_text("".join("\t".join(row) + "\n" for row in rows))
    return dump


def rows_of(file: str) -> list[list[str]]:
    return [line.split("\t") for line in (SAMPLE / file).read_text().splitlines()]


def with_value(rows: list[list[str]], column: str, value: str) -> list[list[str]]:
    index = rows[0].index(column)
    return [rows[0], *([*row[:index], value, *row[index + 1 :]] for row in rows[1:])]


def said(dump: Path, capsys: pytest.CaptureFixture[str]) -> str:
    capsys.readouterr()
    assert run(["inspect", str(dump)]) == 1
    return capsys.readouterr().err


def test_a_right_recording_has_no_mistake(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["inspect", str(SAMPLE)]) == 0
    assert "probably" not in capsys.readouterr().err


def test_ranges_in_nautical_miles_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = column_times("range", 1.0 / NAUTICAL_MILE_M)(rows_of("plots.txt"))
    found = said(edited(tmp_path, "plots.txt", rows), capsys)
    assert found.count("its ranges are probably in nautical miles") == 4


def test_swapped_positions_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = rows_of("plots_ads.txt")
    first, later = rows[0].index("lat"), rows[0].index("lon")
    for row in rows[1:]:
        if len(row) == len(rows[0]):
            row[first], row[later] = row[later], row[first]
    found = said(edited(tmp_path, "plots_ads.txt", rows), capsys)
    assert "adsb: latitude and longitude are probably swapped" in found


@pytest.mark.parametrize(("column", "value"), [("lat", "47.0"), ("lon", "8.0")])
def test_one_coordinate_of_all_aircraft_is_named_by_inspect_and_convert(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], column: str, value: str
) -> None:
    dump = edited(tmp_path, "plots_ads.txt", with_value(rows_of("plots_ads.txt"), column, value))
    assert "itude_deg is probably a placeholder: the value is" in said(dump, capsys)
    assert run(["convert", "vid", str(dump), str(tmp_path / "out"), "--date", "2018-08-01"]) == 1
    assert "itude_deg is probably a placeholder: the value is" in capsys.readouterr().err
