"""The extended Kalman filter: closed forms where it is linear, consistency where it is not."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from multiradar.errors import (
    ConfigurationError,
    CovarianceError,
    MotionParameterError,
    ShapeError,
    TimeOrderError,
)
from multiradar.estimation.gaussian import normalised_squared
from multiradar.estimation.motion.axes import frame_to_velocity
from multiradar.estimation.motion.coordinates import CARTESIAN, VELOCITY_FRAME
from multiradar.estimation.motion.velocity_frame_noise import VelocityFrameNoise
from multiradar.research.extended.extended_filter import Estimate, Outcome, predict, start, update
from multiradar.research.extended.extended_measurement import MeasuredPosition, SpaceMeasurement
from multiradar.research.motion.cartesian_acceleration import CartesianAcceleration
from multiradar.research.motion.model import MotionModel, MotionSimulator
from multiradar.research.motion.relative_speed import RelativeSpeed
from multiradar.research.motion.velocity_frame import VelocityFrame
from multiradar.research.motion.white_acceleration import WhiteAcceleration
from support.references.measured_polar import MeasuredPolar

MEAN = np.array([20e3, -35e3, 8e3, 150.0, 90.0, 6.0])
COVARIANCE = np.diag([100.0, 100.0, 80.0, 8.0, 8.0, 3.0]) ** 2
POSITION = MeasuredPosition(np.diag([30.0, 40.0, 25.0]) ** 2)
SITE = np.array([3e3, -4e3, 200.0])
RADAR = MeasuredPolar(SITE, np.diag([40.0, 1e-3, 1.5e-3]) ** 2)
ALTITUDE = MeasuredPolar(SITE, np.diag([40.0, 1e-3, 30.0]) ** 2, "height")
SENSORS: list[SpaceMeasurement] = [POSITION, RADAR, ALTITUDE]
SENSOR_NAMES = ["place", "elevation", "height"]
MODELS: list[MotionModel] = [
    CartesianAcceleration((1.0, 2.0, 0.5)),
    RelativeSpeed((150.0, 90.0, 6.0), (0.5, 0.5, 0.5)),
    VelocityFrameNoise(1.0, 0.03, 0.01),
    WhiteAcceleration((1.0, 1.0, 0.2)),
    VelocityFrame(1.0, 0.03, 0.01),
]


def name_of(model: object) -> str:
    return type(model).__name__


def test_azimuth_is_clockwise_from_north_and_range_is_slant() -> None:
    """30 km west, 40 km north and 12 km above: azimuth -36.87°, 51.42 km, elevation 13.50°."""
    position = SITE + np.array([-30e3, 40e3, 12e3])
    slant, azimuth, elevation = RADAR.predict(position)
    assert slant == pytest.approx(np.sqrt(0.9e9 + 1.6e9 + 0.144e9), rel=1e-14)
    assert np.degrees(azimuth) == pytest.approx(-36.8699, abs=1e-4)
    assert np.degrees(elevation) == pytest.approx(13.4957, abs=1e-4)
    assert ALTITUDE.predict(position)[2] == 12_200.0


@pytest.mark.parametrize("sensor", SENSORS, ids=SENSOR_NAMES)
def test_jacobian_of_a_measurement_is_that_of_finite_differences(sensor: SpaceMeasurement) -> None:
    positions = np.random.default_rng(0).normal(size=(20, 3)) * [40e3, 40e3, 6e3]
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 1.0
        slope = (
            sensor.residual(sensor.predict(positions + step), sensor.predict(positions - step))
            / 2.0
        )
        np.testing.assert_allclose(
            sensor.jacobian(positions)[..., axis], slope, rtol=2e-5, atol=1e-8
        )


def test_the_linear_filter_is_bayesian_regression_on_the_whole_path() -> None:
    """Without process noise the filter equals the weighted least squares of all measurements."""
    rng = np.random.default_rng(1)
    model = CartesianAcceleration((0.0, 0.0, 0.0))
    times = np.cumsum(rng.uniform(0.5, 6.0, 12))
    measured = rng.normal(size=(12, 3)) * 100.0 + MEAN[:3]
    found, before = start(MEAN, COVARIANCE), 0.0
    information = np.linalg.inv(COVARIANCE)
    sums = information @ MEAN
    for time, value in zip(times, measured, strict=True):
        found = update(predict(found, model, time - before), POSITION, value).estimate
        before = time
        design = np.hstack([np.eye(3), time * np.eye(3)])
        weighted = design.T @ np.linalg.inv(POSITION.noise)
        information, sums = information + weighted @ design, sums + weighted @ value
    carried = np.kron([[1.0, times[-1]], [0.0, 1.0]], np.eye(3))
    np.testing.assert_allclose(found.mean, carried @ np.linalg.solve(information, sums), rtol=1e-10)
    expected = carried @ np.linalg.inv(information) @ carried.T
    np.testing.assert_allclose(found.covariance, expected, rtol=1e-8, atol=1e-9)


def test_prediction_adds_the_noise_of_the_model() -> None:
    for model in MODELS[:4]:
        found = predict(start(MEAN, COVARIANCE), model, 5.0)
        slope = np.kron([[1.0, 5.0], [0.0, 1.0]], np.eye(3))
        expected = slope @ COVARIANCE @ slope.T + model.noise(MEAN, 5.0)
        np.testing.assert_allclose(found.mean, slope @ MEAN, rtol=1e-14)
        np.testing.assert_allclose(found.covariance, expected, rtol=1e-12)


@pytest.mark.parametrize("sensor", SENSORS, ids=SENSOR_NAMES)
@pytest.mark.parametrize("model", MODELS, ids=name_of)
def test_an_update_equals_its_information_form(
    model: MotionModel, sensor: SpaceMeasurement
) -> None:
    before = start(MEAN, COVARIANCE, model.coordinates)
    measured = sensor.predict(MEAN[:3]) + np.array([50.0, 5e-4, -3e-4])
    found = update(before, sensor, measured)
    assert found.outcome == Outcome.UPDATED
    slope = np.zeros((3, 6))
    slope[:, :3] = sensor.jacobian(MEAN[:3])
    inverse = np.linalg.inv(before.covariance) + slope.T @ np.linalg.inv(sensor.noise) @ slope
    expected = np.linalg.inv(inverse)
    change = expected @ slope.T @ np.linalg.inv(sensor.noise) @ found.innovation
    np.testing.assert_allclose(found.estimate.mean, before.mean + change, rtol=1e-9)
    scale = np.sqrt(np.outer(np.diagonal(expected), np.diagonal(expected)))
    np.testing.assert_allclose((found.estimate.covariance - expected) / scale, 0.0, atol=1e-9)
    np.testing.assert_array_equal(found.estimate.covariance, found.estimate.covariance.T)


def test_the_estimate_of_the_velocity_frame_is_the_same_in_cartesian_terms() -> None:
    estimate = start(MEAN, COVARIANCE, VELOCITY_FRAME)
    np.testing.assert_allclose(frame_to_velocity(estimate.mean[3:]), MEAN[3:], rtol=1e-13)
    there = estimate.cartesian()
    np.testing.assert_allclose(there.mean, MEAN, rtol=1e-13)
    np.testing.assert_allclose(there.covariance, COVARIANCE, rtol=1e-10, atol=1e-8)
    assert there.coordinates is CARTESIAN


def test_azimuths_wrap_at_south() -> None:
    mean = np.array([*np.add(SITE, [5.0, -50e3, 4e3]), 150.0, 0.0, 0.0])
    found = update(start(mean, COVARIANCE), RADAR, RADAR.predict(mean[:3] - [10.0, 0.0, 0.0]))
    assert abs(found.innovation[1]) < 1e-3
    assert found.distance_squared < 1.0


def _simulate(
    model: MotionSimulator, sensor: SpaceMeasurement, runs: int, steps: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    rng = np.random.default_rng(seed)
    mean = MEAN + rng.normal(size=(runs, 6)) * np.sqrt(np.diagonal(COVARIANCE))
    state = model.coordinates.from_cartesian(np.broadcast_to(MEAN, (runs, 6)))
    truth, measured = [], []
    root = np.linalg.cholesky(sensor.noise)
    for _ in range(steps):
        state = model.step(state, 2.0, rng.normal(size=(runs, 3)))
        there = model.coordinates.to_cartesian(state)
        truth.append(there)
        measured.append(sensor.predict(there[:, :3]) + rng.normal(size=(runs, 3)) @ root.T)
    return mean, np.array(truth), np.array(measured)


@pytest.mark.parametrize("sensor", SENSORS, ids=SENSOR_NAMES)
@pytest.mark.parametrize(
    ("truth", "model"),
    [
        (MODELS[0], MODELS[0]),
        (MODELS[1], MODELS[1]),
        (MODELS[4], MODELS[4]),
        (MODELS[4], MODELS[2]),
    ],
    ids=["(2)", "relative", "(5)", "(5) by (7)"],
)
def test_the_filter_is_consistent_on_what_its_model_makes(
    truth: MotionSimulator, model: MotionModel, sensor: SpaceMeasurement
) -> None:
    """Mean NEES of 200 runs in its 99.98 % band, with 4 % allowed for nonlinearity."""
    runs, steps = 200, 40
    mean, path, measured = _simulate(truth, sensor, runs, steps, 7)
    estimate = start(mean, np.broadcast_to(COVARIANCE, (runs, 6, 6)), model.coordinates)
    errors = []
    for there, seen in zip(path, measured, strict=True):
        found = update(predict(estimate, model, 2.0), sensor, seen)
        assert (found.outcome == Outcome.UPDATED).all()
        estimate = found.estimate
        cartesian = estimate.cartesian()
        errors.append(normalised_squared(cartesian.mean - there, cartesian.covariance).mean())
    low, high = chi2.ppf([1e-4, 1.0 - 1e-4], 6 * runs) / runs
    assert 0.96 * low < min(errors[5:])
    assert max(errors[5:]) < 1.04 * high


def test_a_measurement_outside_the_gate_changes_nothing() -> None:
    before = start(MEAN, COVARIANCE)
    far = np.add(MEAN[:3], [2000.0, 0.0, 0.0])
    rejected = update(before, POSITION, far, gate=25.0)
    assert rejected.outcome == Outcome.GATED
    np.testing.assert_array_equal(rejected.estimate.mean, before.mean)
    np.testing.assert_array_equal(rejected.estimate.covariance, before.covariance)
    assert rejected.distance_squared == pytest.approx(2000.0**2 / (100.0**2 + 30.0**2))
    assert update(before, POSITION, far).outcome == Outcome.UPDATED


def test_a_singular_innovation_is_rejected() -> None:
    """A noise that is not a covariance, and one lost in rounding."""
    certain = Estimate(MEAN, 1e-30 * np.eye(6), CARTESIAN)
    for noise, expected in ((np.eye(3), Outcome.UPDATED), (-np.eye(3), Outcome.SINGULAR)):
        sensor = MeasuredPosition(np.eye(3))
        object.__setattr__(sensor, "noise", noise)
        found = update(certain, sensor, MEAN[:3] + 1.0)
        assert found.outcome == expected
        assert np.isfinite(found.estimate.covariance).all()
    line = np.zeros((6, 6))
    line[:3, :3] = 1e12
    found = update(Estimate(MEAN, line, CARTESIAN), MeasuredPosition(1e-6 * np.eye(3)), MEAN[:3])
    assert found.outcome == Outcome.SINGULAR
    np.testing.assert_array_equal(found.estimate.covariance, line)


def test_the_cone_of_silence_is_not_usable() -> None:
    for ground in (0.0, 3e3):
        mean = np.array([*np.add(SITE, [ground, 0.0, 9e3]), 150.0, 0.0, 0.0])
        for sensor in (RADAR, ALTITUDE):
            found = update(start(mean, COVARIANCE), sensor, sensor.predict(mean[:3]))
            assert found.outcome == Outcome.CONE_OF_SILENCE
            np.testing.assert_array_equal(found.estimate.mean, mean)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e200])
def test_no_nan_enters_the_estimate(bad: float) -> None:
    for model in MODELS:
        for sensor in SENSORS:
            before = start(MEAN, COVARIANCE, model.coordinates)
            measured = sensor.predict(MEAN[:3])
            measured[0] = bad
            found = update(before, sensor, measured)
            assert found.outcome == Outcome.NOT_FINITE
            np.testing.assert_array_equal(found.estimate.mean, before.mean)
            assert found.distance_squared >= 0.0


def test_one_bad_measurement_does_not_affect_others() -> None:
    rng = np.random.default_rng(3)
    means = MEAN + rng.normal(size=(4, 6))
    before = start(means, np.broadcast_to(COVARIANCE, (4, 6, 6)), VELOCITY_FRAME)
    measured = np.add(RADAR.predict(means[:, :3]), [10.0, 1e-4, 1e-4])
    measured[1, 2] = np.nan
    measured[2, 0] += 5e3
    together = update(before, RADAR, measured, gate=25.0)
    expected = [Outcome.UPDATED, Outcome.NOT_FINITE, Outcome.GATED, Outcome.UPDATED]
    assert together.outcome.tolist() == expected
    for one in range(4):
        alone = start(means[one], COVARIANCE, VELOCITY_FRAME)
        found = update(alone, RADAR, measured[one], gate=25.0).estimate
        np.testing.assert_allclose(together.estimate.mean[one], found.mean, rtol=1e-13)


def test_a_negative_speed_after_an_update_is_canonical() -> None:
    """Strongly correlated with the position, speed changes from 5 to −20 m/s: opposite course."""
    mean = np.array([0.0, 0.0, 1e3, 5.0, 0.3, 0.05])
    covariance = np.diag([100.0, 100.0, 100.0, 50.0, 0.1, 0.1]) ** 2
    covariance[1, 3] = covariance[3, 1] = 0.99 * 100.0 * 50.0
    found = update(Estimate(mean, covariance, VELOCITY_FRAME), POSITION, [0.0, -60.0, 1e3]).estimate
    assert found.mean[3] > 10.0
    assert found.mean[4] == pytest.approx(0.3 - np.pi, abs=0.1)
    assert frame_to_velocity(found.mean[3:])[1] < 0.0
    assert found.covariance[1, 3] < 0.0
    assert np.linalg.eigvalsh(found.covariance).min() > 0.0


def test_bad_input_is_reported() -> None:
    with pytest.raises(ShapeError, match="mean: expected 6 components"):
        start(np.zeros(4), np.eye(4))
    with pytest.raises(ShapeError, match="mean: expected finite numbers"):
        start(MEAN * np.nan, COVARIANCE)
    with pytest.raises(ShapeError, match="covariance: expected the shape"):
        start(MEAN, np.eye(5))
    with pytest.raises(CovarianceError, match="covariance: expected variances above 0"):
        start(MEAN, -COVARIANCE)
    for velocity in ([0.0, 0.0, 0.0], [0.0, 0.0, 90.0]):
        with pytest.raises(
            ConfigurationError, match="velocity: expected a non-zero horizontal component"
        ):
            start([0.0, 0.0, 0.0, *velocity], COVARIANCE, VELOCITY_FRAME)
    estimate = start(MEAN, COVARIANCE)
    with pytest.raises(ConfigurationError, match="expected velocity frame coordinates, found car"):
        predict(estimate, VelocityFrame(1.0, 0.1), 1.0)
    with pytest.raises(TimeOrderError):
        predict(estimate, MODELS[0], -1.0)
    with pytest.raises(ShapeError, match="measurement: expected 3 components"):
        update(estimate, POSITION, [0.0, 0.0])
    with pytest.raises(MotionParameterError, match="gate: expected a finite number above 0"):
        update(estimate, POSITION, MEAN[:3], gate=0.0)
    with pytest.raises(CovarianceError, match="measurement noise"):
        MeasuredPosition(np.diag([1.0, -1.0, 1.0]))
    with pytest.raises(ShapeError, match="measurement noise: expected the shape"):
        MeasuredPolar(SITE, np.eye(2))
    with pytest.raises(ShapeError, match="site: expected three finite numbers"):
        MeasuredPolar(np.zeros(2), np.eye(3))
    with pytest.raises(ShapeError, match="third component 'depth': expected elevation or height"):
        MeasuredPolar(SITE, np.eye(3), "depth")
