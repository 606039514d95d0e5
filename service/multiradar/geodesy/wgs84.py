"""The WGS 84 ellipsoid: constants, Earth-centred coordinates and local frames.

Earth-centred Earth-fixed (ECEF) axes: x towards (0° N, 0° E), y towards (0° N, 90° E), z towards
the north pole. Longitude is positive towards the east, latitude towards the north. Local frames
are ordered (east, north, up).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Equatorial radius, m. NGA.STND.0036_1.0.0_WGS84 (2014), table 3.1.
SEMI_MAJOR_AXIS_M = 6_378_137.0
#: Flattening, 1. Same source, table 3.1: 1 / 298.257 223 563.
FLATTENING = 1.0 / 298.257_223_563
#: Polar radius, m. Derived: a (1 − f).
SEMI_MINOR_AXIS_M = SEMI_MAJOR_AXIS_M * (1.0 - FLATTENING)
#: Square of the first eccentricity, 1. Derived: f (2 − f).
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)

# Each of Bowring's iterations gains about five digits near the surface: three reach rounding.
_BOWRING_ROUNDS = 3


def geodetic_to_ecef(
    latitude_rad: ArrayLike, longitude_rad: ArrayLike, height_m: ArrayLike
) -> NDArray[np.float64]:
    """Convert geodetic coordinates to Earth-centred ones.

    Parameters
    ----------
    latitude_rad, longitude_rad : array_like
        Geodetic WGS 84 position, rad.
    height_m : array_like
        Height above the ellipsoid, m. The three broadcast against each other.

    Returns
    -------
    (..., 3) ndarray
        ECEF coordinates, m.
    """
    latitude, longitude, height = np.broadcast_arrays(latitude_rad, longitude_rad, height_m)
    sine = np.sin(latitude)
    normal_radius = SEMI_MAJOR_AXIS_M / np.sqrt(1.0 - ECCENTRICITY_SQUARED * sine**2)
    from_axis = (normal_radius + height) * np.cos(latitude)
    return np.stack(
        [
            from_axis * np.cos(longitude),
            from_axis * np.sin(longitude),
            (normal_radius * (1.0 - ECCENTRICITY_SQUARED) + height) * sine,
        ],
        axis=-1,
    )


def ecef_to_geodetic(
    position_m: ArrayLike,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Convert Earth-centred coordinates to geodetic ones.

    Parameters
    ----------
    position_m : (..., 3) array_like
        ECEF coordinates, m.

    Returns
    -------
    latitude_rad, longitude_rad, height_m : (...) ndarray
        Geodetic WGS 84 position, rad, and height above the ellipsoid, m. On the polar axis the
        longitude is 0.

    Notes
    -----
    Bowring's iteration on the parametric latitude. Within 100 km of the surface the error is that
    of rounding (below a micrometre); near the centre of the Earth it does not converge.

    References
    ----------
    B. R. Bowring, "Transformation from spatial to geographical coordinates", Survey Review 23
    (1976) 323-327, doi:10.1179/sre.1976.23.181.323.
    """
    position = np.asarray(position_m, np.float64)
    x, y, z = position[..., 0], position[..., 1], position[..., 2]
    from_axis = np.hypot(x, y)
    axis_ratio = SEMI_MINOR_AXIS_M / SEMI_MAJOR_AXIS_M
    second_eccentricity_squared = ECCENTRICITY_SQUARED / (1.0 - ECCENTRICITY_SQUARED)
    parametric = np.arctan2(z, from_axis * axis_ratio)
    latitude = parametric
    for _ in range(_BOWRING_ROUNDS):
        latitude = np.arctan2(
            z + second_eccentricity_squared * SEMI_MINOR_AXIS_M * np.sin(parametric) ** 3,
            from_axis - ECCENTRICITY_SQUARED * SEMI_MAJOR_AXIS_M * np.cos(parametric) ** 3,
        )
        parametric = np.arctan2(axis_ratio * np.sin(latitude), np.cos(latitude))
    sine = np.sin(latitude)
    # This form of the height loses no digits at the poles, where p / cos(latitude) − N does.
    height = (
        from_axis * np.cos(latitude)
        + z * sine
        - SEMI_MAJOR_AXIS_M * np.sqrt(1.0 - ECCENTRICITY_SQUARED * sine**2)
    )
    return latitude, np.arctan2(y, x), height


def enu_rotation(latitude_rad: ArrayLike, longitude_rad: ArrayLike) -> NDArray[np.float64]:
    """Return the rotation from Earth-centred axes to the local east, north and up.

    Parameters
    ----------
    latitude_rad, longitude_rad : array_like
        Geodetic position of the local frame, rad.

    Returns
    -------
    (..., 3, 3) ndarray
        Rows are the unit vectors east, north and up in ECEF axes.
    """
    latitude, longitude = np.broadcast_arrays(
        np.asarray(latitude_rad, np.float64), np.asarray(longitude_rad, np.float64)
    )
    sin_lat, cos_lat = np.sin(latitude), np.cos(latitude)
    sin_lon, cos_lon = np.sin(longitude), np.cos(longitude)
    rotation = np.empty((*latitude.shape, 3, 3))
    rotation[..., 0, 0], rotation[..., 0, 1], rotation[..., 0, 2] = -sin_lon, cos_lon, 0.0
    rotation[..., 1, 0], rotation[..., 1, 1] = -sin_lat * cos_lon, -sin_lat * sin_lon
    rotation[..., 2, 0], rotation[..., 2, 1] = cos_lat * cos_lon, cos_lat * sin_lon
    rotation[..., 1, 2], rotation[..., 2, 2] = cos_lat, sin_lat
    return rotation


def rotated(rotation: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return vectors in other axes.

    Parameters
    ----------
    rotation : (..., k, 3) float64
        Rows are unit vectors.
    vectors : (..., 3) float64
        Broadcast with it.

    Returns
    -------
    (..., k) float64
        The components along the rows. The sums have one order on every processor, other than
        those of a matrix product, which determines the last bits of all output.
    """
    turned: NDArray[np.float64] = np.einsum("...ij,...j->...i", rotation, vectors)
    return turned


def curvatures(latitude_rad: float) -> tuple[float, float]:
    """Return the curvatures of the ellipsoid along the meridian and across it.

    Parameters
    ----------
    latitude_rad : float
        Geodetic latitude, rad.

    Returns
    -------
    meridian_per_m, prime_vertical_per_m : float
        1/M and 1/N, 1/m.
    """
    root = float(np.sqrt(1.0 - ECCENTRICITY_SQUARED * np.sin(latitude_rad) ** 2))
    meridian = root**3 / (SEMI_MAJOR_AXIS_M * (1.0 - ECCENTRICITY_SQUARED))
    return meridian, root / SEMI_MAJOR_AXIS_M
