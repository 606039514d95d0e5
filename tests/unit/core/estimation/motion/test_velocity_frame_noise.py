"""Noise along and across the velocity: as in the paper for a defined course, else bounded."""

import numpy as np
import pytest

from multiradar.errors import MotionParameterError, ShapeError, TimeOrderError
from multiradar.estimation.motion.axes import frame_to_velocity, velocity_by_frame
from multiradar.estimation.motion.velocity_frame_noise import (
    SLOW_SPEED_MPS,
    STEEP_COSINE,
    VelocityFrameNoise,
    acceleration_covariance,
)
from support.references.constant_velocity import process_noise

SPREADS = (1.5, 0.05, 0.02)


def test_equation_7_where_the_course_is_defined() -> None:
    rng = np.random.default_rng(0)
    frame = rng.uniform([10.0, -np.pi, -1.47], [400.0, np.pi, 1.47], (100, 3))
    scaled = velocity_by_frame(frame) * np.array(SPREADS)
    expected = scaled @ np.swapaxes(scaled, -1, -2)
    velocity = frame_to_velocity(frame)
    np.testing.assert_allclose(acceleration_covariance(velocity, *SPREADS), expected, atol=1e-10)


def test_an_asymmetric_case_by_hand() -> None:
    """Flying east at 100 m/s: 2 m/s² eastwards, 0.03 rad/s × 100 m/s northwards, 0.01 × 100 up."""
    found = acceleration_covariance([100.0, 0.0, 0.0], 2.0, 0.03, 0.01)
    np.testing.assert_allclose(found, np.diag([4.0, 9.0, 1.0]), atol=1e-12)


def test_motion_in_the_plane_is_the_block_of_that_in_space() -> None:
    velocity = np.random.default_rng(1).normal(size=(200, 2)) * np.array([[30.0, 8.0]])
    velocity[0] = 0.0
    level = np.concatenate([velocity, np.zeros((200, 1))], axis=-1)
    found = acceleration_covariance(velocity, 1.5, 0.05)
    np.testing.assert_allclose(
        found, acceleration_covariance(level, *SPREADS)[:, :2, :2], rtol=1e-12, atol=1e-13
    )
    e, n = velocity.T
    m = np.maximum(e**2 + n**2, SLOW_SPEED_MPS**2)
    d00 = 2.25 * (1.0 + (e**2 - e**2 - n**2) / m) + 0.0025 * n**2
    d01 = (2.25 / m - 0.0025) * e * n
    d11 = 2.25 * (1.0 + (n**2 - e**2 - n**2) / m) + 0.0025 * e**2
    np.testing.assert_allclose(found[:, 0, 0], d00, atol=1e-12)
    np.testing.assert_allclose(found[:, 0, 1], d01, atol=1e-12)
    np.testing.assert_allclose(found[:, 1, 1], d11, atol=1e-12)


def test_at_rest_an_aircraft_accelerates_along_each_axis() -> None:
    np.testing.assert_array_equal(acceleration_covariance(np.zeros(3), *SPREADS), 2.25 * np.eye(3))
    np.testing.assert_array_equal(acceleration_covariance(np.zeros(2), 1.5, 0.05), 2.25 * np.eye(2))


@pytest.mark.parametrize("up", [120.0, -120.0])
def test_vertical_flight_pitches_in_any_direction(up: float) -> None:
    found = acceleration_covariance([0.0, 0.0, up], *SPREADS)
    pitch = (0.02 * 120.0) ** 2
    np.testing.assert_allclose(found, np.diag([pitch, pitch, 2.25]), rtol=1e-13)


@pytest.mark.parametrize(
    ("centre", "scale"),
    [
        ([0.0, 0.0, 0.0], 1.0),
        ([0.0, SLOW_SPEED_MPS, 0.0], 1.0),
        ([0.0, 0.0, 100.0], 1.0),
        ([100.0 * STEEP_COSINE, 0.0, 100.0 * np.sqrt(1.0 - STEEP_COSINE**2)], 1.0),
    ],
)
def test_the_modified_covariance_is_continuous(centre: list[float], scale: float) -> None:
    """Neighbours 1e-6 m/s away differ by at most the rule's steepest slope times that."""
    directions = np.random.default_rng(2).normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    there = acceleration_covariance(centre, *SPREADS)
    near = acceleration_covariance(np.array(centre) + 1e-6 * scale * directions, *SPREADS)
    assert np.abs(near - there).max() < 1e-5


def test_noise_of_the_paper_and_of_white_acceleration() -> None:
    state = np.array([1e5, -3e4, 9e3, 120.0, -50.0, 4.0])
    spread = acceleration_covariance(state[3:], *SPREADS)
    expected_matrix = VelocityFrameNoise(*SPREADS).noise(state, 4.0)
    np.testing.assert_array_equal(expected_matrix[:3], np.zeros((3, 6)))
    np.testing.assert_allclose(expected_matrix[3:, 3:], 16.0 * spread, rtol=1e-13)
    model = VelocityFrameNoise(*SPREADS, nominal_interval_s=4.0)
    whole = model.noise(state, 7.0)
    step = model.jacobian(state, 5.0)
    parts = step @ model.noise(state, 2.0) @ step.T + model.noise(state, 5.0)
    np.testing.assert_allclose(whole, parts, rtol=1e-12)
    np.testing.assert_allclose(model.noise(state, 4.0)[3:, 3:], expected_matrix[3:, 3:], rtol=1e-13)


def test_as_much_across_as_along_is_white_acceleration() -> None:
    state = np.array([0.0, 0.0, 0.0, 160.0, -120.0, 0.0])
    model = VelocityFrameNoise(0.8, 0.8 / 200.0, nominal_interval_s=5.0)
    plane = np.ix_([0, 1, 3, 4], [0, 1, 3, 4])
    expected = process_noise(6.0, 0.8**2 * 5.0)
    np.testing.assert_allclose(model.noise(state, 6.0)[plane], expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"acceleration_mps2": -1.0}, "acceleration: expected a finite number of 0 or more, was"),
        ({"turn_rate_rad_per_s": np.nan}, "turn rate: expected"),
        ({"climb_rate_rad_per_s": np.inf}, "climb rate: expected"),
        ({"nominal_interval_s": 0.0}, "nominal interval: expected a finite number above 0"),
        ({"slow_speed_mps": -3.0}, "slow speed: expected a finite number above 0, was -3.0"),
    ],
)
def test_an_invalid_parameter_is_rejected(parameters: dict[str, float], message: str) -> None:
    with pytest.raises(MotionParameterError, match=message):
        VelocityFrameNoise(**{"acceleration_mps2": 1.0, "turn_rate_rad_per_s": 0.1, **parameters})


def test_wrong_shapes_and_negative_intervals_are_rejected() -> None:
    model = VelocityFrameNoise(1.0, 0.1)
    with pytest.raises(ShapeError, match="state: expected 6 components"):
        model.noise(np.zeros(4), 1.0)
    with pytest.raises(ShapeError, match="velocity: expected 3 components"):
        acceleration_covariance(np.zeros((3, 4)), 1.0, 0.1)
    for interval in (-1e-9, np.nan, np.inf):
        with pytest.raises(TimeOrderError, match="prediction interval: expected a time of 0"):
            model.noise(np.zeros(6), interval)
