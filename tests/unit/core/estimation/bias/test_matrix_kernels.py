"""The algebra of the shared biases agrees with LAPACK, and is exactly symmetric."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.estimation.bias.store import (
    BiasState,
    drift,
    multiplied,
    symmetric_inverse,
    symmetric_root,
)

# Groups of four rows, and every remainder.
SIZES = (1, 2, 3, 4, 5, 8, 11, 30)


def _positive(size: int) -> NDArray[np.float64]:
    drawn = np.random.default_rng(size).normal(size=(size, 2 * size))
    return np.asarray(drawn @ drawn.T / size + 0.01 * np.eye(size))


@pytest.mark.parametrize("size", SIZES)
def test_the_root_is_the_cholesky_factor_transposed(size: int) -> None:
    matrix = _positive(size)
    np.testing.assert_allclose(
        symmetric_root(matrix), np.linalg.cholesky(matrix).T, rtol=1e-12, atol=1e-14
    )


@pytest.mark.parametrize("size", SIZES)
def test_the_inverse_is_symmetric_to_the_last_bit(size: int) -> None:
    matrix = _positive(size)
    inverse = symmetric_inverse(matrix)
    np.testing.assert_allclose(inverse @ matrix, np.eye(size), atol=1e-11)
    assert (inverse == inverse.T).all()


@pytest.mark.parametrize("size", SIZES)
def test_products(size: int) -> None:
    matrix, vector = _positive(size)[: size // 2 + 1], np.linspace(-1.5, 4.0, size)
    np.testing.assert_allclose(multiplied(matrix, vector), matrix @ vector, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("diagonal", [-1.0, 0.0, np.nan])
def test_a_matrix_that_is_not_positive_definite_is_an_error(diagonal: float) -> None:
    matrix = _positive(6)
    matrix[3, 3] = diagonal
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        symmetric_inverse(matrix)


def test_without_biases_nothing_is_factored() -> None:
    assert symmetric_root(np.empty((0, 0))).shape == (0, 0)


@pytest.mark.parametrize("size", SIZES)
def test_a_drift_widens_the_covariance_and_its_gain_is_the_share_of_before(size: int) -> None:
    # Metres and radians.
    scale = np.where(np.arange(size) % 2, 1e-3, 100.0)
    covariance = _positive(size) * np.outer(scale, scale)
    rates = 0.1 * scale
    state = BiasState(np.linspace(0.0, 1.0, size), covariance, scale)
    after, gain = drift(state, rates, 16.0)
    walked = covariance + np.diag(16.0 * rates**2)
    np.testing.assert_allclose(after.covariance, walked, rtol=1e-14)
    assert after.estimate is state.estimate
    # G (P + Q) = P, each element in its units.
    units = np.outer(scale, scale)
    np.testing.assert_allclose(gain @ walked / units, covariance / units, rtol=0.0, atol=1e-11)
