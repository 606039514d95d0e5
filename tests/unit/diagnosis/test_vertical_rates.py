"""Heights in feet, by the rates of climbs and descents."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.diagnosis.vertical_rates import are_stepped, check_vertical_rates, pairs_apart

FOOT_M = 0.3048
AIRCRAFT = 6


def checked(rate_mps: float, step_m: float, factor: float = 1.0, aircraft: int = AIRCRAFT) -> str:
    """Return the diagnosis of aircraft that climb at one rate, and its severity."""
    time_s = np.tile(np.arange(0.0, 300.0, 5.0), aircraft)
    number = np.repeat(np.arange(aircraft), 60)
    height_m = 1000.0 + 311.0 * number + rate_mps * time_s
    stepped = np.round(height_m / step_m) * step_m
    found = check_vertical_rates("1-10", time_s, stepped * factor, number)
    return "" if found is None else f"{found.severity}: {found.sentence}"


@pytest.mark.parametrize("rate_mps", [0.5, 4.0, 7.0])
@pytest.mark.parametrize("step_m", [25 * FOOT_M, 100 * FOOT_M, 10.0, 0.001])
def test_usual_climbs_in_metres_are_right(rate_mps: float, step_m: float) -> None:
    assert checked(rate_mps, step_m) == ""


@pytest.mark.parametrize("step_ft", [25.0, 100.0])
@pytest.mark.parametrize("rate_mps", [4.0, 7.0, -7.0])
def test_heights_in_feet_are_named(rate_mps: float, step_ft: float) -> None:
    found = checked(rate_mps, step_ft * FOOT_M, 1.0 / FOOT_M)
    assert found.startswith("error: 1-10: its heights are probably in feet")
    assert "and they are multiples of 25" in found


def test_fast_climbs_in_steps_of_feet_that_are_metres_are_right() -> None:
    # Fighters, in true metres.
    assert checked(13.0, 100 * FOOT_M) == ""


def test_impossible_climbs_without_steps_are_a_warning() -> None:
    assert checked(20.0, 0.001).startswith("warning: 1-10: its heights are probably in feet")


def test_few_aircraft_show_nothing() -> None:
    assert checked(7.0, 100 * FOOT_M, 1.0 / FOOT_M, aircraft=2) == ""


def test_missing_heights_and_names_show_nothing() -> None:
    time_s = np.arange(0.0, 900.0, 5.0)
    unknown: NDArray[np.int64] = np.full(len(time_s), -1)
    climbing = 20.0 * time_s
    assert check_vertical_rates("1-10", time_s, climbing, unknown) is None
    missing = np.full(len(time_s), np.nan)
    assert check_vertical_rates("1-10", time_s, missing, np.zeros(len(time_s), np.int64)) is None


def test_pairs_are_of_one_aircraft_and_apart_in_time() -> None:
    time_s = np.array([40.0, 0.0, 5.0, 35.0, 200.0, 0.0])
    aircraft = np.array([1, 1, 2, 2, 2, 3])
    first, last = pairs_apart(time_s, aircraft, 30.0, 60.0)
    assert list(zip(first.tolist(), last.tolist(), strict=True)) == [(1, 0), (2, 3)]


def test_steps_are_multiples() -> None:
    assert are_stepped(np.array([100.0, 125.0, 350.0]), 25.0)
    assert not are_stepped(np.array([100.0, 120.0, 350.0]), 25.0)
