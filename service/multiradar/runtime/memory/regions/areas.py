"""The areas of regions: a place belongs to the region whose centre is nearest."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.geodesy.geodesic import EARTH_RADIUS_M


class Centre(NamedTuple):
    """A region and its centre, degrees."""

    name: str
    latitude_deg: float
    longitude_deg: float


class Areas:
    """The area of a region among its neighbours.

    Parameters
    ----------
    own : Centre
        The region.
    neighbours : sequence of Centre
        Its neighbours, with other centres.

    Notes
    -----
    The boundary of two regions is the great circle on which both centres are equally far, so it is
    the same on both sides, also at a pole and at the antimeridian, and areas neither overlap nor
    leave a gap.
    """

    def __init__(self, own: Centre, neighbours: Sequence[Centre]) -> None:
        self.own = own
        self.neighbours = {one.name: one for one in neighbours}
        centre = _direction(np.radians(own.latitude_deg), np.radians(own.longitude_deg))
        others = _direction(
            np.radians([one.latitude_deg for one in neighbours]),
            np.radians([one.longitude_deg for one in neighbours]),
        )
        self._centres = np.vstack([centre, others])
        normals = centre - others
        self._normals = normals / np.linalg.norm(normals, axis=-1, keepdims=True)

    def depth_m(self, latitude_rad: ArrayLike, longitude_rad: ArrayLike) -> NDArray[np.float64]:
        """Return how far places are within the area.

        Parameters
        ----------
        latitude_rad, longitude_rad : (n,) array_like
            Places.

        Returns
        -------
        (n,) float64
            Distance to the nearest boundary, m; negative in the area of a neighbour.
        """
        places = _direction(np.asarray(latitude_rad), np.asarray(longitude_rad))
        sines = places @ self._normals.T
        depth: NDArray[np.float64] = EARTH_RADIUS_M * np.arcsin(np.clip(sines, -1.0, 1.0))
        nearest: NDArray[np.float64] = depth.min(axis=-1)
        return nearest

    def home(self, latitude_rad: ArrayLike, longitude_rad: ArrayLike) -> NDArray[np.intp]:
        """Return the region of places: the number of a neighbour, −1 for the own one."""
        places = _direction(np.asarray(latitude_rad), np.asarray(longitude_rad))
        nearest: NDArray[np.intp] = np.argmax(places @ self._centres.T, axis=-1) - 1
        return nearest


def _direction(latitude_rad: ArrayLike, longitude_rad: ArrayLike) -> NDArray[np.float64]:
    level = np.cos(latitude_rad)
    return np.stack(
        [level * np.cos(longitude_rad), level * np.sin(longitude_rad), np.sin(latitude_rad)],
        axis=-1,
    )
