"""The elimination of a state from stacked plots, against the Cholesky factor of NumPy."""

from collections.abc import Callable

import numpy as np
import pytest

from multiradar.estimation.filters.separated._macro_kernels import eliminate
from support.kernels import plain

KERNELS = [eliminate, plain(eliminate)]


def information(rank: int, seed: int) -> np.ndarray:
    """Information of a rank about a state, of sigmas of about 0.1 mm and mm/s."""
    half = np.random.default_rng(seed).normal(size=(4, rank))
    return 1e8 * half @ half.T


@pytest.mark.parametrize("kernel", KERNELS)
def test_columns_are_divided_by_the_factor(kernel: Callable[..., bool]) -> None:
    matrix, columns = information(4, 1), np.random.default_rng(2).normal(size=(4, 3))
    expected = np.linalg.solve(np.linalg.cholesky(matrix), columns)
    assert kernel(matrix, columns)
    np.testing.assert_allclose(columns, expected, rtol=1e-9)


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("seed", range(10))
def test_a_state_that_is_not_observed_is_not_eliminated(
    kernel: Callable[..., bool], seed: int
) -> None:
    """Rounding leaves a little information about its fourth axis, of either sign."""
    assert not kernel(information(3, seed), np.ones((4, 2)))
    absent = information(4, seed)
    absent[3, 2] = np.nan
    assert not kernel(absent, np.ones((4, 2)))
