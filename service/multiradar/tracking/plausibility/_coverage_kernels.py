"""Compiled coverage of radars: whether they should detect an aircraft seen by ADS-B only.

References
----------
The project's own. Effective Earth radius for radio propagation: ITU-R P.834, section 3.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import HEIGHT_MAX
from multiradar.estimation.filters.arrays import Model
from multiradar.estimation.measurement._kernels import expected_measurement
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.tracking.lifecycle.report_integrity import SECTORS, ReportIntegrity, Watch
from multiradar_compiled.kernels import in_loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Number of scans for which a radar must miss an aircraft in coverage, and number of such sites.
GHOST_SCANS = 3.0
GHOST_SITES = 2
# Number of scans within which an operating radar gave a plot.
ALIVE_SCANS = 2.5
# Coverage of a radar: this fraction of its range, at least this ratio of ground range to height,
# and at least this sine of the elevation, or an elevation at which it detected others. Twice the
# effective Earth radius, m.
RANGE_PART = 0.98
STEEPEST_RATIO = 2.0
FREE_SIGHT = math.sin(math.radians(1.5))
RADIO_DIAMETER_M = 17.0e6


@in_loop
def is_ghost(
    k: int, time: float, east: float, north: float, height: float, model: Model, watch: Watch,
    integrity: ReportIntegrity,
) -> bool:  # fmt: skip
    """Return whether radars at several sites should have detected an aircraft for some scans."""
    sites = model.site_numbers
    missing = 0
    for s in range(sites.shape[0]):
        covered = False
        if watch.kind[s] == KIND_RADAR and time - watch.alive[s] <= ALIVE_SCANS * watch.period[s]:
            covered = covers(s, east, north, height, model, watch)
        if not covered:
            integrity.unseen[k, s] = np.nan
        elif np.isnan(integrity.unseen[k, s]):
            integrity.unseen[k, s] = time
        elif time - integrity.unseen[k, s] >= GHOST_SCANS * watch.period[s]:
            counted = False
            for before in range(s):
                if sites[before] == sites[s] and not np.isnan(integrity.unseen[k, before]):
                    late = time - integrity.unseen[k, before]
                    counted = counted or late >= GHOST_SCANS * watch.period[before]
            missing += not counted
    return missing >= GHOST_SITES


@in_loop
def covers(s: int, east: float, north: float, height: float, model: Model, watch: Watch) -> bool:
    """Return whether a radar covers a position; False in doubt."""
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
    """Return the sine of the elevation of a target higher than the radar by a rise."""
    return rise / reach - reach / RADIO_DIAMETER_M
