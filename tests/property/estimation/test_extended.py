"""For any measurements of one aircraft the estimate is finite and its covariance valid."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from multiradar.estimation.motion.velocity_frame_noise import VelocityFrameNoise
from multiradar.research.extended.extended_filter import Estimate, Outcome, predict, start, update
from multiradar.research.extended.extended_measurement import MeasuredPosition, SpaceMeasurement
from multiradar.research.motion.cartesian_acceleration import CartesianAcceleration
from multiradar.research.motion.model import MotionModel
from multiradar.research.motion.relative_speed import RelativeSpeed
from multiradar.research.motion.velocity_frame import VelocityFrame
from multiradar.research.motion.white_acceleration import WhiteAcceleration
from support.references.measured_polar import MeasuredPolar

MODELS: list[MotionModel] = [
    CartesianAcceleration((1.0, 2.0, 0.5)),
    RelativeSpeed((150.0, 0.0, 6.0), (0.5, 0.5, 0.5)),
    VelocityFrameNoise(1.0, 0.1, 0.05),
    VelocityFrameNoise(1.0, 0.1, 0.05, nominal_interval_s=4.0),
    WhiteAcceleration((1.0, 1.0, 0.2)),
    VelocityFrame(1.0, 0.1, 0.05),
]
SITE = np.array([3e3, -4e3, 200.0])
SENSORS: list[SpaceMeasurement] = [
    MeasuredPosition(np.diag([30.0, 40.0, 25.0]) ** 2),
    MeasuredPolar(SITE, np.diag([40.0, 1e-3, 1.5e-3]) ** 2),
    MeasuredPolar(SITE, np.diag([40.0, 1e-3, 30.0]) ** 2, "height"),
]
MEAN = np.array([20e3, -35e3, 8e3, 150.0, 90.0, 6.0])
COVARIANCE = np.diag([100.0, 100.0, 80.0, 8.0, 8.0, 3.0]) ** 2


@dataclass(frozen=True)
class Seen:
    """A measurement after a gap: deviating by some sigmas of the noise, or absurd."""

    gap_s: float
    sensor: int
    off: tuple[float, float, float]
    gate: float | None


near, far = st.floats(-4.0, 4.0), st.floats(-1e5, 1e5)
anything = st.sampled_from([np.nan, np.inf, -np.inf, 1e200, -1e200, 1e12])
seen = st.builds(
    Seen,
    gap_s=st.floats(0.0, 40.0),
    sensor=st.integers(0, 2),
    off=st.tuples(near, near, near) | st.tuples(far, far, far) | st.tuples(anything, near, far),
    gate=st.none() | st.floats(1.0, 100.0),
)


# With an absurd measurement rounding is not small relative to the noise.
def require_sound(estimate: Estimate) -> None:
    assert np.isfinite(estimate.mean).all()
    np.testing.assert_array_equal(estimate.covariance, estimate.covariance.T)
    sigmas = np.sqrt(np.diagonal(estimate.covariance))
    assert (sigmas > 0.0).all()
    assert np.linalg.eigvalsh(estimate.covariance / np.outer(sigmas, sigmas)).min() > -1e-6


@pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
@settings(max_examples=30)
@given(history=st.lists(seen, max_size=10))
def test_estimates_remain_finite_for_any_measurements(
    model: MotionModel, history: list[Seen]
) -> None:
    estimate = start(MEAN, COVARIANCE, model.coordinates)
    for one in history:
        predicted = predict(estimate, model, one.gap_s)
        require_sound(predicted)
        sensor = SENSORS[one.sensor]
        sigmas = np.sqrt(np.diagonal(sensor.noise))
        measured = sensor.predict(predicted.mean[:3]) + sigmas * np.array(one.off)
        found = update(predicted, sensor, measured, one.gate)
        require_sound(found.estimate)
        if found.outcome != Outcome.UPDATED:
            np.testing.assert_array_equal(found.estimate.mean, predicted.mean)
            np.testing.assert_array_equal(found.estimate.covariance, predicted.covariance)
        elif one.gate is not None:
            assert found.distance_squared <= one.gate
        estimate = found.estimate
