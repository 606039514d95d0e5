"""Refraction of ranges: simulated with it, and removed where rows become arrays."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from multiradar.errors import ConfigurationError
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.geodesy.refraction import refracted_range
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame
from multiradar.simulation.scenario.file import load_scenario
from multiradar.simulation.scenario.model import Scenario
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.wire import measurement_batch, sensor_table
from multiradar_schemas.errors import DocumentError
from multiradar_schemas.sensors.sensor import parse_sensors

FACTOR, KNOWN_M, SITE = 1.25, 150.0, (50.0, 15.0, 300.0)
TEXT = """
duration_s = 300
[[aircraft]]
latitude_deg = 52.4
longitude_deg = 15
height_m = 11000
speed_mps = 200
heading_deg = 90
[[sensor]]
id = "far"
{kind}
latitude_deg = 50
longitude_deg = 15
height_m = 300
azimuth_sigma_deg = 0.01
{more}
"""
RADAR = f"""
range_sigma_m = 0.1
rotation_period_s = 5
bias.range_offset_m = {{ value = {KNOWN_M}, estimate = false, prior = {KNOWN_M} }}
earth_radius_factor = {FACTOR}
"""


def scenario(tmp_path: Path, kind: str = "", more: str = RADAR) -> Scenario:
    path = tmp_path / "scene.toml"
    path.write_text(TEXT.format(kind=kind, more=more), encoding="utf-8")
    return load_scenario(path)


def test_simulated_ranges_are_refracted_and_corrected_where_they_enter(tmp_path: Path) -> None:
    made = scenario(tmp_path)
    seen = observe(made, np.random.default_rng(1))
    truth = seen.measurements
    place = truth.true_latitude_rad, truth.true_longitude_rad, truth.true_height_m
    site = float(np.radians(SITE[0])), float(np.radians(SITE[1])), SITE[2]
    straight, _, _ = slant_range_azimuth(site, *place)
    bent = refracted_range(straight, truth.true_height_m, SITE[2], FACTOR)
    assert (straight - bent).min() > 25.0
    rows = measurements_frame(made, seen)
    np.testing.assert_allclose(rows["range_m"], bent + KNOWN_M, atol=1.0)
    text = sensors_text(made)
    assert f"earth_radius_factor = {FACTOR}" in text
    table = sensor_table(parse_sensors(text))
    batch, _ = measurement_batch(rows, table)
    np.testing.assert_allclose(batch.range_m, straight, atol=1.0)
    # Heights that are not received count as 8000 m: 3000 m less are some metres.
    unknown, _ = measurement_batch(rows.with_columns(height_m=pl.lit(None, pl.Float64)), table)
    off = np.abs(unknown.range_m - straight)
    assert off.max() < 20.0
    assert off.min() > 2.0


def test_only_radars_of_a_scenario_have_refraction(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="earth_radius_factor"):
        scenario(tmp_path, 'kind = "direction-finder"', "earth_radius_factor = 1.2")


@pytest.mark.parametrize("kind", ["direction-finder", "adsb"])
def test_only_radars_of_a_sensors_file_have_refraction(kind: str) -> None:
    sensor = (
        f'[[sensor]]\nid = "a"\nkind = "{kind}"\nlatitude_deg = 50.0\nlongitude_deg = 15.0\n'
        "height_m = 300.0\nearth_radius_factor = 1.2\n"
    )
    with pytest.raises(DocumentError, match=f"earth_radius_factor does not apply to the {kind} a"):
        parse_sensors(sensor)


def test_a_factor_below_one_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="earth_radius_factor: expected a number of at"):
        scenario(tmp_path, more="earth_radius_factor = 0.75")
