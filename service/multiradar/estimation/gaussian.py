"""Gaussian estimates: checks of covariances, and normalised squared errors (NEES, NIS)."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import CovarianceError, ShapeError
from multiradar.estimation.array_checks import require_numbers

#: Largest asymmetry, in units of the two standard deviations, that rounding may leave.
ASYMMETRY_MAX = 1e-9
#: Smallest eigenvalue of a correlation matrix that differs from zero in double precision.
EIGENVALUE_MIN = 1e-14


def require_covariance(matrix: ArrayLike, name: str) -> NDArray[np.float64]:
    """Return the matrix if it is a covariance; raise otherwise.

    Parameters
    ----------
    matrix : (..., n, n) array_like
        One matrix or several.
    name : str
        Name of the quantity in the message.

    Returns
    -------
    (..., n, n) ndarray
        The same values.

    Raises
    ------
    CovarianceError
        If it is not square, has a number that is not finite, is not symmetric within
        `ASYMMETRY_MAX`, or is not positive definite.
    ShapeError
        If it is not numeric.

    Notes
    -----
    Symmetry and definiteness are tested on the correlation matrix, so that metres and radians, or
    variances of 1e-12 and 1e+6, can stand side by side.
    """
    values = require_numbers(matrix, name)
    if values.ndim < 2 or values.shape[-2] != values.shape[-1]:
        raise CovarianceError(f"{name}: expected a square matrix, found shape {values.shape}")
    if not np.isfinite(values).all():
        raise CovarianceError(f"{name}: expected finite numbers, found {values.tolist()}")
    variances = np.diagonal(values, axis1=-2, axis2=-1)
    if not (variances > 0.0).all():
        raise CovarianceError(f"{name}: expected variances above 0, found {variances.min()}")
    sigmas = np.sqrt(variances)
    correlations = values / (sigmas[..., :, None] * sigmas[..., None, :])
    asymmetry = float(np.abs(correlations - np.swapaxes(correlations, -1, -2)).max(initial=0.0))
    if asymmetry > ASYMMETRY_MAX:
        raise CovarianceError(
            f"{name}: expected a symmetric matrix, but its correlation matrix is asymmetric by "
            f"{asymmetry:.3g}"
        )
    eigenvalue = float(np.linalg.eigvalsh(correlations).min(initial=np.inf))
    if eigenvalue < EIGENVALUE_MIN:
        raise CovarianceError(
            f"{name}: expected a positive definite matrix, but its correlation matrix has an "
            f"eigenvalue of {eigenvalue:.3g}"
        )
    return values


def symmetric_part(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (M + Mᵀ)/2, which removes the asymmetry of rounding.

    Parameters
    ----------
    matrix : (..., n, n) ndarray
        A matrix that is symmetric but for rounding.

    Returns
    -------
    (..., n, n) ndarray
        Exactly symmetric. Without it an update P − K (P Hᵀ)ᵀ diverges within some hundred steps.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.29), whose last form is symmetric but for rounding; the
    divergence by rounding, and this remedy, are the project's own finding.
    """
    return (matrix + np.swapaxes(matrix, -1, -2)) / 2.0


def normalised_squared(error: ArrayLike, covariance: ArrayLike) -> NDArray[np.float64]:
    """Return eᵀ P⁻¹ e: NEES for an error of estimation, NIS for an innovation.

    Parameters
    ----------
    error : (..., n) ndarray
        Error, in any units.
    covariance : (..., n, n) ndarray
        Its covariance by the filter.

    Returns
    -------
    (...) ndarray
        χ² distributed with n degrees of freedom if the covariance is consistent.

    Raises
    ------
    CovarianceError
        If the covariance is not valid.
    ShapeError
        If the error is not numeric, or its components do not match the covariance.

    References
    ----------
    Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
    Navigation", Wiley 2001, section 5.4.2. Scaling to correlations first: N. J. Higham, "Accuracy
    and Stability of Numerical Algorithms", 2nd edition, SIAM 2002, section 7.3.
    """
    errors = require_numbers(error, "error")
    matrix = require_covariance(covariance, "error")
    if errors.ndim == 0 or errors.shape[-1] != matrix.shape[-1]:
        expected = f"{matrix.shape[-1]} components in the last axis, as in its covariance"
        raise ShapeError("error", expected, errors.shape)
    sigmas = np.sqrt(np.diagonal(matrix, axis1=-2, axis2=-1))
    scaled = errors / sigmas
    correlations = matrix / (sigmas[..., :, None] * sigmas[..., None, :])
    return np.asarray((scaled * np.linalg.solve(correlations, scaled[..., None])[..., 0]).sum(-1))
