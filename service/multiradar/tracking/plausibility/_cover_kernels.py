"""Compiled cover of radars: whether they should see an aircraft that only its reports tell of.

References
----------
The project's own. Rays of radio bend by a quarter of the Earth's curvature: ITU-R P.834, section 3.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import HEIGHT_MAX
from multiradar.estimation.filters.arrays import Model
from multiradar.estimation.measurement._kernels import KIND_RADAR, expected_measurement
from multiradar.tracking.plausibility.trust import SECTORS, Trust, Watch
from multiradar_compiled.kernels import in_loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Turns of a radar that should see an aircraft, and how many places must miss it.
GHOST_TURNS = 3.0
GHOST_PLACES = 2
# A radar works that gave a plot within so many turns.
ALIVE_TURNS = 2.5
# What a radar covers: this part of its range, no steeper than ground range over height, at so
# large a sine of the elevation, or where it saw others. Twice the radius of the Earth as radio
# waves bend, m.
RANGE_PART = 0.98
STEEPEST_RATIO = 2.0
FREE_SIGHT = math.sin(math.radians(1.5))
RADIO_DIAMETER_M = 17.0e6


@in_loop
def is_ghost(
    k: int, time: float, east: float, north: float, height: float, model: Model, watch: Watch,
    trust: Trust,
) -> bool:  # fmt: skip
    """Return whether radars on several sites should have seen an aircraft for some turns."""
    places = model.site_numbers
    missing = 0
    for s in range(places.shape[0]):
        covered = False
        if watch.kind[s] == KIND_RADAR and time - watch.alive[s] <= ALIVE_TURNS * watch.period[s]:
            covered = covers(s, east, north, height, model, watch)
        if not covered:
            trust.unseen[k, s] = np.nan
        elif np.isnan(trust.unseen[k, s]):
            trust.unseen[k, s] = time
        elif time - trust.unseen[k, s] >= GHOST_TURNS * watch.period[s]:
            counted = False
            for before in range(s):
                if places[before] == places[s] and not np.isnan(trust.unseen[k, before]):
                    late = time - trust.unseen[k, before]
                    counted = counted or late >= GHOST_TURNS * watch.period[before]
            missing += not counted
    return missing >= GHOST_PLACES


@in_loop
def covers(s: int, east: float, north: float, height: float, model: Model, watch: Watch) -> bool:
    """Return whether a radar should see what is at a place; not where that is in doubt."""
    result = False
    if abs(height) < HEIGHT_MAX:
        reach, azimuth, ground, _, _ = expected_measurement(
            KIND_RADAR, model.plane, model.sites[s], model.noises[s], east, north, height, 0.0
        )
        most = watch.range_max[s]
        if not most < np.inf:
            most = watch.farthest[s]
        rise = height - model.noises[s, 3]
        sine = sine_of_elevation(rise, reach)
        free = sine >= FREE_SIGHT or sine >= watch.lowest[s, sector_of(azimuth)]
        result = reach <= RANGE_PART * most and ground > STEEPEST_RATIO * rise and free
    return result


@in_loop
def sector_of(azimuth: float) -> int:
    """Return the sector of an azimuth, rad."""
    return int(np.floor(azimuth * (SECTORS / (2.0 * math.pi)))) % SECTORS


@in_loop
def sine_of_elevation(rise: float, reach: float) -> float:
    """Return the sine of the elevation at which a radar sees what is higher than it by a rise."""
    return rise / reach - reach / RADIO_DIAMETER_M
