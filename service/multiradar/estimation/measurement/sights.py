"""Sights of an aircraft from a source: azimuth, optionally elevation, optionally range.

Each component present is a measurement of rank one. A missing range is not a number with a large
variance: it adds no information (Nenartovich, Isakov, equation (11)).

Flat axes: east and north, or east, north and up, m. Azimuth is clockwise from north, elevation
above the plane through the source. A sight has the position of its source at that time, so sources
may move.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import PriorError, ShapeError
from multiradar.estimation.array_checks import finite_array
from multiradar.estimation.measurement.angles import wrapped

Floats = NDArray[np.float64]

PLANE, SPACE = 2, 3


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """Measurement of one source at one time; leading axes are aircraft, or runs of a study.

    Attributes
    ----------
    source_m : (2,) or (3,) array
        East and north of the source at that time, m; with up for a sight in space.
    azimuth_rad : (...) array
        Measured azimuth.
    azimuth_sigma_rad : float
        Standard deviation of its error.
    elevation_rad : (...) array, optional
        Measured elevation, in space.
    elevation_sigma_rad : float, optional
        Standard deviation of its error; given with the elevation.
    range_m : (...) array, optional
        Measured range, if any.
    range_sigma_m : float, optional
        Standard deviation of its error; given with the range.

    Raises
    ------
    ShapeError
        If the source does not have two or three coordinates, an angle or range is not finite, an
        elevation is given in the plane, or a component has no standard deviation.
    PriorError
        If a standard deviation is not positive.

    References
    ----------
    Nenartovich, Isakov, equations (1) to (4), for azimuth and range; elevation is the project's
    own.
    """

    source_m: Floats
    azimuth_rad: Floats
    azimuth_sigma_rad: float
    elevation_rad: Floats | None = None
    elevation_sigma_rad: float | None = None
    range_m: Floats | None = None
    range_sigma_m: float | None = None

    def __post_init__(self) -> None:
        source = finite_array(self.source_m, "source")
        if source.shape not in ((PLANE,), (SPACE,)):
            raise ShapeError("source", "two or three coordinates", source.shape)
        if self.elevation_rad is not None and len(source) == PLANE:
            raise ShapeError("source", "three coordinates if an elevation is given", source.shape)
        object.__setattr__(self, "source_m", source)
        for name in ("azimuth", "elevation", "range"):
            unit = "m" if name == "range" else "rad"
            _check_component(self, f"{name}_{unit}", f"{name}_sigma_{unit}")

    @property
    def dimensions(self) -> int:
        """2 in the plane, 3 in space.

        References
        ----------
        The project's own: the paper describes the plane.
        """
        return len(self.source_m)

    def residuals(self, position_m: Floats) -> tuple[Floats, Floats, Floats]:
        """Return measured minus expected components for a position.

        Parameters
        ----------
        position_m : (..., d) array
            Assumed position of the aircraft, m.

        Returns
        -------
        residuals : (..., m) array
            Of azimuth, elevation and range, as present; rad and m.
        slopes : (..., m, d) array
            Derivative of the expected components by the position; 0 where undefined.
        sigmas : (m,) array
            Standard deviations.

        References
        ----------
        Nenartovich, Isakov, equation (3), with the derivative at the position instead of the
        measured angle.
        """
        line = np.asarray(position_m, np.float64) - self.source_m
        east, north = line[..., 0], line[..., 1]
        ground = np.hypot(east, north)
        safe = np.where(ground > 0.0, ground, 1.0)
        flat = np.stack([north, -east], axis=-1) / safe[..., None] ** 2
        parts = [(wrapped(self.azimuth_rad - np.arctan2(east, north)), self._in_space(flat))]
        sigmas = [self.azimuth_sigma_rad]
        slant = np.linalg.norm(line, axis=-1)
        long = np.where(slant > 0.0, slant, 1.0)
        if self.elevation_rad is not None:
            up = line[..., 2]
            bend = -up / (safe * long**2)
            slope = np.stack([bend * east, bend * north, ground / long**2], axis=-1)
            parts.append((self.elevation_rad - np.arctan2(up, ground), slope))
            sigmas.append(float(self.elevation_sigma_rad or 0.0))
        if self.range_m is not None:
            parts.append((self.range_m - slant, line / long[..., None]))
            sigmas.append(float(self.range_sigma_m or 0.0))
        shape = np.broadcast_shapes(*(np.shape(residual) for residual, _ in parts))
        residuals = np.stack([np.broadcast_to(one, shape) for one, _ in parts], axis=-1)
        slopes = np.stack(
            [np.broadcast_to(one, (*shape, self.dimensions)) for _, one in parts], axis=-2
        )
        return residuals, slopes, np.array(sigmas)

    def normals(self) -> tuple[Floats, Floats]:
        """Return the planes through the source and the aircraft that the angles define.

        Returns
        -------
        normals : (..., m, d) array
            Unit normals of the planes through the source, of azimuth and elevation: at a distance
            r in space the error across such a plane is r times its angular sigma (times the cosine
            of the elevation for azimuths).
        sigmas : (m,) array
            Angular sigmas, rad.

        References
        ----------
        Nenartovich, Isakov, the second column of C in equation (1), which is across the line of
        sight x of condition (10).
        """
        azimuth = np.asarray(self.azimuth_rad)
        sine, cosine = np.sin(azimuth), np.cos(azimuth)
        normals = [self._in_space(np.stack([cosine, -sine], axis=-1))]
        sigmas = [self.azimuth_sigma_rad]
        if self.elevation_rad is not None:
            rise, level = np.sin(self.elevation_rad), np.cos(self.elevation_rad)
            normals.append(np.stack([-rise * sine, -rise * cosine, level], axis=-1))
            sigmas.append(float(self.elevation_sigma_rad or 0.0))
        shape = np.broadcast_shapes(*(normal.shape for normal in normals))
        stacked = [np.broadcast_to(normal, shape) for normal in normals]
        return np.stack(stacked, axis=-2), np.array(sigmas)

    def _in_space(self, flat: Floats) -> Floats:
        if self.dimensions == PLANE:
            return flat
        return np.concatenate([flat, np.zeros((*flat.shape[:-1], 1))], axis=-1)


# A component and its sigma must be given together, and be numbers.
def _check_component(sight: Sight, name: str, sigma_name: str) -> None:
    value: ArrayLike | None = getattr(sight, name)
    sigma: float | None = getattr(sight, sigma_name)
    if (value is None) != (sigma is None):
        raise ShapeError(name, f"both a value and {sigma_name}", (), "only one of the two")
    if value is None or sigma is None:
        return
    if not 0.0 < sigma < np.inf:
        raise PriorError(f"{sigma_name}: expected a positive number, was {sigma}")
    object.__setattr__(sight, name, finite_array(value, name))
