"""Information of observations as a square root, on Legendre polynomials."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from multiradar.estimation.filters.polynomial.polynomial_basis import legendre_table, restriction
from multiradar.estimation.filters.polynomial.polynomial_state import PolynomialState

Floats = NDArray[np.float64]


def extended_until(state: PolynomialState, until_s: float) -> PolynomialState:
    """Return the state on the interval extended to another observation.

    Parameters
    ----------
    state : PolynomialState
        The state.
    until_s : float
        Time of the next observation, s.

    Returns
    -------
    PolynomialState
        The same information, on the polynomials of the longer interval.

    References
    ----------
    Koptev, Rozov, Romanovsky, the system of equations after (1), dΘ_n = 0: α is constant, so the
    information changes only its basis, `polynomial_basis.restriction`.
    """
    if until_s <= state.observed_until_s:
        return state
    # P_j on the longer interval is Σ_k M_kj P_k of the shorter one.
    ratio = np.asarray((state.observed_until_s - state.start_s) / (until_s - state.start_s))
    matrix = restriction(state.degree, ratio - 1.0, ratio)
    return replace(state, observed_until_s=until_s, root=state.root @ matrix)


def with_measurements(
    state: PolynomialState, rows: Floats, values: Floats, sigmas: Floats
) -> PolynomialState:
    """Return the state updated by independent measurements.

    Parameters
    ----------
    state : PolynomialState
        State before, on an interval that contains the measurements.
    rows : (m, n + 1) float64
        h: measurement matrix for the coefficients of P_0 … P_n.
    values : (m, *axes) float64
        Measured values (m, or m·s for integrals).
    sigmas : (m,) float64
        Standard deviations of the errors, in the same unit.

    Returns
    -------
    PolynomialState
        BᵀB grows by Σ hᵀh / σ².

    References
    ----------
    G. J. Bierman, Factorization Methods for Discrete Sequential Estimation, Academic Press (1977),
    chapter V: update by an orthogonal transformation of the stacked roots.
    """
    size = state.degree + 1
    triangle, order, vector = sorted_factor(
        np.vstack([state.root, rows / sigmas[:, None]]),
        np.vstack(
            [state.vector.reshape(size, -1), values.reshape(len(sigmas), -1) / sigmas[:, None]]
        ),
    )
    root = np.empty_like(triangle)
    root[:, order] = triangle
    return replace(state, root=root, vector=vector.reshape(state.vector.shape))


def sorted_factor(rows: Floats, values: Floats) -> tuple[Floats, NDArray[np.intp], Floats]:
    """Return R, the order of its columns, and Qᵀ b, with Q R = A.

    Parameters
    ----------
    rows : (m, n) float64
        A, whose rows may differ much in magnitude.
    values : (m, k) float64
        b, k right-hand sides.

    Returns
    -------
    triangle : (min(m, n), n) float64
        R, of the columns in their new order.
    order : (n,) int
        Column of A at each position.
    vector : (min(m, n), k) float64
        Qᵀ b.

    Notes
    -----
    Rows are sorted by magnitude and columns pivoted, which makes the factorisation row-wise stable:
    an accurate measurement does not swamp the small information of a wide prior.

    References
    ----------
    A. J. Cox, N. J. Higham, "Stability of Householder QR factorization for weighted least squares
    problems", in Numerical Analysis 1997, Longman (1998), 57-73.
    """
    largest = np.argsort(-np.abs(rows).max(axis=1), kind="stable")
    unitary, triangle, order = qr(rows[largest], mode="economic", pivoting=True)
    return triangle, order, unitary.T @ values[largest]


def legendre_points(state: PolynomialState, times_s: Floats) -> Floats:
    """Return u of times.

    Parameters
    ----------
    state : PolynomialState
        Its observed interval is used.
    times_s : (...) float64
        Times, s.

    Returns
    -------
    (...) float64
        −1 at the start, 1 at the last observation; −1 everywhere if they coincide.

    References
    ----------
    NIST Digital Library of Mathematical Functions, table 18.3.1: the shifted polynomials.
    """
    span = state.observed_until_s - state.start_s
    if span == 0.0:
        return np.full(times_s.shape, -1.0)
    return 2.0 * (times_s - state.start_s) / span - 1.0


def legendre_part(state: PolynomialState, begin_s: Floats, end_s: Floats) -> tuple[Floats, Floats]:
    """Return middle and half length of parts of the interval, in units of u.

    Parameters
    ----------
    state : PolynomialState
        Its observed interval is used, of length above 0.
    begin_s, end_s : (...) float64
        Start and end of the parts, s.

    Returns
    -------
    middle, half : (...) float64
        Arguments of `averages` and `restriction`.

    References
    ----------
    NIST Digital Library of Mathematical Functions, table 18.3.1: the shifted polynomials.
    """
    span = state.observed_until_s - state.start_s
    middle = (begin_s - state.start_s) / 2.0 + (end_s - state.start_s) / 2.0
    return np.asarray(2.0 * middle / span - 1.0), np.asarray((end_s - begin_s) / span)


def derivative_rows(state: PolynomialState, times_s: Floats) -> Floats:
    """Return the rows that map coefficients to value and derivatives.

    Parameters
    ----------
    state : PolynomialState
        Its observed interval is used, of length above 0.
    times_s : (m,) float64
        Times, s.

    Returns
    -------
    (m, n + 1, n + 1) float64
        d^k P_j / dt^k at [m, k, j], 1/s^k.

    References
    ----------
    Koptev, Rozov, Romanovsky, the text after equation (1): Θ_k(t), the derivatives of X_t, by the
    chain rule.
    """
    table = legendre_table(state.degree, legendre_points(state, times_s), state.degree)
    by_time = 2.0 / (state.observed_until_s - state.start_s)
    return np.asarray(table * (by_time ** np.arange(state.degree + 1.0))[:, None])
