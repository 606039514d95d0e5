"""Ranges that start again from 0, and heights that no aircraft flies."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.diagnosis.motion.vertical_rates import check_height_scatter
from multiradar.diagnosis.single_sensor.steps import check_wrapped
from support.scenarios.rotating import rotating_plots

SEEDS = range(3)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("end_m", [32_768.0, 65_536.0])
def test_ranges_of_too_few_bits_are_named(seed: int, end_m: float) -> None:
    plots = rotating_plots(seed=seed, aircraft=30, clutter_share=0.1 * seed)
    assert check_wrapped("1-10", plots) is None
    found = check_wrapped("1-10", replace(plots, range_m=plots.range_m % end_m))
    assert found is not None
    assert found.code == "range_wrapped"
    beyond_m = float(found.sentence.partition("beyond ")[2].partition(" m")[0])
    assert beyond_m == pytest.approx(end_m, rel=0.01)


def test_identities_of_other_rows_are_no_end_of_the_ranges() -> None:
    plots = rotating_plots(aircraft=30)
    keys = np.random.default_rng(1).permutation(plots.keys)
    assert check_wrapped("1-10", replace(plots, keys=keys)) is None


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("period_s", [4.0, 10.0])
def test_heights_that_jump_are_named(seed: int, period_s: float) -> None:
    plots = rotating_plots(seed=seed, period_s=period_s, duration_s=400.0)
    rows = plots.time_s, plots.height_m, plots.keys[:, 0]
    assert check_height_scatter("1-10", *rows, coded=True) is None
    random = np.random.default_rng(seed)
    jumping = plots.height_m + random.uniform(0.0, 1200.0, plots.size)
    found = check_height_scatter("1-10", rows[0], jumping, rows[2], coded=True)
    assert found is not None
    assert (found.code, found.severity) == ("height_scatter", "error")


def test_some_garbled_heights_and_steep_flight_are_right() -> None:
    plots = rotating_plots(duration_s=600.0)
    random = np.random.default_rng(2)
    garbled = np.where(random.random(plots.size) < 0.04, 3000.0, plots.height_m)
    # Aerobatics: ±500 m in half a minute.
    steep = plots.height_m + 500.0 * np.sin(plots.time_s * 0.1)
    for height_m in (garbled, steep):
        assert (
            check_height_scatter("1-10", plots.time_s, height_m, plots.keys[:, 0], coded=True)
            is None
        )


def test_measured_heights_that_scatter_are_a_warning() -> None:
    plots = rotating_plots(duration_s=400.0)
    scattered = plots.height_m + np.random.default_rng(2).normal(0.0, 600.0, plots.size)
    found = check_height_scatter("1-10", plots.time_s, scattered, plots.keys[:, 0], coded=False)
    assert found is not None
    assert found.severity == "warning"
