"""Sigmas of reported positions by their scatter across the paths of aircraft."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.diagnosis.noise import check_position_scatter
from multiradar.diagnosis.plots import Plots

DEGREE_M = 111_195.0


def _reports(
    sigma_m: float, *, seed: int, interval_s: float = 1.3, turn_deg_per_s: float = 0.0
) -> Plots:
    # Aircraft at 220 m/s; reports at intervals that vary a little.
    random = np.random.default_rng(seed)
    parts = []
    for number in range(10):
        time_s = np.cumsum(random.uniform(0.8, 1.2, 200) * interval_s)
        course = random.uniform(0.0, 2.0 * np.pi) + np.radians(turn_deg_per_s) * time_s
        step = 220.0 * np.diff(time_s, prepend=0.0)
        east, north = (np.cumsum(step * one) for one in (np.sin(course), np.cos(course)))
        noise = random.normal(0.0, sigma_m, (2, len(time_s)))
        parts.append(
            np.column_stack([np.full(200, number), time_s, east + noise[0], north + noise[1]])
        )
    number, time_s, east, north = np.concatenate(parts).T
    missing = np.full(len(time_s), np.nan)
    latitude_deg = 50.0 + north / DEGREE_M
    longitude_deg = 8.0 + east / DEGREE_M / np.cos(np.radians(50.0))
    keys = np.full((len(time_s), 3), -1, np.int64)
    keys[:, 1] = number
    return Plots(time_s, missing, missing, latitude_deg, longitude_deg, missing, keys)


def _found(plots: Plots, sigma_m: float) -> str:
    found = check_position_scatter("adsb", plots, plots.keys[:, 1], sigma_m)
    return "" if found is None else f"{found.severity} {found.code}"


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("turn_deg_per_s", [0.0, 3.0])
def test_a_sigma_far_below_the_scatter_is_named(seed: int, turn_deg_per_s: float) -> None:
    plots = _reports(20.0, seed=seed, turn_deg_per_s=turn_deg_per_s)
    assert _found(plots, 1.0) == "error noise"
    assert _found(plots, 6.0) == "warning noise"
    for sigma_m in (12.0, 20.0, 60.0):
        assert _found(plots, sigma_m) == ""


def test_errors_along_the_path_are_not_those_of_positions() -> None:
    plots = _reports(10.0, seed=4)
    late = replace(
        plots, time_s=plots.time_s + np.random.default_rng(1).normal(0.0, 0.1, plots.size)
    )
    assert _found(late, 10.0) == ""


@pytest.mark.parametrize("interval_s", [4.0, 10.0])
def test_turns_between_reports_are_no_scatter(interval_s: float) -> None:
    plots = _reports(20.0, seed=5, interval_s=interval_s, turn_deg_per_s=3.0)
    assert _found(plots, 20.0) == ""


def test_reports_that_come_twice_do_not_matter() -> None:
    plots = _reports(20.0, seed=6)
    rows = np.repeat(np.arange(plots.size), np.where(np.arange(plots.size) % 7 == 0, 3, 1))
    twice = plots.select(rows)
    assert _found(twice, 1.0) == "error noise"
    assert _found(twice, 20.0) == ""
