"""Manoeuvre planes fitted to the last plots of a track."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.restoration.geometry.manoeuvre_plane import ManoeuvrePlane, fit_plane
from multiradar.restoration.geometry.plot_positions import PlotPositions, plot_positions
from multiradar.runtime.queries.track_windows import bias_estimates, window_plots


def plane_of_track(
    rows: NDArray[np.void], window_s: float, biases: NDArray[np.void], sensors: SensorTable
) -> dict[str, Any]:
    """Fit a plane to the plots of a window.

    Parameters
    ----------
    rows : (n,) ndarray of `PLOT_DTYPE`
        The last plots of a track, by ascending time, at least one.
    window_s : float
        Length of the window before the last plot, s.
    biases : (k,) ndarray of `BIAS_DTYPE`
        The biases published at the time of the last plot; the plots are corrected for them.
    sensors : SensorTable
        The sensors.

    Returns
    -------
    dict
        The fields of `multiradar_schemas.products.manoeuvre_plane.ManoeuvrePlane`.

    Raises
    ------
    PlaneError
        If the plots do not determine a plane.
    """
    last_s = float(rows["time_s"][-1])
    plots = window_plots(rows, window_s)
    placed = plot_positions(plots, sensors, bias_estimates(biases, len(sensors)))
    plane = fit_plane(placed.positions_m, placed.covariances_m2)
    known = {
        "track_id": int(rows["track_id"][-1]),
        "time_s": last_s,
        "window_s": float(window_s),
        **_figures(plane, placed),
    }
    return {**known, "positions": _positions(plane, placed)}


def _figures(plane: ManoeuvrePlane, placed: PlotPositions) -> dict[str, Any]:
    east, north, up = plane.normal.tolist()
    return {
        "points": plane.points,
        "normal_east": east,
        "normal_north": north,
        "normal_up": up,
        "distance_m": plane.distance_m,
        "origin_latitude_deg": float(np.degrees(placed.frame.latitude_rad)),
        "origin_longitude_deg": float(np.degrees(placed.frame.longitude_rad)),
        "tilt_deg": float(np.degrees(np.arctan2(np.hypot(east, north), up))),
        "normal_sigma_deg": float(np.degrees(plane.normal_sigma_rad)),
        "statistic": plane.statistic,
        "degrees_of_freedom": plane.degrees_of_freedom,
        "p_value": plane.p_value,
        "is_planar": plane.is_planar,
        "printed_statistic": plane.printed_statistic,
        "printed_threshold": plane.printed_threshold,
        "refused_by_printed_criterion": plane.refused_by_printed_criterion,
    }


def _positions(plane: ManoeuvrePlane, placed: PlotPositions) -> list[dict[str, float]]:
    east_m, north_m, height_m = plane.positions_m.T
    latitude_rad, longitude_rad = placed.frame.to_geodetic(east_m, north_m)
    columns = (placed.time_s, np.degrees(latitude_rad), np.degrees(longitude_rad), height_m)
    names = ("time_s", "latitude_deg", "longitude_deg", "height_m")
    return [dict(zip(names, row, strict=True)) for row in np.column_stack(columns).tolist()]
