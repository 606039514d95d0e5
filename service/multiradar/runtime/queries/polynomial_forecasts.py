"""Plots of live tracks for polynomial forecasts."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import PlaneError, TrajectoryError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.restoration.geometry.plot_positions import PlotPositions, plot_positions
from multiradar.runtime.queries.track_windows import bias_estimates, window_plots
from multiradar.tracking.forecast.polynomial_forecast import PolynomialForecast, polynomial_forecast

Floats = NDArray[np.float64]


class LastPlots(NamedTuple):
    """Plots in the local frame of the last of them, and the plane of forecasts."""

    placed: PlotPositions
    plane: SystemPlane

    def forecast(self, time_s: Floats) -> PolynomialForecast:
        """Return the predicted positions on the plane at ascending data times, s.

        NaN from where the path leaves the plane or the frame.

        Raises
        ------
        TrajectoryError
            If there are too few plots.
        """
        placed, plane = self
        found = polynomial_forecast(
            placed.time_s, placed.positions_m[:, :2], placed.covariances_m2[:, :2, :2], time_s
        )
        inside = np.logical_and.accumulate(placed.frame.contains(*found.means.T))
        latitude_rad, longitude_rad = placed.frame.to_geodetic(*found.means[inside].T)
        on_plane = np.logical_and.accumulate(plane.contains_geodetic(latitude_rad, longitude_rad))
        inside[inside] = on_plane
        east, north = plane.to_plane(latitude_rad[on_plane], longitude_rad[on_plane])
        means = np.full_like(found.means, np.nan)
        means[inside] = np.column_stack([east, north])
        # The local frame has true scale near its centre.
        across = np.linalg.inv(plane.local_matrix(east, north))
        covariances = np.full_like(found.covariances, np.nan)
        covariances[inside] = across @ found.covariances[inside] @ across.transpose(0, 2, 1)
        return PolynomialForecast(means, covariances)


def last_plots(
    plane: SystemPlane,
    rows: NDArray[np.void],
    window_s: float,
    biases: NDArray[np.void],
    sensors: SensorTable,
) -> LastPlots:
    """Return the plots of a window.

    Parameters
    ----------
    plane : SystemPlane
        The plane of forecasts.
    rows : (n,) ndarray of `PLOT_DTYPE`
        The last measurements of a track, by ascending time, at least one.
    window_s : float
        Length of the window before the last measurement, s.
    biases : (k,) ndarray of `BIAS_DTYPE`
        The biases published at the time of the last measurement; the plots are corrected for them.
    sensors : SensorTable
        The sensors.

    Returns
    -------
    LastPlots
        Plots with height and position.

    Raises
    ------
    TrajectoryError
        If there are none.
    """
    estimates = bias_estimates(biases, len(sensors))
    try:
        placed = plot_positions(window_plots(rows, window_s), sensors, estimates)
    except PlaneError as error:
        raise TrajectoryError("TOO_FEW_PLOTS", str(error)) from error
    return LastPlots(placed, plane)
