"""Slant range, azimuth and elevation against PROJ's topocentric coordinates."""

import numpy as np
import pytest

from multiradar.geodesy.polar import polar_to_geodetic, slant_range_azimuth
from multiradar.geodesy.wgs84 import geodetic_to_ecef
from support.references.oracle import topocentric

SITES = [(56.8, 60.6, 250.0), (-33.9, 151.2, 20.0), (70.0, -179.9, 800.0)]


@pytest.mark.parametrize("site", SITES)
def test_polar_coordinates_are_those_of_proj(site: tuple[float, float, float]) -> None:
    rng = np.random.default_rng(5)
    latitude = site[0] + rng.uniform(-4, 4, 200)
    longitude = site[1] + rng.uniform(-6, 6, 200)
    height = rng.uniform(0, 15_000, 200)
    east, north, up = topocentric(site, latitude, longitude, height)
    slant, azimuth, elevation = slant_range_azimuth(
        (np.radians(site[0]), np.radians(site[1]), site[2]),
        np.radians(latitude),
        np.radians(longitude),
        height,
    )
    ground = np.hypot(east, north)
    np.testing.assert_allclose(slant, np.hypot(ground, up), rtol=0, atol=1e-6)
    turn = np.angle(np.exp(1j * (azimuth - np.arctan2(east, north))))
    np.testing.assert_allclose(turn * ground, 0.0, rtol=0, atol=1e-6)
    np.testing.assert_allclose(slant * np.sin(elevation), up, rtol=0, atol=1e-6)
    assert np.all((azimuth >= 0.0) & (azimuth < 2 * np.pi))


def test_azimuth_is_clockwise_from_north() -> None:
    site = (0.9, 0.5, 0.0)
    _, azimuth, _ = slant_range_azimuth(site, [0.91, 0.9, 0.89, 0.9], [0.5, 0.51, 0.5, 0.49], 100.0)
    expected = np.exp(1j * np.radians([0, 90, 180, 270]))
    np.testing.assert_allclose(np.exp(1j * azimuth), expected, rtol=0, atol=0.01)
    # The line of sight to the east on a parallel starts a little to the north (convergence).
    assert azimuth[1] < np.pi / 2


def test_azimuth_is_never_a_full_turn() -> None:
    # Slightly west of north used to round to 2π.
    _, azimuth, _ = slant_range_azimuth((0.3, 0.0, 0.0), 0.4, -1e-18, 0.0)
    assert azimuth < 2 * np.pi


def test_positions_of_plots_are_found_from_range_azimuth_and_height() -> None:
    rng = np.random.default_rng(5)
    site = (np.radians(47.48), np.radians(8.4), 866.0)
    latitude = site[0] + np.radians(rng.uniform(-3.5, 3.5, 500))
    longitude = site[1] + np.radians(rng.uniform(-5.0, 5.0, 500))
    height = rng.uniform(0.0, 15_000.0, 500)
    range_m, azimuth, _ = slant_range_azimuth(site, latitude, longitude, height)
    found = polar_to_geodetic(site, range_m, azimuth, height)
    apart = geodetic_to_ecef(*found, height) - geodetic_to_ecef(latitude, longitude, height)
    assert np.linalg.norm(apart, axis=1).max() < 0.01


def test_a_range_shorter_than_the_height_has_no_position() -> None:
    found = polar_to_geodetic((0.8, 0.1, 0.0), [5_000.0, 50_000.0], [1.0, 1.0], [9_000.0, 9_000.0])
    assert np.isnan(found[0]).tolist() == [True, False]
