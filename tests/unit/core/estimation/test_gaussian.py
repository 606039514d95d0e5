"""Accepted covariances, and the errors of others."""

import numpy as np
import pytest

from multiradar.errors import CovarianceError, ShapeError
from multiradar.estimation.gaussian import normalised_squared, require_covariance, symmetric_part


def test_a_covariance_of_metres_and_radians_is_accepted() -> None:
    """Eigenvalues of 1e-12 beside 1e6 are units, not a defect."""
    sigmas = np.array([1e3, 1e-6])
    matrix = sigmas[:, None] * np.array([[1.0, -0.999], [-0.999, 1.0]]) * sigmas
    np.testing.assert_array_equal(require_covariance(matrix, "bias"), matrix)
    assert require_covariance(np.stack([matrix, matrix]), "biases").shape == (2, 2, 2)


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.ones((2, 3)), r"track: expected a square matrix, found shape \(2, 3\)"),
        (np.ones(4), r"track: expected a square matrix, found shape \(4,\)"),
        (np.array([[1.0, np.nan], [np.nan, 1.0]]), "expected finite numbers"),
        (np.array([[1.0, 0.0], [0.0, -2.0]]), "expected variances above 0, found -2.0"),
        (np.array([[1.0, 0.3], [0.2, 1.0]]), "correlation matrix is asymmetric by 0.1"),
        (np.array([[4.0, 4.0], [4.0, 4.0]]), "eigenvalue"),
        (np.array([[1.0, 2.0], [2.0, 1.0]]), "eigenvalue of -1"),
    ],
)
def test_an_invalid_covariance_is_rejected(matrix: np.ndarray, message: str) -> None:
    with pytest.raises(CovarianceError, match=message):
        require_covariance(matrix, "track")


def test_one_bad_matrix_among_many_is_found() -> None:
    matrices = np.stack([np.eye(3)] * 5)
    matrices[3, 0, 1] = 1e-6
    with pytest.raises(CovarianceError, match="asymmetric"):
        require_covariance(matrices, "tracks")


def test_symmetric_part_is_symmetric_to_the_last_bit() -> None:
    matrix = np.random.default_rng(0).normal(size=(7, 4, 4))
    part = symmetric_part(matrix)
    np.testing.assert_array_equal(part, np.swapaxes(part, -1, -2))
    np.testing.assert_allclose(part + (matrix - np.swapaxes(matrix, -1, -2)) / 2, matrix)


def test_normalised_squared_error_has_the_mean_of_its_dimension() -> None:
    """10 000 draws: the mean of χ² with 3 degrees is 3, its standard error 0.025."""
    rng = np.random.default_rng(1)
    root = np.array([[100.0, 0.0, 0.0], [3.0, 1e-3, 0.0], [50.0, 2e-3, 7.0]])
    error = rng.normal(size=(10_000, 3)) @ root.T
    found = normalised_squared(error, np.broadcast_to(root @ root.T, (10_000, 3, 3)))
    assert found.shape == (10_000,)
    assert found.mean() == pytest.approx(3.0, abs=0.1)


def test_a_scalar_is_not_a_covariance_and_errors_must_match() -> None:
    with pytest.raises(CovarianceError, match=r"x: expected a square matrix, found shape \(\)"):
        require_covariance(1.0, "x")
    with pytest.raises(ShapeError, match="x: expected numbers, was 'wide'"):
        require_covariance("wide", "x")
    with pytest.raises(ShapeError, match=r"error: expected 2 components .* shape \(3,\)"):
        normalised_squared(np.zeros(3), np.eye(2))


def test_normalised_squared_rejects_an_invalid_covariance() -> None:
    with pytest.raises(CovarianceError):
        normalised_squared(np.ones(2), np.array([[1.0, 2.0], [2.0, 1.0]]))
