"""Slant range, azimuth and elevation of geodetic positions."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.geodesy.wgs84 import (
    SEMI_MAJOR_AXIS_M,
    ecef_to_geodetic,
    enu_rotation,
    geodetic_to_ecef,
    rotated,
)

# The error falls to a hundredth with each step, from some tens of metres.
_ELEVATION_STEPS = 4


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
    east, north, up = np.moveaxis(rotated(rotation, line), -1, 0)
    ground = np.hypot(east, north)
    azimuth = np.mod(np.arctan2(east, north), 2.0 * np.pi)
    # np.mod of a tiny negative number rounds to 2π itself.
    azimuth = np.where(azimuth >= 2.0 * np.pi, 0.0, azimuth)
    return np.hypot(ground, up), azimuth, np.arctan2(up, ground)


def polar_to_geodetic(
    site: tuple[float, float, float],
    range_m: ArrayLike,
    azimuth_rad: ArrayLike,
    height_m: ArrayLike,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the positions of radar plots: the inverse of `slant_range_azimuth`.

    Parameters
    ----------
    site : (latitude_rad, longitude_rad, height_m)
        The radar, WGS 84.
    range_m, azimuth_rad, height_m : (n,) array_like
        Slant ranges, m, azimuths, rad, and heights of the aircraft above the ellipsoid, m.

    Returns
    -------
    latitude_rad, longitude_rad : (n,) ndarray
        The positions; NaN where the range is shorter than the difference of heights.

    Notes
    -----
    The elevation is found by Newton's method, from that on a sphere; for the display of many plots
    at once. Filters use the kernels.
    """
    range_m, azimuth, height = np.broadcast_arrays(
        *(np.asarray(one, np.float64) for one in (range_m, azimuth_rad, height_m))
    )
    origin, rotation = geodetic_to_ecef(*site), enu_rotation(site[0], site[1])
    near, far = SEMI_MAJOR_AXIS_M + site[2], SEMI_MAJOR_AXIS_M + height
    with np.errstate(invalid="ignore", divide="ignore"):
        sine = (far**2 - near**2 - range_m**2) / (2.0 * near * range_m)
        sine = np.where(np.abs(sine) <= 1.0, sine, np.nan)
        for _ in range(_ELEVATION_STEPS):
            cosine = np.sqrt(np.maximum(1.0 - sine**2, 0.0))
            line = np.stack([cosine * np.sin(azimuth), cosine * np.cos(azimuth), sine], axis=-1)
            latitude, longitude, found = ecef_to_geodetic(
                origin + rotated(rotation.T, range_m[..., None] * line)
            )
            sine = np.clip(sine + (height - found) / range_m, -1.0, 1.0)
    return latitude, longitude
