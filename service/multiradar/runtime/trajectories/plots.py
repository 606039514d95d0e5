"""Plots of tracks as places on the system plane, for bundles.

What was published of the biases when a plot came is taken off it; what was not known of them is in
its covariance, as if it were noise of its own.
"""

from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import OutsidePlaneError
from multiradar.estimation.measurement.cone_of_silence import outside_cone
from multiradar.estimation.measurement.known_biases import polar_without_biases
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_NAMES,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
    SensorTable,
)
from multiradar.geodesy import _kernels as geodesy
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.restoration.geometry._plot_position_kernels import locate_polar_plot
from multiradar.restoration.geometry.plot_positions import height_variance
from multiradar.tracking.input.measurements import KIND_BEARING, KIND_POSITION
from multiradar.tracking.outputs import BiasRecords
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]

#: A plot with what its track was taken to be after it, as `track_windows.plot_rows` fills it.
PLOT_DTYPE = np.dtype(
    [("track_id", np.int64), ("sensor", np.int32), ("kind", np.int8)]
    + [
        (name, np.float64)
        for name in (
            "time_s", "range_m", "azimuth_rad", "latitude_rad", "longitude_rad", "height_m",
            "track_height_m", "track_height_sigma_m", "track_speed_mps", "track_heading_rad",
        )
    ]
)  # fmt: skip


class Unplaced(StrEnum):
    """Why a plot has no place on the plane."""

    #: It is a bearing: a line, not a place.
    BEARING = "BEARING"
    #: The aircraft is above its radar, where azimuths are not to be trusted.
    CONE_OF_SILENCE = "CONE_OF_SILENCE"
    #: No point of the plane is at its range and height.
    NO_PLACE = "NO_PLACE"


class Placed(NamedTuple):
    """A plot on the plane.

    Attributes
    ----------
    position_m : (2,) float64
        East and north.
    covariance_m2 : (2, 2) float64
        Noise, and what is not known of the biases and of the height.
    shared_m2 : (2, 2) float64
        The part of it that plots share: that of biases, and of a height that no plot tells.
    """

    position_m: Floats
    covariance_m2: Floats
    shared_m2: Floats


class Published(NamedTuple):
    """What is said of the biases of all sensors.

    Attributes
    ----------
    estimate, sigma : (sensors, parameters) float64
        By sensor and kind of parameter, 0 where there is none; measured minus true.
    """

    estimate: Floats
    sigma: Floats


def known_beforehand(sensors: SensorTable) -> Published:
    """Return what is known of the biases before any is published."""
    estimate = np.zeros((len(sensors), len(PARAMETER_NAMES)))
    sigma = np.zeros_like(estimate)
    estimate[sensors.parameter_sensor, sensors.parameter_kind] = sensors.prior_mean
    sigma[sensors.parameter_sensor, sensors.parameter_kind] = sensors.prior_sigma
    return Published(estimate, sigma)


def published_next(before: Published, records: BiasRecords, rows: NDArray[np.intp]) -> Published:
    """Return what is known of the biases after some records, which come in their order."""
    estimate, sigma = before.estimate.copy(), before.sigma.copy()
    for row in rows.tolist():
        at = records.sensor[row], records.parameter[row]
        estimate[at], sigma[at] = records.estimate[row], records.sigma[row]
    return Published(estimate, sigma)


