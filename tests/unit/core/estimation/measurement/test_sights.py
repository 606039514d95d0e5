"""Sights: expected components, their derivatives, and rejected arguments."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import PriorError, ShapeError
from multiradar.estimation.measurement.sights import Sight

SOURCE = np.array([3e3, -2e3, 100.0])
POSITION = np.array([-20e3, 40e3, 9e3])


def full(position: NDArray[np.float64] = POSITION) -> Sight:
    """Azimuth, elevation and range of a position, without errors."""
    east, north, up = position - SOURCE
    ground = np.hypot(east, north)
    return Sight(
        SOURCE, np.arctan2(east, north), 0.003, np.arctan2(up, ground), 0.002,
        np.hypot(ground, up), 50.0,
    )  # fmt: skip


def test_residuals_vanish_at_the_true_position() -> None:
    residuals, slopes, sigmas = full().residuals(POSITION)
    assert residuals == pytest.approx(0.0, abs=1e-12)
    assert slopes.shape == (3, 3)
    assert sigmas.tolist() == [0.003, 0.002, 50.0]


def test_slopes_are_the_derivatives() -> None:
    """Central differences over 1 m, which leave 1e-13 rad/m of rounding."""
    _, slopes, _ = full().residuals(POSITION)
    for axis in range(3):
        step = np.eye(3)[axis]
        above, below = (full().residuals(POSITION + sign * step)[0] for sign in (1.0, -1.0))
        assert -(above - below) / 2.0 == pytest.approx(slopes[:, axis], rel=1e-6, abs=1e-12)


def test_normals_are_across_the_line_of_sight() -> None:
    normals, sigmas = full().normals()
    line = (POSITION - SOURCE) / np.linalg.norm(POSITION - SOURCE)
    assert normals @ line == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(normals, axis=-1) == pytest.approx(1.0)
    assert sigmas.tolist() == [0.003, 0.002]


def test_an_azimuth_in_space_does_not_depend_on_height() -> None:
    sight = Sight(SOURCE, np.array(0.3), 0.003)
    _, slopes, _ = sight.residuals(POSITION)
    assert slopes.shape == (1, 3)
    assert slopes[0, 2] == 0.0


def test_azimuths_on_both_sides_of_south_are_near() -> None:
    sight = Sight(np.zeros(2), np.array(np.pi - 1e-3), 0.003)
    (residual,), _, _ = sight.residuals(np.array([-1.0, -1000.0]))
    assert residual == pytest.approx(-2e-3, abs=1e-6)


def test_at_the_source_there_is_no_slope() -> None:
    residuals, slopes, _ = full().residuals(SOURCE)
    assert np.isfinite(residuals).all()
    assert np.isfinite(slopes).all()


def test_inconsistent_components_are_rejected() -> None:
    angle = np.array(0.3)
    with pytest.raises(ShapeError, match="two or three"):
        Sight(np.zeros(4), angle, 0.003)
    with pytest.raises(ShapeError, match="three coordinates if an elevation is given"):
        Sight(np.zeros(2), angle, 0.003, angle, 0.003)
    with pytest.raises(ShapeError, match="range_m"):
        Sight(np.zeros(2), angle, 0.003, range_m=np.array(1e4))
    with pytest.raises(ShapeError, match="elevation_rad"):
        Sight(np.zeros(3), angle, 0.003, elevation_sigma_rad=0.1)
    with pytest.raises(ShapeError):
        Sight(np.zeros(2), np.array(np.nan), 0.003)
    for sigma in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(PriorError, match="azimuth_sigma_rad"):
            Sight(np.zeros(2), angle, sigma)
