"""Whatever the places: there and back is where it began."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from multiradar.geodesy import _kernels as kernels
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.geodesy.wgs84 import ecef_to_geodetic, geodetic_to_ecef

latitudes = st.floats(-1.57, 1.57)
longitudes = st.floats(-3.14, 3.14)
heights = st.floats(-1_000.0, 40_000.0)
plane_metres = st.floats(-2e6, 2e6)


@given(latitudes, longitudes, heights)
def test_ecef_round_trip_is_within_a_micrometre(
    latitude: float, longitude: float, height: float
) -> None:
    back = ecef_to_geodetic(geodetic_to_ecef(latitude, longitude, height))
    assert abs(back[0] - latitude) * 6.4e6 < 1e-6
    assert abs(back[1] - longitude) * 6.4e6 * math.cos(latitude) < 1e-6
    assert abs(back[2] - height) < 1e-6


@given(latitudes, longitudes, plane_metres, plane_metres)
def test_plane_round_trip_is_within_a_micrometre(
    latitude: float, longitude: float, east: float, north: float
) -> None:
    plane = SystemPlane(latitude, longitude)
    back = plane.to_plane(*plane.to_geodetic(east, north))
    assert math.hypot(back[0] - east, back[1] - north) < 1e-6
    parameters = plane.parameters
    again = kernels.geodetic_to_plane(
        parameters, *kernels.plane_to_geodetic(parameters, east, north)
    )
    assert math.hypot(again[0] - east, again[1] - north) < 1e-6


@settings(max_examples=300)
@given(
    st.tuples(latitudes, longitudes),
    st.tuples(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.floats(-500.0, 3_000.0)),
    st.tuples(st.floats(2_000.0, 450_000.0), st.floats(0.0, 6.283)),
    st.floats(-500.0, 20_000.0),
)
def test_locate_is_the_inverse_of_predict(
    centre: tuple[float, float],
    site_offset: tuple[float, float, float],
    plot: tuple[float, float],
    height: float,
) -> None:
    """Any range and azimuth with a solution is reproduced by its own foot."""
    latitude, longitude = centre
    off_latitude, off_longitude, site_height = site_offset
    slant, azimuth = plot
    plane = kernels.plane_parameters(latitude, longitude)
    site_latitude = max(-1.57, min(1.57, latitude + off_latitude))
    site = kernels.site_parameters(plane, site_latitude, longitude + off_longitude, site_height)
    ok, east, north = kernels.locate_polar(plane, site, slant, azimuth, height)
    assert ok == (slant >= abs(height - site_height))
    if ok:
        found = kernels.predict_polar(plane, site, east, north, height)
        assert abs(found[0] - slant) < 1e-5
        assert abs(math.remainder(found[1] - azimuth, 2 * math.pi)) * found[6] < 1.1e-4


@given(
    latitudes,
    longitudes,
    st.floats(-4e5, 4e5),
    st.floats(-4e5, 4e5),
    heights,
)
def test_local_matrix_is_the_derivative_of_true_displacement(
    latitude: float, longitude: float, east: float, north: float, height: float
) -> None:
    """Two metres along each axis of the plane, compared in the true frame at the aircraft."""
    plane = SystemPlane(latitude, longitude)
    places = plane.to_geodetic(
        east + np.array([0.0, 1.0, -1.0, 0.0, 0.0]), north + np.array([0.0, 0.0, 0.0, 1.0, -1.0])
    )
    points = geodetic_to_ecef(*places, height)
    up = geodetic_to_ecef(places[0][0], places[1][0], height + 1.0) - points[0]
    eastwards = np.cross([0.0, 0.0, 1.0], up)
    eastwards /= np.linalg.norm(eastwards)
    northwards = np.cross(up, eastwards)
    steps = np.stack([(points[1] - points[2]) / 2.0, (points[3] - points[4]) / 2.0], axis=-1)
    expected = np.stack([eastwards, northwards]) @ steps
    np.testing.assert_allclose(plane.local_matrix(east, north, height), expected, atol=1e-6)
