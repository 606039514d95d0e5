"""Properties of the polynomial filter for any observations."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from multiradar.estimation.filters.polynomial.polynomial_basis import restriction
from multiradar.estimation.filters.polynomial.polynomial_filter import (
    estimate,
    observe,
    observe_interval,
    start,
)
from multiradar.estimation.filters.polynomial.polynomial_state import PolynomialState

Floats = NDArray[np.float64]
degrees = st.integers(0, 6)
seeds = st.integers(0, 2**32 - 1)


def prior(degree: int, span_s: float, rng: np.random.Generator) -> PolynomialState:
    root = rng.normal(size=(degree + 1, degree + 1)) + 2.0 * np.eye(degree + 1)
    sizes = 10.0 / span_s ** np.arange(degree + 1)
    return start(
        degree, rng.normal(size=degree + 1) * sizes, root @ root.T * np.outer(sizes, sizes)
    )


def assert_same(one: PolynomialState, other: PolynomialState, times_s: Floats) -> None:
    first, second = estimate(one, times_s), estimate(other, times_s)
    sigmas = np.sqrt(np.diagonal(first.covariance, axis1=1, axis2=2))
    scale = sigmas[:, :, None] * sigmas[:, None, :]
    np.testing.assert_allclose(first.covariance / scale, second.covariance / scale, atol=1e-10)
    np.testing.assert_allclose(first.mean / sigmas, second.mean / sigmas, rtol=1e-9, atol=1e-9)


@given(degree=degrees, count=st.integers(1, 12), seed=seeds, cuts=st.lists(st.integers(0, 12)))
@settings(max_examples=30)
def test_estimates_do_not_depend_on_grouping_or_order_of_equal_times(
    degree: int, count: int, seed: int, cuts: list[int]
) -> None:
    rng = np.random.default_rng(seed)
    first = prior(degree, 10.0, rng)
    # Whole seconds, so that several coincide.
    times = np.sort(rng.integers(0, 10, count)).astype(float)
    values, variances = rng.normal(size=count), 10.0 ** rng.uniform(-2.0, 2.0, count)
    other = np.lexsort((rng.uniform(size=count), times))
    pieces = np.split(other, sorted(cut for cut in cuts if cut < count))
    grouped = first
    for piece in pieces:
        grouped = observe(grouped, times[piece], values[piece], variances[piece])
    at_once = observe(first, times, values, variances)
    assert_same(at_once, grouped, np.array([0.0, 4.0, 10.0, 25.0]))


@given(degree=degrees, seed=seeds, share=st.floats(1e-3, 0.999), span_s=st.floats(1e-2, 1e4))
@settings(max_examples=30)
def test_splitting_an_interval_does_not_change_the_estimate(
    degree: int, seed: int, share: float, span_s: float
) -> None:
    """The moments of the whole are those of its parts, transformed by the basis of each part."""
    rng = np.random.default_rng(seed)
    first = prior(degree, span_s, rng)
    moments = rng.normal(size=(2, degree + 1)) * span_s
    centre, half = np.array([share - 1.0, share]), np.array([share, 1.0 - share])
    matrices = restriction(degree, centre, half)
    whole = np.einsum("pkj,pk->j", matrices, moments)
    at_once = observe_interval(first, 0.0, span_s, whole, 0.3)
    split = observe_interval(first, 0.0, share * span_s, moments[0], 0.3)
    split = observe_interval(split, share * span_s, span_s, moments[1], 0.3)
    assert_same(at_once, split, span_s * np.array([0.0, 0.5, 1.0, 1.5]))


@given(degree=st.integers(0, 8), count=st.integers(0, 10), seed=seeds, horizon=st.floats(0.0, 1e6))
@settings(max_examples=30)
def test_covariances_are_symmetric_and_without_negative_eigenvalues(
    degree: int, count: int, seed: int, horizon: float
) -> None:
    """At any time, near or absurdly far, with any number of measurements of any accuracy."""
    rng = np.random.default_rng(seed)
    times = np.sort(rng.uniform(0.0, 100.0, count))
    state = observe(
        prior(degree, 100.0, rng), times, rng.normal(size=count), 10.0 ** rng.uniform(-6, 6, count)
    )
    found = estimate(state, [state.observed_until_s + horizon, 0.0, -horizon])
    assert np.isfinite(found.mean).all()
    np.testing.assert_array_equal(found.covariance, np.swapaxes(found.covariance, 1, 2))
    sigmas = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
    correlations = found.covariance / (sigmas[:, :, None] * sigmas[:, None, :])
    assert np.linalg.eigvalsh(correlations).min() > -1e-13


@given(degree=degrees, seed=seeds)
@settings(max_examples=20)
def test_an_observation_never_increases_the_covariance(degree: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    before = observe(prior(degree, 10.0, rng), [1.0, 4.0], [0.0, 0.0], 1.0)
    after = observe_interval(before, 4.0, 4.0 + rng.uniform(0.1, 9.0), np.zeros(degree + 1), 0.5)
    times = np.array([0.0, 3.0, 10.0, 30.0])
    was, became = estimate(before, times).covariance, estimate(after, times).covariance
    sigmas = np.sqrt(np.diagonal(was, axis1=1, axis2=2))
    gained = (was - became) / (sigmas[:, :, None] * sigmas[:, None, :])
    assert np.linalg.eigvalsh(gained).min() > -1e-11
