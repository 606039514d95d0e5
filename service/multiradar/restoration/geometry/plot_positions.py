"""Plots of an aircraft as points in space with known covariances.

The frame is that of the last plot: east and north on the plane that touches the ellipsoid at its
foot, and the height. A level flight is therefore plane, however long; over 50 km the frame differs
from a Cartesian one by 3e-5 of its horizontal lengths.

Only plots have covariances that are known and errors that do not go together: the states of a
filter share most of their plots with the states before them.
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
from multiradar.estimation.measurement.known_biases import polar_without_biases
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy import _kernels as geodesy
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.restoration.geometry._plot_position_kernels import locate_polar_plot

Floats = NDArray[np.float64]

# Kinds of measurement, as in `SensorTable.kinds`; bearings are no points.
_RADAR, _POSITION = 0, 1


class Plots(NamedTuple):
    """Plots of one aircraft, by ascending time; what is missing is NaN.

    Attributes
    ----------
    time_s : (n,) float64
        When they were measured.
    sensor, kind : (n,) integers
        By which sensor, and of which kind.
    range_m, azimuth_rad, latitude_rad, longitude_rad, height_m : (n,) float64
        As measured.
    """

    time_s: Floats
    sensor: NDArray[np.integer]
    kind: NDArray[np.integer]
    range_m: Floats
    azimuth_rad: Floats
    latitude_rad: Floats
    longitude_rad: Floats
    height_m: Floats

    def select(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> "Plots":
        """Return the chosen plots.

        Parameters
        ----------
        rows : (k,) integers or (n,) bool
            Which of them.

        Returns
        -------
        Plots
            In the order asked for.
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
    """Return plots as points, estimated biases taken off.

    Parameters
    ----------
    plots : Plots
        The plots.
    sensors : SensorTable
        Who measured them, and how well.
    biases : (m, p) array_like
        Estimates for each sensor and kind of parameter, 0 where there is none: measured minus true.

    Returns
    -------
    PlotPositions
        The plots that have a place: with a height, outside the cone of silence.

    Raises
    ------
    PlaneError
        If none has.

    Notes
    -----
    Heights by Mode C and heights reported with a position differ by the weather of the day and are
    not mixed: those of radars are taken, or where they are fewer the reported ones. Their errors
    are those of the steps in which they are told and of the transponder. A time offset moves a
    plot along the path, which lies in the plane; it is not taken off. What is not known of biases
    is common to the plots of a radar and not counted.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.5), for the biases; the rest is the project's own.
    """
    told = plots.select(np.isfinite(plots.height_m))
    by_radar = told.kind == _RADAR
    reported = told.kind == _POSITION
    kind = _RADAR if by_radar.sum() >= reported.sum() else _POSITION
    chosen = told.select(told.kind == kind)
    if not len(chosen.time_s):
        raise PlaneError("TOO_FEW_POINTS", "expected plots with heights, was none")
    of_each = np.asarray(biases, np.float64)[chosen.sensor]
    polar = polar_without_biases(chosen.range_m, chosen.azimuth_rad, of_each)
    corrected = np.column_stack([*polar, chosen.height_m])
    variance = height_variance(chosen.height_m)
    if kind == _POSITION:
        return _reported(chosen, sensors, variance)
    frame = _frame(corrected, chosen, sensors)
    return _seen(frame, corrected, chosen, sensors, variance)


def height_variance(height_m: Floats) -> float:
    """Return the variance of heights of an aircraft, by the steps in which they are told.

    Parameters
    ----------
    height_m : (n,) ndarray
        As measured.

    Returns
    -------
    float
        Of the steps and of the transponder, m²; heights all on steps of 100 ft are told in them,
        others are finer.
    """
    beside = np.abs(height_m - COARSE_STEP_M * np.round(height_m / COARSE_STEP_M))
    step = COARSE_VARIANCE if bool((beside <= ROUNDING_M).all()) else FINE_VARIANCE
    return float(TRANSPONDER_VARIANCE + step)


def _reported(plots: Plots, sensors: SensorTable, variance: float) -> PlotPositions:
    frame = SystemPlane(float(plots.latitude_rad[-1]), float(plots.longitude_rad[-1]))
    east, north = frame.to_plane(plots.latitude_rad, plots.longitude_rad)
    covariances = np.zeros((len(east), 3, 3))
    covariances[:, 0, 0] = sensors.position_sigma_m[plots.sensor] ** 2
    covariances[:, 1, 1] = covariances[:, 0, 0]
    covariances[:, 2, 2] = variance
    positions = np.column_stack([east, north, plots.height_m])
    return PlotPositions(frame, plots.time_s, positions, covariances)


# The foot of the last plot that has one, found on the plane of its radar.
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
    raise PlaneError("TOO_FEW_POINTS", "expected plots that have a place, was none")


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
