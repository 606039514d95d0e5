"""Legendre polynomials on an interval of time: values, derivatives, restriction to a part of it.

On [a, b], with u = (2t − a − b)/(b − a), the polynomials P_0(u) … P_n(u) are orthogonal, with
squares that integrate to (b − a)/(2k + 1). With uniform observations over the interval, their
coefficients are estimated independently of each other, for any degree and interval. Powers of t are
so nearly linearly dependent that eleven digits are lost at degree 8.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def legendre_table(degree: int, points: Floats, orders: int) -> Floats:
    """Return P_j and its derivatives.

    Parameters
    ----------
    degree : int
        Highest degree n.
    points : (...) float64
        Points u; −1 … 1 within the interval, beyond it for extrapolation.
    orders : int
        Highest derivative m.

    Returns
    -------
    (..., m + 1, n + 1) float64
        d^k P_j / du^k at [..., k, j].

    Notes
    -----
    By the recurrences (j + 1) P_{j+1} = (2j + 1) u P_j − j P_{j−1} and
    P_{j+1}^{(k)} = P_{j−1}^{(k)} + (2j + 1) P_j^{(k−1)}, stable inside and outside the interval.

    References
    ----------
    NIST Digital Library of Mathematical Functions, section 18.9; the first is Bonnet's.
    """
    table = np.zeros((*points.shape, orders + 1, degree + 1))
    table[..., 0, 0] = 1.0
    for j in range(degree):
        below = table[..., :, j - 1] if j else np.zeros_like(table[..., :, 0])
        table[..., 0, j + 1] = ((2 * j + 1) * points * table[..., 0, j] - j * below[..., 0]) / (
            j + 1
        )
        table[..., 1:, j + 1] = below[..., 1:] + (2 * j + 1) * table[..., :-1, j]
    return table


def averages(degree: int, centre: Floats, half: Floats) -> Floats:
    """Return the mean of each polynomial over parts of the interval: the first row of M below.

    Parameters
    ----------
    degree : int
        Highest degree n.
    centre, half : (...) float64
        Middle and half length of each part, in units of u.

    Returns
    -------
    (..., n + 1) float64
        Means of P_0 … P_n.

    References
    ----------
    NIST Digital Library of Mathematical Functions, section 3.5(v): the rule of Gauss and Legendre,
    exact here.
    """
    nodes, weights = np.polynomial.legendre.leggauss(degree // 2 + 1)
    table = legendre_table(degree, centre[..., None] + half[..., None] * nodes, 0)
    return np.asarray(np.einsum("q,...qj->...j", weights / 2.0, table[..., 0, :]))


def restriction(degree: int, centre: Floats, half: Floats) -> Floats:
    """Return the matrices that express the polynomials of an interval on parts of it.

    Parameters
    ----------
    degree : int
        Highest degree n.
    centre, half : (...) float64
        Middle and half length of each part, in units of u of the whole; a half of 0 is a point.

    Returns
    -------
    (..., n + 1, n + 1) float64
        M, upper triangular, with P_j(centre + half·v) = Σ_k M_kj P_k(v).

    Notes
    -----
    M_kj is (2k + 1)/2 times the integral of P_k(v) P_j(centre + half·v) over −1 … 1. Integrated k
    times by parts (Rodrigues) it is half^k (2k + 1)/(2^{k+1} k!) times that of
    (1 − v²)^k P_j^{(k)}, which Gauss's rule with n + 1 nodes integrates exactly, without loss of
    digits on short parts.

    References
    ----------
    NIST Digital Library of Mathematical Functions, table 18.3.1 (orthogonality), section 18.5(ii)
    (Rodrigues) and section 3.5(v) (the rule of Gauss and Legendre).
    """
    nodes, weights = np.polynomial.legendre.leggauss(degree + 1)
    table = legendre_table(degree, centre[..., None] + half[..., None] * nodes, degree)
    result = np.empty((*centre.shape, degree + 1, degree + 1))
    factor, bell = 0.5, weights
    for k in range(degree + 1):
        area = np.einsum("q,...qj->...j", bell, table[..., k, :])
        result[..., k, :] = (2 * k + 1) * factor * half[..., None] ** k * area
        factor, bell = factor / (2.0 * (k + 1)), bell * (1.0 - nodes**2)
    return result
