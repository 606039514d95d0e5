"""Transition and process noise of an aircraft."""

import numpy as np
import pytest
from scipy.linalg import expm

from multiradar.errors import (
    ConfigurationError,
    MotionParameterError,
    MultiradarError,
    ShapeError,
)
from multiradar.research.motion.white_acceleration import WhiteAcceleration
from support.references.constant_velocity import process_noise, transition


def test_state_order_is_position_then_velocity() -> None:
    moved = transition(2.0) @ np.array([1.0, 10.0, 100.0, 1000.0])
    np.testing.assert_array_equal(moved, [201.0, 2010.0, 100.0, 1000.0])


def test_transition_accepts_many_and_negative_intervals() -> None:
    there, back = transition([[7.5], [-7.5]])[:, 0]
    np.testing.assert_array_equal(there @ back, np.eye(4))


@pytest.mark.parametrize("interval_s", [0.0, 1e-3, 0.7, 4.9, 60.0])
def test_process_noise_is_the_exact_integral(interval_s: float) -> None:
    """By Van Loan's matrix exponential, an independent computation of the integral."""
    drift = np.zeros((4, 4))
    drift[0, 2] = drift[1, 3] = 1.0
    big = np.zeros((8, 8))
    big[:4, :4] = -drift
    big[:4, 4:] = np.diag([0.0, 0.0, 2.5, 2.5])
    big[4:, 4:] = drift.T
    whole = expm(big * interval_s)
    expected = whole[4:, 4:].T @ whole[:4, 4:]
    np.testing.assert_allclose(process_noise(interval_s, 2.5), expected, rtol=1e-9, atol=1e-12)


def test_two_intervals_add_what_their_sum_adds() -> None:
    """The result must not depend on the number of plots per second."""
    rng = np.random.default_rng(2)
    first, second = rng.uniform(0.0, 12.0, (2, 50))
    step = transition(second)
    in_two = step @ process_noise(first, 0.8) @ np.swapaxes(step, -1, -2)
    in_two += process_noise(second, 0.8)
    np.testing.assert_allclose(in_two, process_noise(first + second, 0.8), rtol=1e-12)


@pytest.mark.parametrize(("interval_s", "density"), [(-1e-9, 1.0), (np.nan, 1.0), (1.0, -0.1)])
def test_negative_intervals_of_noise_are_rejected(interval_s: float, density: float) -> None:
    with pytest.raises(MultiradarError, match="expected a"):
        process_noise(interval_s, density)


def test_invalid_intervals_and_densities_are_rejected() -> None:
    with pytest.raises(ShapeError, match="prediction interval: expected numbers, was 'long'"):
        process_noise("long", 1.0)
    with pytest.raises(MotionParameterError, match=r"at most 1e\+12, was 1e\+308"):
        WhiteAcceleration((1e308, 1.0, 1.0))
    model = WhiteAcceleration((1.0, 1.0, 1.0))
    with pytest.raises(ConfigurationError, match=r"prediction interval: expected at most 1e\+09 s"):
        model.noise(np.zeros(6), 1e150)
    assert np.isfinite(model.noise(np.zeros(6), 1e9)).all()
