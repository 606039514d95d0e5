"""Position observability of a track: ranges, or intersecting bearings.

Bearings from one fixed site do not determine the distance of an aircraft. Lines of sight from two
sites intersect at the aircraft, if their crossing angle exceeds the errors. For moving sources and
elevations see `straight_flight`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.estimation.filters.bearings_only import CROSSING_MIN
from multiradar.estimation.measurement.known_biases import polar_without_biases
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy import _kernels as geodesy
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.restoration.geometry.plot_positions import Plots
from multiradar.restoration.geometry.straight_flight import Sightings, crossing_in_straight_flight

Floats = NDArray[np.float64]

# Kind of measurement without a range, as in `SensorTable.kinds`.
_BEARING = 2
# Sites closer than this, m, count as one.
_ONE_PLACE_M = 1.0


class Observability(NamedTuple):
    """Position observability of a track.

    Attributes
    ----------
    ranges : int
        Number of measurements with a range, or of positions.
    bearings : int
        Number of measurements with an azimuth alone.
    places : int
        Number of sites of the bearings; a moving source counts once.
    crossing : float
        Crossing angle of the lines of sight of the bearings in units of their errors; 0 if all are
        parallel, or come from one fixed site. With moving sources or elevations: distance of the
        nearest source in units of the sigma of the position, for straight flight.
    """

    ranges: int
    bearings: int
    places: int
    crossing: float

    @property
    def lines_cross(self) -> bool:
        """Whether lines of sight from two sites intersect beyond their errors."""
        return self.crossing > CROSSING_MIN

    @property
    def is_observable(self) -> bool:
        """Whether a range was measured, or lines of sight intersect."""
        return self.ranges > 0 or self.lines_cross


def observability(
    plots: Plots,
    sensors: SensorTable,
    biases: ArrayLike,
    place: tuple[float, float, float],
    directions: Sightings | None = None,
    *,
    bias_sigma_rad: ArrayLike = 0.0,
) -> Observability:
    """Return the position observability of a track.

    Parameters
    ----------
    plots : Plots
        Measurements of the track.
    sensors : SensorTable
        The sensors.
    biases : (m, p) array_like
        Estimates for each sensor and kind of parameter, 0 where there is none: measured minus true.
    place : tuple of float
        Assumed position of the track: latitude and longitude, rad, and height, m.
    directions : Sightings, optional
        Elevations and source positions, where a source moves or measures elevations.
    bias_sigma_rad : (m,) array_like
        Standard deviation of the azimuth bias of each sensor, an error common to all its bearings.
        One number applies to all; 0 by default.

    Returns
    -------
    Observability
        Counts, and the strength of the intersection.

    References
    ----------
    Nenartovich, Isakov, condition (10), weighted with the errors of the angles. The requirement of
    two sites, and the treatment of biases as errors, are the project's own.
    """
    bearings = plots.select(plots.kind == _BEARING)
    ranges = len(plots.time_s) - len(bearings.time_s)
    own = np.unique(bearings.sensor).tolist()
    unknown = np.broadcast_to(np.asarray(bias_sigma_rad, np.float64), (len(sensors),))
    places = _places(sensors, [one for one in own if not sensors.moving[one]])
    if directions is not None:
        moving = int(sensors.moving[own].sum())
        found = crossing_in_straight_flight(plots, directions, sensors, place, unknown)
        return Observability(ranges, len(bearings.time_s), places + moving, found)
    if places < 2:
        return Observability(ranges, len(bearings.time_s), places, 0.0)
    estimates = np.asarray(biases, np.float64)
    frame = SystemPlane(place[0], place[1])
    crossing = np.zeros((2, 2))
    for sensor in own:
        site = geodesy.site_parameters(
            frame.parameters, sensors.latitude_rad[sensor], sensors.longitude_rad[sensor],
            sensors.height_m[sensor],
        )  # fmt: skip
        seen = geodesy.predict_polar(frame.parameters, site, 0.0, 0.0, place[2])
        across = np.array([seen[4], seen[5]])
        length = float(np.linalg.norm(across))
        if not length > 0.0:
            continue
        # The line of a bearing is rotated against the line to the position by their difference.
        measured = bearings.azimuth_rad[bearings.sensor == sensor]
        # The range is that of the position: a shifted frame turns near lines more.
        _, true = polar_without_biases(
            np.full(len(measured), seen[0]),
            measured,
            np.tile(estimates[sensor], (len(measured), 1)),
        )
        azimuth = true - seen[1]
        sine, cosine = np.sin(azimuth), np.cos(azimuth)
        n0, n1 = across / length
        normals = np.stack([cosine * n0 + sine * n1, cosine * n1 - sine * n0])
        crossing += _line_information(normals, sensors.azimuth_sigma_rad[sensor], unknown[sensor])
    least = float(np.linalg.eigvalsh(crossing)[0])
    return Observability(ranges, len(bearings.time_s), places, float(np.sqrt(max(least, 0.0))))


# Σ n nᵀ/σ² of the lines of one source, reduced for its bias b: N (σ² I + b² 1 1ᵀ)⁻¹ Nᵀ by Sherman
# and Morrison. Any number of lines together is not more accurate than b.
def _line_information(normals: Floats, sigma: float, bias_sigma: float) -> Floats:
    information = normals @ normals.T / sigma**2
    total = normals.sum(axis=1) / sigma**2
    hidden = bias_sigma**2 / (1.0 + normals.shape[1] * (bias_sigma / sigma) ** 2)
    return np.asarray(information - hidden * np.outer(total, total))


def _places(sensors: SensorTable, own: list[int]) -> int:
    sites = [
        SystemPlane(float(sensors.latitude_rad[one]), float(sensors.longitude_rad[one]))
        for one in own
    ]
    found: list[SystemPlane] = []
    for site in sites:
        apart = [np.hypot(*site.to_plane(one.latitude_rad, one.longitude_rad)) for one in found]
        if all(distance >= _ONE_PLACE_M for distance in apart):
            found.append(site)
    return len(found)
