"""`multiradar evaluate --system-tracks`: category 062 of another processor as the reference."""

import html
import json
import math
import shlex
import shutil
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, EXIT_FAILED, EXIT_USAGE, run
from support.asterix.octets import block, plot_048, record, time_of_day

BEGIN_S = 86_400.0 - 120.0
TURN_S = 4.0
TURNS = 60
SENSORS = """
[[sensor]]
kind = "radar"
sac = 20
sic = 130
latitude_deg = 47.0
longitude_deg = 8.0
height_m = 500.0
rotation_period_s = 4.0
"""
# The last bit of item 105, degrees: 0.6 m.
POSITION_BIT = 180 / 2**25


def system_track(
    row: dict[str, Any], source: str = "0004", status: str = "00", number: int | None = None
) -> bytes:
    def place(name: str) -> str:
        return f"{round(row[name] / POSITION_BIT) & 0xFFFF_FFFF:08x}"

    def speed(axis: int) -> str:
        heading = math.radians(row["heading_deg"])
        part = row["speed_mps"] * (math.sin(heading), math.cos(heading))[axis]
        return f"{round(part / 0.25) & 0xFFFF:04x}"

    return record(
        (1, source),
        (4, time_of_day(row["time_s"] % 86_400)),
        (5, place("latitude_deg") + place("longitude_deg")),
        (7, f"{speed(0)}{speed(1)}"),
        (12, f"{row['track_id'] if number is None else number:04x}"),
        (13, status),
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Track two aircraft over midnight, with equal system tracks of another processor."""
    made = tmp_path_factory.mktemp("made")
    plots = []
    for turn in range(TURNS):
        for number, azimuth in enumerate((30.0, 200.0)):
            plots.append(
                plot_048(
                    (BEGIN_S + TURN_S * turn + 0.5 * number) % 86_400,
                    range_nm=40.0 + 0.25 * turn,
                    azimuth_deg=azimuth,
                    address=f"3c000{number}",
                    code=f"0fe{number}",
                )
            )
    (made / "plots.ast").write_bytes(block(48, *plots[:90]) + block(48, *plots[90:]))
    (made / "sensors.toml").write_text(SENSORS)
    shown = ["--sensors", str(made / "sensors.toml"), "--out"]
    assert (
        run(["convert", "asterix", str(made / "plots.ast"), *shown, str(made / "p")]) == EXIT_DONE
    )
    assert run(["track", str(made / "p"), *shown, str(made / "tracks")]) == EXIT_DONE
    rows = pl.read_parquet(made / "tracks" / "tracks.parquet").sort("time_s").to_dicts()
    away = {**rows[-1], "latitude_deg": 40.0}
    others = [system_track(away, status="01 80"), system_track(away, status="01 01 01 80")]
    blocks = [block(62, *(system_track(row) for row in rows)), block(62, *others)]
    (made / "system.ast").write_bytes(b"".join(blocks))
    out = ["--out", str(made / "system")]
    assert run(["convert", "asterix", str(made / "system.ast"), *out]) == EXIT_DONE
    return made


def test_tracks_are_evaluated_against_recorded_system_tracks(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    for reference in (folder / "system", folder / "system" / "system_tracks.parquet"):
        command = ["evaluate", str(folder / "tracks"), "--system-tracks", str(reference), "--json"]
        assert run(command) == EXIT_DONE
        found = json.loads(capsys.readouterr().out)
        assert found["reference"]["kind"] == "system-tracks"
        compared = found["compared"]
        assert compared["aircraft"] == 2
        # Simulated and coasted updates are no reference: their positions differ.
        assert compared["reference_positions"] == 2 * TURNS
        assert compared["updates_compared"] > 1.8 * TURNS
        assert found["errors"]["position_m"]["rms"] < 1.0
        # The velocity is that of the processor, to the last bit of item 185.
        assert found["errors"]["velocity_mps"]["rms"] < 0.5


def test_a_track_number_used_again_is_another_aircraft(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = pl.read_parquet(folder / "tracks" / "tracks.parquet").sort("time_s")
    middle_s = BEGIN_S + 0.5 * TURN_S * TURNS
    first, second = rows["track_id"].unique().sort().to_list()
    early = rows.filter(track_id=first).filter(pl.col("time_s") < middle_s).to_dicts()
    late = rows.filter(track_id=second).filter(pl.col("time_s") > middle_s).to_dicts()
    records = [system_track(row, number=7) for row in early]
    records.append(system_track(early[-1], status="01 40", number=7))
    records += [system_track(row, number=7) for row in late]
    (tmp_path / "again.ast").write_bytes(block(62, *records))
    system = str(tmp_path / "system")
    assert run(["convert", "asterix", str(tmp_path / "again.ast"), "--out", system]) == EXIT_DONE
    capsys.readouterr()
    command = ["evaluate", str(folder / "tracks"), "--system-tracks", system, "--json"]
    assert run(command) == EXIT_DONE
    found = json.loads(capsys.readouterr().out)
    assert found["reference"]["rows"]["rejected"] == 0
    assert found["compared"]["aircraft"] == 2
    # Neither the tentative updates at the begin.
    assert found["compared"]["updates_compared"] >= len(early) + len(late) - 2


def test_the_scorecard_names_the_command_that_makes_it_again(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    moved = tmp_path / "system tracks"
    shutil.copytree(folder / "system", moved)
    command = [
        "evaluate", str(folder / "tracks"), "--system-tracks", str(moved), "--processor", "0-4",
        "--preset", "ed142-tma",
    ]  # fmt: skip
    page = tmp_path / "page.html"
    assert run([*command, "--html", str(page)]) == EXIT_DONE
    assert "the system tracks of another processor" in capsys.readouterr().out
    assert html.escape(shlex.join(["multiradar", *command])) in page.read_text(encoding="utf-8")


def test_a_recording_without_or_with_two_sets_of_system_tracks_is_rejected(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    row = pl.read_parquet(folder / "tracks" / "tracks.parquet").to_dicts()[0]
    both = block(62, system_track(row)) + block(62, system_track(row, source="0005"))
    (tmp_path / "both.ast").write_bytes(both)
    out = ["--out", str(tmp_path / "both")]
    assert run(["convert", "asterix", str(tmp_path / "both.ast"), *out]) == EXIT_DONE
    tracks = str(folder / "tracks")
    for reference, sentence in (
        (folder / "p", "was the output of `convert`"),
        (folder / "tracks" / "biases.parquet", "missing column state; found: time_s"),
        (tmp_path / "both", "contains system tracks of several processors (0-4, 0-5); select one"),
    ):
        assert run(["evaluate", tracks, "--system-tracks", str(reference)]) == EXIT_FAILED
        assert sentence in capsys.readouterr().err
    chosen = ["--system-tracks", str(tmp_path / "both"), "--processor"]
    assert run(["evaluate", tracks, *chosen, "0-6"]) == EXIT_FAILED
    assert "no system tracks of processor 0-6; known: 0-4, 0-5" in capsys.readouterr().err
    # One position is no trajectory, but that of one processor.
    run(["evaluate", tracks, *chosen, "0-5"])
    assert "processor" not in capsys.readouterr().err
    adsb = ["--adsb", str(folder / "p"), "--processor", "0-5"]
    assert run(["evaluate", tracks, *adsb]) == EXIT_USAGE
    assert run(["evaluate", tracks]) == EXIT_USAGE
    known = "--truth, --adsb, --smoothed, --system-tracks"
    assert f"missing reference: one of {known}\n" in capsys.readouterr().err
