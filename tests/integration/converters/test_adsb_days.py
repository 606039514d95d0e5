"""`multiradar convert adsb` and `inspect` of files without dates from the same hours."""

import json
from pathlib import Path

import pytest

from multiradar.cli.main import EXIT_DONE, run
from support.scenarios.trajectories import csv_table, report


def test_files_of_different_days_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for number, path in enumerate(paths):
        rows = [
            report(
                second % 600.0,
                timestamp=40_000.0 + second,
                icao24=f"3c644{aircraft}",
                longitude=8.5 + number,
            )
            for second in range(0, 1200, 30)
            for aircraft in range(3)
        ]
        path.write_bytes(csv_table(rows))
    out = tmp_path / "out"
    # The gap between the days is an error of its own.
    run(["convert", "adsb", *map(str, paths), "--out", str(out)])
    assert "b.csv: placed on a later day than a.csv" in capsys.readouterr().err
    figures = json.loads((out / "report.json").read_bytes())["figures"]
    assert [one["first_day"] for one in figures["files"].values()] == [0, 1]
    assert figures["last_s"] == 40_000.0 + 1170.0 + 86_400.0
    assert run(["inspect", *map(str, paths), "--json"]) == EXIT_DONE
    found = json.loads(capsys.readouterr().out)
    assert found["moved_files"] == figures["moved_files"]
    assert found["last_s"] == figures["last_s"]
