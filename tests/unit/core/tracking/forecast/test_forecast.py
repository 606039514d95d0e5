"""A forecast is the Chapman-Kolmogorov step of a constant velocity with white acceleration."""

import numpy as np
import pytest
from scipy.linalg import expm

from support.references.straight_forecast import forecast

MEAN = np.array([1000.0, -2000.0, 150.0, -80.0])
ROOT = np.array([[30.0, 0, 0, 0], [8.0, 25.0, 0, 0], [1.0, 0.5, 2.0, 0], [-0.3, 1.2, 0.4, 3.0]])
COVARIANCE = ROOT @ ROOT.T
DENSITY = 1.7


def test_the_state_moves_with_its_velocity() -> None:
    means, covariances = forecast(MEAN, COVARIANCE, DENSITY, np.array([0.0, 10.0]))
    assert means[0].tolist() == MEAN.tolist()
    np.testing.assert_allclose(covariances[0], COVARIANCE)
    np.testing.assert_allclose(means[1], [2500.0, -2800.0, 150.0, -80.0])


def test_the_covariance_is_that_of_the_continuous_model() -> None:
    """Van Loan (1978): the covariance by a matrix exponential, without the closed form."""
    ahead_s = 37.5
    drift = np.zeros((4, 4))
    drift[:2, 2:] = np.eye(2)
    noise = np.diag([0.0, 0.0, DENSITY, DENSITY])
    block = expm(np.block([[-drift, noise], [np.zeros((4, 4)), drift.T]]) * ahead_s)
    transition = block[4:, 4:].T
    expected = transition @ COVARIANCE @ transition.T + transition @ block[:4, 4:]
    _, covariances = forecast(MEAN, COVARIANCE, DENSITY, np.array([ahead_s]))
    np.testing.assert_allclose(covariances[0], expected, rtol=1e-9)


def test_two_steps_are_one() -> None:
    means, covariances = forecast(MEAN, COVARIANCE, DENSITY, np.array([12.0]))
    again, spread = forecast(means[0], covariances[0], DENSITY, np.array([30.0]))
    once, whole = forecast(MEAN, COVARIANCE, DENSITY, np.array([42.0]))
    np.testing.assert_allclose(again, once)
    np.testing.assert_allclose(spread, whole)


def test_the_covariance_grows_and_stays_one() -> None:
    _, covariances = forecast(MEAN, COVARIANCE, DENSITY, np.linspace(0.0, 600.0, 50))
    assert np.all(covariances == covariances.transpose(0, 2, 1))
    assert np.all(np.linalg.eigvalsh(covariances) > 0.0)
    assert np.all(np.diff(covariances[:, 0, 0]) > 0.0)


@pytest.mark.parametrize("ahead_s", [-0.1, np.nan, np.inf])
def test_a_time_before_the_state_is_rejected(ahead_s: float) -> None:
    with pytest.raises(ValueError, match=f"finite and not negative, was {ahead_s} s"):
        forecast(MEAN, COVARIANCE, DENSITY, np.array([1.0, ahead_s]))


def test_no_times_give_no_states() -> None:
    means, covariances = forecast(MEAN, COVARIANCE, DENSITY, np.array([]))
    assert (means.shape, covariances.shape) == ((0, 4), (0, 4, 4))
