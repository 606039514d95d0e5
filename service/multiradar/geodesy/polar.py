"""Slant range, azimuth and elevation of geodetic positions."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.geodesy.wgs84 import enu_rotation, geodetic_to_ecef


def slant_range_azimuth(
    site: tuple[float, float, float],
    latitude_rad: ArrayLike,
    longitude_rad: ArrayLike,
    height_m: ArrayLike,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return slant range, azimuth and elevation of positions relative to a radar.

    Parameters
    ----------
    site : (latitude_rad, longitude_rad, height_m)
        The radar, WGS 84.
    latitude_rad, longitude_rad, height_m : array_like
        The positions, WGS 84, height above the ellipsoid.

    Returns
    -------
    range_m : ndarray
        Length of the straight line, m, without refraction.
    azimuth_rad : ndarray
        Direction of the line on the radar's horizon, clockwise from true north, rad, in [0, 2π).
    elevation_rad : ndarray
        Angle of the line above the radar's horizon, rad.

    Notes
    -----
    Reference implementation by ECEF coordinates, without a plane; the kernels are tested against it
    and against PROJ.
    """
    rotation = enu_rotation(site[0], site[1])
    line = geodetic_to_ecef(latitude_rad, longitude_rad, height_m) - geodetic_to_ecef(*site)
    east, north, up = np.moveaxis(line @ rotation.T, -1, 0)
    ground = np.hypot(east, north)
    azimuth = np.mod(np.arctan2(east, north), 2.0 * np.pi)
    # np.mod of a tiny negative number rounds to 2π itself.
    azimuth = np.where(azimuth >= 2.0 * np.pi, 0.0, azimuth)
    return np.hypot(ground, up), azimuth, np.arctan2(up, ground)
