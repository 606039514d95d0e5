"""Positions of retained plots, as measured or without biases."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import KIND_POSITION, KIND_RADAR
from multiradar.estimation.measurement.known_biases import (
    polar_without_biases,
    reports_without_frames,
)
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.polar import polar_to_geodetic

#: Height of a plot without one where its track has none either, m.
HEIGHT_ASSUMED_M = 7_000.0

Floats = NDArray[np.float64]


def plot_coordinates(
    rows: NDArray[np.void], biases: Floats, sensors: SensorTable
) -> tuple[Floats, Floats]:
    """Return the positions of plots on WGS 84.

    Parameters
    ----------
    rows : (n,) ndarray of `PLOT_DTYPE`
        The plots.
    biases : (m, p) float64
        Biases of each sensor to be removed, measured minus true; 0 for the positions as measured.
    sensors : SensorTable
        The sensors.

    Returns
    -------
    latitude_rad, longitude_rad : (n,) float64
        At the measured height, else that of the track, else `HEIGHT_ASSUMED_M`; NaN for bearings
        and for ranges shorter than the height. Time offsets are not removed.
    """
    reported = rows["kind"] == KIND_POSITION
    latitude, longitude = reports_without_frames(
        np.where(reported, rows["latitude_rad"], np.nan),
        np.where(reported, rows["longitude_rad"], np.nan),
        rows["sensor"], sensors, biases,
    )  # fmt: skip
    height = np.where(np.isfinite(rows["height_m"]), rows["height_m"], rows["track_height_m"])
    height = np.where(np.isfinite(height), height, HEIGHT_ASSUMED_M)
    range_m, azimuth_rad = polar_without_biases(
        rows["range_m"], rows["azimuth_rad"], biases[rows["sensor"]]
    )
    for sensor in np.unique(rows["sensor"]).tolist():
        own = (rows["sensor"] == sensor) & (rows["kind"] == KIND_RADAR)
        if not own.any():
            continue
        site = (
            float(sensors.latitude_rad[sensor]), float(sensors.longitude_rad[sensor]),
            float(sensors.height_m[sensor]),
        )  # fmt: skip
        latitude[own], longitude[own] = polar_to_geodetic(
            site, range_m[own], azimuth_rad[own], height[own]
        )
    return latitude, longitude
