"""Size of regions by past errors, and selection of the motion model."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.tracking.forecast.region_sizes import (
    CALIBRATED,
    HORIZONS_S,
    MEMORY,
    ForecastScores,
)
from multiradar.tracking.forecast.regions import gaussian_factor

Floats = NDArray[np.float64]


def _taught(scale: Floats, size: Floats, count: int = 2000, seed: int = 1) -> ForecastScores:
    """Scores of Gaussian errors with variances off by a factor, (motions, horizons)."""
    rng = np.random.Generator(np.random.PCG64(seed))
    scores = ForecastScores(len(scale), 0)
    for horizon in range(len(HORIZONS_S)):
        for _ in range(count // 10):
            drawn = rng.chisquare(2, (10, 1)) * scale[None, :, horizon]
            scores.record(horizon, drawn, np.tile(size[:, horizon], (10, 1)))
    scores.settle()
    return scores


def test_without_scores_the_region_is_that_of_the_covariance() -> None:
    plan = ForecastScores(3, 2).plan(np.array([0.0, 10.0, 1000.0]), 0.95)
    assert plan.motion == 2
    assert not plan.calibrated[1:].any()
    np.testing.assert_allclose(plan.factor, gaussian_factor(0.95))


@pytest.mark.parametrize("probability", [0.5, 0.9, 0.95, 0.99])
def test_the_factor_follows_past_errors(probability: float) -> None:
    scale = np.array([[0.25, 1.0, 4.0, 16.0, 0.04]])
    plan = _taught(scale, np.zeros((1, 5))).plan(HORIZONS_S, probability)
    assert plan.calibrated.all()
    # A thousand effective ones, with the shorter horizon's twenty: 20 % of a quantile.
    np.testing.assert_allclose(
        plan.factor,
        scale[0] * gaussian_factor(probability),
        rtol=0.2 if probability < 0.99 else 0.4,
    )


def test_the_smallest_calibrated_region_is_selected() -> None:
    # The second covariance is four times too small, and its region still half that of the first.
    scale = np.array([[1.0] * 5, [16.0] * 5])
    size = np.array([[10.0] * 5, [10.0 - np.log(32.0)] * 5])
    scores = _taught(scale, size)
    assert scores.motion == 1
    assert _taught(scale, size + np.array([[0.0], [np.log(4.0)]])).motion == 0


def test_a_horizon_with_few_scores_stays_uncalibrated() -> None:
    scores = ForecastScores(1, 0)
    for horizon, count in enumerate((200, int(CALIBRATED) - 10, 200)):
        scores.record(horizon, np.full((count, 1), 0.1), np.zeros((count, 1)))
    scores.settle()
    plan = scores.plan(np.array([5.0, 10.0, 11.0, 30.0, 60.0]), 0.95)
    assert plan.calibrated.tolist() == [True, True, False, False, False]
    # The covariance itself has the weight of 7 forecasts of 200.
    assert plan.factor[1] < 0.25 * gaussian_factor(0.95)
    np.testing.assert_allclose(plan.factor[2:], gaussian_factor(0.95))


def test_factors_are_interpolated_between_horizons_and_constant_beyond() -> None:
    plan = _taught(np.array([[1.0, 2.0, 4.0, 8.0, 16.0]]), np.zeros((1, 5))).plan(
        np.array([0.0, 5.0, 10.0, 20.0, 30.0, 300.0, 3600.0]), 0.95
    )
    assert plan.calibrated.all()
    assert plan.factor[0] == pytest.approx(gaussian_factor(0.95))
    assert (np.diff(plan.factor[2:6]) > 0.0).all()
    assert plan.factor[-1] == plan.factor[-2]


def test_old_errors_fade() -> None:
    scores = ForecastScores(1, 0)
    for value in (100.0, 1.0):
        for _ in range(500):
            scores.record(0, np.full((10, 1), value), np.zeros((10, 1)))
    scores.settle()
    assert scores.heard[0] == pytest.approx(MEMORY, rel=0.02)
    assert scores.plan(np.array([10.0]), 0.95).factor[0] < 1.2
