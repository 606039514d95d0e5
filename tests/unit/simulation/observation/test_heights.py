"""Heights as received by sensors: steps, garbled codes, missing ones; traffic that climbs."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.simulation.observation.heights import GARBLED_STEPS, received_heights
from multiradar.simulation.paths import fly
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.simulation.scenario.model import Aircraft, Sensor
from multiradar.simulation.traffic import all_aircraft

AIRCRAFT = Aircraft(1, 0.0, 0.0, 9000.0, 200.0, 0.0, height_step_m=30.48)
RADAR = Sensor("one", "radar")
TRUE = np.linspace(100.0, 9000.0, 20_000)


def heard(sensor: Sensor, aircraft: Aircraft = AIRCRAFT) -> np.ndarray:
    return received_heights(sensor, aircraft, TRUE, np.random.default_rng(1))


def test_heights_come_in_the_steps_of_the_aircraft() -> None:
    assert np.abs(heard(RADAR) - TRUE).max() == pytest.approx(15.24, abs=0.1)
    np.testing.assert_array_equal(heard(RADAR, replace(AIRCRAFT, height_step_m=0.0)), TRUE)


def test_garbled_heights_have_the_configured_rate_and_large_errors() -> None:
    found = heard(replace(RADAR, garbled_height_probability=0.05))
    off = np.rint((found - heard(RADAR)) / 30.48)
    wrong = off != 0.0
    assert wrong.mean() == pytest.approx(0.05, abs=0.006)
    assert np.abs(off[wrong]).min() >= GARBLED_STEPS[0]
    assert np.abs(off[wrong]).max() <= GARBLED_STEPS[1]
    assert found.min() >= -304.8


def test_heights_are_missing_at_the_configured_rate() -> None:
    found = heard(replace(RADAR, height_probability=0.8))
    assert np.isnan(found).mean() == pytest.approx(0.2, abs=0.01)
    assert np.isnan(heard(RADAR, replace(AIRCRAFT, reports_height=False))).all()
    assert np.isnan(heard(replace(RADAR, received=frozenset()))).all()


def test_traffic_climbs_within_its_span_of_heights() -> None:
    scenario = builtin_scenario("climbs")
    climbing = 0
    for one in all_aircraft(scenario)[:30]:
        path = fly(one, scenario.duration_s, np.random.default_rng(0))
        height = path.height(np.linspace(0.0, scenario.duration_s, 500))
        assert height.min() >= 2000.0 - 1e-6
        assert height.max() <= 11_500.0 + 1e-6
        climbing += int(np.ptp(height) > 500.0)
    assert climbing > 20
