"""Which sensors measure from the same site."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import KIND_POSITION
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_FRAME_EAST,
    PARAMETER_FRAME_NORTH,
    PARAMETER_FRAME_ROTATION,
    SensorTable,
)
from multiradar.geodesy.wgs84 import geodetic_to_ecef

#: Sensors closer together than this measure from one site, m.
ONE_SITE_M = 1000.0


def numbers_of_sites(sensors: SensorTable) -> NDArray[np.int64]:
    """Return the number of the site of each sensor on WGS 84.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.

    Returns
    -------
    (m,) int64
        Index of the first sensor at the same site, see `ONE_SITE_M`. A sensor that measures from
        no fixed site keeps its own: one without coordinates, a moving one, and one of reported
        positions (ADS-B, multilateration), whose coordinates are those of a station that receives.
        One whose local frame is estimated has that of the nearest sensor that may be turned, too.

    Notes
    -----
    Sensors at one site cannot distinguish a rotation of the antenna from one of the air picture,
    because both measure from the same origin. A position has none, wherever it was received. A
    frame whose rotation and shift are both unknown may be turned about any point, also about that
    of a radar with an unknown azimuth offset: the two show no common turn, and linearisation at
    every plot would make one appear observable.
    """
    height_m = np.nan_to_num(sensors.height_m)
    position = geodetic_to_ecef(sensors.latitude_rad, sensors.longitude_rad, height_m)
    found = site_numbers(position, (sensors.kinds != KIND_POSITION) & ~sensors.moving)
    free = _estimated(sensors, PARAMETER_FRAME_ROTATION) & (
        _estimated(sensors, PARAMETER_FRAME_EAST) | _estimated(sensors, PARAMETER_FRAME_NORTH)
    )
    turned = _estimated(sensors, PARAMETER_AZIMUTH_OFFSET) & ~sensors.moving
    for number in np.flatnonzero(free).tolist():
        if turned.any():
            distance_m = np.linalg.norm(position - position[number], axis=1)
            found[number] = found[np.argmin(np.where(turned, distance_m, np.inf))]
        turned[number] = True
    return found


def _estimated(sensors: SensorTable, kind: int) -> NDArray[np.bool_]:
    owners = sensors.parameter_sensor[sensors.parameter_kind == kind]
    return np.isin(np.arange(len(sensors)), owners)


def site_numbers(
    position_m: NDArray[np.float64], measures_from_it: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Return the number of the site of each sensor, from positions.

    Parameters
    ----------
    position_m : (m, d) float64
        Positions of the sensors; NaN without one.
    measures_from_it : (m,) bool
        Whether the sensor measures from its position.

    Returns
    -------
    (m,) int64
        As `numbers_of_sites`.
    """
    distance_m = np.linalg.norm(position_m[:, None, :] - position_m[None, :, :], axis=-1)
    fixed = measures_from_it[:, None] & measures_from_it[None, :]
    same = ((distance_m < ONE_SITE_M) & fixed) | np.eye(len(position_m), dtype=np.bool_)
    return np.asarray(np.argmax(same, axis=1), np.int64)
