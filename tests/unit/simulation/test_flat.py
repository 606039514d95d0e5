"""Flat plots are the truth plus biases plus noise; the report's scenario is as published."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.errors import ConfigurationError
from multiradar.simulation.flat import FlatPlots, flat_plots
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.simulation.scenario.model import Aircraft, Bias, Scenario, Sensor

DEGREE = float(np.radians(1.0))


@pytest.fixture(scope="module")
def plots() -> FlatPlots:
    return flat_plots(builtin_scenario("report-1-6"), np.random.default_rng(1))


def left(plots: FlatPlots) -> np.ndarray:
    """Residuals of range and azimuth without truth and biases, (p, 2)."""
    line = plots.truth[:, :2] - plots.site_m[plots.radar]
    grid = plots.biases[np.round(plots.time_s).astype(int), plots.radar]
    azimuth = plots.azimuth_rad - np.arctan2(*line.T) - grid[:, 1]
    ranges = plots.range_m - np.hypot(*line.T) * (1.0 + grid[:, 2]) - grid[:, 0]
    return np.stack([ranges, np.angle(np.exp(1j * azimuth))], axis=-1)


def test_the_scenario_of_section_1_6_is_as_published(plots: FlatPlots) -> None:
    assert len(plots) == 45_000
    # The table lists north first; here the order is (east, north).
    np.testing.assert_array_equal(plots.site_m, [[-20e3, -20e3], [-30e3, 230e3], [235e3, -35e3]])
    np.testing.assert_allclose(plots.biases[:, :, 0], np.tile([400.0, 130.0, -300.0], (1001, 1)))
    azimuth = plots.biases[-1, :, 1] / DEGREE
    np.testing.assert_allclose(azimuth, [-0.19, -0.16, 0.17], rtol=1e-12)
    assert plots.states.shape == (1001, 15, 4)
    # All radars see all aircraft in every second.
    assert np.all(np.bincount(plots.time_s.astype(int))[1:] == 45)
    assert np.all(np.bincount(plots.aircraft) == 3000)


def test_its_noise_is_15_m_and_a_twentieth_of_a_degree(plots: FlatPlots) -> None:
    noise = left(plots) / [15.0, 0.05 * DEGREE]
    # Standard errors of mean and sigma: 0.0047 and 0.0033.
    np.testing.assert_allclose(noise.mean(axis=0), 0.0, rtol=0, atol=0.02)
    np.testing.assert_allclose(noise.std(axis=0), 1.0, rtol=0, atol=0.015)
    assert abs(np.mean(noise[:, 0] * noise[:, 1])) < 0.02


def test_tracks_are_straight_and_the_grid_agrees_with_the_plots(plots: FlatPlots) -> None:
    np.testing.assert_allclose(np.diff(plots.states[:, :, 2:], axis=0), 0.0, atol=1e-9)
    at = plots.states[np.round(plots.time_s).astype(int), plots.aircraft]
    np.testing.assert_allclose(plots.truth, at, rtol=0, atol=1e-6)
    speed = np.hypot(*plots.states[0, :, 2:].T)
    assert np.all((speed > 150.0) & (speed < 250.0))


def test_runs_share_the_paths_and_differ_in_the_noise() -> None:
    scenario = replace(builtin_scenario("report-1-6"), duration_s=20.0)
    first, second = (flat_plots(scenario, np.random.default_rng(seed)) for seed in (1, 2))
    np.testing.assert_array_equal(first.states, second.states)
    assert not np.any(first.range_m == second.range_m)
    again = flat_plots(scenario, np.random.default_rng(1))
    np.testing.assert_array_equal(first.range_m, again.range_m)
    other = flat_plots(replace(scenario, seed=17), np.random.default_rng(1))
    assert not np.any(first.states[0] == other.states[0])


@pytest.mark.slow
def test_biases_drift_at_the_published_rate() -> None:
    scenario = replace(builtin_scenario("report-1-6-drift"), duration_s=100.0)
    walks = [flat_plots(scenario, np.random.default_rng(seed)).biases for seed in range(60)]
    moved = np.array([walk[100] - walk[0] for walk in walks])
    # 180 values each: a standard error of 5 %.
    assert moved[:, :, 0].std() == pytest.approx(1.0 * 10.0, rel=0.17)
    assert np.degrees(moved[:, :, 1].std()) == pytest.approx(0.02 * 10.0, rel=0.17)
    np.testing.assert_array_equal(moved[:, :, 2:], 0.0)
    steps = np.diff(walks[0][:, 0, 0])
    assert abs(np.corrcoef(steps[1:], steps[:-1])[0, 1]) < 0.3


def _one(bias: tuple[Bias, ...], rotation_period_s: float | None = None) -> FlatPlots:
    # North-east and flying west: range and azimuth both decrease, at different rates.
    aircraft = Aircraft(1, 60e3, 20e3, 0.0, 250.0, np.radians(-100.0))
    radar = Sensor(
        "r", "radar", 10e3, -30e3, biases=bias, range_sigma_m=1e-9, azimuth_sigma_rad=1e-15,
        rotation_period_s=rotation_period_s,
    )  # fmt: skip
    scenario = Scenario("one", 1, 100.0, "flat", (0.9, 1.0), (aircraft,), (), (radar,))
    return flat_plots(scenario, np.random.default_rng(0))


@pytest.mark.parametrize("kind", range(4))
def test_a_bias_is_measured_minus_true(kind: int) -> None:
    size = (123.0, 0.4 * DEGREE, 0.002, 0.5)[kind]
    bias = tuple(Bias(size if one == kind else 0.0) for one in range(4))
    clean, biased = _one((Bias(),) * 4), _one(bias)
    range_m, azimuth_rad = clean.range_m[49], clean.azimuth_rad[49]
    rates = [(column[50] - column[48]) / 2.0 for column in (clean.range_m, clean.azimuth_rad)]
    # A stamp late by half a second shows the position of half a second earlier.
    late = [range_m - 0.5 * rates[0], azimuth_rad - 0.5 * rates[1]]
    expected = [[range_m + 123.0, azimuth_rad], [range_m, azimuth_rad + 0.4 * DEGREE],
                [range_m * 1.002, azimuth_rad], late][kind]  # fmt: skip
    assert rates[0] < -50.0
    at = 49 if kind < 3 else np.array([48, 49])
    measured_range, measured_azimuth = biased.range_m[at], biased.azimuth_rad[at]
    if kind == 3:
        # Stamps are at 49.5 s and 50.5 s: the value at 50 s lies half way.
        np.testing.assert_allclose(biased.time_s[at], [49.5, 50.5])
        measured_range, measured_azimuth = measured_range.mean(), measured_azimuth.mean()
    assert measured_range == pytest.approx(expected[0], abs=0.2)
    assert measured_azimuth == pytest.approx(expected[1], abs=1e-5)


def test_a_rotating_antenna_points_at_the_aircraft_when_it_measures() -> None:
    plots = _one((Bias(),) * 4, rotation_period_s=7.0)
    turns = plots.time_s / 7.0 - plots.azimuth_rad / (2.0 * np.pi)
    np.testing.assert_allclose(turns - turns[0], np.arange(len(turns)), rtol=0, atol=1e-3)
    assert len(plots) in (14, 15)


def test_a_scenario_on_the_ellipsoid_is_rejected() -> None:
    with pytest.raises(ConfigurationError, match="only radars on a flat plane are supported"):
        flat_plots(builtin_scenario("rotating-gaps"), np.random.default_rng(0))
