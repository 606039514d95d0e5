"""Motion models in three dimensions: steps and matrices, exactly and in the mean."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import MotionParameterError, ShapeError, TimeOrderError
from multiradar.estimation.motion.axes import frame_to_velocity
from multiradar.estimation.motion.velocity_frame_noise import VelocityFrameNoise
from multiradar.research.motion.cartesian_acceleration import CartesianAcceleration
from multiradar.research.motion.model import MotionModel, MotionSimulator
from multiradar.research.motion.relative_speed import RelativeSpeed
from multiradar.research.motion.velocity_frame import VelocityFrame
from multiradar.research.motion.white_acceleration import WhiteAcceleration
from support.references.constant_velocity import process_noise, transition

ACCELERATION = CartesianAcceleration((1.0, 2.0, 0.5))
RELATIVE = RelativeSpeed((200.0, 100.0, 0.0), (0.1, 0.2, 0.3), 1000.0)
FRAME = VelocityFrame(1.5, 0.05, 0.02)
SIMULATORS: list[MotionSimulator] = [ACCELERATION, RELATIVE, FRAME]
MODELS: list[MotionModel] = [
    ACCELERATION,
    RELATIVE,
    FRAME,
    VelocityFrameNoise(1.5, 0.05, 0.02),
    WhiteAcceleration((1.0, 2.0, 0.5)),
]
STATES = {
    "cartesian": np.array([1e4, -2e4, 9e3, 180.0, 90.0, -6.0]),
    "velocity frame": np.array([1e4, -2e4, 9e3, 201.0, 1.1, -0.03]),
}


def name_of(model: object) -> str:
    return type(model).__name__


def test_equation_2_by_hand() -> None:
    """Each velocity takes its own draw; the position goes with the old velocity."""
    state = [1000.0, 2000.0, 3000.0, 10.0, 20.0, 30.0]
    moved = ACCELERATION.step(state, 2.0, [1.0, -1.0, 3.0])
    np.testing.assert_array_equal(moved, [1020.0, 2040.0, 3060.0, 12.0, 16.0, 33.0])


def test_relative_speed_by_hand() -> None:
    """γ v_o √(T/T_np): 0.1 × 200 × 0.1 = 2 m/s in 10 s; nothing on the axis without speed."""
    moved = RELATIVE.step([0.0, 0.0, 0.0, 200.0, -100.0, 0.0], 10.0, [1.0, 1.0, 1.0])
    np.testing.assert_allclose(moved, [2000.0, -1000.0, 0.0, 202.0, -98.0, 0.0], rtol=1e-14)


def test_relative_speed_changes_by_gamma_over_the_reference_time() -> None:
    sigmas = np.sqrt(np.diagonal(RELATIVE.noise(STATES["cartesian"], 1000.0)))
    np.testing.assert_allclose(sigmas, [0.0, 0.0, 0.0, 20.0, 20.0, 0.0], atol=1e-12)
    halves = 2.0 * RELATIVE.noise(STATES["cartesian"], 500.0)
    np.testing.assert_allclose(np.sqrt(np.diagonal(halves)), sigmas, atol=1e-12)


def test_equation_5_by_hand() -> None:
    """Course 90° is east: 3 s at 100 m/s; then a, v_K and v_φ times 3 s times the draws."""
    state = [10.0, 20.0, 30.0, 100.0, np.pi / 2.0, 0.0]
    moved = FRAME.step(state, 3.0, [2.0, -1.0, 5.0])
    expected = [310.0, 20.0, 30.0, 109.0, np.pi / 2.0 - 0.15, 0.3]
    np.testing.assert_allclose(moved, expected, rtol=1e-14)


def test_course_passes_south_without_a_jump_of_velocity() -> None:
    state = np.array([0.0, 0.0, 0.0, 100.0, np.pi - 0.01, 0.0])
    moved = VelocityFrame(0.0, 0.02).step(state, 1.0, [0.0, 1.0, 0.0])
    assert moved[4] == pytest.approx(-np.pi + 0.01, abs=1e-14)
    np.testing.assert_allclose(frame_to_velocity(moved[3:]), [-1.0, -99.995, 0.0], atol=1e-3)


@pytest.mark.parametrize(
    ("frame", "draws", "expected"),
    [
        ((1.0, 0.5, 0.2), (-2.0, 0.0, 0.0), (2.0, 0.5 - np.pi, -0.2)),
        ((50.0, 0.5, np.pi / 2.0 - 0.01), (0.0, 0.0, 1.0), (50.0, 0.5 - np.pi, np.pi / 2.0 - 0.01)),
        ((50.0, 0.5, 0.01 - np.pi / 2.0), (0.0, 0.0, -1.0), (50.0, 0.5 - np.pi, 0.01 - np.pi / 2)),
    ],
)
def test_negative_speed_and_climb_beyond_the_vertical_are_made_canonical(
    frame: tuple[float, ...], draws: tuple[float, ...], expected: tuple[float, ...]
) -> None:
    moved = VelocityFrame(1.5, 0.05, 0.02).step([0.0, 0.0, 0.0, *frame], 1.0, draws)
    np.testing.assert_allclose(moved[3:], expected, atol=1e-14)


def test_the_canonical_walk_equals_the_literal_one_with_some_signs_reversed() -> None:
    """The distribution of (5) is preserved: reversed V or φ reverse the sign of later draws."""
    rng = np.random.default_rng(5)
    model, interval = VelocityFrame(30.0, 0.4, 0.5), 1.0
    state = np.array([0.0, 0.0, 0.0, 40.0, 0.3, 0.1])
    literal, crossings = state.copy(), 0
    for _ in range(300):
        draws = rng.normal(size=3)
        signs = np.sign(_signs_between(literal[3:], state[3:]))
        crossings += int((signs < 0.0).any())
        state = model.step(state, interval, draws * signs)
        velocity = frame_to_velocity(literal[3:])
        literal[:3] += interval * velocity
        literal[3:] += interval * np.array([30.0, 0.4, 0.5]) * draws
        np.testing.assert_allclose(state[:3], literal[:3], atol=1e-8)
        np.testing.assert_allclose(
            frame_to_velocity(state[3:]), frame_to_velocity(literal[3:]), atol=1e-9
        )
    assert crossings > 50


# The sign of V and φ in the canonical form against the literal one: from the derivatives of the
# velocity, so that the test does not ask the code under test.
def _signs_between(literal: NDArray[np.float64], state: NDArray[np.float64]) -> NDArray[np.float64]:
    signs = np.ones(3)
    for component in (0, 2):
        slopes = []
        for frame in (literal, state):
            ahead, behind = frame.copy(), frame.copy()
            ahead[component] += 1e-6
            behind[component] -= 1e-6
            slopes.append(frame_to_velocity(ahead) - frame_to_velocity(behind))
        signs[component] = np.sign(slopes[0] @ slopes[1])
    return signs


@pytest.mark.parametrize("model", SIMULATORS, ids=name_of)
def test_a_step_has_the_mean_and_covariance_of_the_filter_model(model: MotionSimulator) -> None:
    """Exact moments by symmetric points ±√3 and 0: the step is linear in its draws."""
    filter_model = MODELS[SIMULATORS.index(model)]
    state = STATES[model.coordinates.name]
    points = np.sqrt(3.0) * np.concatenate([np.eye(3), -np.eye(3)])
    moved = model.step(state, 2.5, points)
    mean = moved.mean(axis=0)
    np.testing.assert_allclose(mean, filter_model.transition(state, 2.5), rtol=1e-12)
    off = moved - mean
    np.testing.assert_allclose(
        off.T @ off / 6.0, filter_model.noise(state, 2.5), rtol=1e-10, atol=1e-12
    )


@pytest.mark.parametrize("model", MODELS, ids=name_of)
def test_jacobian_is_that_of_finite_differences(model: MotionModel) -> None:
    state = STATES[model.coordinates.name]
    steps = np.array([1.0, 1.0, 1.0, 1e-3, 1e-6, 1e-6])
    for component, step in enumerate(steps):
        ahead, behind = state.copy(), state.copy()
        ahead[component] += step
        behind[component] -= step
        slope = (model.transition(ahead, 4.0) - model.transition(behind, 4.0)) / (2.0 * step)
        # The differences of coordinates of 1e4 m carry 2e-12 m of rounding over 1e-6.
        np.testing.assert_allclose(model.jacobian(state, 4.0)[:, component], slope, atol=1e-5)


@pytest.mark.parametrize("model", MODELS, ids=name_of)
def test_conversion_to_cartesian_and_back(model: MotionModel) -> None:
    state = STATES[model.coordinates.name]
    there = model.coordinates.to_cartesian(state)
    np.testing.assert_allclose(model.coordinates.from_cartesian(there), state, rtol=1e-13)
    slope = model.coordinates.to_cartesian_jacobian(state)
    change = 1e-6 * np.array([1.0, -2.0, 3.0, 1.0, 1e-2, -2e-2])
    moved = model.coordinates.to_cartesian(state + change) - there
    np.testing.assert_allclose(moved, slope @ change, atol=1e-9)


@pytest.mark.parametrize("model", MODELS, ids=name_of)
def test_many_aircraft_at_once_are_each_as_alone(model: MotionModel) -> None:
    rng = np.random.default_rng(8)
    states = STATES[model.coordinates.name] * rng.uniform(0.5, 1.0, (4, 3, 6))
    for alone, together in (
        (model.transition(states[2, 1], 3.0), model.transition(states, 3.0)),
        (model.jacobian(states[2, 1], 3.0), model.jacobian(states, 3.0)),
        (model.noise(states[2, 1], 3.0), model.noise(states, 3.0)),
    ):
        np.testing.assert_allclose(together[2, 1], alone, rtol=1e-14)
        assert together.shape == (4, 3, *alone.shape)


def test_white_acceleration_in_space_is_that_of_the_plane_on_each_axis() -> None:
    model = WhiteAcceleration((2.0, 2.0, 0.5))
    state = STATES["cartesian"]
    plane = np.ix_([0, 1, 3, 4], [0, 1, 3, 4])
    np.testing.assert_allclose(model.noise(state, 7.0)[plane], process_noise(7.0, 2.0), rtol=1e-14)
    np.testing.assert_array_equal(model.jacobian(state, 7.0)[plane], transition(7.0))
    up = np.ix_([2, 5], [2, 5])
    expected = process_noise(7.0, 0.5)[np.ix_([0, 2], [0, 2])]
    np.testing.assert_allclose(model.noise(state, 7.0)[up], expected, rtol=1e-14)


@pytest.mark.parametrize("model", MODELS, ids=name_of)
def test_an_interval_of_zero_changes_nothing(model: MotionModel) -> None:
    state = STATES[model.coordinates.name]
    np.testing.assert_array_equal(model.transition(state, 0.0), state)
    np.testing.assert_array_equal(model.jacobian(state, 0.0), np.eye(6))
    np.testing.assert_array_equal(model.noise(state, 0.0), np.zeros((6, 6)))


@pytest.mark.parametrize("model", MODELS, ids=name_of)
@pytest.mark.parametrize("interval_s", [-1e-9, np.nan, np.inf])
def test_a_negative_interval_is_rejected(model: MotionModel, interval_s: float) -> None:
    state = STATES[model.coordinates.name]
    for use in (model.transition, model.jacobian, model.noise):
        with pytest.raises(TimeOrderError, match="prediction interval"):
            use(state, interval_s)


@pytest.mark.parametrize("model", SIMULATORS, ids=name_of)
def test_a_step_rejects_other_shapes(model: MotionSimulator) -> None:
    with pytest.raises(ShapeError, match="state: expected 6 components"):
        model.step(np.zeros(4), 1.0, np.zeros(3))
    with pytest.raises(ShapeError, match="draws: expected 3 components"):
        model.step(np.zeros(6), 1.0, np.zeros(6))
    with pytest.raises(TimeOrderError):
        model.step(np.zeros(6), -1.0, np.zeros(3))


def test_invalid_parameters_are_rejected() -> None:
    with pytest.raises(MotionParameterError, match=r"acceleration: expected .* was -2\.0"):
        CartesianAcceleration((1.0, -2.0, 0.0))
    with pytest.raises(ShapeError, match=r"acceleration: expected three numbers"):
        CartesianAcceleration((1.0, 2.0))  # type: ignore[arg-type]  # the mistake under test
    with pytest.raises(MotionParameterError, match="initial speed: expected"):
        RelativeSpeed((-1.0, 0.0, 0.0), (0.1, 0.1, 0.1))
    with pytest.raises(MotionParameterError, match="relative change: expected"):
        RelativeSpeed((1.0, 0.0, 0.0), (0.1, np.nan, 0.1))
    with pytest.raises(
        MotionParameterError, match=r"reference time: expected .* above 0, was 0\.0"
    ):
        RelativeSpeed((1.0, 0.0, 0.0), (0.1, 0.1, 0.1), 0.0)
    with pytest.raises(MotionParameterError, match="density: expected"):
        WhiteAcceleration((np.inf, 0.0, 0.0))
    with pytest.raises(MotionParameterError, match=r"turn rate: expected .* was nan"):
        VelocityFrame(1.0, np.nan)
    with pytest.raises(MotionParameterError, match="climb rate"):
        VelocityFrame(1.0, 0.1, -0.1)
    with pytest.raises(MotionParameterError, match="acceleration"):
        VelocityFrame(-1.0, 0.1)
