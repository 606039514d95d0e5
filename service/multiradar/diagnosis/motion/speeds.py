"""Ground speeds of targets, by which those that fly, and those on the ground or the sea, are known.

Heights do not enter: they are what is examined by it.
"""

from dataclasses import replace

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.cross_sensor.plausibility import aircraft_of
from multiradar.diagnosis.motion.vertical_rates import pairs_apart
from multiradar.diagnosis.plots import Booleans, Floats, Integers, Plots, Site, positions

#: Aircraft taxi, vehicles drive and ships sail more slowly than the first, m/s; aircraft are faster
#: than the second only in flight.
SURFACE_MPS, FLYING_MPS = 30.0, 100.0
#: Aircraft with their next heights above this fly, m; slow ones only for so long, s, in which they
#: cannot land.
FLYING_M, _LANDING_S = 300.0, 30.0
#: Time between two plots for a speed, s.
_APART_S = (20.0, 60.0)


def are_slow(plots: Plots, site: Site | None) -> bool:
    """Return whether most targets are on the ground or the sea, by their speeds.

    Parameters
    ----------
    plots : Plots
        Plots of one sensor.
    site : Site, optional
        Of a radar, rad and m; None for a sensor that reports positions.
    """
    _, _, speed_mps = _speeds(plots, site, aircraft_of(plots))
    return len(speed_mps) >= TESTED_MIN and float(np.nanmedian(speed_mps)) < SURFACE_MPS


def are_flying(plots: Plots, site: Site | None) -> Booleans:
    """Return which plots, (n,), are those of aircraft in flight, whatever their own height is.

    Parameters
    ----------
    plots : Plots
        Plots of one sensor.
    site : Site, optional
        Of a radar, rad and m; None for a sensor that reports positions.

    Returns
    -------
    (n,) bool
        By the speed before or after each plot, whichever is less; below `FLYING_MPS` by the heights
        before and after it that are not 0.
    """
    names = aircraft_of(plots)
    first, last, speed_mps = _speeds(plots, site, names)
    slower_mps = np.full(plots.size, np.nan)
    for rows in (first, last):
        slower_mps[rows] = np.fmin(slower_mps[rows], speed_mps)
    within_s = np.where(slower_mps > SURFACE_MPS, np.inf, _LANDING_S)
    high = _lowest_beside(plots, names, within_s) > FLYING_M
    return np.asarray((slower_mps > FLYING_MPS) | high)


# Rows of pairs of plots of one target, and the speed from one to the other.
def _speeds(
    plots: Plots, site: Site | None, names: Integers
) -> tuple[Integers, Integers, Floats]:  # fmt: skip
    where = positions(replace(plots, height_m=np.zeros(plots.size)), site)
    first, last = pairs_apart(plots.time_s, names, *_APART_S)
    known = (names[first] >= 0) & np.isfinite(where[first] + where[last]).all(axis=1)
    first, last = first[known], last[known]
    apart_s = plots.time_s[last] - plots.time_s[first]
    return first, last, np.linalg.norm(where[last] - where[first], axis=1) / apart_s


# The lower of the next known heights before and after each plot that are not 0, if they are within
# so long of it; NaN without any.
def _lowest_beside(plots: Plots, names: Integers, within_s: Floats) -> Floats:
    order = np.lexsort((plots.time_s, names))
    found = np.full(plots.size, np.nan)
    for rows in (order, order[::-1]):
        height_m = np.where(plots.height_m[rows] == 0.0, np.nan, plots.height_m[rows])
        place = np.arange(len(rows))
        source = np.maximum.accumulate(np.where(np.isfinite(height_m), place, -1))
        same = (source >= 0) & (names[rows] >= 0) & (names[rows[source]] == names[rows])
        same &= np.abs(plots.time_s[rows] - plots.time_s[rows[source]]) <= within_s[rows]
        found[rows] = np.fmin(found[rows], np.where(same, height_m[source], np.nan))
    return found
