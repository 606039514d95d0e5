"""Plots of an aircraft as points in space with known covariances.

The frame is that of the last plot: east and north in the plane tangent to the ellipsoid at its
foot, and the height. Level flight is therefore planar, however long; over 50 km the frame differs
from a Cartesian one by 3e-5 of its horizontal lengths.

Only plots have known covariances and uncorrelated errors: successive states of a filter share most
of their plots.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import PlaneError
from multiradar.estimation.filters.height._height_kernels import (
    COARSE_STEP_M,
    COARSE_VARIANCE,
    FINE_VARIANCE,
    ROUNDING_M,
    TRANSPONDER_VARIANCE,
)
from multiradar.estimation.measurement.cone_of_silence import outside_cone
from multiradar.estimation.measurement.known_biases import (
    polar_without_biases,
    reports_without_frames,
)
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy import _kernels as geodesy
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.restoration.geometry._plot_position_kernels import locate_polar_plot

Floats = NDArray[np.float64]

# Kinds of measurement, as in `SensorTable.kinds`; bearings are not points.
_RADAR, _POSITION = 0, 1


class Plots(NamedTuple):
    """Plots of one aircraft, by ascending time; missing values are NaN.

    Attributes
    ----------
    time_s : (n,) float64
        When they were measured.
    sensor, kind : (n,) integers
        By which sensor, and of which kind.
    range_m, azimuth_rad, latitude_rad, longitude_rad, height_m : (n,) float64
        As measured.
    position_sigma_m : (n,) float64
        Accuracy of a reported position, 1 sigma on each axis; NaN where that of its sensor applies.
    """

    time_s: Floats
    sensor: NDArray[np.integer]
    kind: NDArray[np.integer]
    range_m: Floats
    azimuth_rad: Floats
    latitude_rad: Floats
    longitude_rad: Floats
    height_m: Floats
    position_sigma_m: Floats

    def select(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> "Plots":
        """Return selected plots.

        Parameters
        ----------
        rows : (k,) integers or (n,) bool
            Rows to select.

        Returns
        -------
        Plots
            In the order of the rows.
        """
        return Plots(**{name: column[rows] for name, column in self._asdict().items()})


class PlotPositions(NamedTuple):
    """Plots in the local frame of the last of them.

    Attributes
    ----------
    frame : SystemPlane
        The plane that touches the ellipsoid at the foot of the last plot.
    time_s : (n,) float64
        When they were measured.
    positions_m : (n, 3) float64
        East, north and height, m.
    covariances_m2 : (n, 3, 3) float64
        Their covariances, m².
    """

    frame: SystemPlane
    time_s: Floats
    positions_m: Floats
    covariances_m2: Floats


def plot_positions(plots: Plots, sensors: SensorTable, biases: ArrayLike) -> PlotPositions:
    """Return plots as points, corrected for estimated biases.

    Parameters
    ----------
    plots : Plots
        The plots.
    sensors : SensorTable
        The sensors, with their accuracies.
    biases : (m, p) array_like
        Estimates for each sensor and kind of parameter, 0 where there is none: measured minus true.

    Returns
    -------
    PlotPositions
        The plots with a position: with a height, outside the cone of silence.

    Raises
    ------
    PlaneError
        If no plot has a position.

    Notes
    -----
    Mode C heights and heights reported with a position differ by the atmospheric pressure and are
    not mixed: those of radars are used, or the reported ones if they are more. Their errors are
    quantisation and the transponder. A time offset moves a plot along the path, which lies in the
    plane; it is not corrected. The uncertainty of biases is common to the plots of a radar and not
    included.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.5), for the biases; the rest is the project's own.
    """
    with_height = plots.select(np.isfinite(plots.height_m))
    by_radar = with_height.kind == _RADAR
    reported = with_height.kind == _POSITION
    kind = _RADAR if by_radar.sum() >= reported.sum() else _POSITION
    chosen = with_height.select(with_height.kind == kind)
    if not len(chosen.time_s):
        raise PlaneError("TOO_FEW_POINTS", "no plot has a height")
    of_each = np.asarray(biases, np.float64)[chosen.sensor]
    polar = polar_without_biases(chosen.range_m, chosen.azimuth_rad, of_each)
    corrected = np.column_stack([*polar, chosen.height_m])
    variance = height_variance(chosen.height_m)
    if kind == _POSITION:
        return _reported(chosen, sensors, np.asarray(biases, np.float64), variance)
    frame = _frame(corrected, chosen, sensors)
    return _seen(frame, corrected, chosen, sensors, variance)


def height_variance(height_m: Floats) -> float:
    """Return the variance of the heights of an aircraft, from their quantisation.

    Parameters
    ----------
    height_m : (n,) ndarray
        As measured.

    Returns
    -------
    float
        Variance of quantisation and transponder, m²; the step is 100 ft if all heights are on such
        steps, else finer.
    """
    beside = np.abs(height_m - COARSE_STEP_M * np.round(height_m / COARSE_STEP_M))
    step = COARSE_VARIANCE if bool((beside <= ROUNDING_M).all()) else FINE_VARIANCE
    return float(TRANSPONDER_VARIANCE + step)


def _reported(plots: Plots, sensors: SensorTable, biases: Floats, variance: float) -> PlotPositions:
    latitude, longitude = reports_without_frames(
        plots.latitude_rad, plots.longitude_rad, plots.sensor, sensors, biases
    )
    frame = SystemPlane(float(latitude[-1]), float(longitude[-1]))
    east, north = frame.to_plane(latitude, longitude)
    covariances = np.zeros((len(east), 3, 3))
    covariances[:, 0, 0] = sensors.position_sigmas(plots.sensor, plots.position_sigma_m) ** 2
    covariances[:, 1, 1] = covariances[:, 0, 0]
    covariances[:, 2, 2] = variance
    positions = np.column_stack([east, north, plots.height_m])
    return PlotPositions(frame, plots.time_s, positions, covariances)


# Foot of the last plot that has one, computed in the plane of its radar.
def _frame(corrected: Floats, plots: Plots, sensors: SensorTable) -> SystemPlane:
    for row in range(len(corrected) - 1, -1, -1):
        sensor = plots.sensor[row]
        latitude, longitude = sensors.latitude_rad[sensor], sensors.longitude_rad[sensor]
        plane = SystemPlane(float(latitude), float(longitude))
        site = geodesy.site_parameters(
            plane.parameters, latitude, longitude, sensors.height_m[sensor]
        )
        ok, east, north = geodesy.locate_polar(plane.parameters, site, *corrected[row])
        if ok:
            foot = plane.to_geodetic(east, north)
            return SystemPlane(float(foot[0]), float(foot[1]))
    raise PlaneError("TOO_FEW_POINTS", "no plot has a position")


def _seen(
    frame: SystemPlane, corrected: Floats, plots: Plots, sensors: SensorTable, variance: float
) -> PlotPositions:
    sites = {
        sensor: geodesy.site_parameters(
            frame.parameters, sensors.latitude_rad[sensor], sensors.longitude_rad[sensor],
            sensors.height_m[sensor],
        )
        for sensor in np.unique(plots.sensor).tolist()
    }  # fmt: skip
    positions = np.empty((len(corrected), 3))
    covariances = np.empty((len(corrected), 3, 3))
    ground = np.empty(len(corrected))
    for row, sensor in enumerate(plots.sensor.tolist()):
        variances = np.array(
            [sensors.range_sigma_m[sensor] ** 2, sensors.azimuth_sigma_rad[sensor] ** 2, variance]
        )
        ground[row] = locate_polar_plot(
            frame.parameters, sites[sensor], corrected[row], variances, positions[row],
            covariances[row],
        )  # fmt: skip
    kept = outside_cone(ground, corrected[:, 2], sensors.height_m[plots.sensor])
    return PlotPositions(frame, plots.time_s[kept], positions[kept], covariances[kept])
