"""A wrong position in a reference is rejected, named and counted; the scorecard is the same."""

import json
import shutil
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, run

WILD = {"latitude_deg": -66.0, "longitude_deg": -73.0}


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Simulate and track; write the truth as system tracks in every form, too."""
    folder = tmp_path_factory.mktemp("scene")
    made, tracks = folder / "made", folder / "tracks"
    options = ["--duration", "240", "--seed", "4"]
    assert run(["simulate", "one-radar-adsb", "--out", str(made), *options]) == EXIT_DONE
    shown = ["--sensors", str(made / "sensors.toml"), "--out", str(tracks), "--kinds", "radar"]
    assert run(["track", str(made), *shown]) == EXIT_DONE
    truth = pl.read_parquet(made / "truth.parquet").drop_nulls("track_number")
    no_address = pl.lit(None, pl.String).alias("mode_s_address")
    rows = truth.select(
        "time_s", "track_number", no_address, "latitude_deg", "longitude_deg", "height_m",
        pl.lit("confirmed").alias("state"), pl.lit("0-4").alias("sensor_id"),
    )  # fmt: skip
    rows.write_parquet(folder / "system_tracks.parquet")
    lines = rows.select("time_s", "latitude_deg", "longitude_deg", "height_m")
    for (number,), one in lines.group_by(rows["track_number"]):
        (folder / "dump" / str(number)).mkdir(parents=True)
        path = folder / "dump" / str(number) / "240_mr.new4"
        one.sort("time_s").write_csv(path, separator="\t", include_header=False)
    return folder


def spoiled(table: Path, kind: str | None = None) -> int:
    """Make the position of one row of a table wrong, and return the row."""
    frame = pl.read_parquet(table).with_row_index()
    of_kind = frame if kind is None else frame.filter(kind=kind)
    known = of_kind.drop_nulls(["latitude_deg", "track_number"])
    row = int(known["index"][len(known) // 2])
    at = pl.col("index") == row
    columns = [pl.when(at).then(value).otherwise(name).alias(name) for name, value in WILD.items()]
    frame.with_columns(columns).drop("index").write_parquet(table)
    return row


def spoiled_line(lines: Path) -> int:
    """Make the position of one line wrong, and return its number."""
    text = lines.read_text(encoding="ascii").splitlines()
    at = len(text) // 2
    time_s, _, _, height_m = text[at].split("\t")
    text[at] = f"{time_s}\t{WILD['latitude_deg']}\t{WILD['longitude_deg']}\t{height_m}"
    lines.write_text("\n".join(text) + "\n", encoding="ascii")
    return at + 1


CASES = ["truth", "adsb", "system-tracks", "new4", "smoothed"]


@pytest.mark.parametrize("case", CASES)
def test_one_wild_row_costs_that_row_only(
    scene: Path, tmp_path: Path, case: str, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "scene"
    shutil.copytree(scene, folder)
    given = folder / {"new4": "dump", "system-tracks": "system_tracks.parquet"}.get(case, "made")
    option = "system-tracks" if case == "new4" else case
    command = ["evaluate", str(folder / "tracks"), f"--{option}", str(given)]
    if case == "smoothed":
        command += ["--sensors", str(folder / "made" / "sensors.toml")]

    def evaluated() -> tuple[dict[str, Any], str]:
        capsys.readouterr()
        assert run([*command, "--json"]) == EXIT_DONE
        shown = capsys.readouterr()
        return json.loads(shown.out), shown.err

    before, silent = evaluated()
    assert "rejected" not in silent
    assert before["reference"]["rejects"] == []
    if case == "new4":
        lines = sorted(folder.glob("dump/*/240_mr.new4"))[0]
        place = f"240_mr.new4: line {spoiled_line(lines)}: aircraft {lines.parent.name}: "
    else:
        files = {"truth": "made/truth.parquet", "system-tracks": "system_tracks.parquet"}
        table = folder / files.get(case, "made/measurements.parquet")
        row = spoiled(table, "adsb" if case in {"adsb", "smoothed"} else None)
        place = f"{table.name}: row {row}: aircraft "
    after, error = evaluated()
    assert "1 of " in error
    assert place in error
    rows = after["reference"]["rows"]
    assert rows["rejected"] == len(after["reference"]["rejects"]) == 1
    assert rows["read"] == rows["accepted"] + rows["rejected"] + rows["duplicate"]
    assert rows["read"] == before["reference"]["rows"]["read"]
    assert after["compared"]["aircraft"] == before["compared"]["aircraft"]
    rms_m = after["errors"]["position_m"]["rms"], before["errors"]["position_m"]["rms"]
    assert rms_m[0] == pytest.approx(rms_m[1], rel=0.01)
    assert run(command) == EXIT_DONE
    shown = capsys.readouterr().out
    assert "Rejected reference rows (" in shown
    assert " 1 rejected + " in shown
