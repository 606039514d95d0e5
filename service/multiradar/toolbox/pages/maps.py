"""Maps of positions, for the pages of commands: a plane with kilometres, sites as rings."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.diagnosis.plots import Floats, Site
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation, geodetic_to_ecef
from multiradar.report.content import Plot, Series

_KILOMETRE_M = 1000.0


@dataclass(frozen=True, slots=True, eq=False)
class MapPlane:
    """The horizontal plane of a map.

    Attributes
    ----------
    middle_m : (3,) float64
        ECEF, m.
    latitude_rad, longitude_rad : float
        Of the middle.
    """

    middle_m: Floats
    latitude_rad: float
    longitude_rad: float

    @classmethod
    def around(cls, positions_m: Floats) -> "MapPlane":
        """Return the plane at the median of ECEF positions (n, 3)."""
        middle = np.median(positions_m, axis=0)
        latitude, longitude, _ = ecef_to_geodetic(middle)
        return cls(middle, float(latitude), float(longitude))

    def kilometres(self, positions_m: Floats) -> Floats:
        """Return east and north (n, 2) of ECEF positions, km."""
        rotation = enu_rotation(self.latitude_rad, self.longitude_rad)
        local = (positions_m - self.middle_m) @ rotation.T / _KILOMETRE_M
        return np.asarray(local[:, :2])

    @property
    def place(self) -> str:
        """Return the middle as text."""
        return f"{math.degrees(self.latitude_rad):.3f}°, {math.degrees(self.longitude_rad):.3f}°"


def site_rings(plane: MapPlane, sites: Mapping[str, Site], key: str = "") -> list[Series]:
    """Return a ring for each site with the names of its sensors.

    Parameters
    ----------
    plane : MapPlane
        The plane of the map.
    sites : mapping of str to Site
        Sites by sensor.
    key : str
        Key of the colour; by default that of the first sensor.
    """
    together: dict[Site, list[str]] = {}
    for name, site in sites.items():
        together.setdefault(site, []).append(name)
    series = []
    for site, names in together.items():
        local = plane.kilometres(geodetic_to_ecef(*site)[None, :])
        colour, text = key or names[0], ", ".join(names)
        series.append(Series("", local[:, 0], local[:, 1], "rings", key=colour, text=text))
    return series


def map_plot(title: str, series: Sequence[Series], caption: str, *, name: str = "map",
             group: str = "") -> Plot:  # fmt: skip
    """Return a map of series in kilometres."""
    return Plot(
        title=title,
        x_label="east, km",
        y_label="north, km",
        series=tuple(series),
        equal_axes=True,
        caption=caption,
        name=name,
        group=group,
    )


def broken_lines(lines: Sequence[Floats]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return lines (n, 2) as one series with gaps between them."""
    gap = np.full((1, 2), np.nan)
    parts = [part for line in lines for part in (line, gap)]
    whole = np.concatenate(parts) if parts else np.empty((0, 2))
    return whole[:, 0], whole[:, 1]
