"""Radar biases as published at the end of each epoch, common to all aircraft."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.bias._matrix_kernels import inverse_by_root, multiply, triangular_root
from multiradar.estimation.measurement.sensors import SensorTable

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BiasState:
    """The published biases of all sensors.

    Attributes
    ----------
    estimate : (c,) float64
        Estimates, in the order of `SensorTable.parameter_kind` (m, rad, 1 or s by kind).
    covariance : (c, c) float64
        Covariance of their errors.
    scale : (c,) float64
        Prior standard deviations. Parameters are divided by them before a factorisation, since
        metres and radians differ by many powers of ten.
    """

    estimate: Floats
    covariance: Floats
    scale: Floats

    @property
    def sigma(self) -> Floats:
        """Standard deviations of the estimates, (c,) float64.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.24): square roots of the diagonal of the block of ς.
        """
        sigma: Floats = np.sqrt(np.diagonal(self.covariance))
        return sigma


def prior(table: SensorTable) -> BiasState:
    """Return the prior of the biases.

    Parameters
    ----------
    table : SensorTable
        The sensors with their bias parameters.

    Returns
    -------
    BiasState
        Prior means, and a diagonal covariance.

    References
    ----------
    IMM UrO RAN report (2016), equations (1.6) and (1.24): ς and its block before the first
    measurement; diagonal, as section 1.4 asks.
    """
    return BiasState(
        estimate=table.prior_mean.copy(),
        covariance=np.diag(table.prior_sigma**2),
        scale=table.prior_sigma.copy(),
    )


def add_information(state: BiasState, information: Floats, vector: Floats) -> BiasState:
    """Add the information of an epoch of measurements.

    Parameters
    ----------
    state : BiasState
        The biases before.
    information : (c, c) float64
        Sum of Uᵀ S⁻¹ U over the measurements.
    vector : (c,) float64
        Sum of Uᵀ S⁻¹ ν, with ν the innovations at bias zero.

    Returns
    -------
    BiasState
        ς̂ = Y⁻¹ y and P_ς = Y⁻¹ with Y = P_ς⁻¹ + information, y = P_ς⁻¹ ς̂ + vector.

    Notes
    -----
    Everything is divided by the prior standard deviations first, so that the factorisations work
    on numbers near one.

    References
    ----------
    Friedland, B., "Treatment of bias in recursive filtering", IEEE TAC 14 (1969), 359-367.
    """
    if len(state.scale) == 0 or not information.any():
        return state
    scale = np.outer(state.scale, state.scale)
    old = symmetric_inverse(state.covariance / scale)
    new = old + information * scale
    covariance = symmetric_inverse(new)
    news = vector - multiplied(information, state.estimate)
    shift = multiplied(covariance, news * state.scale)
    return replace(
        state,
        estimate=state.estimate + shift * state.scale,
        covariance=covariance * scale,
    )


def drift(state: BiasState, rates: Floats, duration_s: float) -> tuple[BiasState, Floats]:
    """Predict the biases: add the variance of their random walk.

    Parameters
    ----------
    state : BiasState
        The biases before.
    rates : (c,) float64
        Standard deviation of the random walk of each parameter after one second.
    duration_s : float
        How long, s.

    Returns
    -------
    state : BiasState
        The same estimate with P_ς + Q_ς.
    gain : (c, c) float64
        G = P_ς (P_ς + Q_ς)⁻¹, which adjusts the aircraft that depend on the biases.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.25) for ς, with A^ς = I of (1.7) and B^ς V^ς B^ςᵀ = Q_ς
    of (1.14). G is the project's own: with it χ | ς remains exact when ς drifts. Another form: M.
    B. Ignagni, "Separate-bias Kalman estimator with bias state noise", IEEE TAC 35 (1990), 338-341.
    """
    scale = np.outer(state.scale, state.scale)
    walked = state.covariance + np.diag(rates**2 * duration_s)
    gain = multiply(state.covariance / scale, symmetric_inverse(walked / scale))
    gain *= state.scale[:, None] / state.scale[None, :]
    return replace(state, covariance=walked), gain


def widened(matrix: Floats, columns: int, diagonal: float) -> Floats:
    """Return a copy of a square matrix with further rows and columns.

    Parameters
    ----------
    matrix : (c, c) float64
        The matrix.
    columns : int
        How many columns the result has, c or more.
    diagonal : float
        Diagonal of the further rows, which are 0 elsewhere.

    Returns
    -------
    (columns, columns) float64
        The copy.
    """
    count = len(matrix)
    wide = np.zeros((columns, columns))
    wide[:count, :count] = matrix
    if columns > count:
        wide[range(count, columns), range(count, columns)] = diagonal
    return wide


def symmetric_inverse(matrix: Floats) -> Floats:
    """Return the inverse of a symmetric positive definite matrix, exactly symmetric.

    Parameters
    ----------
    matrix : (c, c) float64
        The matrix; only symmetric positive definite ones have a Cholesky factor.

    Returns
    -------
    (c, c) float64
        Its inverse.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the matrix is not positive definite.

    References
    ----------
    N. J. Higham, "Accuracy and Stability of Numerical Algorithms", 2nd edition, SIAM 2002, chapters
    10 and 14: the inverse from the Cholesky factor.
    """
    return inverse_by_root(symmetric_root(matrix))


def symmetric_root(matrix: Floats) -> Floats:
    """Return the upper triangular U with UᵀU = matrix, the transposed Cholesky factor.

    Parameters
    ----------
    matrix : (c, c) float64
        The matrix.

    Returns
    -------
    (c, c) float64
        U, with a positive diagonal.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the matrix is not positive definite.

    References
    ----------
    N. J. Higham, "Accuracy and Stability of Numerical Algorithms", 2nd edition, SIAM 2002, chapter
    10: the Cholesky factorisation.
    """
    root = triangular_root(np.ascontiguousarray(matrix))
    if root.size and np.isnan(root[-1, -1]):
        raise np.linalg.LinAlgError("the matrix is not positive definite")
    return root


def multiplied(matrix: Floats, vector: Floats) -> Floats:
    """Return the product of a matrix and a vector; the sums have one order on every processor.

    Parameters
    ----------
    matrix : (n, m) float64
        The matrix.
    vector : (m,) float64
        The vector.

    Returns
    -------
    (n,) float64
        Their product.
    """
    return multiply(np.ascontiguousarray(matrix), np.ascontiguousarray(vector)[:, None])[:, 0]
