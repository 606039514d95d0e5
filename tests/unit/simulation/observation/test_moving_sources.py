"""Moving direction finders that measure elevations, in scenarios."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from multiradar.errors import ConfigurationError
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame, truth_frame
from multiradar.simulation.scenario.file import load_scenario, load_table, table_text
from multiradar.simulation.scenario.model import Scenario
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.wire import measurement_batch, sensor_table
from multiradar_schemas.measurements.columns import (
    MEASUREMENT_DIRECTIONS,
    MEASUREMENT_LATER,
    MEASUREMENT_SCHEMA,
)
from multiradar_schemas.sensors.sensor import parse_sensors

TEXT = """
    duration_s = 300
    [[aircraft]]
    latitude_deg = 50.5
    longitude_deg = 15
    height_m = 9000
    speed_mps = 200
    heading_deg = 90
    [[sensor]]
    id = "df"
    kind = "direction-finder"
    latitude_deg = 50
    longitude_deg = 15
    height_m = 3000
    azimuth_sigma_deg = 0.1
    {more}
"""
FLYING = """
    elevation_sigma_deg = 0.2
    speed_mps = 150
    heading_deg = 45
    [[sensor.leg]]
    duration_s = 300
    turn_rate_deg_per_s = 1.5
"""


def scenario(tmp_path: Path, more: str) -> Scenario:
    path = tmp_path / "scene.toml"
    path.write_text(TEXT.format(more=more), encoding="utf-8")
    return load_scenario(path)


def test_a_moving_finder_flies_its_legs_and_measures_from_its_position(tmp_path: Path) -> None:
    made = scenario(tmp_path, FLYING)
    observation = observe(made, np.random.default_rng(1))
    rows, truth = measurements_frame(made, observation), truth_frame(made, observation)
    # Empty columns are omitted.
    empty = {*MEASUREMENT_LATER} - {"callsign", *MEASUREMENT_DIRECTIONS}
    assert rows.columns == [name for name in MEASUREMENT_SCHEMA if name not in empty]
    assert len(rows) == 300
    sources = np.radians(rows.select(MEASUREMENT_DIRECTIONS[1:3]).to_numpy())
    assert rows["source_height_m"].unique().to_list() == [3000.0]
    # 1.5°/s at 150 m/s is a circle of 5.7 km radius, completed in 240 s.
    radius = 6.38e6 * np.array([1.0, np.cos(np.radians(50.0))])
    steps = np.linalg.norm(np.diff(sources, axis=0) * radius, axis=1)
    assert steps == pytest.approx(np.full(299, 150.0), rel=0.01)
    assert np.linalg.norm((sources[240] - sources[0]) * radius) < 100.0
    places = truth.select(
        pl.col("latitude_deg").radians(), pl.col("longitude_deg").radians(), "height_m"
    ).to_numpy()
    seen = [
        slant_range_azimuth((float(a), float(b), 3000.0), *place)
        for (a, b), place in zip(sources, places, strict=True)
    ]
    _, azimuth, elevation = np.degrees(np.array(seen, np.float64)).T
    off = (rows["azimuth_deg"].to_numpy() - azimuth + 180.0) % 360.0 - 180.0
    assert np.std(off) == pytest.approx(0.1, rel=0.15)
    above = rows["elevation_deg"].to_numpy() - elevation
    assert np.std(above) == pytest.approx(0.2, rel=0.15)
    assert abs(np.mean(above)) < 0.05


def test_its_sensors_file_accepts_its_bearings(tmp_path: Path) -> None:
    made = scenario(tmp_path, FLYING)
    text = sensors_text(made)
    assert "moving = true" in text
    table = sensor_table(parse_sensors(text))
    assert np.degrees(table.elevation_sigma_rad).tolist() == pytest.approx([0.2])
    frame = measurements_frame(made, observe(made, np.random.default_rng(1)))
    batch, rejected = measurement_batch(frame, table)
    assert not len(rejected)
    assert len(batch) == 300


def test_scenarios_without_them_keep_their_columns(tmp_path: Path) -> None:
    made = scenario(tmp_path, "")
    frame = measurements_frame(made, observe(made, np.random.default_rng(1)))
    assert not set(MEASUREMENT_DIRECTIONS) & set(frame.columns)
    assert "moving" not in sensors_text(made)
    # Other measurements do not depend on it.
    elevated = scenario(tmp_path, "elevation_sigma_deg = 0.2")
    other = measurements_frame(elevated, observe(elevated, np.random.default_rng(1)))
    assert other.select(frame.columns).equals(frame)
    assert other["source_height_m"].null_count() == len(other)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("heading_deg = 5", "missing speed_mps, which heading_deg"),
        ("speed_mps = 5\nbias.time_offset_s = 0.1", "bias.time_offset_s does not apply"),
        ("elevation_sigma_deg = 0", "elevation_sigma_deg"),
    ],
)
def test_invalid_settings_are_reported(more: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=words):
        scenario(tmp_path, more)


@pytest.mark.parametrize("key", ["elevation_sigma_deg = 0.2", "speed_mps = 100"])
def test_radars_reject_motion_and_elevations(key: str, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(TEXT.format(more=key).replace("direction-finder", "radar"), encoding="utf-8")
    with pytest.raises(ConfigurationError, match="does not apply to the radar df"):
        load_scenario(path)


def test_a_scenario_with_them_survives_a_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(TEXT.format(more=FLYING), encoding="utf-8")
    copy = tmp_path / "copy.toml"
    copy.write_text(table_text(load_table(path)), encoding="utf-8")
    assert load_scenario(copy) == load_scenario(path)
