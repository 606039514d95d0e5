"""Plots of tracks as positions on the system plane, for bundles.

Plots are corrected for the biases published at their time; the uncertainty of the biases is added
to their covariance, as if it were independent noise.
"""

from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import OutsidePlaneError
from multiradar.estimation.measurement.cone_of_silence import outside_cone
from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_POSITION
from multiradar.estimation.measurement.known_biases import (
    FRAME_PARAMETERS,
    polar_without_biases,
    reports_without_frames,
)
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_COSINE,
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_AZIMUTH_SINE,
    PARAMETER_FRAME_EAST,
    PARAMETER_FRAME_NORTH,
    PARAMETER_FRAME_ROTATION,
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
from multiradar.tracking.outputs import BiasRecords
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]

#: A plot with the state of its track after it, filled by `engine.plot_rows.plot_rows`.
PLOT_DTYPE = np.dtype(
    [("track_id", np.int64), ("sensor", np.int32), ("kind", np.int8)]
    + [
        (name, np.float64)
        for name in (
            "time_s", "range_m", "azimuth_rad", "latitude_rad", "longitude_rad", "height_m",
            "position_sigma_m", "track_height_m", "track_height_sigma_m", "track_speed_mps",
            "track_heading_rad",
        )
    ]
)  # fmt: skip


class NotLocated(StrEnum):
    """Why a plot has no position on the plane."""

    #: A bearing: a line, not a position.
    BEARING = "BEARING"
    #: The aircraft is in the radar's cone of silence, where azimuths are unreliable.
    CONE_OF_SILENCE = "CONE_OF_SILENCE"
    #: No point of the plane has its range and height.
    NO_PLACE = "NO_PLACE"


class LocatedPlot(NamedTuple):
    """A plot on the plane.

    Attributes
    ----------
    position_m : (2,) float64
        East and north.
    covariance_m2 : (2, 2) float64
        Noise, and uncertainty of biases and height.
    shared_m2 : (2, 2) float64
        The part common to all plots: of biases, and of a height that is not reported.
    """

    position_m: Floats
    covariance_m2: Floats
    shared_m2: Floats


class Published(NamedTuple):
    """The published biases of all sensors.

    Attributes
    ----------
    estimate, sigma : (sensors, parameters) float64
        By sensor and kind of parameter, 0 where there is none; measured minus true.
    """

    estimate: Floats
    sigma: Floats


def prior_biases(sensors: SensorTable) -> Published:
    """Return the prior biases."""
    estimate = np.zeros((len(sensors), len(PARAMETER_NAMES)))
    sigma = np.zeros_like(estimate)
    estimate[sensors.parameter_sensor, sensors.parameter_kind] = sensors.prior_mean
    sigma[sensors.parameter_sensor, sensors.parameter_kind] = sensors.prior_sigma
    return Published(estimate, sigma)


def updated_biases(before: Published, records: BiasRecords, rows: NDArray[np.intp]) -> Published:
    """Return the biases updated with records, in their order."""
    estimate, sigma = before.estimate.copy(), before.sigma.copy()
    for row in rows.tolist():
        at = records.sensor[row], records.parameter[row]
        estimate[at], sigma[at] = records.estimate[row], records.sigma[row]
    return Published(estimate, sigma)


