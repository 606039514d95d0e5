"""The player and the sequential filter agree with the plain filters, plot by plot."""

import numpy as np
import pytest

from multiradar.errors import (
    ConfigurationError,
    ShapeError,
    TimeOrderError,
    UnknownAircraftError,
    UnknownFilterError,
)
from multiradar.estimation.filters.bank import Outcome
from multiradar.research.sequential.arrangement import Options
from multiradar.research.sequential.filter import SequentialFilter
from multiradar.research.sequential.player import play
from multiradar.research.sequential.plots import FORMS, Form, Plots
from support.references.constant_velocity import process_noise, transition
from support.references.reference_filters import ReferenceFilter
from support.references.sequential_runs import (
    NAMES,
    SmallScene,
    plain_filter,
    play_plain,
    small_scene,
)

ACCELERATION = 0.3


def assert_close(
    found: tuple[np.ndarray, np.ndarray],
    expected: tuple[np.ndarray, np.ndarray],
    name: str,
) -> None:
    """Means in sigmas, covariances in products of sigmas; CI has an iterative weight."""
    sigmas, share = (0.0025, 0.001) if name == "ci" else (1e-6, 1e-7)
    scale = np.sqrt(np.diagonal(expected[1]))
    np.testing.assert_allclose(found[0] / scale, expected[0] / scale, rtol=0, atol=sigmas)
    outer = np.outer(scale, scale)
    np.testing.assert_allclose(found[1] / outer, expected[1] / outer, rtol=0, atol=share)


