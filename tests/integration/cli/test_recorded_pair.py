"""Tracks of one radar (048) against the system tracks of a processor (062) in one recording."""

import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, run
from support.asterix.octets import final_format
from support.asterix.pair import datagrams, plots, system_tracks

SCENE = """
duration_s = 900
start_time_s = 1778057000.0
seed = 11
[plane]
latitude_deg = 47.0
longitude_deg = 8.0
[[traffic]]
count = 24
east_m = [-90e3, 90e3]
north_m = [-90e3, 90e3]
speed_mps = [150, 250]
start_s = [0, 500]
life_s = [150, 350]
height_step_m = 7.62
[[sensor]]
id = "20-1"
east_m = 0
north_m = 0
rotation_period_s = 4
range_sigma_m = 25
azimuth_sigma_deg = 0.06
range_max_m = 120e3
[[sensor]]
id = "20-2"
east_m = 90e3
north_m = 60e3
rotation_period_s = 8
range_max_m = 350e3
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record a processor with two radars, and the plots of one of them, in Final format."""
    made = tmp_path_factory.mktemp("made")
    (made / "scene.toml").write_text(SCENE)
    scene = made / "scene"
    assert run(["simulate", str(made / "scene.toml"), "--out", str(scene)]) == EXIT_DONE
    command = ["track", str(scene), "--sensors", str(scene / "sensors.toml")]
    assert run([*command, "--out", str(made / "operational")]) == EXIT_DONE
    tracks = pl.read_parquet(made / "operational" / "tracks.parquet")
    measured = pl.read_parquet(scene / "measurements.parquet").filter(sensor_id="20-1")
    records = system_tracks(tracks.filter(pl.col("state") == "confirmed")) + plots(measured)
    (made / "pair.ff").write_bytes(final_format(datagrams(records)))
    _, one, _ = (scene / "sensors.toml").read_text().split("[[sensor]]")
    (made / "sensors.toml").write_text("[[sensor]]" + one)
    command = ["convert", "asterix", str(made / "pair.ff"), "--date", "2026-05-06"]
    assert run([*command, "--out", str(made / "converted")]) == EXIT_DONE
    return made


def test_every_record_is_read(folder: Path) -> None:
    report = json.loads((folder / "converted" / "report.json").read_text())
    assert report["counts"]["read"] == report["counts"]["accepted"]
    assert report["figures"]["bytes"]["pair.ff"]["form"] == "final"
    tracks = pl.read_parquet(folder / "operational" / "tracks.parquet")
    confirmed = tracks.filter(pl.col("state") == "confirmed")
    system = pl.read_parquet(folder / "converted" / "system_tracks.parquet")
    # The second service repeats updates.
    assert len(system) == len(confirmed)
    assert system["track_number"].n_unique() < confirmed["track_id"].n_unique()


def test_tracks_of_the_radar_agree_with_the_system_tracks(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = str(folder / "converted")
    command = ["track", given, "--sensors", str(folder / "sensors.toml"), "--reference", given]
    assert run([*command, "--out", str(tmp_path / "tracks")]) == EXIT_DONE
    capsys.readouterr()
    command = ["evaluate", str(tmp_path / "tracks"), "--system-tracks", given, "--json"]
    assert run(command) == EXIT_DONE
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert found["reference"]["rows"]["rejected"] == 0
    system = pl.read_parquet(folder / "converted" / "system_tracks.parquet")
    assert found["compared"]["aircraft"] > system["track_number"].n_unique()
    assert found["identity"]["swaps"] == 0
    assert found["tracks"]["false"] == 0
    assert found["errors"]["position_m"]["median"] < 60.0
    ranges, azimuths = (
        next(one for one in found["differences"] if one["quantity"] == name)
        for name in ("range_m", "azimuth_deg")
    )
    assert abs(ranges["mean"]) < 15.0
    assert abs(azimuths["mean"]) < 0.02
