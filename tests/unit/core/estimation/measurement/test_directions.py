"""Elevations of the filters against the plain geodesy of lines of sight."""

import numpy as np
import pytest

from multiradar.estimation.filters.height._height_kernels import slant_of_direction
from multiradar.estimation.measurement._kernels import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
    bias_column,
    expected_measurement,
    locate_measurement,
)
from multiradar.estimation.measurement.kinds import KIND_DIRECTION
from multiradar.geodesy._kernels import site_parameters
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.geodesy.system_plane import SystemPlane

PLANE = SystemPlane(np.radians(50.0), np.radians(15.0))
PARAMETERS = np.array(PLANE.parameters)
SIGMA = 0.003


def sine(site: tuple[float, float, float], east: float, north: float, height: float) -> float:
    elevation = slant_range_azimuth(site, *PLANE.to_geodetic(east, north), height)[2]
    return float(np.sin(elevation))


@pytest.mark.parametrize("distance_m", [15e3, 100e3, 300e3])
def test_elevations_are_those_over_the_ellipsoid(distance_m: float) -> None:
    """At 100 km the curvature of the Earth is 0.8 km, half a degree."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        latitude, longitude = np.radians(np.array([50.0, 15.0]) + rng.uniform(-1.0, 1.0, 2))
        base, height = rng.uniform(0.0, 5e3), rng.uniform(500.0, 12e3)
        site = float(latitude), float(longitude), float(base)
        course = rng.uniform(0.0, 2.0 * np.pi)
        east, north = PLANE.to_plane(*site[:2])
        east, north = east + distance_m * np.sin(course), north + distance_m * np.cos(course)
        parameters = site_parameters(PARAMETERS, *site)
        noise = np.array([SIGMA**2, 1e-6, 0.0, base])
        found, azimuth, _, h, w = expected_measurement(
            KIND_DIRECTION, PARAMETERS, parameters, noise, east, north, height, 0.0
        )
        slant, true_azimuth, elevation = slant_range_azimuth(
            site, *PLANE.to_geodetic(east, north), height
        )
        # The error of the sphere is 4 µrad at 300 km, a thousandth of the noise.
        assert np.arcsin(found) == pytest.approx(float(elevation), abs=5e-6)
        assert azimuth % (2.0 * np.pi) == pytest.approx(float(true_azimuth), abs=1e-9)
        by_east = sine(site, east + 10.0, north, height) - sine(site, east - 10.0, north, height)
        by_north = sine(site, east, north + 10.0, height) - sine(site, east, north - 10.0, height)
        # Over 10 km that leaves 30 µrad.
        assert h[:2] == pytest.approx([by_east / 20.0, by_north / 20.0], abs=3e-9)
        assert w[0] == pytest.approx((np.cos(elevation) * SIGMA) ** 2, rel=1e-3)
        steeper = sine(site, east, north, height + 10.0) - sine(site, east, north, height - 10.0)
        with_height = expected_measurement(
            KIND_DIRECTION, PARAMETERS, parameters, 0.0 * noise, east, north, height, 100.0**2
        )[4][0]
        assert np.sqrt(with_height) == pytest.approx(100.0 * steeper / 20.0, rel=0.01)
        if height - base > 2e3:
            # On one sphere for all directions, whose radius is off by a third of a per cent; nearly
            # level sights leave the distance open.
            assert slant_of_direction(found, height - base) == pytest.approx(float(slant), rel=0.02)


def test_an_elevation_has_no_bias_of_its_own() -> None:
    site = np.zeros(15)
    for parameter, expected in (
        (PARAMETER_RANGE_OFFSET, (0.0, 0.0)),
        (PARAMETER_RANGE_GAIN, (0.0, 0.0)),
        (PARAMETER_AZIMUTH_OFFSET, (0.0, 1.0)),
        (PARAMETER_TIME_OFFSET, (-0.25, -0.5)),
    ):
        found = bias_column(KIND_DIRECTION, parameter, site, 0.1, 1.0, 0.25, 0.5)
        assert found[0] == expected[0]
        if parameter in (PARAMETER_AZIMUTH_OFFSET, PARAMETER_TIME_OFFSET):
            assert found[1] == expected[1]


def test_a_direction_locates_nothing() -> None:
    """An elevation alone is no position; impossible elevations have no distance."""
    assert not locate_measurement(KIND_DIRECTION, PARAMETERS, np.zeros(15), 0.1, 1.0, 9e3)[0]
    assert not slant_of_direction(0.5, -1000.0) > 0.0
    assert np.isnan(slant_of_direction(-0.001, -1000.0))
