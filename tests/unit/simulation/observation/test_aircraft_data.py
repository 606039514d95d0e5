"""Simulated registers have the values of the true flight; their faults are found by the checks."""

import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.simulation.observation.observe import Observation, observe
from multiradar.simulation.output import measurements_frame, reported_data, truth_frame
from multiradar.simulation.scenario.file import (
    builtin_table,
    scenario_of,
    scenario_table,
    table_text,
)
from multiradar.simulation.scenario.model import Scenario
from multiradar_schemas.measurements.columns import MEASUREMENT_AIRCRAFT

TURN_DEG_PER_S, WIND_M_S, VARIATION_DEG = 1.5, 30.0, 12.0
HEIGHT_M, SPEED_M_S = 8000.0, 200.0


def scenario(aircraft: int = 1, **reports: Any) -> Scenario:
    """Aircraft that fly straight for 100 s, turn for 60 s, and climb; a westerly wind."""
    legs = [
        {"duration_s": 100.0},
        {"duration_s": 60.0, "turn_rate_deg_per_s": TURN_DEG_PER_S},
        {"duration_s": 200.0, "climb_mps": 8.0},
    ]
    flights = [
        {"east_m": 20e3 + 500.0 * k, "north_m": 0.0, "height_m": HEIGHT_M, "speed_mps": SPEED_M_S,
         "heading_deg": 9.0 * k, "leg": legs}
        for k in range(aircraft)
    ]  # fmt: skip
    sensor = {
        "id": "radar", "east_m": 0.0, "north_m": 0.0, "rotation_period_s": 4.0,
        "range_sigma_m": 10.0, "azimuth_sigma_deg": 0.02, "aircraft_data": reports,
    }  # fmt: skip
    table = {
        "duration_s": 300.0,
        "plane": {"latitude_deg": 47.0, "longitude_deg": 8.0},
        "atmosphere": {
            "wind_speed_mps": WIND_M_S,
            "wind_from_deg": 270.0,
            "magnetic_variation_deg": VARIATION_DEG,
        },
        "aircraft": flights,
        "sensor": [sensor],
    }
    return scenario_of(scenario_table(table, source="a test"))


def observed(described: Scenario) -> tuple[pl.DataFrame, pl.DataFrame, Observation]:
    seen = observe(described, np.random.default_rng(1))
    return measurements_frame(described, seen), truth_frame(described, seen), seen


def dropped(described: Scenario) -> dict[str, int]:
    seen = observe(described, np.random.default_rng(1))
    document: Any = reported_data(described, seen).documents[0]
    counts: dict[str, int] = document["dropped"]
    return counts


def test_values_are_those_of_the_flight_rounded_to_the_steps_of_the_registers() -> None:
    measured, truth, _ = observed(scenario(noise_scale=0.0, age_max_s=0.0, checks=False))
    speed, course = truth["speed_mps"].to_numpy(), np.radians(truth["heading_deg"].to_numpy())
    air = np.array([speed * np.sin(course) - WIND_M_S, speed * np.cos(course)])
    airspeed = np.hypot(*air)
    nose_deg = np.degrees(np.arctan2(*air)) - VARIATION_DEG
    columns = {name: measured[name].to_numpy() for name in MEASUREMENT_AIRCRAFT}

    def apart_deg(name: str, expected: Any) -> float:
        return float(np.abs((columns[name] - expected + 180.0) % 360.0 - 180.0).max())

    half_step_deg, half_step_m_s = 45.0 / 512.0 + 0.01, 0.515
    assert apart_deg("magnetic_heading_deg", nose_deg) < half_step_deg
    assert apart_deg("track_angle_deg", np.degrees(course)) < half_step_deg
    assert np.abs(columns["ground_speed_m_s"] - speed).max() < half_step_m_s
    assert np.abs(columns["true_airspeed_m_s"] - airspeed).max() < half_step_m_s
    time_s = measured["time_s"].to_numpy()
    turning = (time_s > 101.0) & (time_s < 159.0)
    straight = (time_s < 99.0) | (time_s > 161.0)
    rate = columns["track_angle_rate_deg_s"]
    assert rate[turning] == pytest.approx(TURN_DEG_PER_S, abs=0.02)
    assert rate[straight] == pytest.approx(0.0, abs=0.02)
    # The heading turns slower or faster than the track, as the wind is behind or ahead.
    turn = np.gradient(np.unwrap(np.arctan2(*air)), time_s)
    roll = np.degrees(np.arctan(airspeed * turn / 9.80665))
    inner = (time_s > 105.0) & (time_s < 155.0)
    assert columns["roll_deg"][inner] == pytest.approx(roll[inner], abs=0.3)
    assert columns["vertical_rate_m_s"][time_s < 159.0] == pytest.approx(0.0, abs=0.01)
    assert columns["vertical_rate_m_s"][time_s > 161.0] == pytest.approx(8.0, abs=0.09)
    temperature = 288.15 - 0.0065 * truth["height_m"].to_numpy()
    mach = airspeed / np.sqrt(1.4 * 287.053 * temperature)
    assert columns["mach"] == pytest.approx(mach, abs=0.0021)


def test_noise_alone_is_never_implausible() -> None:
    described = scenario(aircraft=20)
    assert dropped(described) == {}
    document: Any = reported_data(described, observe(described, np.random.default_rng(1)))
    found = document.documents[0]
    assert found["with_data"] == found["reports"]
    assert found["magnetic_variation_deg"] == pytest.approx(VARIATION_DEG, abs=1.0)


@pytest.mark.parametrize(
    ("fault", "reasons"),
    [
        ({"stale_share": 1.0}, {"unchanged", "positions"}),
        ({"sign_share": 1.0}, {"roll_and_rate"}),
        ({"stuck_share": 1.0}, {"track_and_heading"}),
    ],
)
def test_faults_are_found(fault: dict[str, float], reasons: set[str]) -> None:
    assert set(dropped(scenario(aircraft=10, **fault))) >= reasons


def test_nearly_all_swapped_registers_are_found() -> None:
    measured, _truth, seen = observed(scenario(aircraft=20, swap_probability=0.2))
    motion = seen.measurements.registers[:, 1]
    clean = observe(scenario(aircraft=20), np.random.default_rng(1)).measurements.registers[:, 1]
    swapped = motion != clean
    assert 0.15 < swapped.mean() < 0.25
    for name in ("ground_speed_m_s", "mach"):
        given = measured[name].is_not_null().to_numpy()
        assert given[swapped].mean() < 0.01
        assert given[~swapped].all()


def test_without_checks_the_faults_stay() -> None:
    measured, _, _ = observed(scenario(swap_probability=1.0, checks=False))
    assert measured["selected_altitude_m"].null_count() == 0
    assert set(MEASUREMENT_AIRCRAFT) & set(measured.columns)


def test_registers_change_nothing_else() -> None:
    described = scenario(aircraft=3, swap_probability=0.5, stale_share=1.0)
    silent = replace(
        described, sensors=tuple(replace(one, aircraft_data=None) for one in described.sensors)
    )
    with_data, _, _ = observed(described)
    without, _, _ = observed(silent)
    assert not set(MEASUREMENT_AIRCRAFT) & set(without.columns)
    assert with_data.select(without.columns).equals(without)


def test_a_scenario_is_written_with_its_registers_and_its_atmosphere() -> None:
    table = builtin_table("aircraft-data")
    again = tomllib.loads(table_text(table))
    assert scenario_of(table) == scenario_of(scenario_table(again, source="again"))
