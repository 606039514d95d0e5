"""Positions of sensors, fixed or moving, and their lines of sight."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.geodesy.wgs84 import enu_rotation, geodetic_to_ecef
from multiradar.simulation.paths import Path, fly
from multiradar.simulation.scenario.model import Aircraft, Sensor

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Site:
    """Position of a sensor.

    Attributes
    ----------
    plane : SystemPlane
        The plane of the scenario.
    fixed : (latitude_rad, longitude_rad, height_m)
        Its position, or its initial position.
    path : Path, optional
        Its path if it moves, like that of an aircraft.
    """

    plane: SystemPlane
    fixed: tuple[float, float, float]
    path: Path | None = None

    def at(self, time_s: Floats) -> tuple[Floats, Floats, Floats]:
        """Return latitude, longitude (rad) and height (m) at times (n,).

        References
        ----------
        The project's own: see `multiradar.simulation.paths`.
        """
        if self.path is None:
            latitude, longitude, height = (np.full(len(time_s), one) for one in self.fixed)
            return latitude, longitude, height
        latitude, longitude = self.plane.to_geodetic(*self.path.position(time_s).T)
        return latitude, longitude, self.path.height(time_s)

    def line_of_sight(
        self, time_s: Floats, latitude_rad: Floats, longitude_rad: Floats, height_m: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Return slant range (m), azimuth and elevation (rad) of positions at times, all (n,).

        References
        ----------
        The project's own: as `slant_range_azimuth`, with a site for each time.
        """
        if self.path is None:
            return slant_range_azimuth(self.fixed, latitude_rad, longitude_rad, height_m)
        here = self.at(time_s)
        line = geodetic_to_ecef(latitude_rad, longitude_rad, height_m) - geodetic_to_ecef(*here)
        east, north, up = np.einsum("nij,nj->in", enu_rotation(here[0], here[1]), line)
        ground = np.hypot(east, north)
        azimuth = np.mod(np.arctan2(east, north), 2.0 * np.pi)
        # np.mod of a tiny negative number rounds to 2π itself.
        azimuth = np.where(azimuth >= 2.0 * np.pi, 0.0, azimuth)
        return np.hypot(ground, up), azimuth, np.arctan2(up, ground)


def site_of(
    sensor: Sensor, fixed: tuple[float, float, float], plane: SystemPlane, duration_s: float,
    rng: np.random.Generator,
) -> Site:  # fmt: skip
    """Return the site of a sensor during a scenario.

    Parameters
    ----------
    sensor : Sensor
        The sensor.
    fixed : (latitude_rad, longitude_rad, height_m)
        Its site.
    plane : SystemPlane
        The plane of the scenario.
    duration_s : float
        Duration of the scenario, s.
    rng : Generator
        Not used: moving sensors fly legs only.

    References
    ----------
    The project's own: legs like those of aircraft.
    """
    if sensor.speed_mps is None:
        return Site(plane, fixed)
    flown = Aircraft(
        track_number=0, east_m=sensor.east_m, north_m=sensor.north_m, height_m=sensor.height_m,
        speed_mps=sensor.speed_mps, heading_rad=sensor.heading_rad, legs=sensor.legs,
    )  # fmt: skip
    return Site(plane, fixed, fly(flown, duration_s, rng))
