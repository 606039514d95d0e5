"""Compiled consistency check of the reports of each aircraft in file order."""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, loop

Words = NDArray[np.int64]
Numbers = NDArray[np.float64]

#: Results for a report.
GOOD, REPEATED, STALE = range(3)

#: Indices in the counts of `check_reports`.
BACKWARDS, JUMPS = range(2)

#: Indices in the state of an aircraft: time of the last report, its position, and the time at which
#: this position was first reported.
LAST, LATITUDE, LONGITUDE, SINCE = range(4)
STATE_NUMBERS = 4

_EARTH_RADIUS_M = 6_371_000.0


@in_loop
def _distance_m(latitude: float, longitude: float, other: float, other_longitude: float) -> float:
    """Great-circle distance, m, of positions in degrees; accurate to 0.5 %."""
    half_north = np.radians(latitude - other) / 2.0
    half_east = np.radians(longitude - other_longitude) / 2.0
    chord = (
        np.sin(half_north) ** 2
        + np.cos(np.radians(latitude)) * np.cos(np.radians(other)) * np.sin(half_east) ** 2
    )
    along: float = 2.0 * _EARTH_RADIUS_M * np.arcsin(min(1.0, np.sqrt(chord)))
    return along


@loop
def check_reports(
    time: Numbers, latitude: Numbers, longitude: Numbers, speed: Numbers, ground: Words,
    aircraft: Words, stale_m: float, speed_max_mps: float, step_s: float, state: Numbers,
    result: Words, counts: Words,
) -> None:  # fmt: skip
    """Check reports (see `consistency.ConsistencyCheck`).

    Parameters
    ----------
    time, latitude, longitude, speed : float64[n]
        s, degrees, m/s (NaN: none).
    ground : int64[n]
        1 if on the ground.
    aircraft : int64[n]
        Row of each in `state`.
    stale_m, speed_max_mps, step_s : float
        Limits.
    state : float64[a, STATE_NUMBERS]
        State of each aircraft (NaN: unknown); updated in place.
    result : int64[n]
        Filled.
    counts : int64[2]
        Reports with decreasing time, and jumps; incremented.
    """
    for k in range(len(time)):
        known = state[aircraft[k]]
        passed = time[k] - known[LAST]
        same = latitude[k] == known[LATITUDE] and longitude[k] == known[LONGITUDE]
        result[k] = GOOD
        if passed < 0.0:
            counts[BACKWARDS] += 1
        if same:
            since = time[k] - known[SINCE]
            if since == 0.0 or passed == 0.0:
                result[k] = REPEATED
                continue
            # Without ground speed (NaN) the comparison is false.
            if since > 0.0 and ground[k] != 1 and speed[k] * since > stale_m:
                result[k] = STALE
                continue
            if since < 0.0:
                known[SINCE] = time[k]
        else:
            moved = _distance_m(latitude[k], longitude[k], known[LATITUDE], known[LONGITUDE])
            if moved > speed_max_mps * (abs(passed) + step_s):
                counts[JUMPS] += 1
            known[LATITUDE], known[LONGITUDE], known[SINCE] = latitude[k], longitude[k], time[k]
        known[LAST] = time[k]
