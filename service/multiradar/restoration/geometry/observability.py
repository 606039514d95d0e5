"""Whether what was measured of a track in some time says where it is: ranges, or lines that cross.

One place that measures azimuths alone sees its line of sight turn with the aircraft and learns no
distance by it; lines from two places cross where the aircraft is, as far as they cross by more than
their errors. Where sources move or measure elevations, `straight_flight` says by how much.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.estimation.filters.bearings_only import CROSSING_MIN
from multiradar.estimation.measurement.sensors import PARAMETER_AZIMUTH_OFFSET, SensorTable
from multiradar.geodesy import _kernels as geodesy
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.restoration.geometry.plot_positions import Plots
from multiradar.restoration.geometry.straight_flight import Sightings, crossing_in_straight_flight

Floats = NDArray[np.float64]

# Kind of measurement without a range, as in `SensorTable.kinds`.
_BEARING = 2
# Sites nearer to each other, m, are one place.
_ONE_PLACE_M = 1.0


class Observability(NamedTuple):
    """What the measurements of a track determine.

    Attributes
    ----------
    ranges : int
        How many of them have a range, or are positions.
    bearings : int
        How many have an azimuth alone.
    places : int
        From how many places these were taken; a source that moves counts once.
    crossing : float
        By how many of their errors the lines of sight of the bearings cross; 0 where all are
        parallel, or come from one place that stands still. With sources that move or measure
        elevations: how many sigmas of the place the nearest source is off, for straight flight.
    """

    ranges: int
    bearings: int
    places: int
    crossing: float

    @property
    def lines_cross(self) -> bool:
        """Whether lines of sight from two places cross beyond their errors."""
        return self.crossing > CROSSING_MIN

    @property
    def is_observable(self) -> bool:
        """Whether a range was measured, or lines cross."""
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
    """Say what measurements determine of the place of a track.

    Parameters
    ----------
    plots : Plots
        What was measured of it.
    sensors : SensorTable
        By whom.
    biases : (m, p) array_like
        Estimates for each sensor and kind of parameter, 0 where there is none: measured minus true.
    place : tuple of float
        Latitude and longitude, rad, and height, m, where the track is taken to be.
    directions : Sightings, optional
        What the measurements tell beside azimuths, where a source moves or measures elevations.
    bias_sigma_rad : (m,) array_like
        Standard deviation of what is not known of the azimuth bias of each sensor: an error that
        all its bearings have in common. One number is that of all; none is unknown by default.

    Returns
    -------
    Observability
        Counts, and by how much lines cross.

    References
    ----------
    Nenartovich, Isakov, condition (10), weighted with the errors of the angles. That one fixed
    place does not do, and that biases are errors, too, is the project's own addition.
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
    offsets = np.asarray(biases, np.float64)[:, PARAMETER_AZIMUTH_OFFSET]
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
        # The line of a bearing is turned against the one to the place by the difference of both.
        azimuth = bearings.azimuth_rad[bearings.sensor == sensor] - offsets[sensor] - seen[1]
        sine, cosine = np.sin(azimuth), np.cos(azimuth)
        n0, n1 = across / length
        normals = np.stack([cosine * n0 + sine * n1, cosine * n1 - sine * n0])
        crossing += _known(normals, sensors.azimuth_sigma_rad[sensor], unknown[sensor])
    least = float(np.linalg.eigvalsh(crossing)[0])
    return Observability(ranges, len(bearings.time_s), places, float(np.sqrt(max(least, 0.0))))


# Σ n nᵀ/σ² of the lines of one source, less what its bias b hides: N (σ² I + b² 1 1ᵀ)⁻¹ Nᵀ by
# Sherman and Morrison. However many there are, together they are no better than b.
def _known(normals: Floats, sigma: float, bias_sigma: float) -> Floats:
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
