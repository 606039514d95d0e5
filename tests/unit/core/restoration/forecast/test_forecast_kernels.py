"""The compiled continuation of a track equals a plain form with numerical derivatives."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.restoration.bundle.estimate import velocity_states
from multiradar.restoration.control_tracks.motion import advance
from multiradar.restoration.forecast import _forecast_kernels as kernels
from multiradar.restoration.forecast.later_manoeuvres import STEP_S, later_turn_moments
from multiradar.restoration.forecast.settings import ForecastSettings

Floats = NDArray[np.float64]

AHEAD_S = np.array([0.0, 12.0, 45.0, 130.0])
RULES = np.array([STEP_S, 1.0 / 100.0, 0.7, 18.0, 0.003])
# Position, speed, heading, lateral and longitudinal acceleration; their covariance.
MOTION = np.array([3000.0, -800.0, 170.0, 1.1, 2.5, -0.2])
ROOT = np.random.default_rng(11).normal(size=(6, 6)) * np.array([20, 20, 1, 0.01, 0.05, 0.02])
COVARIANCE = ROOT.T @ ROOT
#: Tolerance of rates: third order of the steps of numerical derivatives.
SLOPE_ERROR = 1e-5


@cache
def later() -> Floats:
    return later_turn_moments(100.0, ForecastSettings())


def reached(motion: Floats, lasts_s: float, ahead_s: float) -> Floats:
    """East, north and their rates: the segment, then straight flight."""
    run = min(lasts_s, ahead_s)
    turned = advance(motion[:4], motion[4], motion[5], run)
    return velocity_states(advance(turned, 0.0, 0.0, ahead_s - run))


def plain(lasts_s: float, variance: float, ahead_s: float) -> tuple[Floats, Floats]:
    """State and covariance of a member without a new manoeuvre."""
    steps = np.array([1.0, 1.0, 0.01, 1e-5, 1e-4, 1e-4])
    slopes = np.column_stack(
        [
            (reached(MOTION + way, lasts_s, ahead_s) - reached(MOTION - way, lasts_s, ahead_s))
            / (2.0 * step)
            for step, way in zip(steps, np.diag(steps), strict=True)
        ]
    )
    spread = slopes @ COVARIANCE @ slopes.T
    state = reached(MOTION, lasts_s, ahead_s)
    straight = ahead_s - min(lasts_s, ahead_s)
    if straight > 0.0:
        ends = reached(MOTION, lasts_s + 1e-3, ahead_s) - reached(MOTION, lasts_s - 1e-3, ahead_s)
        slope = ends / 2e-3
        most = np.hypot(state[2], state[3]) / np.hypot(slope[2], slope[3])
        spread += np.outer(slope, slope) * min(variance, most**2)
    t = ahead_s
    noise = 0.003 * np.array([[t**3 / 3.0, t**2 / 2.0], [t**2 / 2.0, t]])
    return state, spread + np.kron(noise, np.eye(2))


def compiled(lasts_s: float, variance: float) -> tuple[Floats, Floats, Floats]:
    count = len(AHEAD_S)
    weight, state = np.empty((count, 4)), np.empty((count, 4, 4))
    covariance = np.empty((count, 4, 4, 4))
    kernels.continue_track(
        MOTION, COVARIANCE, lasts_s, variance, 0.5, AHEAD_S, later(), RULES, np.empty((4, 6)),
        np.empty((4, 4)), np.empty((4, 4)), weight, state, covariance,
    )  # fmt: skip
    return weight, state, covariance


@pytest.mark.parametrize(("lasts_s", "variance"), [(20.0, 50.0), (30.0, 1e5), (200.0, 100.0)])
def test_a_member_without_a_new_manoeuvre(lasts_s: float, variance: float) -> None:
    weight, state, covariance = compiled(lasts_s, variance)
    for k, ahead_s in enumerate(AHEAD_S):
        expected, spread = plain(lasts_s, variance, ahead_s)
        np.testing.assert_allclose(state[k, kernels.ON], expected, rtol=1e-12)
        scale = np.sqrt(np.outer(np.diag(spread), np.diag(spread)))
        assert np.abs((covariance[k, kernels.ON] - spread) / scale).max() < SLOPE_ERROR
    straight = np.maximum(AHEAD_S - lasts_s, 0.0)
    np.testing.assert_allclose(weight[:, kernels.ON], 0.5 * np.exp(-straight / 100.0))
    np.testing.assert_allclose(weight.sum(axis=1), 0.5)


@pytest.mark.parametrize("side", [kernels.LATER_RIGHT, kernels.LATER_LEFT])
def test_a_later_turn_starts_at_the_end_of_the_segment(side: int) -> None:
    lasts_s, variance = 15.0, 40.0
    _, state, covariance = compiled(lasts_s, variance)
    for k, ahead_s in enumerate(AHEAD_S):
        straight = max(ahead_s - lasts_s, 0.0)
        end = reached(MOTION, lasts_s, min(ahead_s, lasts_s))
        speed, heading = np.hypot(end[2], end[3]), np.arctan2(end[2], end[3])
        mirror = np.diag([1.0, 1.0 if side == kernels.LATER_RIGHT else -1.0] * 2)
        along, right = [np.sin(heading), np.cos(heading)], [np.cos(heading), -np.sin(heading)]
        turned = np.kron(np.eye(2), np.column_stack([along, right])) @ mirror
        columns = [np.interp(straight, STEP_S * np.arange(len(later())), one) for one in later().T]
        spread = np.zeros((4, 4))
        spread[np.triu_indices(4)] = columns[4:]
        spread += np.triu(spread, 1).T
        mean = np.array([*end[:2], 0.0, 0.0]) + speed * turned @ columns[:4]
        np.testing.assert_allclose(state[k, side], mean, rtol=1e-9, atol=1e-9)
        more = covariance[k, side] - covariance[k, kernels.ON]
        expected = speed**2 * turned @ spread @ turned.T
        np.testing.assert_allclose(more, expected, rtol=1e-8, atol=1e-6)


def test_a_later_change_of_speed_is_along_the_path() -> None:
    lasts_s = 15.0
    _, state, covariance = compiled(lasts_s, 40.0)
    for k, ahead_s in enumerate(AHEAD_S):
        t = max(ahead_s - lasts_s, 0.0)
        velocity = state[k, kernels.ON, 2:]
        along = np.outer(velocity, velocity) / (velocity @ velocity)
        moments = np.array([[t * t / 3.0, t / 2.0], [t / 2.0, 1.0]])
        more = covariance[k, kernels.LATER_SPEED] - covariance[k, kernels.ON]
        np.testing.assert_allclose(more, 18.0**2 * np.kron(moments, along), rtol=1e-8, atol=1e-6)
        np.testing.assert_array_equal(state[k, kernels.LATER_SPEED], state[k, kernels.ON])
