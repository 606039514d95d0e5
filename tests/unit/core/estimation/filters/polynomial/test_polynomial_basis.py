"""Legendre polynomials and their restriction to parts of an interval, against NumPy."""

import numpy as np
import pytest
from numpy.polynomial import Legendre

from multiradar.estimation.filters.polynomial.polynomial_basis import (
    averages,
    legendre_table,
    restriction,
)


def test_values_and_derivatives_are_those_of_numpy_inside_and_outside() -> None:
    points = np.array([-1.0, -0.3, 0.0, 0.9, 1.0, 3.5])
    table = legendre_table(6, points, 6)
    for degree in range(7):
        for order in range(7):
            known = derivative(Legendre.basis(degree), order)(points)
            np.testing.assert_allclose(table[:, order, degree], known, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("centre", "half"), [(0.0, 1.0), (-0.4, 0.25), (0.9, 1e-9), (3.0, 2.0)])
def test_restriction_equals_the_whole_on_a_part(centre: float, half: float) -> None:
    """Also on a part of 1e-9, where each coefficient must be accurate by itself."""
    matrix = restriction(7, np.array(centre), np.array(half))
    for degree in range(8):
        whole = Legendre.basis(degree)
        for order in range(degree + 1):
            # The derivatives in the middle of the part test the small coefficients, too.
            wanted = derivative(whole, order)(centre) * half**order
            found = derivative(Legendre(matrix[:, degree]), order)(0.0)
            assert found == pytest.approx(wanted, rel=1e-10, abs=1e-11 * half**order)


def test_a_part_of_length_zero_is_a_point() -> None:
    matrix = restriction(3, np.array(0.5), np.array(0.0))
    np.testing.assert_allclose(matrix[0], [1.0, 0.5, -0.125, -0.4375])
    np.testing.assert_array_equal(matrix[1:], 0.0)


def test_averages_are_means_over_the_parts() -> None:
    centre, half = np.array([-0.5, 0.2, 0.9]), np.array([0.5, 0.1, 1e-9])
    rows = averages(8, centre, half)
    matrix = restriction(8, centre, half)
    np.testing.assert_allclose(rows, matrix[:, 0, :], rtol=0.0, atol=1e-14)
    integral = Legendre.basis(8).integ()
    known = (integral(0.0) - integral(-1.0)) / 1.0
    assert rows[0, 8] == pytest.approx(known, abs=1e-14)


def derivative(polynomial: Legendre, order: int) -> Legendre:
    return polynomial.deriv(order) if order else polynomial
