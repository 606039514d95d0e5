"""Heights in feet, by the rates of climbs and descents."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.diagnosis.motion.vertical_rates import (
    check_height_scatter,
    check_vertical_rates,
    pairs_apart,
)

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


@pytest.mark.parametrize("factor", [1.0, 1.0 / FOOT_M])
def test_garbled_heights_hide_no_unit(factor: float) -> None:
    """Two of a hundred heights are wrong."""
    time_s, number = (
        np.tile(np.arange(0.0, 1500.0, 5.0), AIRCRAFT),
        np.repeat(np.arange(AIRCRAFT), 300),
    )
    height_m = np.round((1000.0 + 500.0 * number + 5.0 * time_s) / (25.0 * FOOT_M)) * 25.0 * FOOT_M
    height_m[::100] += 5000.0
    found = check_vertical_rates("1-10", time_s, height_m * factor, number)
    assert (found.code if found else "") == ("" if factor == 1.0 else "height_unit")


@pytest.mark.parametrize("garbled", [0.01, 0.02, 0.05])
def test_garbled_heights_of_level_flights_show_nothing(garbled: float) -> None:
    rng = np.random.default_rng(3)
    number = np.repeat(np.arange(20), 180)
    height_m = np.round((3000.0 + 300.0 * number) / (100.0 * FOOT_M)) * 100.0 * FOOT_M
    wrong = rng.random(len(number)) < garbled
    # Far enough to be climbs, too near to be jumps.
    height_m[wrong] += rng.uniform(-700.0, 700.0, np.count_nonzero(wrong))
    time_s = np.tile(np.arange(0.0, 900.0, 5.0), 20)
    assert check_vertical_rates("1-10", time_s, height_m, number) is None


@pytest.mark.parametrize("shift", [1, 3])
def test_heights_of_other_rows_are_not_taken_for_feet(shift: int) -> None:
    """Level flights at different heights, whose plots are not always in the same order."""
    rng = np.random.default_rng(1)
    time_s = np.concatenate([5.0 * scan + np.sort(rng.uniform(0.0, 4.0, 8)) for scan in range(60)])
    number = np.concatenate([rng.permutation(8) for _ in range(60)])
    height_m = 3000.0 + 1000.0 * number
    assert check_vertical_rates("1-10", time_s, height_m, number) is None
    found = check_vertical_rates("1-10", time_s, np.roll(height_m, shift), number)
    assert found is not None
    assert found.code == "height_rows"
    assert found.sentence.startswith("1-10: its heights or the identities of its aircraft probably")


def test_shuffled_heights_are_not_taken_for_feet() -> None:
    """The few that do not jump, by chance, climb fast."""
    rng = np.random.default_rng(2)
    time_s = np.tile(np.arange(0.0, 600.0, 5.0), 20)
    number = np.repeat(np.arange(20), 120)
    height_m = rng.permutation(2000.0 + 100.0 * number + 2.0 * time_s)
    found = check_vertical_rates("1-10", time_s, height_m, number)
    assert found is not None
    assert found.code == "height_rows"


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


@pytest.mark.parametrize("step_m", [25 * FOOT_M, 100 * FOOT_M, 0.001])
@pytest.mark.parametrize("rate_mps", [50.0, -80.0])
def test_steep_climbs_of_fighters_are_no_heights_in_feet(rate_mps: float, step_m: float) -> None:
    assert checked(rate_mps, step_m) == ""


@pytest.mark.parametrize(
    ("rate_mps", "step_m", "factor", "severity"),
    [
        # In steps of feet from 9 m/s on, without steps from 14 m/s on, and up to 8 m/s in feet.
        (2.9, 25 * FOOT_M, 1.0 / FOOT_M, "error"),
        (2.6, 25 * FOOT_M, 1.0 / FOOT_M, ""),
        (14.1, 0.001, 1.0, "warning"),
        (13.9, 0.001, 1.0, ""),
        (26.2, 0.001, 1.0, "warning"),
        (26.3, 0.001, 1.0, ""),
    ],
)
def test_rates_show_feet_between_bounds(
    rate_mps: float, step_m: float, factor: float, severity: str
) -> None:
    assert checked(rate_mps, step_m, factor).partition(":")[0] == severity


# Heights each 30 s, some of which follow by a climb of 20 m/s.
@pytest.mark.parametrize(
    ("pairs", "climbs", "known"),
    [
        (100, [15, 15, 15], True),
        (100, [14, 14, 14], False),
        (10, [7, 7, 6], True),
        (10, [7, 6, 6], False),
        (10, [10, 10], False),
    ],
)
def test_climbs_are_twenty_of_three_aircraft_that_climb_often(
    pairs: int, climbs: list[int], *, known: bool
) -> None:
    heights = [600.0 * np.minimum(np.arange(pairs + 1), count) + 0.1 for count in climbs]
    time_s = np.tile(30.0 * np.arange(pairs + 1), len(climbs))
    number = np.arange(len(climbs)).repeat(pairs + 1)
    found = check_vertical_rates("1-10", time_s, np.concatenate(heights), number)
    assert (found is not None) is known


def _scattered(
    sizes: list[int], off: list[int], *, off_m: float = 300.0, each_s: float = 4.0
) -> bool:
    """Return whether heights scatter, some of each aircraft's, which are apart, by so much."""
    parts = []
    for size, count in zip(sizes, off, strict=True):
        heights = np.zeros(size + 2)
        heights[1 : 1 + 3 * count : 3] = off_m
        parts.append(heights)
    number = np.arange(len(sizes)).repeat([len(one) for one in parts])
    time_s = each_s * np.concatenate([np.arange(len(one)) for one in parts])
    found = check_height_scatter("1-10", time_s, np.concatenate(parts), number, coded=True)
    return found is not None


@pytest.mark.parametrize(
    ("scattered", "known"),
    [
        (_scattered([36] * 3, [9] * 3), True),
        (_scattered([36] * 3, [9, 9, 8]), False),
        # 150 m, and 2 m/s² between two heights.
        (_scattered([36] * 3, [9] * 3, off_m=166.1), True),
        (_scattered([36] * 3, [9] * 3, off_m=165.9), False),
        (_scattered([36] * 3, [9] * 3, each_s=1.0), True),
        (_scattered([36] * 3, [9] * 3, each_s=0.99), False),
        (_scattered([36] * 3, [9] * 3, off_m=400.0, each_s=15.0), True),
        (_scattered([36] * 3, [9] * 3, off_m=400.0, each_s=15.1), False),
        (_scattered([33, 33, 34], [9] * 3), True),
        (_scattered([33, 33, 33], [9] * 3), False),
        # Of three aircraft, and of half of them.
        (_scattered([60] * 2, [20] * 2), False),
        (_scattered([60, 60, 60, 20, 20, 20], [20] * 3 + [0] * 3), True),
        (_scattered([60, 60, 60, 15, 15, 15, 15], [20] * 3 + [0] * 4), False),
    ],
)
def test_heights_scatter_from_their_bounds_on(*, scattered: bool, known: bool) -> None:
    assert scattered is known
