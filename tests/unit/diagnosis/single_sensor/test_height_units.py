"""Heights of one radar in another unit, by their steps, and heights of 0 that stand for none."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.diagnosis.motion.height_steps import are_in
from multiradar.diagnosis.plots import Plots
from multiradar.diagnosis.single_sensor.height_units import check_filled_heights, check_height_unit

SITE = (0.87, 0.26, 300.0)
FEET, FLIGHT_LEVELS, QUARTERS = 0.3048, 30.48, 7.62


def traffic(
    lowest_m: float, highest_m: float, speed_mps: float, step_m: float = 7.62, aircraft: int = 12
) -> Plots:
    """Return flights towards a radar from 110 km, at heights in steps; 0 for none."""
    time_s = np.tile(np.arange(0.0, 200.0, 4.0), aircraft)
    number = np.repeat(np.arange(aircraft), len(time_s) // aircraft)
    heights = np.linspace(lowest_m, highest_m, aircraft)[number] + 0.3 * time_s
    stepped = np.round(heights / step_m) * step_m if step_m else heights
    missing = np.full(len(time_s), np.nan)
    return Plots(
        time_s, 110e3 - speed_mps * time_s, number * 360.0 / aircraft, missing, missing, stepped,
        number[:, None] * np.ones((1, 3), np.int64),
    )  # fmt: skip


def unit_of(plots: Plots, metres: float = 1.0) -> str:
    """Return the unit that is named where the heights are divided by so many metres."""
    found = check_height_unit("1-10", replace(plots, height_m=plots.height_m / metres), SITE)
    return "" if found is None else found.sentence.partition("probably in ")[2].partition(":")[0]


@pytest.mark.parametrize("step_m", [7.62, 30.48, 0.0])
@pytest.mark.parametrize(
    ("lowest_m", "highest_m", "speed_mps"),
    [
        # Low military flights, and those higher than airliners.
        (150.0, 500.0, 260.0),
        (300.0, 2500.0, 260.0),
        (15_000.0, 20_000.0, 220.0),
    ],
)
def test_heights_of_military_flights_are_metres(
    lowest_m: float, highest_m: float, speed_mps: float, step_m: float
) -> None:
    assert unit_of(traffic(lowest_m, highest_m, speed_mps, step_m)) == ""


def test_heights_in_whole_metres_are_metres() -> None:
    plots = traffic(150.0, 500.0, 260.0)
    assert unit_of(replace(plots, height_m=np.round(plots.height_m))) == ""


@pytest.mark.parametrize(
    ("metres", "unit"),
    [
        (FEET, "feet"),
        (QUARTERS, "units of 25 ft"),
        (FLIGHT_LEVELS, "flight levels"),
        (10.0, "tens of metres"),
        (100.0, "hundreds of metres"),
        (1000.0, "kilometres"),
    ],
)
def test_steps_show_the_unit(metres: float, unit: str) -> None:
    assert unit in unit_of(traffic(6000.0, 11_500.0, 220.0), metres)


@pytest.mark.parametrize(("highest_m", "known"), [(8_000.0, True), (5_000.0, False)])
def test_heights_without_steps_are_in_feet_where_no_aircraft_flies(
    highest_m: float, *, known: bool
) -> None:
    assert (unit_of(traffic(3000.0, highest_m, 220.0, 0.0), FEET) == "feet") == known


def test_few_values_and_whole_units_show_no_metres() -> None:
    assert not are_in(np.array([0.0, 7.62, 7.62]), 1.0)
    assert are_in(np.array([0.0, 8.0, 15.0, 23.0, 30.0]), 1.0)
    whole = np.arange(1.0, 13.0)
    assert not are_in(whole, 1.0)
    assert are_in(whole, QUARTERS)
    assert not are_in(whole[:6], QUARTERS)


def test_level_flights_at_round_heights_show_no_unit() -> None:
    plots = traffic(300.0, 450.0, 260.0, aircraft=6)
    levels = 300.0 + 30.0 * plots.keys[:, 0].astype(np.float64)
    assert unit_of(replace(plots, height_m=levels)) == ""


@pytest.mark.parametrize("positions", [False, True])
@pytest.mark.parametrize(
    ("speed_mps", "every", "known"), [(220.0, 3, True), (220.0, 200, False), (10.0, 3, False)]
)
def test_heights_of_0_of_aircraft_that_fly_are_named(
    speed_mps: float, every: int, *, positions: bool, known: bool
) -> None:
    plots = traffic(6000.0, 9000.0, speed_mps)
    # Aircraft without heights, and aircraft on the ground at the level of the sea.
    zero = (plots.keys[:, 0] + 1) % every == 0
    plots = replace(plots, height_m=np.where(zero, 0.0, plots.height_m))
    plots = replace(plots, range_m=plots.range_m - 70e3)
    if positions:
        east = plots.keys[:, 0].astype(np.float64)
        plots = replace(plots, latitude_deg=plots.range_m / 111e3, longitude_deg=east)
    found = check_filled_heights("1-10", plots, None if positions else SITE)
    assert (found is not None) == known
    assert found is None or found.code == "column_constant"
    assert found is None or "probably 0 where no height was reported" in found.sentence


def test_garbled_heights_of_0_are_named_by_the_other_heights() -> None:
    plots = traffic(6000.0, 9000.0, 220.0)
    zero = np.arange(plots.size) % 10 == 0
    found = check_filled_heights(
        "1-10", replace(plots, height_m=np.where(zero, 0.0, plots.height_m)), SITE
    )
    assert found is not None
