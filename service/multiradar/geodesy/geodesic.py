"""Direct geodesic problem: position and heading after a distance flown straight."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.geodesy.wgs84 import ECCENTRICITY_SQUARED, SEMI_MAJOR_AXIS_M, enu_rotation

Floats = NDArray[np.float64]

#: Mean radius of the Earth, m (IUGG); good to 0.3 %, 20 m of height at 300 km.
EARTH_RADIUS_M = 6_371_008.8


class PositionAndHeading(NamedTuple):
    """Latitude, longitude and heading, rad."""

    latitude_rad: Floats
    longitude_rad: Floats
    heading_rad: Floats


def direct_geodesic(
    latitude_rad: ArrayLike, longitude_rad: ArrayLike, heading_rad: ArrayLike, distance_m: ArrayLike
) -> PositionAndHeading:
    """Return position and heading after a distance along the geodesic.

    Parameters
    ----------
    latitude_rad, longitude_rad : (n,) array_like
        Geodetic WGS 84 position, poles included.
    heading_rad : (n,) array_like
        Heading, clockwise from true north.
    distance_m : (n,) array_like
        Distance over ground.

    Returns
    -------
    Way
        End position, the longitude in [-π, π], and the heading there, in [0, 2π).

    Notes
    -----
    The vertical moves along a great circle at the rate given by the curvatures at the start:
    accurate to a metre up to 30 km.

    References
    ----------
    The project's own: direct problem of geodesy, to second order.
    """
    latitude, longitude, heading, distance = np.broadcast_arrays(
        *(np.asarray(one, np.float64) for one in (latitude_rad, longitude_rad, heading_rad)),
        np.asarray(distance_m, np.float64),
    )
    meridian_m, across_m = _radii(latitude)
    # Azimuth of the motion of the vertical: it rotates faster along the meridian than across it.
    to_east, to_north = np.sin(heading) / across_m, np.cos(heading) / meridian_m
    angle = (distance * np.hypot(to_east, to_north))[..., None]
    azimuth = np.arctan2(to_east, to_north)
    rotation = enu_rotation(latitude, longitude)
    forward = (
        np.sin(azimuth)[..., None] * rotation[..., 0, :]
        + np.cos(azimuth)[..., None] * rotation[..., 1, :]
    )
    up = rotation[..., 2, :]
    there = up * np.cos(angle) + forward * np.sin(angle)
    onward = forward * np.cos(angle) - up * np.sin(angle)
    end_latitude = np.arctan2(there[..., 2], np.hypot(there[..., 0], there[..., 1]))
    end_longitude = np.arctan2(there[..., 1], there[..., 0])
    level = np.einsum("...ij,...j->...i", enu_rotation(end_latitude, end_longitude), onward)
    meridian_m, across_m = _radii(end_latitude)
    end_heading = np.arctan2(level[..., 0] * across_m, level[..., 1] * meridian_m)
    end_heading = np.mod(end_heading, 2.0 * np.pi)
    # The remainder of a tiny negative angle rounds to 2π itself.
    end_heading = np.where(end_heading >= 2.0 * np.pi, 0.0, end_heading)
    return PositionAndHeading(end_latitude, end_longitude, end_heading)


def _radii(latitude_rad: Floats) -> tuple[Floats, Floats]:
    # Radii of curvature along the meridian and across it, m.
    root = np.sqrt(1.0 - ECCENTRICITY_SQUARED * np.sin(latitude_rad) ** 2)
    across_m = SEMI_MAJOR_AXIS_M / root
    return np.asarray(across_m * (1.0 - ECCENTRICITY_SQUARED) / root**2), np.asarray(across_m)
