"""Simulated paths follow their configuration: all evaluations depend on them."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.estimation.motion.axes import frame_to_velocity
from multiradar.research.motion.velocity_frame import VelocityFrame
from multiradar.simulation.paths import fly
from multiradar.simulation.scenario.model import Aircraft, CoupledNoise, Leg, Waypoints

# East and north always differ: a swap of axes is detected.
AIRCRAFT = Aircraft(1, 5e3, -7e3, 8000.0, 200.0, np.radians(30.0), start_s=100.0)
VELOCITY = 200.0 * np.array([0.5, np.sqrt(0.75)])


def test_a_straight_path_keeps_its_initial_position_and_velocity() -> None:
    path = fly(AIRCRAFT, 500.0, np.random.default_rng(0))
    assert (path.start_s, path.end_s) == (100.0, 500.0)
    states = path.states(np.array([100.0, 350.0]))
    np.testing.assert_allclose(states[0], [5e3, -7e3, *VELOCITY], rtol=0, atol=1e-9)
    np.testing.assert_allclose(
        states[1], [*(np.array([5e3, -7e3]) + 250.0 * VELOCITY), *VELOCITY], rtol=0, atol=1e-7
    )
    np.testing.assert_array_equal(path.height(np.array([100.0, 350.0])), 8000.0)


def test_a_turn_to_the_right_is_a_circle_of_the_right_duration() -> None:
    # 3°/s at 200 m/s: a quarter of a circle of 3820 m in 30 s, then straight on.
    turning = replace(AIRCRAFT, heading_rad=0.0, legs=(Leg(30.0, np.radians(3.0)),))
    path = fly(turning, 500.0, np.random.default_rng(0))
    radius = 200.0 / np.radians(3.0)
    quarter = path.states(np.array([130.0]))[0]
    np.testing.assert_allclose(quarter, [5e3 + radius, -7e3 + radius, 200.0, 0.0], atol=1e-6)
    times = np.linspace(100.0, 130.0, 1001)
    away = path.position(times) - [5e3 + radius, -7e3]
    # Between the half-second knots a cubic approximates the circle.
    np.testing.assert_allclose(np.hypot(*away.T), radius, rtol=0, atol=1e-4)
    np.testing.assert_allclose(path.states(np.array([200.0]))[0, 2:], [200.0, 0.0], atol=1e-9)


def test_legs_follow_each_other_without_a_jump() -> None:
    legs = (
        Leg(20.0, acceleration_mps2=1.5, climb_mps=10.0),
        Leg(40.0, np.radians(-2.0), -0.5, -3.0),
        Leg(0.7, np.radians(6.0)),
    )
    path = fly(replace(AIRCRAFT, legs=legs), 400.0, np.random.default_rng(0))
    for moment in (120.0, 160.0, 160.7):
        before, after = path.states(np.array([moment - 1e-6, moment + 1e-6]))
        np.testing.assert_allclose(before[:2], after[:2], rtol=0, atol=1e-3)
        np.testing.assert_allclose(before[2:], after[2:], rtol=0, atol=1e-4)
    end = path.states(np.array([300.0]))[0]
    assert np.hypot(*end[2:]) == pytest.approx(200.0 + 20.0 * 1.5 - 40.0 * 0.5, abs=1e-9)
    course = np.radians(30.0 - 80.0 + 4.2)
    assert np.arctan2(end[2], end[3]) == pytest.approx(course, abs=1e-9)
    heights = path.height(np.array([110.0, 120.0, 160.0, 399.0]))
    np.testing.assert_allclose(heights, [8100.0, 8200.0, 8080.0, 8080.0], atol=1e-9)


def test_waypoints_are_joined_by_straight_lines() -> None:
    recorded = Waypoints((90.0, 110.0, 120.0), (0.0, 4e3, 4e3), (0.0, 0.0, 2e3), (8e3, 8e3, 7900.0))
    path = fly(replace(AIRCRAFT, waypoints=recorded, end_s=118.0), 500.0, np.random.default_rng(0))
    assert (path.start_s, path.end_s) == (100.0, 118.0)
    states = path.states(np.array([100.0, 109.0, 111.0, 118.0]))
    expected = [
        [2e3, 0.0, 200.0, 0.0], [3800.0, 0.0, 200.0, 0.0], [4e3, 200.0, 0.0, 200.0],
        [4e3, 1600.0, 0.0, 200.0],
    ]  # fmt: skip
    np.testing.assert_allclose(states, np.array(expected), rtol=0, atol=1e-6)
    np.testing.assert_allclose(path.height(np.array([105.0, 115.0])), [8e3, 7950.0], atol=0.3)
    # The corner is cut within half a second of it, by some ten metres.
    corner = path.position(np.array([110.0]))[0]
    assert 10.0 < np.hypot(*(corner - [4e3, 0.0])) < 60.0


def test_the_velocity_is_the_derivative_of_the_position() -> None:
    legs = (Leg(30.0, np.radians(2.5), 0.4), Leg(30.0, np.radians(-1.0), -0.8))
    path = fly(replace(AIRCRAFT, legs=legs), 400.0, np.random.default_rng(0))
    times = np.linspace(101.0, 158.0, 300)
    rate = (path.position(times + 1e-3) - path.position(times - 1e-3)) / 2e-3
    np.testing.assert_allclose(rate, path.states(times)[:, 2:], rtol=0, atol=1e-4)


def test_white_acceleration_has_the_configured_density() -> None:
    rng = np.random.default_rng(4)
    wandering = replace(AIRCRAFT, acceleration_density=2.0)
    straight = fly(AIRCRAFT, 160.0, rng).states(np.array([160.0]))[0]
    ends = np.array([fly(wandering, 160.0, rng).states(np.array([160.0]))[0] for _ in range(500)])
    sigma = (ends - straight).std(axis=0)
    # q t³/3 and q t, with a standard error of 3 %.
    assert sigma[:2] == pytest.approx(np.sqrt(2.0 * 60.0**3 / 3.0), rel=0.1)
    assert sigma[2:] == pytest.approx(np.sqrt(2.0 * 60.0), rel=0.1)


@pytest.mark.slow
def test_white_acceleration_is_exact_within_a_single_step() -> None:
    rng = np.random.default_rng(7)
    wandering = replace(AIRCRAFT, acceleration_density=2.0, speed_mps=0.0)
    moved = [fly(wandering, 160.0, rng).states(np.array([100.5]))[0] for _ in range(4000)]
    away = np.array(moved) - [5e3, -7e3, 0.0, 0.0]
    # q t³/3, q t²/2 and q t after half a second, with standard errors of 2 to 3 %.
    np.testing.assert_allclose(np.mean(away[:, :2] ** 2, axis=0), 2.0 * 0.125 / 3.0, rtol=0.1)
    np.testing.assert_allclose(
        np.mean(away[:, :2] * away[:, 2:], axis=0), 2.0 * 0.25 / 2.0, rtol=0.1
    )
    np.testing.assert_allclose(np.mean(away[:, 2:] ** 2, axis=0), 2.0 * 0.5, rtol=0.1)


def test_speed_course_and_climb_angle_follow_model_5() -> None:
    noise = CoupledNoise(0.8, np.radians(1.0), np.radians(0.2), step_s=2.0)
    rng = np.random.default_rng(5)
    ends, rises = [], []
    for _ in range(400):
        path = fly(replace(AIRCRAFT, heading_rad=1.0, coupled=noise), 160.0, rng)
        ends.append(path.states(np.array([160.0]))[0, 2:])
        rises.append(np.diff(path.height(np.array([158.0, 160.0])))[0] / 2.0)
    speed, course = np.hypot(*np.array(ends).T), np.arctan2(*np.array(ends).T)
    climb = np.arcsin(np.array(rises) / 200.0)
    # Thirty steps of two seconds: sigma · T · √30 each, with a standard error of 4 %.
    assert course.std() == pytest.approx(np.radians(1.0) * 2.0 * np.sqrt(30.0), rel=0.12)
    assert climb.std() == pytest.approx(np.radians(0.2) * 2.0 * np.sqrt(29.0), rel=0.12)
    # The horizontal speed is V cos φ; φ stays below 4° or so.
    assert speed.std() == pytest.approx(0.8 * 2.0 * np.sqrt(30.0), rel=0.12)
    assert course.mean() == pytest.approx(1.0, abs=0.05)


def test_model_5_is_that_of_the_motion_models_step_by_step() -> None:
    noise = CoupledNoise(1.0, np.radians(3.0), np.radians(0.5), step_s=2.0)
    path = fly(replace(AIRCRAFT, coupled=noise), 160.0, np.random.default_rng(6))
    model = VelocityFrame(1.0, np.radians(3.0), np.radians(0.5))
    # Sixty seconds, and as long again beyond the end.
    draws = np.random.default_rng(6).normal(size=(60, 3))
    state = np.array([5e3, -7e3, 8000.0, 200.0, np.radians(30.0), 0.0])
    for number, draw in enumerate(draws[:30], start=1):
        state = model.step(state, 2.0, draw)
        now = np.array([100.0 + 2.0 * number])
        (east, north, up), velocity = state[:3], frame_to_velocity(state[3:])
        np.testing.assert_allclose(path.states(now)[0, :2], [east, north], rtol=0, atol=1e-6)
        np.testing.assert_allclose(path.states(now)[0, 2:], velocity[:2], rtol=0, atol=1e-9)
        assert path.height(now)[0] == pytest.approx(up, abs=1e-6)
