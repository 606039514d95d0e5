"""The Cartesian form against the polar plot that it linearises."""

import numpy as np
import pytest

from multiradar.errors import ShapeError
from multiradar.estimation.measurement.linearised import cartesian_plot
from support.references.linearised import cartesian_bias_matrix, cartesian_noise

SITE = np.array([-30_000.0, 230_000.0])


def test_azimuth_is_clockwise_from_north_and_east_comes_first() -> None:
    place = cartesian_plot(SITE, 1000.0, np.radians([0.0, 90.0, 180.0]))
    np.testing.assert_allclose(place - SITE, [[0, 1000], [1000, 0], [0, -1000]], atol=1e-9)


def test_columns_are_the_derivatives_of_the_position() -> None:
    slant, azimuth = 87_000.0, np.radians(213.0)
    matrix = cartesian_bias_matrix(SITE, cartesian_plot(SITE, slant, azimuth))
    by_range = cartesian_plot(SITE, slant + 0.5, azimuth) - cartesian_plot(
        SITE, slant - 0.5, azimuth
    )
    by_azimuth = cartesian_plot(SITE, slant, azimuth + 5e-6) - cartesian_plot(
        SITE, slant, azimuth - 5e-6
    )
    np.testing.assert_allclose(matrix[:, 0], by_range, rtol=0, atol=1e-9)
    np.testing.assert_allclose(matrix[:, 1], by_azimuth / 1e-5, rtol=1e-6)


def test_noise_is_a_thin_ellipse_across_the_line_of_sight() -> None:
    """At 100 km to the east 0.05° are 87 m along north, 15 m of range lie along east."""
    matrix = cartesian_bias_matrix(SITE, SITE + np.array([100_000.0, 0.0]))
    noise = cartesian_noise(matrix, 15.0, np.radians(0.05))
    np.testing.assert_allclose(noise, np.diag([15.0**2, 87.27**2]), rtol=1e-3, atol=1e-6)


def test_many_positions_are_computed_at_once() -> None:
    places = SITE + np.array([[3e4, 4e4], [-5e4, 1e3]])
    matrices = cartesian_bias_matrix(SITE, places)
    np.testing.assert_array_equal(matrices[1], cartesian_bias_matrix(SITE, places[1]))
    assert cartesian_noise(matrices, 15.0, 1e-3).shape == (2, 2, 2)


def test_at_the_radar_there_is_no_direction() -> None:
    with pytest.raises(ShapeError, match="a distance from the radar"):
        cartesian_bias_matrix(SITE, SITE)
