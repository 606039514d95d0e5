"""What was learnt is put to what tracks err by themselves."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.tracking.encounters._relative_kernels import RARE, USUAL
from multiradar.tracking.encounters.learnt_courses import Courses, learnt_courses
from multiradar.tracking.forecast.forecast_calibration import ForecastCalibration, calibration_for
from multiradar.tracking.forecast.forecast_family import STRAIGHT
from multiradar.tracking.forecast.forecast_scores import HORIZONS_S
from multiradar.tracking.outputs import TrackStates
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.encounter_paths import covariance

Floats = NDArray[np.float64]

SETTINGS = TrackingSettings(acceleration_density=1.0)
TIMES_S = np.arange(0.0, 301.0, 10.0)
JUDGED = np.searchsorted(TIMES_S, HORIZONS_S)
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
    """Errors of straight flight have been those of a Gaussian of this size beside C."""
    calibration = calibration_for(SETTINGS)
    shares = (np.arange(2000) + 0.5) / 2000.0
    motions = len(calibration.family.names)
    sizes = np.full((len(shares), motions), POOR)
    sizes[:, calibration.family.names.index(STRAIGHT)] = 0.0
    scores = np.tile(-2.0 * size * np.log1p(-shares)[:, None], motions)
    for horizon in range(horizons):
        calibration.scores.take(horizon, scores, sizes)
    calibration.scores.settle()
    return calibration


def _spreads(courses: Courses, column: int) -> Floats:
    """The covariances of places that the courses stand for, (n, k, 3)."""
    now, t = courses.now, TIMES_S[:, None]
    common = np.stack([2.0 * now[:, 2], now[:, 3] + now[:, 5], 2.0 * now[:, 6]], axis=-1)
    walks = courses.walks[..., column : column + 3]
    return np.asarray(now[:, None, [0, 1, 4]] + t * common[:, None] + t**2 * walks)


def _straight(states: TrackStates, ahead_s: Floats) -> Floats:
    family = calibration_for(SETTINGS).family
    _, found = family.forecast(family.names.index(STRAIGHT), states, ahead_s)
    return np.asarray(found[..., [0, 0, 1], [0, 1, 1]])


def test_before_anything_is_learnt_everybody_may_turn_all_the_time() -> None:
    calibration, states = calibration_for(SETTINGS), _states()
    courses = learnt_courses(calibration, states, np.zeros(2), TIMES_S)
    means, _ = calibration.family.forecast(calibration.family.first, states, TIMES_S)
    careful = calibration.family.careful_covariances(means, states, TIMES_S)
    np.testing.assert_allclose(courses.means[..., :2], means)
    for column in (USUAL, RARE):
        np.testing.assert_allclose(
            _spreads(courses, column), careful[..., [0, 0, 1], [0, 1, 1]], rtol=1e-6, atol=1e-3
        )


@pytest.mark.parametrize("size", [1.0, 3.0, 8.0])
def test_where_errors_were_judged_they_are_as_large_as_they_were(size: float) -> None:
    states = _states()
    courses = learnt_courses(_taught(size), states, np.zeros(2), TIMES_S)
    plain = _straight(states, TIMES_S)
    for column in (USUAL, RARE):
        ratio = _spreads(courses, column)[..., [0, 2]] / plain[..., [0, 2]]
        np.testing.assert_allclose(ratio[:, 0], 1.0, rtol=1e-9)
        # Counted in steps of an eighth of e, which parts both sizes by a fifth. After ten seconds
        # the place now is most of it.
        np.testing.assert_allclose(ratio[:, JUDGED[1:]], size, rtol=0.2)


def test_nobody_is_surer_than_the_filter_itself() -> None:
    """Whoever flew straight so far may turn next."""
    states = _states()
    courses = learnt_courses(_taught(0.001), states, np.zeros(2), TIMES_S)
    for column in (USUAL, RARE):
        np.testing.assert_allclose(
            _spreads(courses, column), _straight(states, TIMES_S), rtol=1e-9, atol=1e-6
        )


def test_what_tracks_err_by_alike_is_neither_scaled_nor_learnt() -> None:
    """A bias of 30 m that both have is in either covariance, whole and once."""
    bias_m = 30.0
    alone, biased = (
        learnt_courses(_taught(1.0), _states(shared), np.zeros(2), TIMES_S)
        for shared in (0.0, bias_m)
    )
    for column in (USUAL, RARE):
        apart = (_spreads(biased, column) - _spreads(alone, column))[:, JUDGED[2:], 0]
        # The size of C with the bias in it, a part of 1e-2 after a minute, is a little larger.
        grown = 0.05 * _spreads(alone, column)[:, JUDGED[2:], 0]
        assert (apart >= bias_m**2 * (1.0 - 1e-6)).all()
        assert (apart <= bias_m**2 + grown).all()
    assert biased.now[0, 0] == pytest.approx(alone.now[0, 0] + bias_m**2)


def test_beyond_what_was_judged_errors_grow_with_the_way() -> None:
    """Sixty seconds are judged: at 120 s errors are twice as large beside the covariance."""
    states = _states()
    courses = learnt_courses(_taught(3.0, horizons=3), states, np.zeros(2), TIMES_S)
    ratio = _spreads(courses, RARE)[..., 0] / _straight(states, TIMES_S)[..., 0]
    np.testing.assert_allclose(ratio[:, JUDGED[3]], 2.0 * ratio[:, JUDGED[2]], rtol=1e-6)
    np.testing.assert_allclose(ratio[:, JUDGED[4]], 5.0 * ratio[:, JUDGED[2]], rtol=1e-6)


def test_a_track_that_was_not_heard_goes_on_from_its_state() -> None:
    """Ten seconds after one state is forty seconds after one that is half a minute older."""
    states = _states()
    calibration = _taught(2.0)
    fresh = learnt_courses(calibration, states, np.zeros(2), TIMES_S)
    old = learnt_courses(calibration, states, np.full(2, 30.0), TIMES_S)
    np.testing.assert_allclose(old.means[:, :-3], fresh.means[:, 3:])
    for column in (USUAL, RARE):
        # Its place now is that of both who stray and who do not.
        np.testing.assert_allclose(
            _spreads(old, column)[:, :-3], _spreads(fresh, column)[:, 3:], rtol=0.05
        )


def test_no_covariance_is_less_than_none_however_little_is_known() -> None:
    states = replace(_states(), covariance=np.array([covariance(3e3, 200.0, -0.9)] * 2))
    for size in (0.001, 1.0, 100.0):
        courses = learnt_courses(_taught(size), states, np.array([0.0, 50.0]), TIMES_S)
        for column in (USUAL, RARE):
            assert np.isfinite(courses.walks).all()
            assert (_spreads(courses, column)[..., [0, 2]] > 0.0).all()
