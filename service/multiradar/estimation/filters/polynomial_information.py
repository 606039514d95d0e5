"""The information that observations add up to, as a root on Legendre polynomials."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from multiradar.estimation.filters.polynomial_basis import legendre_table, restriction
from multiradar.estimation.filters.polynomial_state import PolynomialState

Floats = NDArray[np.float64]


def extended(state: PolynomialState, until_s: float) -> PolynomialState:
    """Return the state on the time up to another observation, if that is longer."""
    if until_s <= state.observed_until_s:
        return state
    # P_j on the longer interval is Σ_k M_kj P_k of the shorter one.
    ratio = np.asarray((state.observed_until_s - state.start_s) / (until_s - state.start_s))
    matrix = restriction(state.degree, ratio - 1.0, ratio)
    return replace(state, observed_until_s=until_s, root=state.root @ matrix)


def added(state: PolynomialState, rows: Floats, values: Floats, sigmas: Floats) -> PolynomialState:
    """Return the state with rows h of independent measurements, their values and their sigmas."""
    size = state.degree + 1
    triangle, order, vector = factored(
        np.vstack([state.root, rows / sigmas[:, None]]),
        np.vstack(
            [state.vector.reshape(size, -1), values.reshape(len(sigmas), -1) / sigmas[:, None]]
        ),
    )
    root = np.empty_like(triangle)
    root[:, order] = triangle
    return replace(state, root=root, vector=vector.reshape(state.vector.shape))


def factored(rows: Floats, values: Floats) -> tuple[Floats, NDArray[np.intp], Floats]:
    """Return R, the order of its columns, and Qᵀ b, with Q R = A.

    Rows are sorted by size and columns exchanged, which makes it stable row by row: a sharp
    measurement does not wash out what little a wide prior says.

    References
    ----------
    A. J. Cox, N. J. Higham, "Stability of Householder QR factorization for weighted least squares
    problems", in Numerical Analysis 1997, Longman (1998).
    """
    largest = np.argsort(-np.abs(rows).max(axis=1), kind="stable")
    unitary, triangle, order = qr(rows[largest], mode="economic", pivoting=True)
    return triangle, order, unitary.T @ values[largest]


def units(state: PolynomialState, times_s: Floats) -> Floats:
    """Return u of times: −1 at the start, 1 at the last observation."""
    span = state.observed_until_s - state.start_s
    if span == 0.0:
        return np.full(times_s.shape, -1.0)
    return 2.0 * (times_s - state.start_s) / span - 1.0


def part(state: PolynomialState, begin_s: Floats, end_s: Floats) -> tuple[Floats, Floats]:
    """Return middle and half length of parts of the interval, in units of u."""
    span = state.observed_until_s - state.start_s
    middle = (begin_s - state.start_s) / 2.0 + (end_s - state.start_s) / 2.0
    return np.asarray(2.0 * middle / span - 1.0), np.asarray((end_s - begin_s) / span)


def derivatives(state: PolynomialState, times_s: Floats) -> Floats:
    """Return the rows of value and derivatives over the coefficients: (m, n + 1, n + 1)."""
    table = legendre_table(state.degree, units(state, times_s), state.degree)
    by_time = 2.0 / (state.observed_until_s - state.start_s)
    return np.asarray(table * (by_time ** np.arange(state.degree + 1.0))[:, None])
