"""Aircraft on the ground, from a recording of category 048 to the table of tracks."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from numpy.typing import NDArray

from multiradar.cli.main import run
from support.asterix import ground_scene as scene
from support.asterix.ground_scene import SENSORS, TARGETS, position_deg, recording

FILTERS = ("two-stage", "imm", "joint", "blom")
#: Time until a track is settled, s.
SETTLED_S = 24.0


def tracked(tmp_path: Path, whole: bytes, name: str) -> tuple[pl.DataFrame, dict[str, Any]]:
    (tmp_path / "recording.ast").write_bytes(whole)
    (tmp_path / "sensors.toml").write_text(SENSORS)
    out = str(tmp_path / "converted")
    tracks = tmp_path / "tracks"
    assert run(["convert", "asterix", str(tmp_path / "recording.ast"), "--out", out]) == 0
    command = ["track", out, "--sensors", str(tmp_path / "sensors.toml"), "--out", str(tracks)]
    assert run([*command, "--filter", name]) == 0
    report = json.loads((tracks / "report.json").read_text())
    return pl.read_parquet(tracks / "tracks.parquet"), report


@pytest.fixture(scope="module", params=FILTERS)
def table(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[pl.DataFrame, dict[str, Any]]:
    return tracked(tmp_path_factory.mktemp("ground"), recording(), request.param)


def of(frame: pl.DataFrame, address: str) -> pl.DataFrame:
    return frame.filter(
        (pl.col("mode_s_address") == address) & (pl.col("time_s") > scene.START_S + SETTLED_S)
    )


def errors_m(frame: pl.DataFrame, address: str) -> NDArray[np.float64]:
    """Return the position errors of an aircraft."""
    (target,) = (one for one in TARGETS if one.address == address)
    rows = of(frame, address)
    moments = [target.at(time_s - scene.START_S) for time_s in rows["time_s"]]
    truth = np.array([position_deg(moment) for moment in moments])
    apart = rows.select("latitude_deg", "longitude_deg").to_numpy() - truth
    errors: NDArray[np.float64] = np.hypot(apart[:, 0] * scene.NORTH_M, apart[:, 1] * scene.EAST_M)
    return errors


def test_every_aircraft_has_one_track_and_every_plot_a_position(
    table: tuple[pl.DataFrame, dict[str, Any]],
) -> None:
    frame, report = table
    assert frame["track_id"].n_unique() == frame["mode_s_address"].n_unique() == len(TARGETS)
    outcomes = report["figures"]["measurements_by_outcome"]
    assert outcomes["unlocatable"] == outcomes["restarted"] == 0
    assert outcomes["started"] == len(TARGETS)
    assert outcomes["updated"] >= (scene.SCANS - 2) * len(TARGETS)


def test_parked_aircraft_stand_on_the_ground(
    table: tuple[pl.DataFrame, dict[str, Any]],
) -> None:
    frame, _ = table
    for address in ("4b0001", "4b0002"):
        rows = of(frame, address)
        assert rows["on_ground"].all()
        assert set(rows["height_m"]) == {scene.SITE_HEIGHT_M}
        assert set(rows["vertical_rate_mps"]) == {0.0}
        assert rows["speed_mps"].to_numpy().max() < 6.0
        assert np.median(rows["speed_mps"]) < 1.5
        assert np.median(errors_m(frame, address)) < 10.0


def test_stops_and_sharp_turns_of_taxiing_aircraft_are_followed(
    table: tuple[pl.DataFrame, dict[str, Any]],
) -> None:
    frame, _ = table
    rows = of(frame, "4b0003")
    assert rows["on_ground"].all()
    assert np.median(errors_m(frame, "4b0003")) < 15.0
    assert errors_m(frame, "4b0003").max() < 60.0


@pytest.mark.parametrize(
    ("address", "since_s", "before"), [("4b0004", 92.0, True), ("4b0005", 100.0, False)]
)
def test_a_track_lasts_through_take_off_and_landing(
    table: tuple[pl.DataFrame, dict[str, Any]], address: str, since_s: float, before: bool
) -> None:
    frame, _ = table
    rows = of(frame, address)
    after = rows["time_s"] > scene.START_S + since_s
    assert set(rows.filter(~after)["on_ground"]) == {before}
    assert set(rows.filter(after)["on_ground"]) == {not before}
    # Pressure altitudes of their kind, in one piece.
    airborne = rows.filter(~pl.col("on_ground"))["height_m"].to_numpy()
    assert np.abs(np.diff(airborne)).max() < 80.0
    assert np.median(errors_m(frame, address)) < 25.0
    assert errors_m(frame, address).max() < 120.0


def test_an_aircraft_too_fast_for_the_ground_is_airborne(
    table: tuple[pl.DataFrame, dict[str, Any]],
) -> None:
    frame, _ = table
    rows = of(frame, "4b0006")
    assert not rows["on_ground"].any()
    pressure_m = scene.SURFACE_HEIGHT_M + 300.0 + scene.PRESSURE_OFF_M
    assert np.abs(rows["height_m"].to_numpy() - pressure_m).max() < 8.0
    assert np.median(rows["speed_mps"]) == pytest.approx(250.0, abs=5.0)


def test_without_statuses_there_is_none_in_the_tracks(tmp_path: Path) -> None:
    frame, _ = tracked(tmp_path, recording(statuses=False), "two-stage")
    assert frame["on_ground"].null_count() == len(frame)
