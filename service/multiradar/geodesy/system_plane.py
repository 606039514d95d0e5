"""The system plane: the map projection in which aircraft are estimated.

The plane is the *orthographic* projection of the WGS 84 surface: the plane coordinates (east,
north) of an aircraft are the east and north components, in the local frame at the centre O, of its
foot on the ellipsoid. Nothing is approximated: a foot and a height give the exact position in
space, with one square root and no trigonometry, and so the exact slant range and azimuth at any
radar. Only the scale is distorted far from O: a metre in the plane is 1 / cos(distance / R) metres
on the ground along the direction away from O (0.2 % at 400 km). Speeds, headings and covariances
are therefore converted to true metres at the aircraft before they leave the core.

Signs: east, north and up positive; headings and azimuths clockwise from true north; longitude
positive towards the east.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ConfigurationError, OutsidePlaneError
from multiradar.geodesy import _kernels as kernels
from multiradar.geodesy.wgs84 import (
    ecef_to_geodetic,
    enu_rotation,
    geodetic_to_ecef,
    rotated,
)

#: Largest angle between the verticals at the centre and at a foot, degrees.
ANGLE_MAX_DEG = 60.0


@dataclass(frozen=True, slots=True)
class SystemPlane:
    """An orthographic plane of the WGS 84 surface.

    Parameters
    ----------
    latitude_rad, longitude_rad : float
        Geodetic position of the centre O.

    Attributes
    ----------
    parameters : (9,) float64
        The parameters of the centre for `multiradar.geodesy._kernels`.

    Raises
    ------
    ConfigurationError
        If the centre is not a position on the Earth.

    Notes
    -----
    Valid for feet whose vertical is inclined by at most 60° to that at O (about 6 600 km on the
    ground); the methods raise `OutsidePlaneError` beyond.
    """

    latitude_rad: float
    longitude_rad: float
    parameters: NDArray[np.float64] = field(init=False, repr=False, compare=False)
    _centre: NDArray[np.float64] = field(init=False, repr=False, compare=False)
    _rotation: NDArray[np.float64] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # Written so that NaN fails.
        if not (abs(self.latitude_rad) <= np.pi / 2 and abs(self.longitude_rad) <= np.pi):
            raise ConfigurationError(
                "centre of the system plane: expected a latitude in [−π/2, π/2] and a longitude "
                f"in [−π, π] rad, was ({self.latitude_rad}, {self.longitude_rad})"
            )
        parameters = kernels.plane_parameters(self.latitude_rad, self.longitude_rad)
        parameters.setflags(write=False)
        object.__setattr__(self, "parameters", parameters)
        centre = geodetic_to_ecef(self.latitude_rad, self.longitude_rad, 0.0)
        object.__setattr__(self, "_centre", centre)
        rotation = enu_rotation(self.latitude_rad, self.longitude_rad)
        object.__setattr__(self, "_rotation", rotation)

    @classmethod
    def for_sensors(cls, latitude_rad: ArrayLike, longitude_rad: ArrayLike) -> "SystemPlane":
        """Return the plane centred on the sensors.

        Parameters
        ----------
        latitude_rad, longitude_rad : (m,) array_like
            Sites; a sensor without a site has NaN and is skipped.

        Returns
        -------
        SystemPlane
            Its centre is the direction of the mean of the sites' verticals.

        Raises
        ------
        ConfigurationError
            If no sensor has a site, or the sites are distributed around the Earth.
        OutsidePlaneError
            If a site is outside the plane.
        """
        latitude = np.atleast_1d(np.asarray(latitude_rad, np.float64))
        longitude = np.atleast_1d(np.asarray(longitude_rad, np.float64))
        sited = np.isfinite(latitude) & np.isfinite(longitude)
        if not sited.any():
            raise ConfigurationError("system plane: no sensor has a site")
        mean = enu_rotation(latitude[sited], longitude[sited])[:, 2].mean(axis=0)
        if np.linalg.norm(mean) < np.cos(np.radians(ANGLE_MAX_DEG)):
            raise ConfigurationError(
                "system plane: the sensors are spread around the Earth and do not fit on one "
                "plane; divide them into regions, each with its own service"
            )
        plane = cls(
            float(np.arctan2(mean[2], np.hypot(mean[0], mean[1]))),
            float(np.arctan2(mean[1], mean[0])),
        )
        plane.to_plane(latitude[sited], longitude[sited])
        return plane

    def to_plane(
        self, latitude_rad: ArrayLike, longitude_rad: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the plane coordinates of geodetic positions.

        Parameters
        ----------
        latitude_rad, longitude_rad : array_like
            Geodetic WGS 84 positions.

        Returns
        -------
        east_m, north_m : ndarray
            Coordinates of their feet on the plane, m.

        Raises
        ------
        OutsidePlaneError
            If a position is more than 60° from the centre, or not a number.
        """
        latitude, longitude = np.broadcast_arrays(
            np.asarray(latitude_rad, np.float64), np.asarray(longitude_rad, np.float64)
        )
        cosine = self._cosine(latitude, longitude)
        self._require_inside(cosine, latitude, longitude, "position (rad)")
        line = geodetic_to_ecef(latitude, longitude, 0.0) - self._centre
        foot = rotated(self._rotation, line)
        return foot[..., 0], foot[..., 1]

    def to_geodetic(
        self, east_m: ArrayLike, north_m: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the geodetic positions of plane coordinates.

        Parameters
        ----------
        east_m, north_m : array_like
            Plane coordinates, m.

        Returns
        -------
        latitude_rad, longitude_rad : ndarray
            Geodetic WGS 84 positions; the longitude in [−π, π].

        Raises
        ------
        OutsidePlaneError
            If a foot is more than 60° from the centre, or not a number.
        """
        return self._geodetic(*self._gradient(east_m, north_m))

    # The same of coordinates with half the gradient there.
    def _geodetic(
        self,
        east: NDArray[np.float64],
        north: NDArray[np.float64],
        gradient: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        up = -(self.parameters[kernels.M_EE] * east**2 + self.parameters[kernels.M_NN] * north**2)
        up /= 1.0 + self.parameters[kernels.M_NU] * north + gradient[..., 2]
        latitude, longitude, _ = ecef_to_geodetic(
            self._centre + rotated(self._rotation.T, np.stack([east, north, up], axis=-1))
        )
        return latitude, longitude

    def local_matrix(
        self, east_m: ArrayLike, north_m: ArrayLike, height_m: ArrayLike = 0.0
    ) -> NDArray[np.float64]:
        """Return the matrix that converts displacements in the plane to true ones at the aircraft.

        Parameters
        ----------
        east_m, north_m : array_like
            Plane coordinates of the foot, m.
        height_m : array_like
            Height of the aircraft above the ellipsoid, m.

        Returns
        -------
        (..., 2, 2) ndarray
            d(true east, true north)/d(plane east, plane north). A velocity v becomes T v, a
            covariance P becomes T P Tᵀ.

        Raises
        ------
        OutsidePlaneError
            If a foot is more than 60° from the centre, or not a number.
        """
        east, north, gradient = self._gradient(east_m, north_m)
        length = np.linalg.norm(gradient, axis=-1)
        parameters = self.parameters
        slope_east = -gradient[..., 0] / gradient[..., 2]
        slope_north = -gradient[..., 1] / gradient[..., 2]
        zero = np.zeros_like(slope_east)
        m_nu, m_uu = parameters[kernels.M_NU], parameters[kernels.M_UU]
        rise = (np.asarray(height_m, np.float64) / length)[..., None]
        by_east = np.stack([zero + 1.0, zero, slope_east], axis=-1) + rise * np.stack(
            [zero + parameters[kernels.M_EE], m_nu * slope_east, m_uu * slope_east], axis=-1
        )
        by_north = np.stack([zero, zero + 1.0, slope_north], axis=-1) + rise * np.stack(
            [zero, parameters[kernels.M_NN] + m_nu * slope_north, m_nu + m_uu * slope_north],
            axis=-1,
        )
        latitude, longitude = self._geodetic(east, north, gradient)
        level = enu_rotation(latitude, longitude)[..., :2, :]
        slopes = [rotated(level, rotated(self._rotation.T, slope)) for slope in (by_east, by_north)]
        return np.stack(slopes, axis=-1)

    def ground_velocity(
        self,
        east_m: ArrayLike,
        north_m: ArrayLike,
        velocity_east_mps: ArrayLike,
        velocity_north_mps: ArrayLike,
        height_m: ArrayLike = 0.0,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return speed and heading at the aircraft.

        Parameters
        ----------
        east_m, north_m : array_like
            Plane coordinates of the foot, m.
        velocity_east_mps, velocity_north_mps : array_like
            Velocity on the plane, m/s.
        height_m : array_like
            Height of the aircraft above the ellipsoid, m.

        Returns
        -------
        speed_mps : ndarray
            Horizontal speed at the height of the aircraft, m/s.
        heading_rad : ndarray
            Direction of the horizontal velocity, clockwise from true north *at the aircraft*,
            rad, in [0, 2π); 0 at speed zero.

        Raises
        ------
        OutsidePlaneError
            If a foot is more than 60° from the centre, or not a number.
        """
        velocity = np.stack(np.broadcast_arrays(velocity_east_mps, velocity_north_mps), axis=-1)
        matrix = self.local_matrix(east_m, north_m, height_m)
        true = np.einsum("...ij,...j->...i", matrix, velocity)
        heading = np.mod(np.arctan2(true[..., 0], true[..., 1]), 2.0 * np.pi)
        # np.mod of a tiny negative number rounds to 2π itself.
        heading = np.where(heading >= 2.0 * np.pi, 0.0, heading)
        return np.hypot(true[..., 0], true[..., 1]), heading

    def contains(self, east_m: ArrayLike, north_m: ArrayLike) -> NDArray[np.bool_]:
        """Return which plane coordinates are within the plane.

        Parameters
        ----------
        east_m, north_m : array_like
            Plane coordinates, m; NaN is outside.

        Returns
        -------
        ndarray of bool
            Whether the foot is at most 60° from the centre.
        """
        *_, cosine = self._inclination(east_m, north_m)
        return np.asarray(cosine >= kernels.COSINE_MIN)

    def contains_geodetic(
        self, latitude_rad: ArrayLike, longitude_rad: ArrayLike
    ) -> NDArray[np.bool_]:
        """Return which geodetic positions have a foot within the plane.

        Parameters
        ----------
        latitude_rad, longitude_rad : array_like
            Geodetic WGS 84 positions; NaN is outside.

        Returns
        -------
        ndarray of bool
            Whether the position is at most 60° from the centre.
        """
        return np.asarray(self._cosine(latitude_rad, longitude_rad) >= kernels.COSINE_MIN)

    # Cosine of the angle between the verticals of positions and that of the centre.
    def _cosine(self, latitude_rad: ArrayLike, longitude_rad: ArrayLike) -> NDArray[np.float64]:
        upright = self._rotation[2]
        return rotated(upright[None], enu_rotation(latitude_rad, longitude_rad)[..., 2, :])[..., 0]

    # Broadcast coordinates and half the gradient of the quadric at the foot, (..., 3).
    def _gradient(
        self, east_m: ArrayLike, north_m: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        east, north, gradient, cosine = self._inclination(east_m, north_m)
        self._require_inside(cosine, east, north, "plane coordinates (m)")
        return east, north, gradient

    # The same with the cosine of the angle between the verticals, without a check.
    def _inclination(
        self, east_m: ArrayLike, north_m: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        east, north = np.broadcast_arrays(
            np.asarray(east_m, np.float64), np.asarray(north_m, np.float64)
        )
        m_ee, m_nn, m_uu, m_nu = self.parameters[kernels.M_EE : kernels.M_NU + 1]
        linear = 1.0 + m_nu * north
        constant = m_ee * east**2 + m_nn * north**2
        # Infinite coordinates give inf − inf here; the check below reports them.
        with np.errstate(invalid="ignore"):
            discriminant = np.maximum(linear**2 - m_uu * constant, 0.0)
        upwards = np.sqrt(discriminant)
        with np.errstate(invalid="ignore"):
            up = -constant / (linear + upwards)
            gradient = np.stack([m_ee * east, m_nn * north + m_nu * up, upwards], axis=-1)
            cosine = upwards / np.linalg.norm(gradient, axis=-1)
        return east, north, gradient, cosine

    def _require_inside(
        self,
        cosine: NDArray[np.float64],
        first: NDArray[np.float64],
        second: NDArray[np.float64],
        what: str,
    ) -> None:
        outside = ~(cosine >= kernels.COSINE_MIN)
        if np.any(outside):
            first_outside = int(np.argmax(outside))
            raise OutsidePlaneError(
                what,
                (float(first.flat[first_outside]), float(second.flat[first_outside])),
                (self.latitude_rad, self.longitude_rad),
                ANGLE_MAX_DEG,
            )
