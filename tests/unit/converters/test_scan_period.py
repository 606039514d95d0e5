"""Scan periods from plots alone: of antennas that rotate, and none of those that do not."""

import math

import numpy as np
import pytest

from multiradar_converters.scan_period import (
    PLOTS_MIN,
    preferred_period,
    scan_period_s,
    why_no_period,
)
from support.scenarios.sweeps import sweep


@pytest.mark.parametrize("period_s", [4.0, 4.9, 12.0])
def test_traffic_in_one_direction_does_not_halve_the_period(period_s: float) -> None:
    found = scan_period_s(*sweep(period_s, 600.0, 1, sector_deg=20.0))
    assert found == pytest.approx(period_s, rel=2e-3)


@pytest.mark.parametrize("seed", range(4))
def test_traffic_in_a_single_direction_means_the_slowest_of_equal_explanations(seed: int) -> None:
    # Its frequency lies between two that are tried, twice its frequency on one.
    period_s = 360.0 / 72.5
    found = scan_period_s(*sweep(period_s, 600.0, seed, targets=10, sector_deg=0.5))
    assert found == pytest.approx(period_s, rel=2e-3)


def test_plots_that_come_one_by_one_without_order_say_nothing() -> None:
    for seed in range(12):
        generator = np.random.default_rng(seed)
        count, span_s = 80, 7200.0
        time_s, azimuth_deg = (
            generator.uniform(0.0, span_s, count),
            generator.uniform(0, 360, count),
        )
        assert math.isnan(scan_period_s(time_s, azimuth_deg))


@pytest.mark.parametrize(("scans", "relative"), [(1.0, 0.03), (3.0, 0.01)])
def test_a_few_scans_are_enough(scans: float, relative: float) -> None:
    found = scan_period_s(*sweep(5.0, scans * 5.0, 2, targets=80))
    assert found == pytest.approx(5.0, rel=relative)


def test_clutter_among_the_plots_does_no_harm() -> None:
    time_s, azimuth_deg = sweep(4.0, 600.0, 3)
    generator = np.random.default_rng(4)
    false = len(time_s) // 2
    time_s = np.append(time_s, generator.uniform(time_s.min(), time_s.max(), false))
    azimuth_deg = np.append(azimuth_deg, generator.uniform(0.0, 360.0, false))
    assert scan_period_s(time_s, azimuth_deg) == pytest.approx(4.0, rel=1e-3)


def test_what_does_not_rotate_has_none() -> None:
    generator = np.random.default_rng(5)
    time_s, azimuth_deg = generator.uniform(0.0, 600.0, 4000), generator.uniform(0.0, 360.0, 4000)
    assert math.isnan(scan_period_s(time_s, azimuth_deg))
    clockwise = sweep(4.0, 600.0, 6)
    assert math.isnan(scan_period_s(clockwise[0], -clockwise[1] % 360.0))
    assert math.isnan(scan_period_s(np.full(100, 7.0), generator.uniform(0.0, 360.0, 100)))


def test_few_plots_and_those_without_azimuth_say_nothing() -> None:
    time_s, azimuth_deg = sweep(4.0, 600.0, 7)
    assert math.isnan(scan_period_s(time_s[: PLOTS_MIN - 1], azimuth_deg[: PLOTS_MIN - 1]))
    assert math.isnan(scan_period_s(time_s, np.full(len(time_s), np.nan)))
    assert math.isnan(scan_period_s(np.zeros(0), np.zeros(0)))
    some = np.where(np.arange(len(time_s)) % 2, azimuth_deg, np.nan)
    assert scan_period_s(time_s, some) == pytest.approx(4.0, rel=1e-3)


def test_the_reason_for_no_scan_period_is_named() -> None:
    time_s, azimuth_deg = np.linspace(0.0, 0.45, 4), np.zeros(4)
    assert why_no_period(time_s, azimuth_deg) == (
        "only 4 plots in 0.45 s; at least 30 within a minute are needed"
    )
    assert why_no_period(time_s, azimuth_deg * np.nan) == "no plots with a time and an azimuth"
    generator = np.random.default_rng(5)
    still = generator.uniform(0.0, 600.0, 4000), generator.uniform(0.0, 360.0, 4000)
    assert math.isnan(scan_period_s(*still))
    assert why_no_period(*still) == "4000 plots show no rotation"


def test_north_marks_of_which_many_are_missing_do_not_give_the_scan_period() -> None:
    assert preferred_period(4.0, 4.001, "plots") == (4.0, "service messages")
    assert preferred_period(4.0, 11.9, "plots") == (4.0, "service messages")
    assert preferred_period(4.0, math.nan, "too few plots") == (4.0, "service messages")
    assert preferred_period(math.nan, 4.0, "plots") == (4.0, "plots")
    assert preferred_period(12.0, 4.0, "plots") == (
        4.0, "plots; north markers (every 12 s) are incomplete"
    )  # fmt: skip
