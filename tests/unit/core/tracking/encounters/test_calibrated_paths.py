"""Calibration applies to the independent errors of tracks."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.tracking.encounters._relative_kernels import RARE, USUAL
from multiradar.tracking.encounters.calibrated_paths import CalibratedPaths, calibrated_paths
from multiradar.tracking.forecast.forecast_calibration import ForecastCalibration, calibration_for
from multiradar.tracking.forecast.forecast_family import STRAIGHT
from multiradar.tracking.forecast.region_sizes import HORIZONS_S
from multiradar.tracking.outputs import TrackStates
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.encounter_paths import covariance

Floats = NDArray[np.float64]

SETTINGS = TrackingSettings(filter_name="two-stage", acceleration_density=1.0)
TIMES_S = np.arange(0.0, 301.0, 10.0)
SCORED = np.searchsorted(TIMES_S, HORIZONS_S)
#: Logarithm of the area of regions of a motion that does not fit.
POOR = 9.0


def _states(shared_m: float = 0.0) -> TrackStates:
    bias = np.zeros((2, 4, 1))
    bias[:, 0] = shared_m
    known = np.array([covariance(50.0, 4.0), covariance(80.0, 3.0)])
    return TrackStates(
        track_id=np.array([1, 2]),
        time_s=np.zeros(2),
        mean=np.array([[0.0, 0.0, 200.0, 0.0], [5e3, 0.0, 0.0, 150.0]]),
        covariance=known + bias @ bias.swapaxes(-1, -2),
        height_m=np.full(2, np.nan),
        shared=bias,
    )


def _taught(size: float, horizons: int = len(HORIZONS_S)) -> ForecastCalibration:
    """Errors of straight flight were those of a Gaussian of this size in terms of C."""
    calibration = calibration_for(SETTINGS)
    shares = (np.arange(2000) + 0.5) / 2000.0
    motions = len(calibration.family.names)
    sizes = np.full((len(shares), motions), POOR)
    sizes[:, calibration.family.names.index(STRAIGHT)] = 0.0
    scores = np.tile(-2.0 * size * np.log1p(-shares)[:, None], motions)
    for horizon in range(horizons):
        calibration.scores.record(horizon, scores, sizes)
    calibration.scores.settle()
    return calibration


def _spreads(paths: CalibratedPaths, column: int) -> Floats:
    """Covariances of the positions of paths, (n, k, 3)."""
    now, t = paths.now, TIMES_S[:, None]
    common = np.stack([2.0 * now[:, 2], now[:, 3] + now[:, 5], 2.0 * now[:, 6]], axis=-1)
    velocity_spreads = paths.velocity_spreads[..., column : column + 3]
    return np.asarray(now[:, None, [0, 1, 4]] + t * common[:, None] + t**2 * velocity_spreads)


def _straight(states: TrackStates, ahead_s: Floats) -> Floats:
    family = calibration_for(SETTINGS).family
    _, found = family.forecast(family.names.index(STRAIGHT), states, ahead_s)
    return np.asarray(found[..., [0, 0, 1], [0, 1, 1]])


def test_without_calibration_any_aircraft_may_turn_all_the_time() -> None:
    calibration, states = calibration_for(SETTINGS), _states()
    paths = calibrated_paths(calibration, states, np.zeros(2), TIMES_S)
    means, _ = calibration.family.forecast(calibration.family.first, states, TIMES_S)
    careful = calibration.family.worst_case_covariances(means, states, TIMES_S)
    np.testing.assert_allclose(paths.means[..., :2], means)
    for column in (USUAL, RARE):
        np.testing.assert_allclose(
            _spreads(paths, column), careful[..., [0, 0, 1], [0, 1, 1]], rtol=1e-6, atol=1e-3
        )


@pytest.mark.parametrize("size", [1.0, 3.0, 8.0])
def test_calibrated_errors_have_the_size_of_past_ones(size: float) -> None:
    states = _states()
    paths = calibrated_paths(_taught(size), states, np.zeros(2), TIMES_S)
    plain = _straight(states, TIMES_S)
    for column in (USUAL, RARE):
        ratio = _spreads(paths, column)[..., [0, 2]] / plain[..., [0, 2]]
        np.testing.assert_allclose(ratio[:, 0], 1.0, rtol=1e-9)
        # Bins of width 1/8 in the logarithm separate both sizes by a fifth. After ten seconds the
        # current position error dominates.
        np.testing.assert_allclose(ratio[:, SCORED[1:]], size, rtol=0.2)


def test_no_covariance_is_below_that_of_the_filter() -> None:
    """Aircraft that flew straight so far may turn next."""
    states = _states()
    paths = calibrated_paths(_taught(0.001), states, np.zeros(2), TIMES_S)
    for column in (USUAL, RARE):
        np.testing.assert_allclose(
            _spreads(paths, column), _straight(states, TIMES_S), rtol=1e-9, atol=1e-6
        )


def test_common_errors_are_neither_scaled_nor_calibrated() -> None:
    """A common bias of 30 m is included in both covariances once."""
    bias_m = 30.0
    alone, biased = (
        calibrated_paths(_taught(1.0), _states(shared), np.zeros(2), TIMES_S)
        for shared in (0.0, bias_m)
    )
    for column in (USUAL, RARE):
        apart = (_spreads(biased, column) - _spreads(alone, column))[:, SCORED[2:], 0]
        # The size of C with the bias in it, 1e-2 after a minute, is a little larger.
        grown = 0.05 * _spreads(alone, column)[:, SCORED[2:], 0]
        assert (apart >= bias_m**2 * (1.0 - 1e-6)).all()
        assert (apart <= bias_m**2 + grown).all()
    assert biased.now[0, 0] == pytest.approx(alone.now[0, 0] + bias_m**2)


def test_beyond_the_calibrated_horizon_errors_grow_with_time() -> None:
    """Sixty seconds are calibrated: at 120 s errors are twice as large in terms of C."""
    states = _states()
    paths = calibrated_paths(_taught(3.0, horizons=3), states, np.zeros(2), TIMES_S)
    ratio = _spreads(paths, RARE)[..., 0] / _straight(states, TIMES_S)[..., 0]
    np.testing.assert_allclose(ratio[:, SCORED[3]], 2.0 * ratio[:, SCORED[2]], rtol=1e-6)
    np.testing.assert_allclose(ratio[:, SCORED[4]], 5.0 * ratio[:, SCORED[2]], rtol=1e-6)


def test_a_track_without_updates_is_extrapolated_from_its_state() -> None:
    """Ten seconds after one state is forty seconds after one that is half a minute older."""
    states = _states()
    calibration = _taught(2.0)
    fresh = calibrated_paths(calibration, states, np.zeros(2), TIMES_S)
    old = calibrated_paths(calibration, states, np.full(2, 30.0), TIMES_S)
    np.testing.assert_allclose(old.means[:, :-3], fresh.means[:, 3:])
    for column in (USUAL, RARE):
        # Its current position covers both usual and rare errors.
        np.testing.assert_allclose(
            _spreads(old, column)[:, :-3], _spreads(fresh, column)[:, 3:], rtol=0.05
        )


def test_covariances_are_positive_for_any_state_uncertainty() -> None:
    states = replace(_states(), covariance=np.array([covariance(3e3, 200.0, -0.9)] * 2))
    for size in (0.001, 1.0, 100.0):
        paths = calibrated_paths(_taught(size), states, np.array([0.0, 50.0]), TIMES_S)
        for column in (USUAL, RARE):
            assert np.isfinite(paths.velocity_spreads).all()
            assert (_spreads(paths, column)[..., [0, 2]] > 0.0).all()
