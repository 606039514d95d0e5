"""Magnetic variation from headings, tracks and speeds of many aircraft.

The wind of a report is its ground velocity minus its velocity through the air. With the right
variation the winds of a layer of heights agree, whatever the headings: the variation sought is that
with the least scatter. Headings of one direction leave it open, since every variation then adds the
same wind to all.
"""

import numpy as np

from multiradar_converters.aircraft_data import quantities as q
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


def magnetic_variation(values: Numbers, height_m: Numbers) -> float | None:
    """Estimate the magnetic variation.

    Parameters
    ----------
    values : float64[n, 10]
        Columns of `QUANTITIES`, of the reports of one sensor.
    height_m : float64[n]
        Heights, m; NaN for none.

    Returns
    -------
    float or None
        Degrees, positive to the east; None if there are too few reports, or all have the same
        heading.
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
    rows = rows[np.argsort(layer, kind="stable")]
    course = np.radians(track[rows])
    parts = [ground[rows] * np.sin(course), ground[rows] * np.cos(course), air[rows], heading[rows]]
    # Each layer apart.
    cuts = np.flatnonzero(np.diff(np.sort(layer))) + 1
    layers = list(zip(*(np.split(part, cuts) for part in parts), strict=True))
    best = 0.0
    around = np.arange(-VARIATION_MAX_DEG, VARIATION_MAX_DEG + 1.0, _STEPS_DEG[0])
    for step in _STEPS_DEG:
        scatters = [_scatter(layers, one) for one in around]
        best = float(around[int(np.argmin(scatters))])
        around = np.arange(best - step, best + step, _STEPS_DEG[1])
    least = _scatter(layers, best)
    others = (_scatter(layers, best - _OFF_DEG), _scatter(layers, best + _OFF_DEG))
    return round(best, 1) if min(others) > CONTRAST_MIN * least else None


# Median distance of the wind from that of its layer; of a layer: ground speed east and north,
# airspeed, heading.
def _scatter(layers: list[tuple[Numbers, ...]], variation_deg: float) -> float:
    apart = []
    for ground_east, ground_north, air, heading in layers:
        nose = np.radians(heading + variation_deg)
        east = ground_east - air * np.sin(nose)
        north = ground_north - air * np.cos(nose)
        apart.append(np.hypot(east - np.median(east), north - np.median(north)))
    return float(np.median(np.concatenate(apart)))
