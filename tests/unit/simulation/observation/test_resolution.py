"""Aircraft closer than the resolution of a radar give one plot."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from multiradar.errors import ConfigurationError
from multiradar.simulation.observation.measurements import Measurements
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.scenario.file import load_scenario
from multiradar.simulation.scenario.model import Aircraft, Scenario, Sensor

DEGREE = float(np.radians(1.0))
RADAR = Sensor(
    "east", "radar", east_m=60e3, range_sigma_m=0.0, azimuth_sigma_rad=0.0, rotation_period_s=4.0
)
SINGLE = replace(RADAR, range_resolution_m=200.0, azimuth_resolution_rad=2.0 * DEGREE)
LEADER = Aircraft(7, -20e3, 0.0, 8000.0, 200.0, np.radians(90.0), end_s=100.0)


def seen(sensor: Sensor, *aircraft: Aircraft) -> Measurements:
    scenario = Scenario("", 0, 120.0, "wgs84", (0.98, 1.07), aircraft, (), (sensor,))
    return observe(scenario, np.random.default_rng(3)).measurements


def beside(east_m: float, north_m: float, number: int = 8) -> Aircraft:
    return replace(
        LEADER, track_number=number, east_m=LEADER.east_m + east_m, north_m=LEADER.north_m + north_m
    )


def test_two_close_aircraft_give_one_plot_with_the_identity_of_the_first() -> None:
    both = seen(SINGLE, LEADER, beside(-120.0, 150.0))
    each = seen(RADAR, LEADER, beside(-120.0, 150.0))
    assert 2 * len(both) == len(each) > 40
    assert set(both.aircraft) == {0}
    first, second = each.aircraft == 0, each.aircraft == 1
    np.testing.assert_allclose(
        both.range_m, (each.range_m[first] + each.range_m[second]) / 2.0, atol=1e-6
    )
    np.testing.assert_allclose(
        both.azimuth_rad, (each.azimuth_rad[first] + each.azimuth_rad[second]) / 2.0, atol=1e-12
    )
    np.testing.assert_array_equal(both.time_s, each.time_s[first])


@pytest.mark.parametrize(("east_m", "north_m"), [(-400.0, 0.0), (0.0, 4000.0)])
def test_resolution_in_one_coordinate_is_enough(east_m: float, north_m: float) -> None:
    away = beside(east_m, north_m)
    np.testing.assert_array_equal(
        seen(SINGLE, LEADER, away).range_m, seen(RADAR, LEADER, away).range_m
    )


def test_three_in_a_row_are_merged_through_the_middle_one() -> None:
    row = (LEADER, beside(-150.0, 0.0), beside(-300.0, 0.0, number=9))
    assert len(seen(SINGLE, *row)) == len(seen(SINGLE, LEADER))
    ends = seen(SINGLE, row[0], row[2])
    assert len(ends) == 2 * len(seen(SINGLE, LEADER))


def test_close_aircraft_are_merged_across_north() -> None:
    # The two aircraft lie on each side of north as seen from the radar.
    north = replace(LEADER, east_m=-100.0, north_m=80e3, heading_rad=0.0)
    pair = (north, replace(north, track_number=8, east_m=100.0))
    rows = seen(replace(SINGLE, east_m=0.0), *pair)
    each = seen(replace(RADAR, east_m=0.0), *pair)
    assert len(rows) == pytest.approx(len(each) / 2, abs=1)
    assert np.ptp(each.azimuth_rad) > 350.0 * DEGREE
    away = np.mod(rows.azimuth_rad + np.pi, 2.0 * np.pi) - np.pi
    assert np.all(np.abs(away) < 0.5 * DEGREE)


def test_other_random_numbers_stay_as_they_are() -> None:
    noisy = replace(RADAR, range_sigma_m=50.0, azimuth_sigma_rad=0.001, detection_probability=0.8)
    far = beside(30e3, 20e3)
    one = seen(noisy, LEADER, far)
    other = seen(
        replace(noisy, range_resolution_m=200.0, azimuth_resolution_rad=DEGREE), LEADER, far
    )
    np.testing.assert_array_equal(one.range_m, other.range_m)
    np.testing.assert_array_equal(one.azimuth_rad, other.azimuth_rad)


def test_a_resolution_in_range_alone_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(
        "duration_s = 60\n[[aircraft]]\neast_m = 0\nnorth_m = 0\nspeed_mps = 200\nheading_deg = 0\n"
        '[[sensor]]\nid = "a"\nlatitude_deg = 50\nlongitude_deg = 10\nrange_resolution_m = 200\n'
    )
    with pytest.raises(ConfigurationError, match="azimuth_resolution_deg together"):
        load_scenario(path)
