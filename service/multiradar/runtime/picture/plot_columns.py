"""Plots of the air picture: where they were measured, and where they lie without their biases."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.queries.plot_coordinates import plot_coordinates


def plot_columns(
    rows: NDArray[np.void], estimates: NDArray[np.float64], sensors: SensorTable
) -> dict[str, NDArray[Any]]:
    """Return the columns of the table `plots` of a frame.

    Parameters
    ----------
    rows : (n,) ndarray of `PLOT_DTYPE`
        The plots.
    estimates : (s, p) float64
        Biases by sensor and parameter, m, rad, 1, s.
    sensors : SensorTable
        The sensors.

    Returns
    -------
    dict of (n,) ndarray
        Time, track, number of the sensor, position as measured and without biases, degrees; NaN
        for bearings and plots without a position.
    """
    measured = plot_coordinates(rows, np.zeros_like(estimates), sensors)
    corrected = plot_coordinates(rows, estimates, sensors)
    return {
        "time_s": rows["time_s"].astype(np.float64),
        "track_id": rows["track_id"].astype(np.float64),
        "sensor": rows["sensor"].astype(np.int32),
        "latitude_deg": np.degrees(measured[0]),
        "longitude_deg": np.degrees(measured[1]),
        "corrected_latitude_deg": np.degrees(corrected[0]),
        "corrected_longitude_deg": np.degrees(corrected[1]),
    }
