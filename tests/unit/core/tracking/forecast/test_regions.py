"""The ellipse of a mixture contains its probability."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ndtr
from scipy.stats import ncx2

from multiradar.errors import ConfigurationError, CovarianceError, ShapeError
from multiradar.tracking.forecast.regions import (
    ellipses,
    gaussian_factor,
    mixed,
    region_factor,
    region_factors,
)

Floats = NDArray[np.float64]

#: Accuracy of the probability of regions.
WITHIN = 1e-4


def _held(weights: Floats, means: Floats, covariances: Floats, factor: float) -> float:
    """Integrate across the ellipse by strips, each component along a strip analytically."""
    mean, whole = mixed(weights, means, covariances)
    root = np.linalg.inv(np.linalg.cholesky(whole))
    # Mid-points are dense at the ends, where the strips are short.
    angle = (np.arange(20000) + 0.5) * np.pi / 20000 - np.pi / 2
    across, half = np.sqrt(factor) * np.sin(angle), np.sqrt(factor) * np.cos(angle)
    width = half * np.pi / 20000
    total = 0.0
    for weight, centre, spread in zip(weights, means, covariances, strict=True):
        m, s = root @ (centre - mean), root @ spread @ root.T
        density = np.exp(-0.5 * (across - m[0]) ** 2 / s[0, 0]) / np.sqrt(2 * np.pi * s[0, 0])
        along = m[1] + s[0, 1] / s[0, 0] * (across - m[0])
        sigma = np.sqrt(s[1, 1] - s[0, 1] ** 2 / s[0, 0])
        strip = ndtr((half - along) / sigma) - ndtr((-half - along) / sigma)
        total += weight * float(np.sum(density * strip * width))
    return total


def test_one_gaussian_has_the_factor_of_two_degrees_of_freedom() -> None:
    for probability in (0.01, 0.5, 0.95, 0.999):
        expected = -2.0 * np.log(1.0 - probability)
        assert gaussian_factor(probability) == pytest.approx(expected, rel=1e-13)
        alone = region_factor([1.0], [[3.0, -4.0]], [[[9.0, 2.0], [2.0, 4.0]]], probability)
        assert alone == gaussian_factor(probability)


def test_a_component_without_weight_changes_nothing() -> None:
    spread = np.array([np.zeros((2, 2)), [[9.0, 2.0], [2.0, 4.0]]])
    found = region_factor([0.0, 1.0], [[9e9, 0.0], [3.0, -4.0]], spread, 0.95)
    assert found == gaussian_factor(0.95)


def test_components_that_differ_in_width_alone_follow_the_sum_of_their_exponentials() -> None:
    # One mean: P = Σ w (1 − exp(−k c / 2 s)), c the mean of the s.
    weights, variances = np.array([0.8, 0.2]), np.array([1.0, 400.0])
    factor = region_factor(weights, np.zeros((2, 2)), variances[:, None, None] * np.eye(2), 0.95)
    whole = weights @ variances
    held = weights @ (1.0 - np.exp(-0.5 * factor * whole / variances))
    assert held == pytest.approx(0.95, abs=1e-8)
    assert factor > gaussian_factor(0.95) + 1.0


@pytest.mark.parametrize("sigma", [0.005, 0.05, 1.0, 30.0])
@pytest.mark.parametrize("probability", [0.2, 0.5, 0.95, 0.99])
def test_four_components_around_a_centre_are_a_noncentral_distribution(
    sigma: float, probability: float
) -> None:
    means = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    spread = np.tile(sigma**2 * np.eye(2), (4, 1, 1))
    factor = region_factor(np.full(4, 0.25), means, spread, probability)
    held = ncx2.cdf(factor * (0.5 + sigma**2) / sigma**2, 2, 1.0 / sigma**2)
    assert held == pytest.approx(probability, abs=WITHIN)


@pytest.mark.parametrize("width_m", [30.0, 300.0, 3000.0])
@pytest.mark.parametrize("probability", [0.5, 0.95, 0.99])
def test_any_mixture_holds_its_probability(width_m: float, probability: float) -> None:
    rng = np.random.Generator(np.random.PCG64(int(width_m)))
    for _ in range(5):
        weights = rng.dirichlet(np.ones(8))
        means = rng.normal(size=(8, 2)) * np.array([3000.0, 800.0])
        root = rng.normal(size=(8, 2, 2)) * width_m
        spread = root @ root.swapaxes(-1, -2) + 0.01 * width_m**2 * np.eye(2)
        factor = region_factor(weights, means, spread, probability)
        assert _held(weights, means, spread, factor) == pytest.approx(probability, abs=WITHIN)


def test_many_mixtures_are_evaluated_as_single_ones() -> None:
    rng = np.random.Generator(np.random.PCG64(4))
    weights = rng.dirichlet(np.ones(3), size=5)
    means, spread = rng.normal(size=(5, 3, 2)), np.tile(0.1 * np.eye(2), (5, 3, 1, 1))
    together = region_factors(weights, means, spread, 0.9)
    alone = [region_factor(*one, 0.9) for one in zip(weights, means, spread, strict=True)]
    np.testing.assert_array_equal(together, alone)
    assert len(region_factors(weights[:0], means[:0], spread[:0], 0.9)) == 0


def test_the_factor_does_not_depend_on_units_or_directions() -> None:
    rng = np.random.Generator(np.random.PCG64(5))
    weights, means = rng.dirichlet(np.ones(4)), rng.normal(size=(4, 2))
    root = rng.normal(size=(4, 2, 2))
    spread = root @ root.swapaxes(-1, -2) + 0.1 * np.eye(2)
    turn = 700.0 * np.array([[0.6, 0.8], [-0.8, 0.6]])
    factor = region_factor(weights, means, spread, 0.95)
    other = region_factor(weights, means @ turn.T + 1e5, turn @ spread @ turn.T, 0.95)
    assert other == pytest.approx(factor, rel=1e-6)


def test_point_components_are_widened() -> None:
    means = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    points = np.tile(1e-12 * np.eye(2), (4, 1, 1))
    # On a circle of radius 1 with a covariance of a half: its rim, to a hundredth.
    factor = region_factor(np.full(4, 0.25), means, points, 0.95)
    assert np.sqrt(factor * 0.5) == pytest.approx(1.0, abs=0.01)


def test_an_ellipse_has_its_axes_and_the_azimuth_of_the_major_one() -> None:
    direction = np.radians([30.0, 150.0])
    along = np.stack([np.sin(direction), np.cos(direction)], axis=-1)
    across = np.stack([along[:, 1], -along[:, 0]], axis=-1)
    covariance = (
        25.0 * along[:, :, None] * along[:, None] + 4.0 * across[:, :, None] * across[:, None]
    )
    found = ellipses(covariance, np.array([1.0, 9.0]))
    np.testing.assert_allclose(found.major_m, [5.0, 15.0])
    np.testing.assert_allclose(found.minor_m, [2.0, 6.0])
    np.testing.assert_allclose(np.degrees(found.azimuth_rad), [30.0, 150.0])


@pytest.mark.parametrize("probability", [0.0, 1.0, -0.1, 95.0, np.nan])
def test_an_invalid_probability_is_rejected(probability: float) -> None:
    with pytest.raises(ConfigurationError, match="probability: expected"):
        region_factor([1.0], [[0.0, 0.0]], [np.eye(2)], probability)


def test_an_invalid_mixture_is_rejected() -> None:
    two, both = np.zeros((2, 2)), np.tile(np.eye(2), (2, 1, 1))
    with pytest.raises(ConfigurationError, match="a sum of 1"):
        region_factor([0.5, 0.6], two, both, 0.9)
    with pytest.raises(ConfigurationError, match="non-negative weights"):
        region_factor([1.5, -0.5], two, both, 0.9)
    with pytest.raises(CovarianceError):
        region_factor([0.5, 0.5], two, 0.0 * both, 0.9)
    with pytest.raises(ShapeError):
        region_factor([0.5, 0.5], two[:1], both, 0.9)
    with pytest.raises(ShapeError):
        region_factor([0.5, 0.5], two * np.nan, both, 0.9)
