"""Magnetic variation from headings, tracks and speeds of many aircraft.

The wind of a report is its ground velocity minus its velocity through the air. With the right
variation the winds of a layer of heights agree, whatever the headings: the variation sought is that
with the least scatter. Headings of one direction leave it open, since every variation then adds the
same wind to all.
"""

from typing import NamedTuple

import numpy as np

from multiradar_converters.aircraft_data import quantities as q
from multiradar_converters.aircraft_data.checking import Integers
from multiradar_converters.aircraft_data.plausibility import (
    AIRBORNE_MIN_M_S,
    VARIATION_MAX_DEG,
    speed_of_sound_m_s,
)
from multiradar_converters.aircraft_data.quantities import Numbers

#: Reports that are compared; more are thinned.
REPORTS_MAX = 4000
REPORTS_MIN = 30
#: The wind changes with the height.
LAYER_M = 2000.0
#: The scatter has to rise by this factor, 10 degrees off, for the variation to be known.
CONTRAST_MIN = 1.2
_OFF_DEG = 10.0
_STEPS_DEG = (2.0, 0.1)


class Variation(NamedTuple):
    """Magnetic variation, positive to the east, and the scatter of the winds with it, m/s."""

    variation_deg: float
    scatter_m_s: float


def magnetic_variation(values: Numbers, height_m: Numbers) -> Variation | None:
    """Estimate the magnetic variation.

    Parameters
    ----------
    values : float64[n, 10]
        Columns of `QUANTITIES`, of the reports of one sensor.
    height_m : float64[n]
        Heights, m; NaN for none.

    Returns
    -------
    Variation or None
        None if there are too few reports, or all have the same heading.
    """
    air = q.first_of(values[:, q.TRUE_AIRSPEED], values[:, q.MACH] * speed_of_sound_m_s(height_m))
    ground = values[:, q.GROUND_SPEED]
    heading, track = values[:, q.MAGNETIC_HEADING], values[:, q.TRACK_ANGLE]
    usable = (np.fmin(air, ground) >= AIRBORNE_MIN_M_S) & np.isfinite(heading + track + air)
    rows = np.flatnonzero(usable & np.isfinite(height_m))
    if len(rows) < REPORTS_MIN:
        return None
    rows = rows[:: len(rows) // REPORTS_MAX + 1]
    layer = np.floor(height_m[rows] / LAYER_M).astype(np.int64)
    own = np.stack([ground[rows], track[rows], air[rows], heading[rows]])
    best = 0.0
    around = np.arange(-VARIATION_MAX_DEG, VARIATION_MAX_DEG + 1.0, _STEPS_DEG[0])
    for step in _STEPS_DEG:
        scatters = [_scatter(own, layer, one) for one in around]
        best = float(around[int(np.argmin(scatters))])
        around = np.arange(best - step, best + step, _STEPS_DEG[1])
    least = _scatter(own, layer, best)
    others = (_scatter(own, layer, best - _OFF_DEG), _scatter(own, layer, best + _OFF_DEG))
    return Variation(round(best, 1), least) if min(others) > CONTRAST_MIN * least else None


def _scatter(own: Numbers, layer: Integers, variation_deg: float) -> float:
    ground, track, air, heading = own
    course, nose = np.radians(track), np.radians(heading + variation_deg)
    east = ground * np.sin(course) - air * np.sin(nose)
    north = ground * np.cos(course) - air * np.cos(nose)
    apart = np.empty(len(layer))
    for one in np.unique(layer):
        same = layer == one
        apart[same] = np.hypot(
            east[same] - np.median(east[same]), north[same] - np.median(north[same])
        )
    return float(np.median(apart))
