"""Heights of one radar in another unit, by their steps, and heights of 0 that stand for none."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

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


def arrivals(aircraft: int, taxi_s: float) -> Plots:
    """Return flights that land at a runway 5 km from a radar at the level of the sea, and taxi."""
    time_s = np.arange(-600.0, taxi_s, 4.0)
    number = np.repeat(np.arange(aircraft), len(time_s))
    to_s = np.tile(time_s, aircraft)
    ranges = 5e3 + np.where(to_s < 0.0, -130.0 * to_s, 5.0 * to_s)
    # At 70 m/s in the last two minutes, and on the runway.
    ranges -= np.where(to_s < 0.0, 60.0 * np.maximum(to_s + 120.0, 0.0) - 7200.0, 0.0)
    heights = np.round(np.maximum(-4.0 * to_s, 0.0) / 7.62) * 7.62
    missing = np.full(len(to_s), np.nan)
    return Plots(
        to_s + 90.0 * number, np.hypot(ranges, heights), np.full(len(to_s), 30.0), missing, missing,
        heights, number[:, None] * np.ones((1, 3), np.int64),
    )  # fmt: skip


@pytest.mark.parametrize("positions", [False, True])
def test_heights_of_0_on_the_runway_and_taxiways_are_heights(*, positions: bool) -> None:
    """Regression: all plots of an aircraft counted as flying that had once exceeded 1000 m."""
    plots = arrivals(30, 180.0)
    if positions:
        plots = replace(plots, latitude_deg=plots.range_m / 111e3, longitude_deg=plots.azimuth_deg)
    assert check_filled_heights("1-10", plots, None if positions else LEVEL) is None
    # Every second one in flight without a height: fewer are known than on the ground.
    filled = np.where(plots.keys[:, 0] % 2 == 0, 0.0, plots.height_m)
    found = check_filled_heights(
        "1-10", replace(plots, height_m=filled), None if positions else LEVEL
    )
    assert found is not None


# Ships, and reported as well by a radar on a mountain as by one that sees them in a duct.
@pytest.mark.parametrize("site_m", [400.0, 20.0])
@pytest.mark.parametrize(("speed_mps", "known"), [(8.0, False), (150.0, True)])
def test_heights_of_0_of_ships_are_no_placeholders(
    site_m: float, speed_mps: float, *, known: bool
) -> None:
    plots = traffic(0.0, 0.0, speed_mps, aircraft=15)
    plots = replace(plots, height_m=np.zeros(plots.size))
    found = check_height_unit("1-10", plots, (0.87, 0.26, site_m))
    assert (found is not None) == known


LEVEL = (0.87, 0.26, 0.0)


def constant(ranges: NDArray[np.float64], height_m: float, *, number: ArrayLike = -1) -> bool:
    """Return whether one height for all is in another unit than metres, or a placeholder."""
    count = len(ranges)
    missing = np.full(count, np.nan)
    keys = np.full((count, 3), -1, np.int64)
    keys[:, 0] = number
    plots = Plots(
        np.linspace(0.0, 4.0 * (count - 1), count), ranges, np.full(count, 30.0), missing, missing,
        np.full(count, height_m), keys,
    )  # fmt: skip
    return check_height_unit("1-10", plots, LEVEL) is not None


# Below 600 m, farther than 60 km; at 150 km the horizon is at 1324 m.
@pytest.mark.parametrize(
    ("found", "known"),
    [
        (constant(np.full(40, 60_001.0), 599.9), True),
        (constant(np.full(40, 60_001.0), 600.0), False),
        (constant(np.full(40, 60_000.0), 599.9), False),
        (constant(np.full(19, 60_001.0), 599.9), False),
        (constant(np.repeat([150e3, 9e3], [11, 29]), 700.0), True),
        (constant(np.repeat([150e3, 9e3], [10, 30]), 700.0), False),
        (constant(np.repeat([150e3, 9e3], [11, 29]), 1020.0), True),
        (constant(np.repeat([150e3, 9e3], [11, 29]), 1030.0), False),
    ],
)
def test_low_heights_of_far_aircraft_are_no_metres(*, found: bool, known: bool) -> None:
    assert found is known


# Flights towards the radar: below 10 000 ft, 190 m/s are too fast for the most of five aircraft.
@pytest.mark.parametrize(
    ("height_m", "speed_mps", "aircraft", "known"),
    [
        (3047.9, 191.0, 5, True),
        (3048.0, 191.0, 5, False),
        (3047.9, 189.0, 5, False),
        (3047.9, 191.0, 4, False),
    ],
)
def test_traffic_below_fl100_is_slow(
    height_m: float, speed_mps: float, aircraft: int, *, known: bool
) -> None:
    rows = np.arange(50 * aircraft)
    number = rows // 50
    # 90 km away, the slant range changes like the path.
    ranges = np.asarray(100e3 - speed_mps * 4.0 * (rows % 50), np.float64)
    assert constant(ranges, height_m, number=number) is known


def filled(
    zero: int, others: int, other_m: float, *, range_m: float = 10e3, speed_mps: float = 0.0,
    ground: int = 0,
) -> bool:  # fmt: skip
    """Return whether heights of 0 are missing ones, of an aircraft and of one on the ground."""
    count = zero + others
    time_s = 4.0 * np.concatenate([np.arange(count), np.arange(ground)])
    missing = np.full(len(time_s), np.nan)
    keys = np.full((len(time_s), 3), -1, np.int64)
    keys[:, 0] = np.arange(len(time_s)) >= count
    ranges = np.where(keys[:, 0] == 0, range_m + speed_mps * time_s, 10e3)
    # Evenly among the others, which show the height before and after.
    heights = np.concatenate([np.full(count, other_m), np.zeros(ground)])
    heights[np.arange(zero) * count // zero] = 0.0
    plots = Plots(time_s, ranges, np.full(len(time_s), 30.0), missing, missing, heights, keys)
    return check_filled_heights("1-10", plots, LEVEL) is not None


@pytest.mark.parametrize(
    ("found", "known"),
    [
        (filled(20, 100, 300.1), True),
        (filled(20, 100, 300.0), False),
        (filled(19, 100, 300.1), False),
        (filled(20, 980, 300.1), True),
        (filled(20, 981, 300.1), False),
        (filled(20, 100, 300.1, ground=20), True),
        (filled(20, 100, 300.1, ground=21), False),
        (filled(200, 20, 200.0, speed_mps=101.0), True),
        (filled(200, 20, 200.0, speed_mps=99.0), False),
        # The next height is up to 80 s away: a slow aircraft may land.
        (filled(200, 5, 500.0, speed_mps=31.0), True),
        (filled(200, 5, 500.0, speed_mps=29.0), False),
        # The horizon is at 300 m in 71.4 km.
        (filled(20, 20, 250.0, range_m=71_500.0), True),
        (filled(20, 20, 250.0, range_m=71_200.0), False),
    ],
)
def test_heights_of_0_are_missing_ones_from_their_bounds_on(*, found: bool, known: bool) -> None:
    assert found is known
