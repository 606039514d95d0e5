"""For any velocity noise is a bounded covariance that rotates with the course."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from multiradar.estimation.motion.axes import canonical_frame, frame_to_velocity, velocity_to_frame
from multiradar.estimation.motion.velocity_frame_noise import (
    VelocityFrameNoise,
    acceleration_covariance,
)
from multiradar.research.motion.velocity_frame import VelocityFrame

speeds = (
    st.floats(-400.0, 400.0) | st.floats(-1e-3, 1e-3) | st.just(0.0) | st.floats(-1e-200, 1e-200)
)
velocities = st.tuples(speeds, speeds, speeds).map(np.array)
spreads = st.tuples(st.floats(0.0, 20.0), st.floats(0.0, 0.5), st.floats(0.0, 0.5))
angles = st.floats(-np.pi, np.pi)


def about_the_vertical(angle: float) -> NDArray[np.float64]:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])


@given(velocities, spreads)
def test_the_noise_is_a_bounded_covariance_at_every_velocity(
    velocity: NDArray[np.float64], spread: tuple[float, float, float]
) -> None:
    found = acceleration_covariance(velocity, *spread)
    np.testing.assert_array_equal(found, found.T)
    a, turn, climb = spread
    bound = 3.0 * a**2 + (turn**2 + 2.0 * climb**2) * (velocity @ velocity)
    assert np.trace(found) <= bound * (1.0 + 1e-12)
    assert np.linalg.eigvalsh(found).min() >= -1e-13 * bound


@given(velocities, spreads, angles)
def test_the_noise_rotates_with_the_course(
    velocity: NDArray[np.float64], spread: tuple[float, float, float], angle: float
) -> None:
    """Claim of the paper: nothing depends on the direction of the horizontal axes."""
    turn = about_the_vertical(angle)
    turned = acceleration_covariance(turn @ velocity, *spread)
    expected = turn @ acceleration_covariance(velocity, *spread) @ turn.T
    scale = 1.0 + np.abs(expected).max()
    np.testing.assert_allclose(turned, expected, atol=1e-9 * scale)


@given(velocities, st.floats(0.0, 60.0), st.none() | st.floats(0.1, 10.0))
def test_process_noise_is_a_covariance(
    velocity: NDArray[np.float64], interval_s: float, nominal_s: float | None
) -> None:
    model = VelocityFrameNoise(1.5, 0.05, 0.02, nominal_interval_s=nominal_s)
    found = model.noise(np.concatenate([np.zeros(3), velocity]), interval_s)
    np.testing.assert_array_equal(found, found.T)
    assert np.linalg.eigvalsh(found).min() >= -1e-12 * max(np.trace(found), 1e-300)


@given(velocities)
def test_velocity_survives_conversion_to_the_frame_and_back(velocity: NDArray[np.float64]) -> None:
    frame = velocity_to_frame(velocity)
    np.testing.assert_array_equal(canonical_frame(frame)[0], frame)
    np.testing.assert_allclose(frame_to_velocity(frame), velocity, rtol=1e-12, atol=1e-11)


@given(
    st.tuples(st.floats(-400.0, 400.0), st.floats(-20.0, 20.0), st.floats(-20.0, 20.0)),
    st.tuples(*[st.floats(-6.0, 6.0)] * 3),
    angles,
)
def test_a_path_of_the_velocity_frame_rotates_with_its_start(
    frame: tuple[float, float, float], draws: tuple[float, float, float], angle: float
) -> None:
    model = VelocityFrame(3.0, 0.1, 0.1)
    states = []
    for course in (frame[1], frame[1] + angle):
        state = np.array([0.0, 0.0, 0.0, frame[0], course, frame[2]])
        for _ in range(3):
            state = model.step(state, 2.0, draws)
        states.append(np.concatenate([state[:3], frame_to_velocity(state[3:])]))
    turn = np.kron(np.eye(2), about_the_vertical(angle))
    np.testing.assert_allclose(states[1], turn @ states[0], atol=1e-8)
