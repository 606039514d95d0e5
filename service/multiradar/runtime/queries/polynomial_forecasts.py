"""Plots of live tracks, for forecasts by a polynomial through them."""

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
        """Return where the track is expected on the plane at ascending data times, s.

        From where it leaves the plane or the frame on there are no numbers: NaN.

        Raises
        ------
        TrajectoryError
            If the plots are too few.
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
        # Metres of the local frame are true ones near its centre.
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
        Those so long before the last one are taken, s.
    biases : (k,) ndarray of `BIAS_DTYPE`
        What was published of the biases when the last one came; it is taken off.
    sensors : SensorTable
        Who measured them.

    Returns
    -------
    LastPlots
        Those that have a height and a place.

    Raises
    ------
    TrajectoryError
        If none has.
    """
    estimates = bias_estimates(biases, len(sensors))
    try:
        placed = plot_positions(window_plots(rows, window_s), sensors, estimates)
    except PlaneError as error:
        raise TrajectoryError("TOO_FEW_PLOTS", str(error)) from error
    return LastPlots(placed, plane)
