"""Position observability of an aircraft in straight flight, by moving sources and elevations.

Lines of sight of a moving source satisfy condition (10) even if source and aircraft both fly
straight, although twice the distance at twice the speed gives the same angles. So the velocity is
estimated too, and with elevations the height. The result is the distance in units of the sigma of
the position, which for fixed sites is condition (10) in units of the errors.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.height._height_kernels import COARSE_STEP_M
from multiradar.estimation.measurement._kernels import expected_measurement, sine_by_height
from multiradar.estimation.measurement.kinds import KIND_DIRECTION
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy import _kernels as geodesy
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.restoration.geometry.plot_positions import Plots

Floats = NDArray[np.float64]

#: Prior sigma of each component of the velocity, m/s.
SPEED_SIGMA_MPS = 300.0
# Information of an unknown height, 1/m².
_NO_HEIGHT = 1e-12
# Kind of measurement without a range, as in `SensorTable.kinds`.
_BEARING = 2


class Sightings(NamedTuple):
    """Elevations and source positions of measurements, and assumed positions of the aircraft.

    Attributes
    ----------
    elevation_rad : (n,) float64
        Elevation, NaN for none.
    sources : (n, 3) float64
        Latitude, longitude (rad) and height (m) of a moving source, NaN for others.
    positions : (n, 3) float64
        The same of the aircraft.
    """

    elevation_rad: Floats
    sources: Floats
    positions: Floats


def crossing_in_straight_flight(
    plots: Plots,
    directions: Sightings,
    sensors: SensorTable,
    place: tuple[float, float, float],
    bias_sigma_rad: Floats,
) -> float:
    """Return the distance of the nearest source in units of the sigma of the position.

    Parameters
    ----------
    plots : Plots
        Measurements by ascending time; only bearings are used.
    directions : Sightings
        Elevations and source positions of the measurements.
    sensors : SensorTable
        The sensors.
    place : tuple of float
        Latitude and longitude, rad, and height, m, of the aircraft at the last measurement.
    bias_sigma_rad : (m,) ndarray
        Standard deviation of the azimuth bias of each sensor; 0 if it is known.

    Returns
    -------
    float
        0 if the bearings do not determine the position.

    References
    ----------
    Nenartovich, Isakov, condition (10); velocity and biases as further unknowns are the project's
    own.
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
        site = _site(frame, sensors, sensor, directions.sources[row])
        sigmas = sensors.azimuth_sigma_rad[sensor], sensors.elevation_sigma_rad[sensor]
        slopes = _slopes(
            frame,
            site,
            directions.positions[row],
            sigmas,
            not np.isnan(directions.elevation_rad[row]),
        )
        ago = plots.time_s[row] - plots.time_s[-1]
        # The bias affects the azimuth, the first row; elevations have none.
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


# Derivatives of azimuth and, if measured, of the sine of the elevation, by east, north and
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


# Largest sigma of the position; infinite if undetermined.
def _sigma(information: Floats) -> float:
    scale = np.sqrt(np.where(np.diag(information) > 0.0, np.diag(information), 1.0))
    scaled = information / np.outer(scale, scale)
    values, vectors = np.linalg.eigh(scaled)
    if not values[0] > np.finfo(np.float64).eps * len(values):
        return np.inf
    covariance = (vectors / values) @ vectors.T / np.outer(scale, scale)
    return float(np.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[-1]))
