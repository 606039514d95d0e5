"""The polynomial filter against rational arithmetic and the equations of the paper."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import (
    ConfigurationError,
    CovarianceError,
    ForecastError,
    MultiradarError,
    ShapeError,
    TimeOrderError,
)
from multiradar.estimation.filters.polynomial.polynomial_filter import (
    estimate,
    forecast,
    observe,
    observe_increments,
    observe_interval,
    start,
)
from multiradar.estimation.filters.polynomial.polynomial_state import PolynomialState
from support.references.exact_regression import ExactRegression

Floats = NDArray[np.float64]
# Variances of α in the paper: 100 m², (5 m/s)², (0.2 m/s²)².
PAPER = np.diag([100.0, 25.0, 0.04])
NOTHING = np.zeros(3)
# By Bayesian regression in rational arithmetic, to the digits known for these tables.
FILTERED = {0.1: (0.204, 0.145, 0.134, 0.109, 0.089), 1.0: (1.913, 1.063, 0.918, 0.901, 0.822)}
AHEAD_OF_10 = {0.1: (0.361, 1.04, 2.40, 4.77, 8.57), 1.0: (3.19, 9.07, 20.8, 41.2, 73.8)}
AHEAD_OF_20 = (0.095, 0.183, 0.322, 0.528, 0.821)


@pytest.mark.parametrize("intensity", [0.1, 1.0])
def test_the_tables_of_the_paper_are_reproduced(intensity: float) -> None:
    """To the digits of the tables, and to 1e-12 of rational arithmetic."""
    state, exact = start(2, NOTHING, PAPER), ExactRegression(NOTHING, PAPER)
    filtered: list[float] = []
    for begin in range(0, 20, 2):
        state = observe_interval(state, begin, begin + 2, NOTHING, intensity)
        exact.watch(begin, begin + 2, intensity)
        filtered.append(float(estimate(state, begin + 2.0).variance))
        assert filtered[-1] == pytest.approx(exact.covariance(begin + 2.0)[0, 0], rel=1e-12)
        if begin == 8:
            ahead = forecast(state, np.arange(2.0, 12.0, 2.0)).variance
            known = [exact.covariance(time)[0, 0] for time in range(12, 22, 2)]
            np.testing.assert_allclose(ahead, known, rtol=1e-12)
            np.testing.assert_allclose(ahead, AHEAD_OF_10[intensity], rtol=2e-3)
    np.testing.assert_allclose(filtered[:5], FILTERED[intensity], atol=6e-4)
    if intensity == 0.1:
        np.testing.assert_allclose(
            forecast(state, np.arange(2.0, 12.0, 2.0)).variance, AHEAD_OF_20, atol=6e-4
        )


@pytest.mark.slow
@pytest.mark.parametrize("span_s", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize("degree", [0, 1, 3, 8])
def test_any_degree_agrees_with_rational_arithmetic(degree: int, span_s: float) -> None:
    """Irregular times, variances over six decades, processed in four parts; all derivatives.

    Sigmas and correlations to 1e-11, means to 1e-9 of their sigmas: normal equations in powers of t
    would be wrong in the fifth digit at degree 8, where they can be solved at all.
    """
    rng = np.random.default_rng(degree)
    root = rng.normal(size=(degree + 1, degree + 1)) + 2.0 * np.eye(degree + 1)
    sizes = 100.0 / span_s ** np.arange(degree + 1)
    prior, mean = (root @ root.T) * np.outer(sizes, sizes), rng.normal(size=degree + 1) * sizes
    times = np.sort(rng.uniform(0.0, span_s, 20))
    values, variances = rng.normal(0.0, 100.0, 20), 10.0 ** rng.uniform(-3.0, 3.0, 20)
    exact, state = ExactRegression(mean, prior), start(degree, mean, prior)
    for time, value, variance in zip(times, values, variances, strict=True):
        exact.observe(float(time), float(value), float(variance))
    for part in np.array_split(np.arange(20), 4):
        state = observe(state, times[part], values[part], variances[part])
    for time in (0.0, 0.3 * span_s, 2.0 * span_s):
        assert_agrees(state, exact, time)


@pytest.mark.slow
def test_a_long_track_updated_one_by_one_remains_accurate() -> None:
    """Degree 8, 400 measurements over 1e4 s, with the basis extended at each of them."""
    prior = np.diag(0.01 ** np.arange(9.0)) * 1e4
    times = np.linspace(0.0, 1e4, 400)
    values = 100.0 * np.sin(times / 2000.0)
    exact, state = ExactRegression(np.zeros(9), prior), start(8, np.zeros(9), prior)
    for time, value in zip(times, values, strict=True):
        exact.observe(float(time), float(value), 1.0)
        state = observe(state, [time], [value], 1.0)
    for time in (0.0, 5000.0, 1e4, 1.1e4):
        assert_agrees(state, exact, time)


def test_accurate_measurements_do_not_swamp_a_wide_prior() -> None:
    """Two measurements of 1e-8 m under a prior of 1e8 m, degree 3: sixteen decades apart.

    With the rows of the least squares problem left in their order no digit of the covariance is
    right here.
    """
    prior = np.diag((1e8 * 0.5 ** np.arange(4.0)) ** 2)
    exact, state = ExactRegression(np.zeros(4), prior), start(3, np.zeros(4), prior)
    for time, value in ((3.7, 2e7), (8.1, -1e8)):
        exact.observe(time, value, 1e-16)
        state = observe(state, [time], [value], 1e-16)
    for time in (0.0, 5.0, 20.0):
        assert_agrees(state, exact, time)


def test_increments_and_measurements_mix() -> None:
    """Increments over long intervals are integrals, not X times the length."""
    prior = np.diag([100.0, 25.0, 0.04, 1e-4])
    edges, increments = np.array([1.0, 1.5, 6.0, 14.0]), np.array([4.0, -30.0, 8.0])
    state = observe(start(3, np.zeros(4), prior), [0.0, 1.0], [3.0, 5.0], [4.0, 1.0])
    state = observe_increments(state, edges, increments, 0.3)
    state = observe(state, [14.0], [2.0], 9.0)
    exact = ExactRegression(np.zeros(4), prior)
    for time, value, variance in ((0.0, 3.0, 4.0), (1.0, 5.0, 1.0), (14.0, 2.0, 9.0)):
        exact.observe(time, value, variance)
    for begin, end, value in zip(edges[:-1], edges[1:], increments, strict=True):
        exact.observe_increment(float(begin), float(end), float(value), 0.3)
    assert_agrees(state, exact, 20.0)


def test_many_short_increments_are_equivalent_to_moments() -> None:
    """Moments are the limit of sums of weighted increments: 4000 intervals, 1e-6."""
    rng = np.random.default_rng(3)
    edges = np.linspace(0.0, 10.0, 4001)
    middle, length = (edges[1:] + edges[:-1]) / 2.0, np.diff(edges)
    increments = (3.0 + 2.0 * middle - 0.5 * middle**2) * length
    increments += np.sqrt(0.1 * length) * rng.normal(size=4000)
    weights = np.polynomial.legendre.legvander(middle / 5.0 - 1.0, 2)
    first = start(2, NOTHING, PAPER)
    by_increments = estimate(observe_increments(first, edges, increments, 0.1), 10.0)
    by_moments = estimate(observe_interval(first, 0.0, 10.0, increments @ weights, 0.1), 10.0)
    np.testing.assert_allclose(by_moments.covariance, by_increments.covariance, rtol=1e-6)
    np.testing.assert_allclose(by_moments.mean, by_increments.mean, rtol=1e-5)


def test_axes_are_independent() -> None:
    """X and y in one state equal each alone, to the last few bits."""
    rng = np.random.default_rng(4)
    mean, values = rng.normal(size=(3, 2)), rng.normal(size=(7, 2))
    times = np.arange(7.0)
    both = forecast(observe(start(2, mean, PAPER, -1.0), times, values, 0.5), [0.0, 5.0])
    assert both.mean.shape == (2, 3, 2)
    assert both.value.shape == (2, 2)
    assert both.covariance.shape == (2, 3, 3)
    for axis in (0, 1):
        alone = observe(start(2, mean[:, axis], PAPER, -1.0), times, values[:, axis], 0.5)
        np.testing.assert_allclose(forecast(alone, [0.0, 5.0]).mean, both.mean[:, :, axis])


def test_without_observations_the_prior_is_extrapolated() -> None:
    """Also when all observations were at the start itself, where no interval has a length."""
    state = start(2, [1.0, 2.0, 4.0], PAPER, 10.0)
    ahead = forecast(state, 3.0)
    moved = np.array([[1.0, 3.0, 4.5], [0.0, 1.0, 3.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(ahead.mean, moved @ [1.0, 2.0, 4.0], rtol=1e-12)
    np.testing.assert_allclose(ahead.covariance, moved @ PAPER @ moved.T, rtol=1e-12)
    at_start = estimate(observe(state, [10.0, 10.0], [3.0, 5.0], [200.0, 200.0]), 10.0)
    np.testing.assert_allclose(at_start.covariance, np.diag([50.0, 25.0, 0.04]), atol=1e-12)
    np.testing.assert_allclose(at_start.mean, [2.5, 2.0, 4.0], rtol=1e-12)


def test_unix_times_lose_only_their_own_digits() -> None:
    """Seconds since 1970 resolve 2e-7 s: estimates there equal those near time zero."""
    epoch = 1_541_000_000.0
    times, values = np.array([0.0, 2.0, 2.0, 7.0]), np.array([4.0, 5.0, 6.0, 1.0])
    early = observe(start(2, NOTHING, PAPER), times, values, 1.0)
    late = observe(start(2, NOTHING, PAPER, epoch), times + epoch, values, 1.0)
    assert late.observed_until_s == epoch + 7.0
    np.testing.assert_array_equal(forecast(late, 5.0).mean, forecast(early, 5.0).mean)


@pytest.mark.slow
def test_euler_steps_of_the_riccati_equation_diverge_where_the_filter_does_not() -> None:
    """The paper's equations of γ in Euler steps: γ_00(0)/C₂ = 1000 per second for C₂ = 0.1.

    A step of 1 ms removes all of γ_00 at once. The matrix is not a covariance from then on, is
    wrong by a fifth after 2 s, and (not repeated here) diverges after 127 s; with 2 ms it does
    after five steps. This is why the filter does not integrate.
    """
    slow, fast = euler_covariances(1e-3, 2000), euler_covariances(2e-3, 10)
    assert np.linalg.eigvalsh(slow[0]).min() < -1e-5
    assert slow[-1][0, 0] == pytest.approx(0.158, abs=1e-3)
    assert fast[4][0, 0] < -1e6
    for steps in (1, 2000):
        state = start(2, NOTHING, PAPER)
        for begin, end in pairwise(np.linspace(0.0, 2.0, steps + 1)):
            state = observe_interval(state, begin, end, NOTHING, 0.1)
        assert float(forecast(state, 0.0).variance) == pytest.approx(0.203533199058610, rel=1e-11)


def euler_covariances(step_s: float, count: int) -> list[Floats]:
    motion, intensity, covariance = np.diag(np.ones(2), 1), 0.1, PAPER
    found = []
    for _ in range(count):
        gain = covariance[:, 0] / intensity
        growth = motion @ covariance + covariance @ motion.T
        covariance = covariance + step_s * (growth - intensity * np.outer(gain, gain))
        found.append(covariance)
        if abs(covariance[0, 0]) > 1e6:
            break
    return found


@pytest.mark.parametrize(
    ("covariance", "error", "message"),
    [
        (np.array([[1.0, 0.2], [0.1, 1.0]]), CovarianceError, "asymmetric"),
        (np.array([[1.0, 2.0], [2.0, 1.0]]), CovarianceError, "positive definite"),
        (np.diag([1.0, 0.0]), CovarianceError, "above 0"),
        (np.eye(3), ShapeError, r"prior covariance: expected the shape \(2, 2\)"),
        (np.full((2, 2), np.nan), ShapeError, "finite"),
    ],
)
def test_an_invalid_prior_is_rejected(
    covariance: Floats, error: type[MultiradarError], message: str
) -> None:
    with pytest.raises(error, match=message):
        start(1, np.zeros(2), covariance)


def test_an_invalid_degree_or_mean_is_rejected() -> None:
    with pytest.raises(ConfigurationError, match="degree: expected an integer of at least 0"):
        start(-1, np.zeros(0), np.zeros((0, 0)))
    with pytest.raises(ShapeError, match=r"prior mean: expected the shape \(3,\)"):
        start(2, np.zeros(2), PAPER)
    with pytest.raises(ShapeError, match="prior mean: expected finite"):
        start(2, [0.0, np.inf, 0.0], PAPER)
    with pytest.raises(ConfigurationError, match="start: expected a finite time"):
        start(2, NOTHING, PAPER, np.nan)


def test_decreasing_times_are_rejected() -> None:
    state = observe(start(2, NOTHING, PAPER), [1.0, 4.0], [0.0, 0.0], 1.0)
    with pytest.raises(TimeOrderError, match=r"expected a time of 4.0 s or later, was 3.0 s"):
        observe(state, [3.0], [0.0], 1.0)
    with pytest.raises(TimeOrderError, match=r"6.0 s or later, was 5.0"):
        observe(state, [6.0, 5.0], [0.0, 0.0], 1.0)
    with pytest.raises(TimeOrderError, match="was nan"):
        observe(state, [np.nan], [0.0], 1.0)
    with pytest.raises(TimeOrderError, match="edge"):
        observe_increments(state, [4.0, 5.0, 5.0], [0.0, 0.0], 1.0)
    with pytest.raises(TimeOrderError, match="interval end"):
        observe_interval(state, 3.0, 6.0, NOTHING, 1.0)
    with pytest.raises(TimeOrderError, match="horizon"):
        forecast(state, -1.0)


def test_wrong_shapes_and_zero_noise_are_rejected() -> None:
    state = start(2, NOTHING, PAPER)
    with pytest.raises(ShapeError, match=r"values: expected the shape \(2,\)"):
        observe(state, [1.0, 2.0], [0.0], 1.0)
    with pytest.raises(ShapeError, match="values: expected finite"):
        observe(state, [1.0], [np.nan], 1.0)
    with pytest.raises(ShapeError, match="variance"):
        observe(state, [1.0, 2.0], [0.0, 0.0], [1.0, 1.0, 1.0])
    with pytest.raises(ConfigurationError, match=r"variance.*above 0, was 0"):
        observe(state, [1.0, 2.0], [0.0, 0.0], [1.0, 0.0])
    with pytest.raises(ConfigurationError, match=r"noise intensity.*above 0, was -0.1"):
        observe_interval(state, 0.0, 1.0, NOTHING, -0.1)
    with pytest.raises(ShapeError, match=r"moments: expected the shape \(3,\)"):
        observe_interval(state, 0.0, 1.0, np.zeros(2), 0.1)
    with pytest.raises(ShapeError, match="at least 2"):
        observe_increments(state, [0.0], np.zeros(0), 0.1)
    with pytest.raises(ShapeError, match="one dimension"):
        observe(state, 1.0, 0.0, 1.0)
    with pytest.raises(ShapeError, match="finite"):
        estimate(state, np.nan)
    with pytest.raises(ForecastError, match="too far ahead"):
        forecast(state, [1.0, 1e200])


def test_times_and_values_out_of_range_are_rejected() -> None:
    state = start(2, NOTHING, PAPER)
    with pytest.raises(ConfigurationError, match=r"expected within 1e\+12 s of 0, was 1e\+308 s"):
        observe(state, [1e308], [0.0], 1.0)
    with pytest.raises(ConfigurationError, match=r"at least 1e-09 s later; was 1.99998e-320"):
        observe(state, [1e-320, 2e-320], [0.0, 0.0], 1.0)
    with pytest.raises(ConfigurationError, match="at least 1e-09 s"):
        observe_increments(state, [0.0, 1e-320], [0.0], 1.0)
    with pytest.raises(ConfigurationError, match="expected within"):
        observe_interval(state, 0.0, 1e300, NOTHING, 1.0)
    with pytest.raises(ConfigurationError, match="values: expected sigmas above 1e-100"):
        observe(state, [1.0], [1e308], 1e-10)
    with pytest.raises(ConfigurationError, match="start: expected a finite time within"):
        start(2, NOTHING, PAPER, 1e13)
    high = observe(start(40, np.zeros(41), np.eye(41)), [1e-8], [0.0], 1.0)
    with pytest.raises(ForecastError, match="interval too short for degree"):
        estimate(high, 1.0)


def test_a_state_is_immutable() -> None:
    """Also when the caller's arrays change after the start."""
    mean, covariance = np.zeros(3), PAPER.copy()
    state = start(2, mean, covariance)
    before = replace(state, root=state.root.copy(), vector=state.vector.copy())
    mean[:], covariance[0, 0] = 7.0, 9.0
    observe(state, [1.0], [2.0], 1.0)
    for name in ("prior_mean", "prior_covariance", "root", "vector"):
        np.testing.assert_array_equal(getattr(state, name), getattr(before, name))
    assert float(estimate(state, 0.0).variance) == pytest.approx(100.0, rel=1e-12)
    assert observe(state, [], [], 1.0) is state
    assert (state.degree, state.axes) == (2, ())


def assert_agrees(state: PolynomialState, exact: ExactRegression, time_s: float) -> None:
    found = estimate(state, time_s)
    covariance = exact.covariance(time_s)
    sigmas = np.sqrt(np.diagonal(covariance))
    np.testing.assert_allclose(
        found.covariance / np.outer(sigmas, sigmas),
        covariance / np.outer(sigmas, sigmas),
        atol=1e-11,
    )
    np.testing.assert_allclose(
        found.mean / sigmas, exact.mean(time_s) / sigmas, rtol=1e-9, atol=1e-9
    )
