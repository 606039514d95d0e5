"""How well bearings of sources that move, and elevations, place an aircraft that flies straight.

Lines of a source that moves cross in the sense of condition (10) also where source and aircraft
both fly straight: twice as far and twice as fast all angles would be the same. So the velocity is
looked for as well, and of elevations the height. The place is told by as many of its sigmas as it
is off, which for lines from places that stand still is what (10) says in units of the errors.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.height._height_kernels import COARSE_STEP_M
from multiradar.estimation.measurement._kernels import (
    KIND_DIRECTION,
    expected_measurement,
    sine_by_height,
)
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy import _kernels as geodesy
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.restoration.geometry.plot_positions import Plots

Floats = NDArray[np.float64]

#: What is known of each component of a velocity beforehand, m/s: aircraft fly no faster.
SPEED_SIGMA_MPS = 300.0
# Nothing is known of a height below this information, 1/m²; above, it is the prior of a height.
_NO_HEIGHT = 1e-12
# Kind of measurement without a range, as in `SensorTable.kinds`.
_BEARING = 2


class Sightings(NamedTuple):
    """What measurements tell beside azimuths, and where the aircraft was taken to be.

    Attributes
    ----------
    elevation_rad : (n,) float64
        Elevation, NaN for none.
    sources : (n, 3) float64
        Latitude, longitude (rad) and height (m) of a source that moves, NaN for others.
    ways : (n, 3) float64
        The same of the aircraft.
    """

    elevation_rad: Floats
    sources: Floats
    ways: Floats


def crossing_in_straight_flight(
    plots: Plots,
    told: Sightings,
    sensors: SensorTable,
    place: tuple[float, float, float],
    bias_sigma_rad: Floats,
) -> float:
    """Return how many sigmas of the place the nearest source is off.

    Parameters
    ----------
    plots : Plots
        What was measured, by ascending time; bearings are looked at.
    told : Sightings
        What they tell beside azimuths.
    sensors : SensorTable
        By whom.
    place : tuple of float
        Latitude and longitude, rad, and height, m, of the aircraft at the end.
    bias_sigma_rad : (m,) ndarray
        Standard deviation of what is not known of the azimuth bias of each sensor; 0 where it is
        known.

    Returns
    -------
    float
        0 where the bearings leave the place open.

    References
    ----------
    Nenartovich, Isakov, condition (10), with the velocity and the biases among the unknown; the
    project's own.
    """
    frame = SystemPlane(place[0], place[1])
    own = np.flatnonzero(plots.kind == _BEARING)
    heard = ~np.isnan(plots.height_m[own])
    known = COARSE_STEP_M**-2 if heard.any() else _NO_HEIGHT
    loose = SPEED_SIGMA_MPS**-2
    seen_by = np.unique(plots.sensor[own])
    biased = seen_by[bias_sigma_rad[seen_by] > 0.0].tolist()
    # Unknown: east, north, their rates, height, biases.
    information = np.diag([0.0, 0.0, loose, loose, known, *bias_sigma_rad[biased] ** -2.0])
    nearest = np.inf
    for row in own.tolist():
        sensor = int(plots.sensor[row])
        site = _site(frame, sensors, sensor, told.sources[row])
        sigmas = sensors.azimuth_sigma_rad[sensor], sensors.elevation_sigma_rad[sensor]
        slopes = _slopes(frame, site, told.ways[row], sigmas, not np.isnan(told.elevation_rad[row]))
        ago = plots.time_s[row] - plots.time_s[-1]
        # The bias turns the azimuth, which comes first; elevations have none.
        turned = np.zeros((len(slopes), len(biased)))
        if sensor in biased:
            turned[0, biased.index(sensor)] = 1.0 / sigmas[0]
        whole = np.column_stack([slopes[:, :2], ago * slopes[:, :2], slopes[:, 2], turned])
        information += whole.T @ whole
        nearest = min(nearest, float(np.hypot(site[geodesy.PE], site[geodesy.PN])))
    return nearest / _sigma(information) if len(own) else 0.0


def _site(frame: SystemPlane, sensors: SensorTable, sensor: int, moved: Floats) -> Floats:
    where = np.array(
        [sensors.latitude_rad[sensor], sensors.longitude_rad[sensor], sensors.height_m[sensor]]
    )
    latitude, longitude, height = (where if np.isnan(moved).any() else moved).tolist()
    return geodesy.site_parameters(frame.parameters, latitude, longitude, height)


# Derivatives of azimuth and, where it is there, of the sine of the elevation, by east, north and
# height, over their sigmas.
def _slopes(
    frame: SystemPlane, site: Floats, way: Floats, sigmas: tuple[float, float], elevated: bool
) -> Floats:
    east, north = frame.to_plane(way[0], way[1])
    noise = np.array([sigmas[1] ** 2, 1.0, 0.0, site[geodesy.HEIGHT]])
    sine, _, ground, h, w = expected_measurement(
        KIND_DIRECTION, frame.parameters, site, noise, float(east), float(north), float(way[2]), 0.0
    )
    azimuth = np.array([[h[2], h[3], 0.0]]) / sigmas[0]
    if not elevated:
        return azimuth
    elevation = np.array([[h[0], h[1], sine_by_height(sine, ground)]]) / np.sqrt(w[0])
    return np.concatenate([azimuth, elevation])


# Of the place, in its worst direction; infinite where it is open.
def _sigma(information: Floats) -> float:
    scale = np.sqrt(np.where(np.diag(information) > 0.0, np.diag(information), 1.0))
    scaled = information / np.outer(scale, scale)
    values, vectors = np.linalg.eigh(scaled)
    if not values[0] > np.finfo(np.float64).eps * len(values):
        return np.inf
    covariance = (vectors / values) @ vectors.T / np.outer(scale, scale)
    return float(np.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[-1]))