def moved(
    one: ReferenceFilter, scene: SmallScene, aircraft: int, time_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """An aircraft of a plain filter, predicted to a later time."""
    mean, covariance = one.aircraft(aircraft)
    seen = scene.plots.time_s[scene.plots.aircraft == aircraft]
    ahead = time_s - seen.max()
    step = transition(ahead)
    return step @ mean, step @ covariance @ step.T + process_noise(ahead, ACCELERATION)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("drift", [0.0, 1.0])
def test_the_player_is_the_plain_filter(name: str, form: Form, drift: float) -> None:
    """With missing plots, process noise, and drifting biases; aircraft are predicted to the end."""
    scene = small_scene(3, drift=drift)
    plain = plain_filter(name, form, scene, ACCELERATION)
    play_plain(plain, scene, walk_s=2.0)
    end_s = 21.5
    record = play(
        name, scene.sensors, scene.plots, scene.starts, [0.0, end_s],
        form=form, walk_s=2.0, options=Options(acceleration_density=ACCELERATION),
    )  # fmt: skip
    biases = record.bias[1], record.bias_covariance[1]
    assert_close(biases, plain.biases(), name)
    for aircraft in range(3):
        found = record.mean[1, aircraft], record.covariance[1, aircraft]
        assert_close(found, moved(plain, scene, aircraft, end_s), name)
        np.testing.assert_array_equal(record.mean[0, aircraft], scene.starts.mean[aircraft])
    np.testing.assert_array_equal(record.bias_covariance[0], scene.sensors.prior.covariance)


@pytest.mark.parametrize("name", NAMES)
def test_the_sequential_filter_is_the_player(name: str) -> None:
    """Plot by plot through the public class; one aircraft ends and another number is used."""
    scene = small_scene(4, drift=1.0)
    options = Options(acceleration_density=ACCELERATION)
    record = play(name, scene.sensors, scene.plots, scene.starts, [20.0], options=options)
    one = SequentialFilter(name, scene.sensors, options=options)
    for aircraft in range(3):
        one.start(
            100 + aircraft, 0.0, scene.starts.mean[aircraft], scene.starts.covariance[aircraft]
        )
    plots, walked = scene.plots, 0
    row = 0
    while row < len(plots):
        time_s, aircraft = float(plots.time_s[row]), int(plots.aircraft[row])
        one.walk(time_s - walked)
        walked = int(time_s)
        last = row + 1
        while last < len(plots) and (plots.time_s[last], plots.aircraft[last]) == (
            time_s, aircraft,
        ):  # fmt: skip
            last += 1
        outcomes = one.observe_together(
            100 + aircraft, time_s, plots.sensor[row:last].tolist(), plots.value[row:last]
        )
        assert set(outcomes) == {Outcome.UPDATED}
        row = last
    np.testing.assert_allclose(one.biases()[0], record.bias[0], rtol=1e-12)
    np.testing.assert_allclose(one.biases()[1], record.bias_covariance[0], rtol=1e-12)
    for aircraft in range(3):
        if plots.time_s[plots.aircraft == aircraft].max() == 20.0:
            mean, covariance = one.aircraft(100 + aircraft)
            np.testing.assert_allclose(mean, record.mean[0, aircraft], rtol=1e-12)
            np.testing.assert_allclose(covariance, record.covariance[0, aircraft], rtol=1e-10)
    before = one.biases()
    one.end(101)
    with pytest.raises(UnknownAircraftError):
        one.aircraft(101)
    np.testing.assert_array_equal(one.biases()[0], before[0])


def test_the_two_stage_filter_is_the_joint_filter() -> None:
    """To a micrometre and to 1e-9 of the variances, in both forms, at every second."""
    scene = small_scene(5, duration_s=60)
    times = np.arange(0.0, 61.0)
    for form in FORMS:
        joint, two_stage = (
            play(name, scene.sensors, scene.plots, scene.starts, times, form=form)
            for name in ("joint", "two-stage")
        )
        np.testing.assert_allclose(two_stage.mean, joint.mean, rtol=0, atol=1e-6)
        sigma = np.sqrt(np.diagonal(joint.covariance, axis1=-2, axis2=-1))
        outer = sigma[..., :, None] * sigma[..., None, :]
        np.testing.assert_allclose(
            two_stage.covariance / outer, joint.covariance / outer, rtol=0, atol=1e-9
        )


def test_a_filter_can_start_at_its_first_plot() -> None:
    scene = small_scene(6, missing=0.0)
    one = SequentialFilter("two-stage", scene.sensors)
    for row in range(len(scene.plots)):
        outcome = one.observe(
            int(scene.plots.aircraft[row]), float(scene.plots.time_s[row]),
            int(scene.plots.sensor[row]), scene.plots.value[row],
        )  # fmt: skip
        assert outcome == (Outcome.STARTED if row in (0, 3, 6) else Outcome.UPDATED)
    mean, covariance = one.aircraft(1)
    error = mean - scene.state(1, 20.0)
    assert error @ np.linalg.solve(covariance, error) < 25.0


def test_the_record_counts_outcomes() -> None:
    scene = small_scene(6, duration_s=20)
    plots, spoilt = scene.plots, scene.plots.value.copy()
    # Too far off to be usable, once within the time and once after the end.
    spoilt[[2, -1]] = 1e13
    given = Plots(plots.time_s, plots.aircraft, plots.sensor, spoilt)
    until = float(plots.time_s[-1]) - 1e-3
    record = play("two-stage", scene.sensors, given, scene.starts, [until])
    taken = int(np.sum(plots.time_s <= until))
    assert taken < len(plots)
    assert record.outcomes[Outcome.SINGULAR] == 1
    assert record.outcomes[Outcome.UPDATED] == record.outcomes.sum() - 1 == taken - 1
    assert play("two-stage", scene.sensors, given, scene.starts, []).outcomes.sum() == 0


def test_covariance_intersection_uses_the_velocity_factor() -> None:
    """A larger time factor of velocities improves the final velocity."""
    scene = small_scene(8, duration_s=60)
    sigma = []
    for scale_s in (1.0, 10.0, 100.0):
        record = play(
            "ci", scene.sensors, scene.plots, scene.starts, [60.0],
            options=Options(ci_scale_time_s=scale_s),
        )  # fmt: skip
        sigma.append(np.trace(record.covariance[0, 0, 2:, 2:]) ** 0.5)
    assert sigma[0] > 1.2 * sigma[1] > 1.2 * sigma[2]


def test_invalid_input_of_the_player_is_rejected() -> None:
    scene = small_scene(7)
    with pytest.raises(UnknownFilterError, match=r"unknown filter 'kalman'.*joint"):
        play("kalman", scene.sensors, scene.plots, scene.starts, [1.0])
    with pytest.raises(ConfigurationError, match="form"):
        play("joint", scene.sensors, scene.plots, scene.starts, [1.0], form="square")  # type: ignore[arg-type]
    with pytest.raises(ConfigurationError, match="walk"):
        play("joint", scene.sensors, scene.plots, scene.starts, [1.0], walk_s=0.0)
    with pytest.raises(TimeOrderError, match="output time"):
        play("joint", scene.sensors, scene.plots, scene.starts, [2.0, 1.0])
    far = Plots([1.0], [9], [0], [[1e4, 0.0]])
    with pytest.raises(ShapeError, match="aircraft"):
        play("joint", scene.sensors, far, scene.starts, [1.0])
    early = Plots([-1.0], [0], [0], [[1e4, 0.0]])
    with pytest.raises(TimeOrderError, match="aircraft"):
        play("joint", scene.sensors, early, scene.starts, [1.0])
    with pytest.raises(ConfigurationError, match="cone_ratio"):
        Options(cone_ratio=-1.0)
