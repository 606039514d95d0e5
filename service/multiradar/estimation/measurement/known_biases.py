"""Correction of measurements for biases.

Known biases are removed before a measurement is tracked. Estimated ones are parts of the state of
the filters, which never see corrected plots; they are removed for display, queries and analyses.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.angles import wrapped
from multiradar.estimation.measurement.kinds import KIND_POSITION
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_COSINE,
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_AZIMUTH_SINE,
    PARAMETER_FRAME_EAST,
    PARAMETER_FRAME_NORTH,
    PARAMETER_FRAME_ROTATION,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
    SensorTable,
)
from multiradar.geodesy.system_plane import SystemPlane

Floats = NDArray[np.float64]

#: Biases of a local frame.
FRAME_PARAMETERS = (PARAMETER_FRAME_EAST, PARAMETER_FRAME_NORTH, PARAMETER_FRAME_ROTATION)
#: Reach of a local frame from its reference point, rad (300 km).
FRAME_REACH_RAD = 0.05

_BY_AZIMUTH = (
    PARAMETER_AZIMUTH_SINE, PARAMETER_AZIMUTH_COSINE, PARAMETER_FRAME_EAST, PARAMETER_FRAME_NORTH,
)  # fmt: skip
_ROUNDS = 3


class Measured(NamedTuple):
    """Time stamps (s), ranges (m) and azimuths (rad) of measurements."""

    time_s: Floats
    range_m: Floats
    azimuth_rad: Floats


def without_known_biases(measured: Measured, known: Floats) -> Measured:
    """Return measurements corrected for known biases.

    Parameters
    ----------
    measured : Measured
        As measured, (n,) each; NaN stays NaN.
    known : (n, p) float64
        `SensorTable.known_bias` of the sensor of each measurement.

    Returns
    -------
    Measured
        Time minus time offset; range and azimuth as in `polar_without_biases`.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.5) solved for the true measurement: measured = true +
    offset, plus gain · true for the range. Unlike J, the time offset is exact.
    """
    range_m, azimuth_rad = polar_without_biases(measured.range_m, measured.azimuth_rad, known)
    time_s = measured.time_s - known[:, PARAMETER_TIME_OFFSET]
    return Measured(time_s=time_s, range_m=range_m, azimuth_rad=azimuth_rad)


def polar_without_biases(
    range_m: Floats, azimuth_rad: Floats, biases: Floats
) -> tuple[Floats, Floats]:
    """Return ranges and azimuths corrected for biases; times are unchanged.

    Parameters
    ----------
    range_m, azimuth_rad : (n,) float64
        As measured, m and rad; NaN stays NaN.
    biases : (n, p) float64
        Known or estimated biases of the sensor of each measurement.

    Returns
    -------
    range_m, azimuth_rad : (n,) float64
        (Range minus range offset) / (1 + range gain), and azimuth minus azimuth offset in [0, 2π);
        both without eccentricity and shift of the frame, by their effects at the true azimuth. An
        azimuth without range keeps the effect of the shift, which depends on the range.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.5) solved for the true measurement; the effects of
    eccentricity and frame are the project's own: see `bias_parameters`.
    """
    offset, gain = biases[:, PARAMETER_RANGE_OFFSET], biases[:, PARAMETER_RANGE_GAIN]
    true_m = (range_m - offset) / (1.0 + gain)
    corrected = azimuth_rad - biases[:, PARAMETER_AZIMUTH_OFFSET]
    if biases[:, _BY_AZIMUTH].any():
        sine, cosine, east, north = biases[:, _BY_AZIMUTH].T
        # Without a range the effect of a shift is unknown, and neglected as in the filters.
        least_m = np.where(np.isnan(true_m), np.inf, np.maximum(true_m, 1.0))
        true_rad = corrected
        # Each round gains the digits of the effect, which is a small angle.
        for _ in range(_ROUNDS):
            s, c = np.sin(true_rad), np.cos(true_rad)
            true_rad = corrected - sine * s - cosine * c - (east * c - north * s) / least_m
        true_m = true_m - east * np.sin(true_rad) - north * np.cos(true_rad)
        corrected = true_rad
    return true_m, np.mod(corrected, 2.0 * np.pi)


def position_without_biases(
    east_m: Floats, north_m: Floats, biases: Floats
) -> tuple[Floats, Floats]:
    """Return reported positions corrected for biases of their local frame.

    Parameters
    ----------
    east_m, north_m : (n,) float64
        From the reference point of the frame, along its axes; NaN stays NaN.
    biases : (n, p) float64
        Known or estimated biases of the sensor of each measurement.

    Returns
    -------
    east_m, north_m : (n,) float64
        Without the shift, and turned back counter-clockwise.

    References
    ----------
    The project's own: `bias_parameters` solved for the true position; the rotation is exact.
    """
    east = east_m - biases[:, PARAMETER_FRAME_EAST]
    north = north_m - biases[:, PARAMETER_FRAME_NORTH]
    turn = biases[:, PARAMETER_FRAME_ROTATION]
    sine, cosine = np.sin(turn), np.cos(turn)
    return cosine * east - sine * north, sine * east + cosine * north


def reports_without_frames(
    latitude_rad: Floats,
    longitude_rad: Floats,
    sensor: NDArray[np.integer],
    sensors: SensorTable,
    biases: Floats,
) -> tuple[Floats, Floats]:
    """Return reported positions on WGS 84 corrected for biases of local frames.

    Parameters
    ----------
    latitude_rad, longitude_rad : (n,) float64
        As reported; NaN stays NaN.
    sensor : (n,) int
        Sensor of each.
    sensors : SensorTable
        The sensors; the site of one is the reference point of its frame.
    biases : (m, p) float64
        Known or estimated biases of each sensor; 0 where it has none.

    Returns
    -------
    latitude_rad, longitude_rad : (n,) float64
        Corrected in the plane at the reference point, up to `FRAME_REACH_RAD` from it; positions
        farther away do not come from such a frame.

    References
    ----------
    The project's own: see `position_without_biases`.
    """
    framed = (biases[:, FRAME_PARAMETERS] != 0.0).any(axis=1) & (sensors.kinds == KIND_POSITION)
    if not framed.any():
        return latitude_rad, longitude_rad
    latitude, longitude = latitude_rad.copy(), longitude_rad.copy()
    for number in np.flatnonzero(framed).tolist():
        centre = float(sensors.latitude_rad[number]), float(sensors.longitude_rad[number])
        near = np.abs(latitude - centre[0]) < FRAME_REACH_RAD
        near &= np.abs(wrapped(longitude - centre[1])) * np.cos(centre[0]) < FRAME_REACH_RAD
        own = np.flatnonzero(near & (sensor == number))
        plane = SystemPlane(*centre)
        position = plane.to_plane(latitude[own], longitude[own])
        corrected = position_without_biases(*position, biases[[number]])
        latitude[own], longitude[own] = plane.to_geodetic(*corrected)
    return latitude, longitude
