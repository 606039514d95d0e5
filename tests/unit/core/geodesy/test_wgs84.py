"""The ellipsoid against PROJ."""

import numpy as np
import pyproj
import pytest

from multiradar.geodesy import wgs84

MICROMETRE = 1e-6
PLACES = np.array(
    [
        [0.0, 0.0, 0.0],
        [56.8, 60.6, 250.0],
        [-33.9, 151.2, 11_000.0],
        [64.1, -21.9, 40_000.0],
        [-77.8, 166.7, -400.0],
        [89.999, -179.999, 9_000.0],
        [45.0, 180.0, 100.0],
    ]
)


def test_geodetic_to_ecef_is_that_of_proj() -> None:
    to_ecef = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    expected = np.stack(to_ecef.transform(PLACES[:, 1], PLACES[:, 0], PLACES[:, 2]), axis=-1)
    latitude, longitude = np.radians(PLACES[:, 0]), np.radians(PLACES[:, 1])
    found = wgs84.geodetic_to_ecef(latitude, longitude, PLACES[:, 2])
    np.testing.assert_allclose(found, expected, rtol=0, atol=MICROMETRE)


def test_ecef_to_geodetic_is_that_of_proj() -> None:
    to_ecef = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    position = np.stack(to_ecef.transform(PLACES[:, 1], PLACES[:, 0], PLACES[:, 2]), axis=-1)
    latitude, longitude, height = wgs84.ecef_to_geodetic(position)
    radian = MICROMETRE / wgs84.SEMI_MAJOR_AXIS_M
    np.testing.assert_allclose(latitude, np.radians(PLACES[:, 0]), rtol=0, atol=radian)
    turn = np.angle(np.exp(1j * (longitude - np.radians(PLACES[:, 1]))))
    np.testing.assert_allclose(turn * np.cos(latitude), 0.0, rtol=0, atol=radian)
    np.testing.assert_allclose(height, PLACES[:, 2], rtol=0, atol=MICROMETRE)


def test_the_poles_have_a_height_and_no_warning() -> None:
    latitude, longitude, height = wgs84.ecef_to_geodetic(
        [[0.0, 0.0, wgs84.SEMI_MINOR_AXIS_M + 500.0], [0.0, 0.0, -wgs84.SEMI_MINOR_AXIS_M]]
    )
    np.testing.assert_allclose(latitude, [np.pi / 2, -np.pi / 2], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(longitude, 0.0)
    np.testing.assert_allclose(height, [500.0, 0.0], rtol=0, atol=MICROMETRE)


def test_local_axes_point_east_north_and_up() -> None:
    # At 0° N 90° E: east is −x, north is z, up is y. Any swapped axis or sign shows here.
    np.testing.assert_allclose(
        wgs84.enu_rotation(0.0, np.pi / 2), [[-1, 0, 0], [0, 0, 1], [0, 1, 0]], atol=1e-15
    )


@pytest.mark.parametrize("latitude_deg", [0.0, 37.0, -82.0])
def test_curvatures_are_those_of_short_geodesics(latitude_deg: float) -> None:
    """The change of the direction of the normal along 1 km by PROJ is the curvature."""
    geod = pyproj.Geod(ellps="WGS84")
    meridian, prime_vertical = wgs84.curvatures(np.radians(latitude_deg))
    _, north, _ = geod.fwd(10.0, latitude_deg, 0.0, 500.0)
    _, south, _ = geod.fwd(10.0, latitude_deg, 180.0, 500.0)
    assert np.radians(north - south) / 1000.0 == pytest.approx(meridian, rel=1e-6)
    east, _, _ = geod.fwd(10.0, latitude_deg, 90.0, 500.0)
    turned = np.radians(east - 10.0) * np.cos(np.radians(latitude_deg))
    assert turned / 500.0 == pytest.approx(prime_vertical, rel=1e-6)
