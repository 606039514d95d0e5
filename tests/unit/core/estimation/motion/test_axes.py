"""Axes and course: north is 0, east a quarter turn, and one velocity has one canonical frame."""

import numpy as np
import pytest

from multiradar.estimation.motion.axes import (
    canonical_frame,
    frame_to_velocity,
    velocity_by_frame,
    velocity_to_frame,
)

ODD_FRAMES = [
    (-50.0, 0.3, 0.2),
    (80.0, 0.3, 2.0),
    (80.0, -3.0, -1.9),
    (-80.0, 2.9, 2.5),
    (60.0, 40.0, -9.0),
    (-60.0, -7.0, -14.0),
    (0.0, 1.0, 0.5),
]


@pytest.mark.parametrize(
    ("frame", "velocity"),
    [
        ((200.0, 0.0, 0.0), (0.0, 200.0, 0.0)),
        ((200.0, np.pi / 2.0, 0.0), (200.0, 0.0, 0.0)),
        ((200.0, np.radians(30.0), 0.0), (100.0, 200.0 * np.sqrt(0.75), 0.0)),
        (
            (100.0, np.radians(-60.0), np.radians(30.0)),
            (-75.0, 100.0 * np.sqrt(0.75) * 0.5, 50.0),
        ),
    ],
)
def test_course_is_clockwise_from_north_and_climb_is_upwards(
    frame: tuple[float, float, float], velocity: tuple[float, float, float]
) -> None:
    np.testing.assert_allclose(frame_to_velocity(frame), velocity, atol=1e-12)
    np.testing.assert_allclose(velocity_to_frame(velocity), frame, atol=1e-14)


@pytest.mark.parametrize(
    ("velocity", "frame"),
    [
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ((0.0, 0.0, 7.0), (7.0, 0.0, np.pi / 2.0)),
        ((0.0, 0.0, -7.0), (7.0, 0.0, -np.pi / 2.0)),
        ((0.0, -5.0, 0.0), (5.0, -np.pi, 0.0)),
    ],
)
def test_an_undefined_course_is_zero(
    velocity: tuple[float, float, float], frame: tuple[float, float, float]
) -> None:
    np.testing.assert_array_equal(velocity_to_frame(velocity), frame)


@pytest.mark.parametrize("frame", ODD_FRAMES)
def test_the_canonical_frame_is_the_same_velocity(frame: tuple[float, float, float]) -> None:
    canonical, _ = canonical_frame(frame)
    assert canonical[0] >= 0.0
    assert -np.pi <= canonical[1] < np.pi
    assert abs(canonical[2]) <= np.pi / 2.0
    np.testing.assert_allclose(frame_to_velocity(canonical), frame_to_velocity(frame), atol=1e-12)


@pytest.mark.parametrize("frame", ODD_FRAMES)
def test_signs_are_the_derivative_of_the_canonical_form(frame: tuple[float, float, float]) -> None:
    step = 1e-6
    _, signs = canonical_frame(frame)
    for component in range(3):
        moved = np.array(frame)
        moved[component] += step
        change = canonical_frame(moved)[0] - canonical_frame(frame)[0]
        expected = np.zeros(3)
        expected[component] = step * signs[component]
        np.testing.assert_allclose(change, expected, atol=1e-13)


def test_a_canonical_frame_is_unchanged() -> None:
    frames = np.random.default_rng(0).uniform(
        [0.0, -np.pi, -np.pi / 2.0], [300.0, np.pi, np.pi / 2.0], (200, 3)
    )
    canonical, signs = canonical_frame(frames)
    np.testing.assert_array_equal(canonical, frames)
    np.testing.assert_array_equal(signs, np.ones_like(frames))


def test_the_matrix_of_equation_7_is_that_of_the_paper_and_of_finite_differences() -> None:
    """The entries of the paper in terms of the velocity, X north and Y east: rows 1, 0, 2 here."""
    rng = np.random.default_rng(3)
    frame = rng.uniform([20.0, -3.0, -1.4], [300.0, 3.0, 1.4], (50, 3))
    y, x, z = frame_to_velocity(frame).T
    speed, level = np.sqrt(x**2 + y**2 + z**2), np.hypot(x, y)
    expected_matrix = np.array(
        [
            [x / speed, -y, -z * x / level],
            [y / speed, x, -z * y / level],
            [z / speed, np.zeros(50), level],
        ]
    )
    found = velocity_by_frame(frame)
    np.testing.assert_allclose(found[:, [1, 0, 2]], np.moveaxis(expected_matrix, -1, 0), atol=1e-10)
    for component, step in enumerate([1e-3, 1e-6, 1e-6]):
        ahead, behind = frame.copy(), frame.copy()
        ahead[:, component] += step
        behind[:, component] -= step
        slope = (frame_to_velocity(ahead) - frame_to_velocity(behind)) / (2.0 * step)
        np.testing.assert_allclose(found[..., component], slope, atol=1e-6)
