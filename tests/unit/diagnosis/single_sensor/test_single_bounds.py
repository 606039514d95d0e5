"""Checks of one sensor at their bounds: on the bound, and one step beyond it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

from multiradar.diagnosis.plots import Floats, Plots
from multiradar.diagnosis.single_sensor.columns import (
    check_constant,
    check_signed,
    check_time_rate,
    check_time_resolution,
    check_time_unit,
)
from multiradar.diagnosis.single_sensor.jumps import check_jumps
from multiradar.diagnosis.single_sensor.steps import check_limits, check_wrapped, step_of


def plots(
    time_s: ArrayLike, *, number: ArrayLike = -1, address: ArrayLike = -1, **columns: ArrayLike
) -> Plots:
    """Return plots with some columns, one value each or one for all."""
    times = np.asarray(time_s, np.float64)
    rows = len(times)

    def given(name: str) -> Floats:
        return np.array(np.broadcast_to(np.asarray(columns.get(name, np.nan), np.float64), rows))

    identity = [np.broadcast_to(np.asarray(one, np.int64), rows) for one in (number, address, -1)]
    return Plots(
        times, given("range_m"), given("azimuth_deg"), given("latitude_deg"),
        given("longitude_deg"), given("height_m"), np.column_stack(identity),
    )  # fmt: skip


# Of 20 azimuths of at most −1° on; −180° is one, and so is 180°.
@pytest.mark.parametrize(
    ("negative", "largest", "known"),
    [
        ([-1.0] * 20, 90.0, True),
        ([-1.0] * 19 + [-0.99], 90.0, False),
        ([-180.0] * 20, 90.0, True),
        ([-180.0] * 19 + [-180.01], 90.0, False),
        ([-1.0] * 20, 180.0, True),
        ([-1.0] * 20, 180.01, False),
    ],
)
def test_azimuths_are_signed_within_half_a_circle(
    negative: list[float], largest: float, *, known: bool
) -> None:
    azimuth_deg = np.array([*negative, largest, np.nan])
    found = check_signed("1-10", plots(np.arange(len(azimuth_deg)), azimuth_deg=azimuth_deg))
    assert (found is not None) is known
    assert found is None or f"20 of {len(negative) + 1} are negative" in found.sentence


@pytest.mark.parametrize(
    ("same", "rows", "known"), [(14, 20, True), (13, 20, False), (16, 19, False)]
)
def test_a_column_is_constant_in_two_thirds_of_twenty_plots(
    same: int, rows: int, *, known: bool
) -> None:
    azimuth_deg = np.arange(rows, dtype=np.float64)
    azimuth_deg[:same] = 10.0
    made = plots(np.arange(rows), range_m=1e3 * np.arange(rows), azimuth_deg=azimuth_deg)
    found = check_constant("1-10", made)
    assert (found is not None) is known
    assert found is None or "its azimuth_deg is probably a placeholder" in found.sentence
    # A transponder at a fixed place.
    assert check_constant("1-10", replace(made, range_m=azimuth_deg)) is None


@pytest.mark.parametrize(("different", "known"), [(20, True), (19, False)])
def test_copies_are_no_constant_column(different: int, *, known: bool) -> None:
    time_s = np.arange(different).repeat(3)
    found = check_constant("1-10", plots(time_s, range_m=time_s * 1e3, azimuth_deg=10.0))
    assert (found is not None) is known


def _repeating(between_s: float, count: int = 21) -> Plots:
    return plots(between_s * np.arange(count), number=7, range_m=1e3, azimuth_deg=1.0)


@pytest.mark.parametrize(
    ("made", "known"),
    [
        (_repeating(4000.0 * 1.049), True),
        (_repeating(4000.0 * 0.951), True),
        (_repeating(4000.0 * 1.051), False),
        (_repeating(4000.0 * 0.949), False),
        (_repeating(4000.0, count=20), False),
    ],
)
def test_a_unit_of_times_is_that_of_twenty_intervals_within_5_per_cent(
    made: Plots, *, known: bool
) -> None:
    found = check_time_unit("1-10", made, 4.0)
    assert (found is not None) is known
    assert found is None or "probably in milliseconds: the plots of an aircraft" in found.sentence


@pytest.mark.parametrize(("between", "text"), [(99.9, "99.9 apart"), (100.0, "100 apart")])
def test_long_times_between_plots_are_written_as_whole_numbers(between: float, text: str) -> None:
    found = check_time_unit("1-10", _repeating(between), between / 1e3)
    assert found is not None
    assert text in found.sentence


@pytest.mark.parametrize(("median", "known"), [(1.0e11, False), (1.001e11, True)])
def test_unix_times_beyond_the_year_5000_are_in_another_unit(median: float, *, known: bool) -> None:
    made = plots(median + 4.1 * np.arange(-10.0, 11.0), range_m=1e3, azimuth_deg=1.0)
    found = check_time_unit("1-10", made, np.nan)
    assert (found is not None) is known


def _steady(period_s: float) -> tuple[Plots, float]:
    return plots(period_s * np.arange(30.0), number=7, range_m=1e3, azimuth_deg=1.0), 4.0


# Periods that are as different from each other as the configured ones show a rate.
@pytest.mark.parametrize(
    ("periods_s", "configured_s", "known"),
    [
        ((4.8, 6.0), (4.0, 5.0), True),
        ((4.8,), (4.0,), False),
        ((4.36, 5.45), (4.0, 5.0), False),
        ((4.8, 6.11), (4.0, 5.0), True),
        ((4.8, 6.13), (4.0, 5.0), False),
        # The same period twice.
        ((4.8, 5.27), (4.0, 4.4), False),
        ((4.8, 5.29), (4.0, 4.4), True),
    ],
)
def test_times_run_at_another_rate_where_different_periods_have_one_ratio(
    periods_s: tuple[float, ...], configured_s: tuple[float, ...], *, known: bool
) -> None:
    radars = [
        (_steady(found_s)[0], given_s)
        for found_s, given_s in zip(periods_s, configured_s, strict=True)
    ]
    found = check_time_rate([*radars, (_steady(4.0)[0], np.nan)])
    assert (found is not None) is known
    assert found is None or "s per second: all 2 radars" in found.sentence


@pytest.mark.parametrize(("ratio", "code"), [(1049.0, "time_unit"), (1051.0, "time_rate")])
def test_a_rate_is_a_unit_within_5_per_cent(ratio: float, code: str) -> None:
    found = check_time_rate([(_steady(ratio * one)[0], one) for one in (4.0, 5.0)])
    assert found is not None
    assert found.code == code


@pytest.mark.parametrize(
    ("count", "step_s", "period_s", "severity"),
    [
        (100, 1.0, 4.0, "error"),
        (99, 1.0, 4.0, None),
        (100, 0.5, 4.0, "warning"),
        (100, 0.25, 4.0, None),
        (100, 10.0, 4.0, "error"),
        # One time for each scan.
        (100, 4.0, 4.15, None),
        (100, 4.0, 4.25, "error"),
        (100, 1.0, np.nan, None),
    ],
)
def test_coarse_times_are_those_of_100_plots(
    count: int, step_s: float, period_s: float, severity: str | None
) -> None:
    found = check_time_resolution("1-10", plots(step_s * np.arange(count)), period_s)
    assert (None if found is None else found.severity) == severity


# Plots of two aircraft at once, far apart, that are exchanged each second time, `swapped` times.
def _exchanging(steps: int, swapped: int, *, far_m: float = 50_000.0, each_s: float = 4.0) -> Plots:
    time_s = each_s * np.arange(steps + 1).repeat(2)
    number = np.tile([0, 1], steps + 1)
    other = number.astype(np.bool_)
    rows = np.arange(steps + 1).repeat(2)
    other ^= (rows < 2 * swapped) & (rows % 2 == 1)
    return plots(
        time_s, number=number, range_m=60_000.0 + far_m * other, azimuth_deg=90.0, height_m=0.0
    )


SITE = (0.8, 0.1, 0.0)


@pytest.mark.parametrize(
    ("made", "known"),
    [
        # 100 steps of both aircraft, 3 of which jump there, and 3 back.
        (_exchanging(50, 2), True),
        (_exchanging(49, 2), False),
        # 3 % of the steps.
        (_exchanging(65, 1), True),
        (_exchanging(66, 1), False),
        # 5 km, and 700 m/s for 4 s.
        (_exchanging(50, 2, far_m=7810.0), True),
        (_exchanging(50, 2, far_m=7790.0), False),
        (_exchanging(50, 2, each_s=30.0), True),
        (_exchanging(50, 2, each_s=30.1), False),
    ],
)
def test_identities_jump_from_their_bounds_on(made: Plots, *, known: bool) -> None:
    found = check_jumps("1-10", made, SITE)
    assert (found is not None) is known
    assert found is None or found.code == "other_rows"


@pytest.mark.parametrize(("steady", "known"), [(2, True), (3, False)])
def test_half_of_the_identities_jump(steady: int, *, known: bool) -> None:
    made = _exchanging(50, 2)
    merged = plots(
        np.concatenate([made.time_s, np.tile(made.time_s[::2], steady)]),
        number=np.concatenate([made.keys[:, 0], 2 + np.arange(steady).repeat(51)]),
        range_m=np.concatenate([made.range_m, np.full(51 * steady, 200_000.0)]),
        azimuth_deg=90.0,
        height_m=0.0,
    )
    assert (check_jumps("1-10", merged, SITE) is not None) is known


# Single plots of aircraft 150 km away; `near` of them are nearer than it.
def _reflected(far: int, near: int) -> Plots:
    count = 4 * (far + near) + 4
    ranges = np.full(count, 150_000.0)
    ranges[2 : 2 + 4 * far : 4] = 200_000.0
    ranges[2 + 4 * far : 2 + 4 * (far + near) : 4] = 100_000.0
    return plots(
        4.0 * np.arange(count), number=np.arange(count) // 60, range_m=ranges, azimuth_deg=90.0,
        height_m=0.0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("far", "near", "code"),
    [(30, 10, "reflections"), (30, 11, None), (20, 0, None), (40, 0, "reflections")],
)
def test_reflections_come_from_farther_away(far: int, near: int, code: str | None) -> None:
    found = check_jumps("1-10", _reflected(far, near), SITE)
    assert (None if found is None else found.code) == code


@pytest.mark.parametrize(
    ("values", "least", "step"),
    [
        ([0.0, 10.0, 20.0, 50.0], 9.9, 10.0),
        ([0.0, 10.0, 20.0, 50.0], 10.0, 0.0),
        ([0.3, 10.3, 20.3, 50.3], 9.0, 10.0),
        # Within 2 % of the step, and of 1.1 where all are whole numbers.
        ([0.0, 10.0, 20.15, 50.0], 9.0, 10.0),
        ([0.0, 10.0, 20.25, 50.0], 9.0, 0.0),
        ([0.0, 10.0, 21.0, 50.0], 9.0, 10.0),
        ([0.0, 10.0, 22.0, 50.0], 9.0, 0.0),
        ([5.0], 1.0, 0.0),
    ],
)
def test_a_step_divides_all_distances(values: list[float], least: float, step: float) -> None:
    assert step_of(np.array(values), least) == pytest.approx(step, abs=0.01)


# 8 times more often than any other value, and in 2 % of the plots.
@pytest.mark.parametrize(
    ("limited", "others", "repeats", "wide_deg", "known"),
    [
        (20, 980, 1, 90.0, True),
        (19, 500, 1, 90.0, False),
        (20, 981, 1, 90.0, False),
        (32, 200, 4, 90.0, True),
        (31, 200, 4, 90.0, False),
        (20, 19, 1, 90.0, True),
        (20, 18, 1, 90.0, False),
        # Two directions: their mean is shorter than cos 5°.
        (20, 980, 1, 10.1, True),
        (20, 980, 1, 9.9, False),
    ],
)
def test_the_largest_range_is_a_limit_where_many_plots_have_it(
    limited: int, others: int, repeats: int, wide_deg: float, *, known: bool
) -> None:
    ranges = np.concatenate([1e3 + np.arange(others // repeats).repeat(repeats), [90e3] * limited])
    azimuth_deg = np.concatenate([np.zeros(others), wide_deg * (np.arange(limited) % 2)])
    made = plots(np.arange(len(ranges)), range_m=ranges, azimuth_deg=azimuth_deg)
    found = check_limits("1-10", made)
    assert (found is not None) is known


# Aircraft that pass from one end of the ranges to the other.
def _wrapping(jumps: int, aircraft: int, *, others: int = 0, near_m: float = 900.0) -> Plots:
    each = 12
    number = np.arange(max(aircraft, jumps)).repeat(each)
    ranges = np.tile(40_000.0 + 100.0 * np.arange(each), max(aircraft, jumps))
    for one in range(jumps):
        ranges[each * one : each * one + 6] = 60_000.0
        ranges[each * one + 6 : each * (one + 1)] = near_m
    # The other long steps are of clutter far from the ends.
    number = np.concatenate([number % aircraft + 100 * (number // aircraft), *(
        np.full(2, 9000 + one) for one in range(others)
    )])  # fmt: skip
    ranges = np.concatenate([ranges, np.tile([10_000.0, 45_000.0], others)])
    return plots(4.0 * np.arange(len(ranges)), number=number, range_m=ranges)


@pytest.mark.parametrize(
    ("made", "known"),
    [
        (_wrapping(5, 5), True),
        (_wrapping(4, 4), False),
        (_wrapping(9, 9, others=1), True),
        (_wrapping(9, 9, others=2), False),
        # 2 km, and 500 m/s for 4 s.
        (_wrapping(5, 5, near_m=4000.0), True),
        (_wrapping(5, 5, near_m=4001.0), False),
    ],
)
def test_ranges_start_again_in_five_jumps_from_end_to_end(made: Plots, *, known: bool) -> None:
    assert (check_wrapped("1-10", made) is not None) is known


@pytest.mark.parametrize(("jumping", "known"), [(3, True), (2, False)])
def test_ranges_start_again_for_three_aircraft(jumping: int, *, known: bool) -> None:
    """There and back again, more than five times in all."""
    ranges = np.tile([60_000.0, 900.0], 10)
    number = np.arange(jumping).repeat(20)
    made = plots(4.0 * np.arange(20 * jumping), number=number, range_m=np.tile(ranges, jumping))
    assert (check_wrapped("1-10", made) is not None) is known
    # After half a minute it is another flight.
    slow = replace(made, time_s=made.time_s / 4.0 * 31.0)
    assert check_wrapped("1-10", slow) is None
