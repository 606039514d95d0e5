"""The direct geodesic problem against PROJ."""

import numpy as np
import pyproj
import pytest

from multiradar.geodesy.geodesic import direct_geodesic


def test_the_direct_geodesic_equals_proj() -> None:
    random = np.random.default_rng(1)
    latitude, longitude = random.uniform(-90, 90, 500), random.uniform(-180, 180, 500)
    heading, distance = random.uniform(0, 360, 500), random.uniform(0, 30_000, 500)
    way = direct_geodesic(
        np.radians(latitude), np.radians(longitude), np.radians(heading), distance
    )
    geod = pyproj.Geod(ellps="WGS84")
    end_longitude, end_latitude, back = geod.fwd(longitude, latitude, heading, distance)
    _, _, apart = geod.inv(
        end_longitude, end_latitude, np.degrees(way.longitude_rad), np.degrees(way.latitude_rad)
    )
    assert np.max(apart) < 1.0
    # Near a pole the heading changes by many degrees per metre.
    far = np.abs(end_latitude) < 89.0
    turn = np.degrees(way.heading_rad) - (np.asarray(back) + 180.0)
    assert np.max(np.abs((turn[far] + 180.0) % 360.0 - 180.0)) < 0.01
    assert ((way.heading_rad >= 0.0) & (way.heading_rad < 2.0 * np.pi)).all()


def test_over_the_pole_and_over_the_antimeridian() -> None:
    way = direct_geodesic(
        np.radians([89.99, 60.0]), np.radians([30.0, 179.99]), [0.0, 0.5 * np.pi], 5e3
    )
    assert np.degrees(way.longitude_rad[0]) == pytest.approx(-150.0)
    assert np.degrees(way.heading_rad[0]) == pytest.approx(180.0)
    # 5 km are 0.0895° of longitude there.
    assert np.degrees(way.longitude_rad[1]) == pytest.approx(-180.0 + 0.0795, abs=2e-4)


def test_distance_zero_returns_the_start() -> None:
    way = direct_geodesic([0.7], [-2.0], [1.2], [0.0])
    assert np.stack(way)[:, 0] == pytest.approx([0.7, -2.0, 1.2])
