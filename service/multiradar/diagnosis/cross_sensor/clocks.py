"""Clock errors of sensors that report positions, from the path of each aircraft."""

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN, Comparison
from multiradar.diagnosis.cross_sensor.references import RECORDING, Pairs, are_named
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation

#: Range of clock errors that are reported, s: smaller ones are those of transmission, and across
#: longer ones an aircraft turns.
LATE_MIN_S, LATE_MAX_S = 1.0, 600.0
#: Speed that the time along a path needs, m/s.
_SPEED_MIN_MPS = 60.0
#: Positions are this far from the path of their aircraft at most, m, and the time offsets of half
#: of them this close to their median, s and as a fraction of it.
_ACROSS_M, _ALIKE_S, _ALIKE = 3000.0, 1.5, 0.1
#: GPS minus UTC since 2017, s (IERS Bulletin C 52).
GPS_MINUS_UTC_S, _GPS_WITHIN_S = 18.0, 0.7


def late_positions(comparison: Comparison, number: int, pairs: Pairs) -> float:
    """Return the time offset of reported positions against others, s; NaN where unknown.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    number : int
        A sensor that reports positions.
    pairs : Pairs
        Positions of its aircraft by others.

    Returns
    -------
    float
        Claimed time minus true time: positive where its clock is ahead.
    """
    pairs = pairs.select(pairs.source != RECORDING)
    if not pairs.size or not are_named(pairs):
        return np.nan
    latitude, longitude, _ = ecef_to_geodetic(pairs.position_m)
    rotation = enu_rotation(latitude, longitude)
    own_m = comparison.tested_positions(number)[pairs.plot]
    apart_m = np.einsum("kij,kj->ki", rotation, own_m - pairs.position_m)[:, :2]
    flown_mps = np.einsum("kij,kj->ki", rotation, pairs.velocity_mps)[:, :2]
    speed_mps = np.linalg.norm(flown_mps, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        late_s = -np.sum(apart_m * flown_mps, axis=1) / speed_mps**2
        across_m = np.linalg.norm(apart_m + flown_mps * late_s[:, None], axis=1)
    # The path behind a turn is another: the farther from the time, the wider.
    near = (across_m <= _ACROSS_M + 0.2 * np.abs(late_s) * speed_mps) & (
        speed_mps >= _SPEED_MIN_MPS
    )
    late_s = late_s[near & (np.abs(late_s) <= LATE_MAX_S)]
    if len(np.unique(pairs.plot)) < TESTED_MIN or len(late_s) < 0.5 * pairs.size:
        return np.nan
    middle_s = float(np.median(late_s))
    spread_s = float(np.median(np.abs(late_s - middle_s)))
    return middle_s if spread_s <= max(_ALIKE_S, _ALIKE * abs(middle_s)) else np.nan


def gps_time(late_s: float) -> str:
    """Return a hint if a clock is ahead by as much as GPS time is of UTC, else nothing."""
    is_gps = abs(late_s - GPS_MINUS_UTC_S) <= _GPS_WITHIN_S
    return " (GPS time instead of UTC?)" if is_gps else ""
