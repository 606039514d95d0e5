"""The compiled motion equals its plain form."""

from collections.abc import Callable

import numpy as np
import pytest

from multiradar.estimation.filters import _kernels as kernels
from multiradar.estimation.motion._kernels import move_aircraft, moved_covariance, predict_motion
from multiradar.estimation.motion.velocity_frame_noise import VelocityFrameNoise
from support.kernels import plain
from support.references.constant_velocity import process_noise, transition

UPPER = np.triu_indices(4)


@pytest.mark.parametrize("form", [predict_motion, plain(predict_motion)])
@pytest.mark.parametrize("interval_s", [0.0, 0.004, 4.9, 55.0])
def test_prediction_is_that_of_the_matrices(form: Callable[..., None], interval_s: float) -> None:
    rng = np.random.default_rng(4)
    root = rng.normal(size=(4, 4)) * np.array([[300.0], [200.0], [20.0], [30.0]])
    covariance, mean = root @ root.T, rng.normal(size=4) * 100.0
    sensitivity = rng.normal(size=(4, 5))
    step = transition(interval_s)
    expected = step @ covariance @ step.T + process_noise(interval_s, 0.7)
    moved, packed, tied = mean.copy(), covariance[UPPER].copy(), sensitivity.copy()
    form(moved, packed, tied, interval_s, (0.7, 0.0, 0.7))
    np.testing.assert_allclose(moved, step @ mean, rtol=1e-12)
    np.testing.assert_allclose(packed, expected[UPPER], rtol=1e-12)
    np.testing.assert_allclose(tied, step @ sensitivity, rtol=1e-12)


@pytest.mark.parametrize("form", [move_aircraft, plain(move_aircraft)])
def test_predicting_one_aircraft_leaves_the_others(form: Callable[..., None]) -> None:
    rng = np.random.default_rng(5)
    means, packed, tied = (rng.normal(size=size) for size in ((3, 4), (3, 10), (3, 4, 5)))
    expected = means.copy(), packed.copy(), tied.copy()
    predict_motion(expected[0][1], expected[1][1], expected[2][1], 2.5, (0.7, 0.1, 0.4))
    form(means, packed, tied, 1, 2.5, (0.7, 0.1, 0.4))
    for found, wanted in zip((means, packed, tied), expected, strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-12)


def velocity_frame(acceleration: float, turn_rate: float) -> np.ndarray:
    options = np.zeros(kernels.OPTION_COUNT)
    options[kernels.VELOCITY_FRAME] = 1.0
    options[kernels.DENSITY_ALONG] = acceleration**2
    options[kernels.DENSITY_OF_COURSE] = turn_rate**2
    return options


@pytest.mark.parametrize(
    "form", [kernels.acceleration_density, plain(kernels.acceleration_density)]
)
@pytest.mark.parametrize("velocity", [(180.0, -95.0), (0.0, 240.0), (3.0, 4.0), (0.0, 0.0)])
def test_noise_of_the_velocity_frame_is_that_of_the_model(
    velocity: tuple[float, float], form: Callable[..., tuple[float, float, float]]
) -> None:
    """Vasiliev and Mattis (7), including slow aircraft."""
    density = form(*velocity, 1.0, velocity_frame(0.8, 0.02))
    found = moved_covariance((0.0,) * 10, 7.0, density)
    model = VelocityFrameNoise(0.8, 0.02, nominal_interval_s=1.0)
    level = [0, 1, 3, 4]
    expected = model.noise(np.array([0.0, 0.0, 0.0, *velocity, 0.0]), 7.0)[np.ix_(level, level)]
    np.testing.assert_allclose(found, expected[UPPER], rtol=1e-12, atol=1e-12)


def test_an_aircraft_at_rest_may_accelerate_in_any_direction() -> None:
    assert kernels.acceleration_density(0.0, 0.0, 1.0, velocity_frame(0.8, 0.02)) == pytest.approx(
        (0.64, 0.0, 0.64)
    )


def test_two_steps_add_the_noise_of_one() -> None:
    density = kernels.acceleration_density(180.0, -95.0, 1.0, velocity_frame(0.8, 0.02))
    twice = moved_covariance(moved_covariance((0.0,) * 10, 3.0, density), 4.0, density)
    np.testing.assert_allclose(twice, moved_covariance((0.0,) * 10, 7.0, density), rtol=1e-12)
