"""The usual scheme for comparison: position fixes are computed from angles first, then tracked.

References
----------
Nenartovich, Isakov, the section on the simulation, which does not specify it. Least squares over
the lines of sight of a scan and a Kalman filter over the fixes are the project's own reading.
"""

import numpy as np

from multiradar.estimation.filters.bearings_only import BearingsState, initiate, predict
from multiradar.estimation.measurement.sights import Sight
from multiradar.research.studies.bearing_only.runs import (
    AZIMUTH_SIGMA_RAD,
    DENSITY,
    ELEVATION_SIGMA_RAD,
    SPEED_SIGMA_MPS,
    Bearings,
    Filtered,
    collected,
)


def triangulated(bearings: Bearings, *, extrapolated: bool) -> Filtered:
    """Compute a position fix from the angles of each scan first, and track the fixes.

    Parameters
    ----------
    bearings : Bearings
        Bearings without ranges.
    extrapolated : bool
        Whether the angles of a scan are extrapolated to the time of its last one, by the rate
        between the last two of each source; else they are treated as simultaneous.

    Returns
    -------
    Filtered
        At the last angle of each scan, from the second scan on; a scan with one angle gives no
        fix.

    References
    ----------
    Nenartovich, Isakov, the section on the simulation: the usual scheme.
    """
    found: list[tuple[int, BearingsState]] = []
    state: BearingsState | None = None
    for number in range(1, int(bearings.scan[-1]) + 1):
        of_scan = np.flatnonzero(bearings.scan == number).tolist()
        if not of_scan:
            continue
        time_s = float(bearings.times_s[of_scan[-1]])
        fix = (
            _position_fix(bearings, of_scan, time_s, extrapolated=extrapolated)
            if len(of_scan) > 1
            else None
        )
        state = fix if state is None else _with_fix(predict(state, time_s, DENSITY), fix)
        if state is not None:
            found.append((of_scan[-1], state))
    return collected(bearings, found)


# Simultaneous angles: the velocity does not enter the fix.
def _position_fix(
    bearings: Bearings, of_scan: list[int], time_s: float, *, extrapolated: bool
) -> BearingsState:
    sights = [
        _extrapolated(bearings, index, time_s) if extrapolated else bearings.sights[index]
        for index in of_scan
    ]
    return initiate(sights, np.full(len(sights), time_s), SPEED_SIGMA_MPS)


def _with_fix(state: BearingsState, fix: BearingsState | None) -> BearingsState:
    if fix is None:
        return state
    d = state.vector.shape[-1] // 2
    information, vector = state.information.copy(), state.vector.copy()
    information[..., :d, :d] += fix.information[..., :d, :d]
    vector[..., :d] += fix.vector[..., :d]
    return BearingsState(state.time_s, information, vector, state.crossing)


# A bearing extrapolated to a later time, by the rate since the previous one of the same source.
def _extrapolated(bearings: Bearings, index: int, time_s: float) -> Sight:
    earlier = np.flatnonzero(bearings.source[:index] == bearings.source[index])
    now, before = bearings.sights[index], bearings.sights[earlier[-1]]
    apart_s = float(bearings.times_s[index] - bearings.times_s[earlier[-1]])
    ahead = (time_s - float(bearings.times_s[index])) / apart_s
    noise = float(np.hypot(1.0 + ahead, ahead))
    elevation = elevation_sigma = None
    if now.elevation_rad is not None and before.elevation_rad is not None:
        elevation = now.elevation_rad + ahead * (now.elevation_rad - before.elevation_rad)
        elevation_sigma = noise * ELEVATION_SIGMA_RAD
    return Sight(
        now.source_m, now.azimuth_rad + ahead * (now.azimuth_rad - before.azimuth_rad),
        noise * AZIMUTH_SIGMA_RAD, elevation, elevation_sigma,
    )  # fmt: skip
