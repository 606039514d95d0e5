"""The modes with reported motion are one Kalman filter of the state and of the slow states."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import SEVERAL, UPDATED
from multiradar.estimation.filters.arrays import (
    SLOW_COUNT,
    Aircraft,
    Model,
    Rows,
    Work,
    aircraft_arrays,
    result_arrays,
)
from multiradar.estimation.filters.imm import _reported_motion_kernels as motion_kernels
from multiradar.estimation.filters.imm import _slow_state_kernels as slow_kernels
from multiradar.estimation.filters.imm._imm_step_kernels import imm_step
from multiradar.estimation.filters.imm._mode_scratch_kernels import (
    ACROSS,
    ALONG,
    ENTERING,
    LEAVING,
    MODE_COUNT,
)
from multiradar.estimation.measurement import reported_motion as reported
from multiradar.estimation.measurement.kinds import KIND_POSITION
from multiradar.estimation.measurement.reported_motion import AIRSPEED_SIGMA_MPS
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.settings import TrackingSettings
from support.references.compiled_filters import UPPER
from validation.motion.check_manoeuvres import table

Floats = NDArray[np.float64]

INTERVAL_S, DENSITY, SIGMA_M = 4.0, 0.5, 40.0
HEIGHT_M = 9000.0
START, WIND_MPS = np.array([2e3, -5e3, 180.0, 60.0]), np.array([18.0, -9.0])


class JointMotion:
    """A Kalman filter of the state of straight flight and of the slow states together."""

    def __init__(self, mean: Floats, covariance: Floats, *, density: float, sigma_m: float) -> None:
        self._density, self._sigma_m, self._reported_s = density, sigma_m, np.nan
        self.mean = np.r_[mean, np.zeros(SLOW_COUNT)]
        self.mean[4 + slow_kernels.AGE] = slow_kernels.AGE_MPS
        self.covariance = np.zeros((4 + SLOW_COUNT, 4 + SLOW_COUNT))
        self.covariance[:4, :4] = covariance

    def begin(self) -> None:
        sigmas = [
            slow_kernels.WIND_SIGMA_MPS, slow_kernels.WIND_SIGMA_MPS,
            slow_kernels.SCALE_SIGMA_MPS, slow_kernels.VARIATION_SIGMA_MPS,
            slow_kernels.GROUND_SIGMA_MPS, slow_kernels.GROUND_SIGMA_MPS,
            slow_kernels.AGE_SIGMA_MPS,
        ]  # fmt: skip
        self.covariance[4:, 4:] = np.diag(np.square(sigmas))

    def report(self, time_s: float) -> None:
        """Let the slow states drift since the last report; the first one gives them their prior."""
        if np.isnan(self._reported_s):
            self.begin()
        else:
            self.drift(time_s - self._reported_s)
        self._reported_s = time_s

    def predict(self, dt: float) -> None:
        step = np.eye(4 + SLOW_COUNT)
        step[0, 2] = step[1, 3] = dt
        self.mean = step @ self.mean
        self.covariance = step @ self.covariance @ step.T
        block = self._density * np.array([[dt**3 / 3.0, dt**2 / 2.0], [dt**2 / 2.0, dt]])
        for axis in range(2):
            self.covariance[np.ix_([axis, axis + 2], [axis, axis + 2])] += block

    def drift(self, dt: float) -> None:
        wind = slow_kernels.WIND_DRIFT
        rates = [
            wind, wind, slow_kernels.SCALE_DRIFT, slow_kernels.VARIATION_DRIFT,
            slow_kernels.GROUND_DRIFT, slow_kernels.GROUND_DRIFT, slow_kernels.AGE_DRIFT,
        ]  # fmt: skip
        along = self.mean[2:4] / np.linalg.norm(self.mean[2:4])
        drifting = np.vstack([np.zeros((4, SLOW_COUNT)), np.eye(SLOW_COUNT)])
        drifting[2:4, :2] = np.outer(along, along)
        self.covariance += drifting @ np.diag(np.array(rates) * dt) @ drifting.T

    def update(self, innovation: Floats, slope: Floats, noise: Floats) -> None:
        spread = slope @ self.covariance @ slope.T + noise
        gain = self.covariance @ slope.T @ np.linalg.inv(spread)
        self.mean = self.mean + gain @ innovation
        self.covariance = self.covariance - gain @ spread @ gain.T

    def observe(self, z: Floats) -> None:
        slope = np.eye(2, 4 + SLOW_COUNT)
        self.update(z - slope @ self.mean, slope, self._sigma_m**2 * np.eye(2))

    def hear(self, u: Floats, *, ground: bool) -> None:
        slope = np.zeros((2, 4 + SLOW_COUNT))
        slope[:, 2:4] = np.eye(2)
        if ground:
            slope[:, 8:10] = np.eye(2)
        else:
            slope[:, 4:6] = -np.eye(2)
            scaled = u / slow_kernels.NOMINAL_SPEED_MPS
            slope[:, 6], slope[:, 7] = -scaled, [-scaled[1], scaled[0]]
        across = (motion_kernels.DIRECTION_SIGMA_RAD * np.hypot(*u)) ** 2
        along = motion_kernels.GROUND_VELOCITY_SIGMA_MPS**2
        if not ground:
            across += motion_kernels.GUST_SIGMA_MPS**2
            along = AIRSPEED_SIGMA_MPS**2
        d = u / np.linalg.norm(u)
        side = np.array([d[1], -d[0]])
        self.update(
            u - slope @ self.mean, slope, along * np.outer(d, d) + across * np.outer(side, side)
        )


def unpacked(upper: Floats) -> Floats:
    matrix = np.zeros((4, 4))
    matrix[UPPER] = upper
    return matrix + np.triu(matrix, 1).T


def run(model: Model, aircraft: Aircraft, time_s: float, z: Floats, report: Floats) -> None:
    rows = Rows(
        slot=np.array([0]), time=np.array([time_s]), kind=np.array([KIND_POSITION]),
        sensor=np.array([0]), z=z[None].copy(), height=np.array([np.nan]), seen=np.array([0]),
        ground=np.array([-1]), motion=report[None].copy(),
    )  # fmt: skip
    result = result_arrays(1, 1, 0)
    work = Work(partitions=np.array([0]), bounds=np.array([0, 1]), order=np.array([0]))
    imm_step(work, rows, model, aircraft, result, True)
    assert result.outcome[0] == UPDATED


# Straight flight in three equal modes, and known biases: one Kalman filter. Registers alternate.
def test_state_and_slow_states_are_those_of_one_joint_kalman_filter() -> None:
    equal = np.zeros((3, MODE_COUNT))
    equal[:, ALONG] = equal[:, ACROSS] = DENSITY
    equal[:, LEAVING], equal[1:, ENTERING] = 1.0 / 50.0, 0.5
    noises = np.array([[1.0, 1.0, SIGMA_M**2, 0.0]])
    engine = Engine(table(known=True), TrackingSettings(filter_name="imm"))
    model = engine._model._replace(modes=equal, noises=noises)
    covariance = np.diag([200.0**2, 200.0**2, 30.0**2, 30.0**2])
    aircraft = started(START, covariance)
    joint = JointMotion(START, covariance, density=DENSITY, sigma_m=SIGMA_M)
    rng = np.random.default_rng(5)
    true = START + np.array([60.0, -90.0, 12.0, 9.0])
    for step in range(1, 25):
        time_s = step * INTERVAL_S
        z = true[:2] + true[2:] * time_s + rng.normal(0.0, SIGMA_M, 2)
        joint.predict(INTERVAL_S)
        joint.observe(z)
        shape = engine.plane.local_matrix(joint.mean[0], joint.mean[1], HEIGHT_M)
        air = shape @ (true[2:] - WIND_MPS) + rng.normal(0.0, 1.0, 2) if step % 2 else None
        over = shape @ true[2:] + rng.normal(0.0, 0.5, 2) if step % 3 == 0 else None
        run(model, aircraft, time_s, z, report_of(air, over))
        if air is not None or over is not None:
            joint.report(time_s)
        for velocity, ground in ((over, True), (air, False)):
            if velocity is not None:
                joint.hear(np.linalg.solve(shape, velocity), ground=ground)
        np.testing.assert_allclose(aircraft.mean[0], joint.mean[:4], rtol=1e-5, atol=1e-3)
        np.testing.assert_allclose(
            unpacked(aircraft.covariance[0]), joint.covariance[:4, :4], rtol=2e-3, atol=0.05
        )
        np.testing.assert_allclose(aircraft.slow[0], joint.mean[4:], rtol=1e-3, atol=0.01)
        np.testing.assert_allclose(
            aircraft.slow_covariance[0], joint.covariance[4:, 4:], rtol=2e-3, atol=0.05
        )


def started(mean: Floats, covariance: Floats) -> Aircraft:
    aircraft = aircraft_arrays(1, 0, modes=3)
    aircraft.mean[0], aircraft.covariance[0] = mean, covariance[UPPER]
    aircraft.time[0], aircraft.measured_from[0], aircraft.height[0] = 0.0, SEVERAL, HEIGHT_M
    return aircraft


def report_of(air: Floats | None, over: Floats | None) -> Floats:
    report = np.full(reported.MOTION_COUNT, np.nan)
    if air is not None:
        report[reported.HEADING], report[reported.AIRSPEED] = np.arctan2(*air), np.hypot(*air)
        report[reported.AIRSPEED_VARIANCE] = reported.AIRSPEED_SIGMA_MPS**2
    if over is not None:
        report[reported.TRACK_ANGLE] = np.arctan2(*over)
        report[reported.GROUND_SPEED] = np.hypot(*over)
    return report
