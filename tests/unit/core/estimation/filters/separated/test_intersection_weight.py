"""The weight of covariance intersection, against the matrices of (1.45)."""

from collections.abc import Callable

import numpy as np
import pytest

from multiradar.estimation.filters.separated._intersection_kernels import best_gamma, scaled_trace
from support.kernels import plain
from support.references.reference_filters import intersection_bound

WEIGHTS = np.array([1.0, 1.0, 100.0, 100.0])
Triple = tuple[float, float, float]


def triple(matrix: np.ndarray) -> Triple:
    return float(matrix[0, 0]), float(matrix[0, 1]), float(matrix[1, 1])


def scalars(
    bound: np.ndarray, matrix: np.ndarray, other: np.ndarray, noise: np.ndarray
) -> tuple[float, Triple, Triple, Triple, Triple]:
    """Arguments of the kernels: tr T R, C R T R Cᵀ, C R Cᵀ, the other part, W."""
    seen = matrix @ bound
    return (
        float(WEIGHTS @ np.diagonal(bound)),
        triple((seen * WEIGHTS) @ seen.T),
        triple(seen @ matrix.T),
        triple(other),
        triple(noise),
    )


@pytest.mark.parametrize("kernel", [scaled_trace, plain(scaled_trace)])
@pytest.mark.parametrize("gamma", [1e-4, 0.03, 1.0, 40.0])
def test_scaled_trace_is_that_of_the_matrices(kernel: Callable[..., float], gamma: float) -> None:
    rng = np.random.default_rng(1)
    root, other_root = rng.normal(size=(4, 4)) * 50.0, rng.normal(size=(2, 2)) * 80.0
    bound, other = root @ root.T, other_root @ other_root.T
    matrix, noise = rng.normal(size=(2, 4)), np.diag([400.0, 900.0])
    expected = WEIGHTS @ np.diagonal(intersection_bound(gamma, bound, matrix, other, noise)[1])
    found = kernel(gamma, *scalars(bound, matrix, other, noise))
    assert found == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("kernel", [best_gamma, plain(best_gamma)])
def test_no_weight_is_used_if_none_improves_the_bound(
    kernel: Callable[..., float],
) -> None:
    """A nearly known aircraft and a radar with unknown biases: the bound must not grow."""
    bound, other = np.diag([1.0, 1.0, 0.01, 0.01]), np.diag([500.0**2, 500.0**2])
    assert kernel(*scalars(bound, np.eye(2, 4), other, np.eye(2))) == 0.0


@pytest.mark.parametrize("seed", range(20))
def test_the_weight_found_is_as_good_as_the_best(seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(4, 4)) * np.array([[500.0], [300.0], [30.0], [40.0]])
    bound, other = root @ root.T, np.diag(10 ** rng.uniform(2, 5, 2))
    matrix, noise = np.eye(2, 4), np.diag(10 ** rng.uniform(1, 4, 2))
    given = scalars(bound, matrix, other, noise)
    best = min(scaled_trace(gamma, *given) for gamma in np.geomspace(1e-6, 99.0, 2000))
    gamma = best_gamma(*given)
    found = scaled_trace(gamma, *given) if gamma > 0.0 else given[0]
    assert found <= min(best, given[0]) * (1.0 + 1e-6)
