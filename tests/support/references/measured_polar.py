"""A radar plot with a height as a measurement of the extended filter."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ShapeError
from multiradar.estimation.array_checks import component_array
from multiradar.estimation.gaussian import require_covariance
from multiradar.estimation.measurement.angles import wrapped
from multiradar.estimation.measurement.cone_of_silence import outside_cone
from multiradar.estimation.motion.axes import Floats


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredPolar:
    """Slant range, azimuth, and elevation or height.

    Attributes
    ----------
    site_m : (3,) array
        East, north and up of the radar, m.
    noise : (3, 3) array
        Covariance of the error: m, rad, and rad or m.
    third : str
        `elevation`, the angle above the horizontal plane through the radar, or `height`, the up
        coordinate of the aircraft, such as its reported altitude.

    Raises
    ------
    CovarianceError
        The noise is not a covariance.
    ShapeError
        The site or the noise has another shape, or the third component has another name.

    Notes
    -----
    Azimuth is clockwise from north. In the cone of silence over the radar (`cone_of_silence`)
    the azimuth carries no information and the measurement is not usable.

    References
    ----------
    IMM UrO RAN report (2016), equations (1.5) and (1.13), read in polar form and for three axes;
    the formulas are the project's own, from the geometry of the line of sight.
    """

    site_m: Floats
    noise: Floats
    third: str = "elevation"

    def __post_init__(self) -> None:
        site = np.asarray(self.site_m, np.float64)
        if site.shape != (3,) or not np.isfinite(site).all():
            raise ShapeError("site", "three finite numbers (east, north, up)", site.shape)
        if self.third not in ("elevation", "height"):
            raise ShapeError(f"third component {self.third!r}", "elevation or height", (3,))
        object.__setattr__(self, "site_m", site)
        object.__setattr__(self, "noise", _covariance(self.noise))

    def predict(self, position: Floats) -> Floats:
        """Return slant range (m), azimuth (rad), and elevation (rad) or height (m).

        Parameters
        ----------
        position : (..., 3) ndarray
            East, north and up, m.

        Returns
        -------
        (..., 3) ndarray
            m, rad, and rad or m.

        Raises
        ------
        ShapeError
            If the position has another number of components.

        References
        ----------
        The project's own, from the geometry of the line of sight; the azimuth counts as the course
        K of Vasiliev, Mattis, the projections after equation (5).
        """
        east, north, up, ground = self._line(position)
        is_height = self.third == "height"
        third = up + self.site_m[2] if is_height else np.arctan2(up, ground)
        return np.stack([np.hypot(ground, up), np.arctan2(east, north), third], -1)

    def jacobian(self, position: Floats) -> Floats:
        """Return the derivative by (east, north, up); 0 where an angle is undefined.

        Parameters
        ----------
        position : (..., 3) ndarray
            East, north and up, m.

        Returns
        -------
        (..., 3, 3) ndarray
            Rows for slant range, azimuth and the third component: 1, rad/m, and rad/m or 1.

        Raises
        ------
        ShapeError
            If the position has another number of components.

        References
        ----------
        Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
        Navigation", Wiley 2001, section 10.3: H of the extended Kalman filter, the derivative of
        `predict`.
        """
        east, north, up, ground = self._line(position)
        slant = _or_one(np.hypot(ground, up))
        ground = _or_one(ground)
        zero = np.zeros_like(east)
        by_range = np.stack([east / slant, north / slant, up / slant], -1)
        by_azimuth = np.stack([north / ground**2, -east / ground**2, zero], -1)
        if self.third == "height":
            by_third = np.stack([zero, zero, zero + 1.0], -1)
        else:
            bend = -up / (ground * slant**2)
            by_third = np.stack([bend * east, bend * north, ground / slant**2], -1)
        return np.stack([by_range, by_azimuth, by_third], -2)

    def residual(self, measured: Floats, predicted: Floats) -> Floats:
        """Return the difference, angles wrapped.

        Parameters
        ----------
        measured, predicted : (..., 3) ndarray
            m, rad, and rad or m.

        Returns
        -------
        (..., 3) ndarray
            Their difference, in the same units.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.22): z − C ξ̄.
        """
        result = np.asarray(measured - predicted)
        result[..., 1] = wrapped(result[..., 1])
        return result

    def usable(self, position: Floats) -> NDArray[np.bool_]:
        """Return whether the aircraft is outside the cone of silence.

        Parameters
        ----------
        position : (..., 3) ndarray
            East, north and up, m.

        Returns
        -------
        (...) ndarray of bool
            One for each aircraft.

        Raises
        ------
        ShapeError
            If the position has another number of components.

        References
        ----------
        The project's own: see `multiradar.estimation.measurement.cone_of_silence`.
        """
        _, _, up, ground = self._line(position)
        return np.asarray(outside_cone(ground, up, 0.0) & (ground > 0.0))

    def _line(self, position: ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
        line = component_array(position, "position", 3) - self.site_m
        east, north, up = np.moveaxis(line, -1, 0)
        return east, north, up, np.hypot(east, north)


def _or_one(length: Floats) -> Floats:
    return np.where(length > 0.0, length, 1.0)


def _covariance(noise: ArrayLike) -> Floats:
    values = require_covariance(noise, "measurement noise")
    if values.shape != (3, 3):
        raise ShapeError("measurement noise", "the shape (3, 3)", values.shape)
    return values
