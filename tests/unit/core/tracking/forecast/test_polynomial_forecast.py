"""Forecasts by a polynomial through the last plots."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import TrajectoryError
from multiradar.tracking.forecast.polynomial_forecast import (
    CHANGE_MPS2,
    PLOTS_MIN,
    PRIOR_SIGMAS,
    SPAN_MIN_S,
    WANDER,
    WINDOW_S,
    polynomial_forecast,
)

Floats = NDArray[np.float64]

NOISE_M2 = np.array([[2500.0, 1200.0], [1200.0, 6400.0]])


def path(time_s: Floats, acceleration_mps2: tuple[float, ...] = (0.6, 0.3)) -> Floats:
    """A path of constant acceleration."""
    start, velocity, along = np.array([[2e4, -3e4], [150.0, -80.0], acceleration_mps2])[:, None]
    return np.asarray(start + velocity * time_s[:, None] + 0.5 * along * time_s[:, None] ** 2)


def test_a_path_of_constant_acceleration_is_extrapolated() -> None:
    time_s = np.arange(0.0, 29.0, 2.0)
    noise = np.broadcast_to(np.eye(2), (len(time_s), 2, 2))
    found = polynomial_forecast(time_s, path(time_s), noise, np.array([28.0, 38.0, 88.0]))
    # The prior of the acceleration has an effect of less than a tenth of a metre now.
    assert found.means[0] == pytest.approx(path(np.array([28.0]))[0], abs=0.1)
    assert found.means[1:] == pytest.approx(path(np.array([38.0, 88.0])), abs=5.0)


@pytest.mark.slow
def test_errors_are_consistent_while_the_acceleration_is_constant() -> None:
    """Without later manoeuvres: squares of two components have the mean of 2.

    Accelerations are drawn from the prior.
    """
    random, squares = np.random.default_rng(7), []
    time_s, at_s = np.arange(0.0, 29.0, 2.0), np.array([58.0])
    left = WANDER * 30.0**3 / 3.0 + (0.5 * CHANGE_MPS2 * 30.0**2) ** 2
    noise = np.broadcast_to(NOISE_M2, (len(time_s), 2, 2))
    for _ in range(100):
        flown = tuple(PRIOR_SIGMAS[2] * random.normal(size=2))
        plots = path(time_s, flown) + random.multivariate_normal(np.zeros(2), NOISE_M2, len(time_s))
        found = polynomial_forecast(time_s, plots, noise, at_s)
        off = found.means[0] - path(at_s, flown)[0]
        squares.append(off @ np.linalg.solve(found.covariances[0] - left * np.eye(2), off))
    # Three sigmas of the mean of 100 chi² of two degrees of freedom.
    assert np.mean(squares) == pytest.approx(2.0, abs=3.0 * 2.0 / np.sqrt(100.0))


def test_plots_before_the_window_and_times_before_the_last_plot_are_ignored() -> None:
    time_s = np.arange(0.0, 60.0, 2.0)
    noise = np.broadcast_to(NOISE_M2, (len(time_s), 2, 2))
    bent = path(time_s)
    bent[time_s < 58.0 - WINDOW_S] += 5e4
    one = polynomial_forecast(time_s, bent, noise, np.array([10.0, 58.0, 70.0]))
    new = time_s >= 58.0 - WINDOW_S
    other = polynomial_forecast(time_s[new], bent[new], noise[new], np.array([58.0, 58.0, 70.0]))
    np.testing.assert_array_equal(one.means, other.means)
    np.testing.assert_array_equal(one.covariances, other.covariances)


def test_regions_grow_with_time_and_have_the_axes_of_the_noise() -> None:
    time_s = np.arange(0.0, 29.0, 2.0)
    noise = np.broadcast_to(NOISE_M2, (len(time_s), 2, 2))
    found = polynomial_forecast(time_s, path(time_s), noise, 28.0 + np.arange(0.0, 300.0, 10.0))
    sizes = np.linalg.eigvalsh(found.covariances)
    assert (np.diff(sizes, axis=0) > 0.0).all()
    # All plots have larger errors along one direction, and so has the position.
    axes = np.linalg.eigh(NOISE_M2)[1]
    turned = axes.T @ found.covariances[0] @ axes
    assert turned[0, 1] == pytest.approx(0.0, abs=1e-6)
    assert turned[1, 1] > turned[0, 0]


@pytest.mark.parametrize(
    "time_s",
    [
        np.empty(0),
        np.linspace(0.0, SPAN_MIN_S, PLOTS_MIN - 1),
        np.linspace(0.0, SPAN_MIN_S - 0.1, 10),
        np.append(np.arange(0.0, 20.0, 2.0), 20.0 + 2.0 * WINDOW_S),
    ],
    ids=["none", "few", "short", "silent before"],
)
def test_too_few_plots_raise_an_error_with_a_code(time_s: Floats) -> None:
    noise = np.broadcast_to(NOISE_M2, (len(time_s), 2, 2))
    with pytest.raises(TrajectoryError, match="plots spanning") as error:
        polynomial_forecast(time_s, path(time_s), noise, np.array([500.0]))
    assert error.value.code == "TOO_FEW_PLOTS"
