"""Moments of a random-walk heading against simulated aircraft."""

import numpy as np
import pytest

from multiradar.tracking.forecast.persistent_walk import propagate_random_walk, propagate_straight
from support.references.straight_forecast import forecast

MEAN = np.array([[1000.0, -500.0, 120.0, 160.0]])
KNOWN = np.zeros((1, 4, 4))


@pytest.mark.slow
def test_the_moments_are_those_of_many_aircraft() -> None:
    turning_per_s, ahead_s, step_s = 1.0 / 100.0, np.array([30.0, 120.0, 300.0]), 0.5
    rng = np.random.Generator(np.random.PCG64(1))
    count = 20_000
    heading = np.full(count, np.arctan2(160.0, 120.0))
    position = np.tile(MEAN[0, :2], (count, 1))
    means, covariances = propagate_random_walk(MEAN, KNOWN, turning_per_s, 0.0, ahead_s)
    found = 0
    for step in range(int(ahead_s[-1] / step_s)):
        turned = heading + rng.normal(0.0, np.sqrt(2.0 * turning_per_s * step_s), count)
        middle = 0.5 * (heading + turned)
        position += 200.0 * step_s * np.column_stack([np.cos(middle), np.sin(middle)])
        heading = turned
        if (step + 1) * step_s == ahead_s[found]:
            sigma = np.sqrt(np.trace(covariances[0, found]))
            # Twenty thousand aircraft determine a mean to 1 % of a sigma, a covariance to 1.5 %.
            np.testing.assert_allclose(position.mean(axis=0), means[0, found], atol=0.02 * sigma)
            spread = np.cov(position.T)
            np.testing.assert_allclose(spread, covariances[0, found], atol=0.04 * sigma**2)
            found += 1
    assert found == len(ahead_s)


def test_a_slow_random_walk_is_straight_flight() -> None:
    covariance = np.diag([100.0, 400.0, 4.0, 9.0])[None]
    covariance[0, 0, 2] = covariance[0, 2, 0] = 5.0
    ahead_s = np.array([0.0, 10.0, 60.0])
    means, covariances = propagate_random_walk(MEAN, covariance, 1e-7, 2.0, ahead_s)
    expected, spread = forecast(MEAN[0], covariance[0], 2.0, ahead_s)
    np.testing.assert_allclose(means[0], expected[:, :2], rtol=1e-5)
    # The random walk adds 0.2e-6 rad²/s · 200² m²/s² · 60³ s³ / 3 at most: 600 m² of 288 000.
    np.testing.assert_allclose(covariances[0], spread[:, :2, :2], atol=700.0)


@pytest.mark.parametrize("rate", [1.0 / 3000.0, 1.0 / 100.0])
def test_covariances_are_valid_from_the_first_second_to_the_last_hour(rate: float) -> None:
    ahead_s = np.array([0.0, 1e-3, 1.0, 100.0, 3600.0])
    still = MEAN * [[1.0, 1.0, 0.0, 0.0]]
    for mean in (MEAN, still):
        means, covariances = propagate_random_walk(mean, 1e-6 * np.eye(4)[None], rate, 1.0, ahead_s)
        assert np.isfinite(means).all()
        assert (np.linalg.eigvalsh(covariances[0]) > 0.0).all()


def test_straight_flight_of_many_is_that_of_each_aircraft() -> None:
    rng = np.random.Generator(np.random.PCG64(2))
    mean, root = rng.normal(size=(3, 4)) * 100.0, rng.normal(size=(3, 4, 4))
    covariance, ahead_s = root @ root.swapaxes(-1, -2), np.array([0.0, 7.0, 300.0])
    spread = rng.normal(size=(3, 2, 2))
    densities = spread @ spread.swapaxes(-1, -2)
    means, covariances = propagate_straight(mean, covariance, densities, ahead_s)
    for i in range(3):
        expected, whole = forecast(mean[i], covariance[i], densities[i], ahead_s)
        np.testing.assert_allclose(means[i], expected[:, :2], rtol=1e-12)
        np.testing.assert_allclose(covariances[i], whole[:, :2, :2], rtol=1e-9, atol=1e-9)