class PlotPlaces:
    """Lays plots on the system plane.

    Parameters
    ----------
    sensors : SensorTable
        Who measures.
    tracking : TrackingSettings
        What the tracker takes heights for that nobody tells, and where its cones of silence are.
    """

    def __init__(self, sensors: SensorTable, tracking: TrackingSettings) -> None:
        self.plane = SystemPlane.for_sensors(sensors.latitude_rad, sensors.longitude_rad)
        self._sensors, self._tracking = sensors, tracking
        self._sites = {
            sensor: geodesy.site_parameters(
                self.plane.parameters, sensors.latitude_rad[sensor], sensors.longitude_rad[sensor],
                sensors.height_m[sensor],
            )
            for sensor in np.flatnonzero(np.isfinite(sensors.latitude_rad)).tolist()
        }  # fmt: skip

    def place(self, plot: np.void, published: Published) -> Placed | Unplaced:
        """Return where a plot was measured.

        Parameters
        ----------
        plot : row of `PLOT_DTYPE`
            The plot.
        published : Published
            The biases as they were published when it came.

        Returns
        -------
        Placed or Unplaced
            Its place, or why it has none.

        Notes
        -----
        A plot without height is laid at the height of its track, or where that is not known at the
        assumed one, as the tracker does; how well the height is known is in the covariance.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.5), for the biases; the rest is the project's own.
        """
        if plot["kind"] == KIND_BEARING:
            return Unplaced.BEARING
        try:
            if plot["kind"] == KIND_POSITION:
                return self._reported(plot)
            placed = self._seen(plot, published)
            if isinstance(placed, Unplaced):
                return placed
            return self._at_its_time(placed, plot, published)
        except OutsidePlaneError:
            return Unplaced.NO_PLACE

    def _seen(self, plot: np.void, published: Published) -> Placed | Unplaced:
        sensors, own = self._sensors, int(plot["sensor"])
        estimate, sigma = published.estimate[own], published.sigma[own]
        height_m, own_variance, shared_variance = self.height(plot)
        said = np.array([plot["range_m"]]), np.array([plot["azimuth_rad"]])
        (range_m,), (azimuth_rad,) = polar_without_biases(*said, estimate[None])
        measured = np.array([range_m, azimuth_rad, height_m])
        # J P Jᵀ of a bias is what as much noise of the range or azimuth would do.
        common = np.array(
            [
                sigma[PARAMETER_RANGE_OFFSET] ** 2 + (range_m * sigma[PARAMETER_RANGE_GAIN]) ** 2,
                sigma[PARAMETER_AZIMUTH_OFFSET] ** 2,
                shared_variance,
            ]
        )
        noise = np.array(
            [sensors.range_sigma_m[own] ** 2, sensors.azimuth_sigma_rad[own] ** 2, own_variance]
        )
        position, covariance, shared = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
        place = self.plane.parameters, self._sites[own], measured
        ground_m = locate_polar_plot(*place, noise + common, position, covariance)
        locate_polar_plot(*place, common, position, shared)
        if np.isnan(ground_m):
            return Unplaced.NO_PLACE
        cone_ratio = self._tracking.cone_ratio
        if not outside_cone(ground_m, height_m, sensors.height_m[own], cone_ratio):
            return Unplaced.CONE_OF_SILENCE
        return Placed(position[:2], covariance[:2, :2], shared[:2, :2])

    def _reported(self, plot: np.void) -> Placed:
        east, north = self.plane.to_plane(plot["latitude_rad"], plot["longitude_rad"])
        across = np.linalg.inv(self.plane.local_matrix(east, north))
        variance = self._sensors.position_sigma_m[plot["sensor"]] ** 2
        covariance = variance * across @ across.T
        return Placed(np.array([east, north], np.float64), covariance, np.zeros((2, 2)))

    # A plot whose clock is fast is laid where its track is at the time it says, so that the order
    # of the plots stays.
    def _at_its_time(self, placed: Placed, plot: np.void, published: Published) -> Placed:
        own = int(plot["sensor"])
        offset_s = published.estimate[own, PARAMETER_TIME_OFFSET]
        sigma_s = published.sigma[own, PARAMETER_TIME_OFFSET]
        if offset_s == 0.0 and sigma_s == 0.0:
            return placed
        heading, speed = float(plot["track_heading_rad"]), float(plot["track_speed_mps"])
        true = speed * np.array([np.sin(heading), np.cos(heading)])
        velocity = np.linalg.solve(self.plane.local_matrix(*placed.position_m), true)
        late = sigma_s**2 * np.outer(velocity, velocity)
        return Placed(
            placed.position_m + offset_s * velocity,
            placed.covariance_m2 + late,
            placed.shared_m2 + late,
        )

    def height(self, plot: np.void) -> tuple[float, float, float]:
        """Return the height at which a plot is laid, m, and its variances, m².

        The first is that of the plot alone, the second that of a height taken for all of them.
        """
        told = float(plot["height_m"])
        if np.isfinite(told):
            return told, height_variance(np.array([told])), 0.0
        known, sigma = float(plot["track_height_m"]), float(plot["track_height_sigma_m"])
        if np.isfinite(known) and np.isfinite(sigma):
            return known, 0.0, sigma**2
        return self._tracking.assumed_height_m, 0.0, self._tracking.assumed_height_sigma_m**2