class PlotLocator:
    """Computes positions of plots on the system plane.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    tracking : TrackingSettings
        Assumed height of aircraft without height, and cone of silence.
    """

    def __init__(self, sensors: SensorTable, tracking: TrackingSettings) -> None:
        self.plane = SystemPlane.for_sensors(sensors.latitude_rad, sensors.longitude_rad)
        self._tracking = tracking
        self.use(sensors)

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors: those so far at their places."""
        self._sensors = sensors
        self._sites = {
            sensor: geodesy.site_parameters(
                self.plane.parameters, sensors.latitude_rad[sensor], sensors.longitude_rad[sensor],
                float(np.nan_to_num(sensors.height_m[sensor])),
            )
            for sensor in np.flatnonzero(np.isfinite(sensors.latitude_rad)).tolist()
        }  # fmt: skip

    def locate(self, plot: np.void, published: Published) -> LocatedPlot | NotLocated:
        """Return the position of a plot.

        Parameters
        ----------
        plot : row of `PLOT_DTYPE`
            The plot.
        published : Published
            The biases published at its time.

        Returns
        -------
        LocatedPlot or NotLocated
            Its position, or why it has none.

        Notes
        -----
        A plot without height is located at the height of its track, or at the assumed height where
        that is unknown, as in the tracker. The covariance includes the uncertainty of the height.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.5), for the biases; otherwise the project's own.
        """
        if plot["kind"] == KIND_BEARING:
            return NotLocated.BEARING
        try:
            if plot["kind"] == KIND_POSITION:
                placed: LocatedPlot | NotLocated = self._reported_position(plot, published)
            else:
                placed = self._measured_plot(plot, published)
            if isinstance(placed, NotLocated):
                return placed
            return self._at_reported_time(placed, plot, published)
        except OutsidePlaneError:
            return NotLocated.NO_PLACE

    def _measured_plot(self, plot: np.void, published: Published) -> LocatedPlot | NotLocated:
        sensors, own = self._sensors, int(plot["sensor"])
        estimate, sigma = published.estimate[own], published.sigma[own]
        height_m, own_variance, shared_variance = self.height(plot)
        polar = np.array([plot["range_m"]]), np.array([plot["azimuth_rad"]])
        (range_m,), (azimuth_rad,) = polar_without_biases(*polar, estimate[None])
        measured = np.array([range_m, azimuth_rad, height_m])
        # J P Jᵀ of a bias equals that of the same noise in range or azimuth.
        wave = sigma[[PARAMETER_AZIMUTH_SINE, PARAMETER_AZIMUTH_COSINE]]
        wave *= np.array([np.sin(azimuth_rad), np.cos(azimuth_rad)])
        common = np.array(
            [
                sigma[PARAMETER_RANGE_OFFSET] ** 2 + (range_m * sigma[PARAMETER_RANGE_GAIN]) ** 2,
                sigma[PARAMETER_AZIMUTH_OFFSET] ** 2 + wave @ wave,
                shared_variance,
            ]
        )
        noise = np.array(
            [sensors.range_sigma_m[own] ** 2, sensors.azimuth_sigma_rad[own] ** 2, own_variance]
        )
        position, covariance, shared = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
        geometry = self.plane.parameters, self._sites[own], measured
        ground_m = locate_polar_plot(*geometry, noise + common, position, covariance)
        locate_polar_plot(*geometry, common, position, shared)
        if np.isnan(ground_m):
            return NotLocated.NO_PLACE
        cone_ratio = self._tracking.cone_ratio
        if not outside_cone(ground_m, height_m, sensors.height_m[own], cone_ratio):
            return NotLocated.CONE_OF_SILENCE
        shift = self._frame_covariance(own, position[:2], sigma)
        return LocatedPlot(position[:2], covariance[:2, :2] + shift, shared[:2, :2] + shift)

    def _reported_position(self, plot: np.void, published: Published) -> LocatedPlot:
        own = int(plot["sensor"])
        # Of its sensor alone: those published may be of fewer, before another one was added.
        biases = np.zeros((len(self._sensors), len(PARAMETER_NAMES)))
        biases[own] = published.estimate[own]
        reported = np.array([plot["latitude_rad"]]), np.array([plot["longitude_rad"]])
        latitude, longitude = reports_without_frames(
            *reported, np.array([own]), self._sensors, biases
        )
        (east,), (north,) = self.plane.to_plane(latitude, longitude)
        across = np.linalg.inv(self.plane.local_matrix(east, north))
        variance = float(self._sensors.position_sigmas(own, plot["position_sigma_m"])) ** 2
        shared = self._frame_covariance(own, np.array([east, north]), published.sigma[own])
        covariance = variance * across @ across.T + shared
        return LocatedPlot(np.array([east, north], np.float64), covariance, shared)

    # Covariance of a position by the biases of its frame; their correlation is not published.
    def _frame_covariance(self, own: int, position_m: Floats, sigma: Floats) -> Floats:
        if not sigma[list(FRAME_PARAMETERS)].any():
            return np.zeros((2, 2))
        site = self._sites[own]
        east, north = position_m - site[[geodesy.PE, geodesy.PN]]
        moves = np.array(
            [
                site[[geodesy.EE, geodesy.EN]] * sigma[PARAMETER_FRAME_EAST],
                site[[geodesy.NE, geodesy.NN]] * sigma[PARAMETER_FRAME_NORTH],
                np.array([north, -east]) * sigma[PARAMETER_FRAME_ROTATION],
            ]
        )
        return np.asarray(moves.T @ moves)

    # A plot with a time offset is extrapolated to its reported time, so that the order of plots is
    # kept.
    def _at_reported_time(
        self, placed: LocatedPlot, plot: np.void, published: Published
    ) -> LocatedPlot:
        own = int(plot["sensor"])
        offset_s = published.estimate[own, PARAMETER_TIME_OFFSET]
        sigma_s = published.sigma[own, PARAMETER_TIME_OFFSET]
        if offset_s == 0.0 and sigma_s == 0.0:
            return placed
        heading, speed = float(plot["track_heading_rad"]), float(plot["track_speed_mps"])
        true = speed * np.array([np.sin(heading), np.cos(heading)])
        velocity = np.linalg.solve(self.plane.local_matrix(*placed.position_m), true)
        late = sigma_s**2 * np.outer(velocity, velocity)
        return LocatedPlot(
            placed.position_m + offset_s * velocity,
            placed.covariance_m2 + late,
            placed.shared_m2 + late,
        )

    def height(self, plot: np.void) -> tuple[float, float, float]:
        """Return the height at which a plot is located, m, and its variances, m².

        The first is independent for each plot, the second that of a height common to all plots.
        """
        measured_m = float(plot["height_m"])
        if np.isfinite(measured_m):
            return measured_m, height_variance(np.array([measured_m])), 0.0
        known, sigma = float(plot["track_height_m"]), float(plot["track_height_sigma_m"])
        if np.isfinite(known) and np.isfinite(sigma):
            return known, 0.0, sigma**2
        return self._tracking.assumed_height_m, 0.0, self._tracking.assumed_height_sigma_m**2
