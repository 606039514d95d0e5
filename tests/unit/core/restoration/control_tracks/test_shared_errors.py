"""Common errors of plots remain in the estimates of a bundle for any number of plots."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import CovarianceError, ShapeError
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.control_tracks.shared_errors import AROUND_S, shared_at
from support.scenarios.flown import flight, plots_of

Floats = NDArray[np.float64]

SIGMA_M = 50.0
BIAS_M = np.array([120.0, 40.0])
SHARED_M2 = np.diag(BIAS_M**2)
FLOWN = flight(((0.0, 0.0),))


def followed(seed: int, bias_m: Floats, shared_m2: Floats | None) -> Bundle:
    plots = plots_of(FLOWN, 90.0, np.random.default_rng(seed), sigma_m=SIGMA_M)
    bundle = Bundle(BundleSettings())
    covariance = SIGMA_M**2 * np.eye(2) + SHARED_M2
    for time_s, position_m in zip(plots.time_s, plots.position_m, strict=True):
        bundle.push(float(time_s), position_m + bias_m, covariance, shared_m2)
    return bundle


def test_a_common_error_is_added_without_effect_on_tracks_and_weights() -> None:
    without, with_shared = (followed(1, np.zeros(2), part) for part in (None, SHARED_M2))
    np.testing.assert_array_equal(with_shared.weights(), without.weights())
    np.testing.assert_array_equal(with_shared.estimate().state, without.estimate().state)
    for one, other in (
        (with_shared.estimate().covariance, without.estimate().covariance),
        (with_shared.path([30.0, 80.0]).covariance[1], without.path([30.0, 80.0]).covariance[1]),
        (with_shared.final_states().covariance[0], without.final_states().covariance[0]),
        (with_shared.copy().estimate().covariance, without.estimate().covariance),
    ):
        more = one - other
        assert more[:2, :2] == pytest.approx(SHARED_M2)
        assert not more[2:].any()


@pytest.mark.slow
def test_estimates_with_a_common_bias_are_consistent() -> None:
    """NEES of two components: mean 2 if consistent; a common bias adds at most its bound."""
    rng = np.random.default_rng(3)
    squares: list[float] = []
    silent: list[float] = []
    truth = FLOWN.geometric([88.5]).position_m[0]
    for seed in range(20):
        bias_m = BIAS_M * rng.normal(size=2)
        for found, part in ((squares, SHARED_M2), (silent, None)):
            said = followed(seed, bias_m, part).estimate()
            off = said.state[:2] - truth
            found.append(float(off @ np.linalg.solve(said.covariance[:2, :2], off)))
    # Twenty runs of chi² with two degrees of freedom: 99.9 % are below 3.7 in the mean.
    assert np.mean(squares) < 3.7
    assert np.mean(silent) > 3.7


def test_common_errors_are_weighted_by_information_and_time() -> None:
    plots = np.zeros((3, layout.PLOT_COUNT))
    plots[:, layout.TIME] = 0.0, 10.0, 60.0
    plots[:, layout.EAST_EAST], plots[:, layout.NORTH_NORTH] = (1.0, 2.0, 1.0), (1.0, 1.0, 1.0)
    shares = np.array([[4.0, 1.0, 9.0], [1.0, 0.0, 1.0], [100.0, -5.0, 25.0]])
    plots[:, layout.SHARED :] = shares
    times = np.array([0.0, 20.0, 1e6])
    found = shared_at(plots, times)
    for time_s, matrix in zip(times[:2], found, strict=False):
        weight = np.array([2.0, 3.0, 2.0]) * np.exp(-np.abs(time_s - plots[:, 0]) / AROUND_S)
        east, cross, north = weight @ shares / weight.sum()
        assert matrix == pytest.approx(np.array([[east, cross], [cross, north]]))
    # Long after all plots the last one has the largest weight, without underflow.
    weight = np.array([2.0, 3.0, 2.0]) * np.exp(-(60.0 - plots[:, 0]) / AROUND_S)
    assert found[2, 0, 0] == pytest.approx((weight @ shares / weight.sum())[0])


def test_the_mean_covariance_bounds_any_correlated_mean() -> None:
    rng = np.random.default_rng(4)
    for _ in range(200):
        factor, weight = rng.normal(size=(6, 6)), rng.uniform(size=3)
        together, weight = factor @ factor.T, weight / weight.sum()
        across = np.kron(weight, np.eye(2))
        apart = sum(
            w * together[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] for i, w in enumerate(weight)
        )
        assert np.linalg.eigvalsh(apart - across @ together @ across.T).min() > -1e-9


@pytest.mark.parametrize(
    ("shared_m2", "error"),
    [
        (np.diag([-1.0, 4.0]), CovarianceError),
        (np.diag([2.0 * SIGMA_M**2, 0.0]), CovarianceError),
        (np.diag([np.nan, 0.0]), ShapeError),
        (np.zeros(3), ShapeError),
    ],
)
def test_an_invalid_common_part_is_rejected_without_effect(
    shared_m2: Floats, error: type[Exception]
) -> None:
    bundle = Bundle(BundleSettings())
    with pytest.raises(error, match="shared errors"):
        bundle.push(0.0, np.zeros(2), SIGMA_M**2 * np.eye(2), shared_m2)
    assert bundle.plots == 0
