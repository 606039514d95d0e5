"""The stereographic plane of Cartesian coordinates in other systems.

The ellipsoid is mapped to a sphere and the sphere to a plane, both conformally; the scale is one at
the centre. (Aircraft are estimated in a different plane: `system_plane`.)
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ConfigurationError
from multiradar.geodesy.wgs84 import ECCENTRICITY_SQUARED, curvatures

Floats = NDArray[np.float64]

_ECCENTRICITY = float(np.sqrt(ECCENTRICITY_SQUARED))
# Step of the derivative, rad: 6 m.
_STEP_RAD = 1e-6


@dataclass(frozen=True)
class StereographicPlane:
    """An oblique stereographic plane of the WGS 84 ellipsoid.

    Parameters
    ----------
    latitude_rad, longitude_rad : float
        Geodetic position of the centre, where the scale is one; not a pole.

    Raises
    ------
    ConfigurationError
        If the centre is not a position, or within a degree of a pole.

    References
    ----------
    IOGP publication 373-7-2 (EPSG guidance note 7-2), "Oblique Stereographic", method 9809; the
    derivative is the project's own.
    """

    latitude_rad: float
    longitude_rad: float
    _sphere: tuple[float, float, float, float] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # Written so that NaN fails.
        if not (abs(self.latitude_rad) <= np.radians(89.0) and abs(self.longitude_rad) <= np.pi):
            raise ConfigurationError(
                "centre of the stereographic plane: expected a latitude in [-89, 89] and a "
                "longitude in [-180, 180] degrees, was "
                f"({np.degrees(self.latitude_rad):g}, {np.degrees(self.longitude_rad):g})"
            )
        meridian, across = curvatures(self.latitude_rad)
        sine, cosine = float(np.sin(self.latitude_rad)), np.cos(self.latitude_rad)
        exponent = np.sqrt(1.0 + ECCENTRICITY_SQUARED * cosine**4 / (1.0 - ECCENTRICITY_SQUARED))
        first = float(_ratio(np.asarray(self.latitude_rad)) ** exponent)
        sine_before = (first - 1.0) / (first + 1.0)
        factor = (exponent + sine) * (1.0 - sine_before)
        factor /= (exponent - sine) * (1.0 + sine_before)
        second = factor * first
        centre = np.arcsin((second - 1.0) / (second + 1.0))
        sphere = 1.0 / np.sqrt(meridian * across), exponent, factor, centre
        object.__setattr__(self, "_sphere", tuple(float(one) for one in sphere))

    def to_plane(self, latitude_rad: ArrayLike, longitude_rad: ArrayLike) -> tuple[Floats, Floats]:
        """Return x (east at the centre) and y (north there), m, of geodetic positions, rad."""
        radius, exponent, factor, centre = self._sphere
        power = factor * _ratio(np.asarray(latitude_rad, np.float64)) ** exponent
        on_sphere = np.arcsin((power - 1.0) / (power + 1.0))
        difference = np.asarray(longitude_rad, np.float64) - self.longitude_rad
        difference = exponent * (np.mod(difference + np.pi, 2.0 * np.pi) - np.pi)
        sine, cosine = np.sin(on_sphere), np.cos(on_sphere)
        # Opposite the centre this is zero: the point is infinitely far.
        with np.errstate(divide="ignore", invalid="ignore"):
            stretch = (
                2.0
                * radius
                / (1.0 + sine * np.sin(centre) + cosine * np.cos(centre) * np.cos(difference))
            )
            x = stretch * cosine * np.sin(difference)
            y = stretch * (sine * np.cos(centre) - cosine * np.sin(centre) * np.cos(difference))
        return x, y

    def matrix(self, latitude_rad: ArrayLike, longitude_rad: ArrayLike) -> Floats:
        """Return d(x, y)/d(true east, true north) at geodetic positions, (..., 2, 2)."""
        latitude = np.minimum(latitude_rad, np.pi / 2.0 - _STEP_RAD)
        here = self.to_plane(latitude, longitude_rad)
        there = self.to_plane(latitude + _STEP_RAD, longitude_rad)
        root = np.sqrt(1.0 - ECCENTRICITY_SQUARED * np.sin(latitude) ** 2)
        meridian_per_m = curvatures(0.0)[0] * root**3
        step_m = _STEP_RAD / meridian_per_m
        x_by_north, y_by_north = (there[0] - here[0]) / step_m, (there[1] - here[1]) / step_m
        # Conformal: east is perpendicular to north in the plane, too.
        return np.stack(
            [
                np.stack([y_by_north, x_by_north], axis=-1),
                np.stack([-x_by_north, y_by_north], axis=-1),
            ],
            axis=-2,
        )


def _ratio(latitude: Floats) -> Floats:
    # (1 + sin φ) / (1 - sin φ), corrected for the flattening; finite at the poles by rounding.
    sine = np.sin(latitude)
    flat = (1.0 - _ECCENTRICITY * sine) / (1.0 + _ECCENTRICITY * sine)
    return np.asarray(np.tan(np.pi / 4.0 + 0.5 * latitude) ** 2 * flat**_ECCENTRICITY)
