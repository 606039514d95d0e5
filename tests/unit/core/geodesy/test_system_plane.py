"""The system plane against PROJ, and its limits."""

import dataclasses

import numpy as np
import pyproj
import pytest

from multiradar.errors import ConfigurationError, OutsidePlaneError
from multiradar.geodesy.system_plane import SystemPlane
from support.references.oracle import orthographic

CENTRES = [(56.0, 61.0), (-12.0, -77.0), (0.0, 180.0), (78.0, 15.0)]


def plane_at(centre_deg: tuple[float, float]) -> SystemPlane:
    return SystemPlane(*np.radians(centre_deg).tolist())


@pytest.mark.parametrize("centre", CENTRES)
def test_plane_is_proj_s_orthographic_projection(centre: tuple[float, float]) -> None:
    rng = np.random.default_rng(1)
    latitude = np.clip(centre[0] + rng.uniform(-9, 9, 300), -90, 90)
    longitude = centre[1] + rng.uniform(-9, 9, 300)
    expected = np.stack(orthographic(centre)(longitude, latitude))
    plane = plane_at(centre)
    east, north = plane.to_plane(np.radians(latitude), np.radians(longitude))
    np.testing.assert_allclose(np.stack([east, north]), expected, rtol=0, atol=1e-6)
    back = plane.to_geodetic(east, north)
    np.testing.assert_allclose(back[0], np.radians(latitude), rtol=0, atol=1e-13)
    turn = np.angle(np.exp(1j * (back[1] - np.radians(longitude))))
    np.testing.assert_allclose(turn * np.cos(back[0]), 0.0, rtol=0, atol=1e-13)


def test_east_and_north_are_not_swapped() -> None:
    east, north = plane_at((56.0, 61.0)).to_plane(np.radians(56.5), np.radians(63.0))
    # 2° of longitude at 56.5° N are 123 km, half a degree of latitude 56 km.
    assert east == pytest.approx(123e3, rel=0.01)
    assert north == pytest.approx(57.4e3, rel=0.02)


def test_speed_and_heading_are_those_of_the_geodesic_flown() -> None:
    """Ten seconds in the plane 400 km from the centre, measured with PROJ on the ground."""
    plane = plane_at((56.0, 61.0))
    east, north = 350_000.0, -200_000.0
    speed, heading = plane.ground_velocity(east, north, 190.0, -120.0)
    latitude, longitude = plane.to_geodetic(
        [east - 950.0, east + 950.0], [north + 600.0, north - 600.0]
    )
    geod = pyproj.Geod(ellps="WGS84")
    ends = np.degrees([longitude, latitude])
    azimuth, _, distance = geod.inv(ends[0, 0], ends[1, 0], ends[0, 1], ends[1, 1])
    assert speed == pytest.approx(distance / 10.0, rel=1e-6)
    # The azimuth at the middle of the path is that at its start plus half the convergence.
    _, back, _ = geod.inv(ends[0, 0], ends[1, 0], ends[0, 1], ends[1, 1])
    middle = (azimuth + np.mod(back + 180.0, 360.0)) / 2.0
    assert np.degrees(heading) == pytest.approx(middle, abs=1e-4)
    # The plane shortens radial distances by 0.2 % there.
    assert speed / np.hypot(190.0, 120.0) == pytest.approx(1.002, abs=1e-4)


def test_an_aircraft_moves_faster_than_its_foot() -> None:
    plane = plane_at((56.0, 61.0))
    low, _ = plane.ground_velocity(3e4, 8e4, -100.0, 200.0)
    high, _ = plane.ground_velocity(3e4, 8e4, -100.0, 200.0, 12_000.0)
    assert high / low == pytest.approx(1.0 + 12_000.0 / 6.38e6, rel=2e-5)


def test_heading_is_clockwise_from_north_in_a_full_turn() -> None:
    plane = plane_at((56.0, 61.0))
    _, heading = plane.ground_velocity(0.0, 0.0, [0.0, 5.0, 0.0, -5.0, 0.0], [5.0, 0.0, -5.0, 0, 0])
    np.testing.assert_allclose(np.degrees(heading), [0, 90, 180, 270, 0], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    "place", [(5e6, 3e6), (7e6, 0.0), (np.nan, 0.0), (np.inf, 0.0), (0.0, -np.inf)]
)
def test_a_foot_outside_the_plane_is_rejected_with_its_coordinates(
    place: tuple[float, float],
) -> None:
    plane = plane_at((56.0, 61.0))
    with pytest.raises(OutsidePlaneError, match="within 60 degrees") as caught:
        plane.to_geodetic([0.0, place[0]], [0.0, place[1]])
    np.testing.assert_array_equal(caught.value.position, place)
    with pytest.raises(OutsidePlaneError):
        plane.ground_velocity(*place, 1.0, 1.0)


@pytest.mark.parametrize("place", [(-60.0, 61.0), (56.0, -119.0), (np.nan, 0.0), (0.0, np.nan)])
def test_a_position_outside_the_plane_is_rejected(place: tuple[float, float]) -> None:
    with pytest.raises(OutsidePlaneError):
        plane_at((56.0, 61.0)).to_plane(np.radians(place[0]), np.radians(place[1]))


@pytest.mark.parametrize("centre", [(2.0, 0.0), (0.0, 4.0), (np.nan, 0.0), (0.0, np.inf)])
def test_a_centre_off_the_earth_is_rejected(centre: tuple[float, float]) -> None:
    with pytest.raises(ConfigurationError, match="expected a latitude"):
        SystemPlane(*centre)


def test_the_plane_of_sensors_lies_in_their_middle_across_the_date_line() -> None:
    latitude = np.radians([60.0, 60.0, np.nan])
    longitude = np.radians([179.0, -177.0, np.nan])
    plane = SystemPlane.for_sensors(latitude, longitude)
    assert np.degrees(plane.longitude_rad) == pytest.approx(-179.0, abs=1e-9)
    assert np.degrees(plane.latitude_rad) == pytest.approx(60.0, abs=0.1)


def test_sensors_around_the_earth_are_rejected() -> None:
    with pytest.raises(ConfigurationError, match="no sensor has a site"):
        SystemPlane.for_sensors([np.nan], [np.nan])
    with pytest.raises(ConfigurationError, match="spread around the Earth"):
        SystemPlane.for_sensors([0.0, 0.0], [0.0, np.pi])
    with pytest.raises(OutsidePlaneError):
        SystemPlane.for_sensors(np.zeros(4), np.radians([0.0, 0.0, 0.0, 90.0]))


def test_a_plane_cannot_be_changed() -> None:
    plane = plane_at((56.0, 61.0))
    with pytest.raises(ValueError, match="read-only"):
        plane.parameters[0] = 0.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        plane.latitude_rad = 0.0  # type: ignore[misc]
    assert plane == plane_at((56.0, 61.0))


def test_contains_reports_points_outside_the_plane() -> None:
    """The plane ends at 60°: 5 517 km of it in every direction."""
    plane = SystemPlane(np.radians(50.0), np.radians(15.0))
    east_m = np.array([0.0, 5.4e6, 5.6e6, -5.6e6, 7e6, np.nan, np.inf])
    found = plane.contains(east_m, np.zeros(7))
    assert found.tolist() == [True, True, False, False, False, False, False]
    plane.to_geodetic(east_m[found], np.zeros(2))
    north = np.radians([80.0, 90.0, -9.9, -10.1, np.nan])
    held = plane.contains_geodetic(north, np.radians(15.0))
    assert held.tolist() == [True, True, True, False, False]
    plane.to_plane(north[held], np.radians(15.0))
