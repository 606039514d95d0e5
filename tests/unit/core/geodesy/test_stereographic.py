"""The stereographic plane against PROJ."""

import numpy as np
import pyproj
import pytest

from multiradar.errors import ConfigurationError
from multiradar.geodesy.stereographic import StereographicPlane

CENTRES = [(47.0, 8.0), (-12.0, -77.0), (0.5, 180.0), (78.0, 15.0)]


def proj(centre: tuple[float, float]) -> pyproj.Proj:
    return pyproj.Proj(proj="sterea", lat_0=centre[0], lon_0=centre[1], ellps="WGS84")


@pytest.mark.parametrize("centre", CENTRES)
def test_plane_is_proj_s_oblique_stereographic_projection(centre: tuple[float, float]) -> None:
    random = np.random.default_rng(2)
    latitude = np.clip(centre[0] + random.uniform(-12, 12, 300), -89.999, 89.999)
    longitude = centre[1] + random.uniform(-12, 12, 300)
    expected = np.stack(proj(centre)(longitude, latitude))
    plane = StereographicPlane(*np.radians(centre).tolist())
    found = np.stack(plane.to_plane(np.radians(latitude), np.radians(longitude)))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-3)


def test_the_matrix_turns_and_stretches_displacements() -> None:
    """A hundred metres to the east and to the north, by PROJ, 500 km from the centre."""
    centre, place = (47.0, 8.0), (50.0, 13.0)
    plane = StereographicPlane(*np.radians(centre).tolist())
    matrix = plane.matrix(*np.radians(place))
    geod, to_plane = pyproj.Geod(ellps="WGS84"), proj(centre)
    here = np.array(to_plane(place[1], place[0]))
    for column, azimuth in enumerate((90.0, 0.0)):
        longitude, latitude, _ = geod.fwd(place[1], place[0], azimuth, 100.0)
        there = np.array(to_plane(longitude, latitude))
        np.testing.assert_allclose(matrix[:, column], (there - here) / 100.0, atol=1e-5)


def test_poles_and_the_antipode_are_valid() -> None:
    plane = StereographicPlane(*np.radians([47.0, 8.0]).tolist())
    latitude, longitude = np.radians([90.0, -90.0, -47.0]), np.radians([0.0, 0.0, -172.0])
    x, y = plane.to_plane(latitude, longitude)
    assert np.isfinite([x[:2], y[:2]]).all()
    # What is farther than the item reaches is left out of it.
    assert not abs(y[2]) < 1e8
    assert np.isfinite(plane.matrix(latitude[:2], longitude[:2])).all()


@pytest.mark.parametrize("centre", [(90.0, 0.0), (np.nan, 0.0), (0.0, 181.0)])
def test_an_invalid_centre_is_rejected(centre: tuple[float, float]) -> None:
    with pytest.raises(ConfigurationError, match="centre of the stereographic plane"):
        StereographicPlane(*np.radians(centre).tolist())
