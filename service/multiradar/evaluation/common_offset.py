"""An offset that all tracks have in common from the reference: in position, or in time."""

from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.instants import Instants
from multiradar.evaluation.matching import near_pairs
from multiradar.evaluation.measures.update_errors import UpdateErrors
from multiradar.evaluation.trajectories import Floats
from multiradar.report.times import gps_time

#: Aircraft with so many updates count; fewer of them show no common offset.
UPDATES_MIN, AIRCRAFT_MIN = 20, 4
#: Smaller offsets are those of registration, m.
OFFSET_MIN_M = 50.0
#: Half of the aircraft are within this fraction of the offset from it, and the errors without the
#: offset are smaller by this factor: then it is most of the error.
SCATTER_MAX, REMAINING_MAX = 0.5, 0.5
#: From this offset on, m, it is an error: the distance of two datums or antennas is smaller.
ERROR_MIN_M = 250.0
#: Time offsets that are tried, s: up to a minute or two, as of leap seconds, and whole hours, as of
#: time zones; instants at which they are tried, at most.
LATE_MAX_S, HOUR_S, ZONES_MAX, TRIED_MAX = 120.0, 3600.0, 14, 60
#: An offset is the cause if with it so much of the time of the aircraft has a track, and this much
#: more than without it; of so many positions.
MATCHED_MIN, MATCHED_MORE, POSITIONS_MIN = 0.6, 0.3, 100
#: Slower aircraft show no time, m/s.
_SPEED_MIN_MPS = 50.0
_POINTS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")


@dataclass(frozen=True, slots=True)
class CommonOffset:
    """What all tracks are displaced by.

    Attributes
    ----------
    sentence : str
        Its size and direction, and what to check.
    dominates : bool
        Whether it is so large that the other figures say little.
    """

    sentence: str
    dominates: bool


def common_offset(errors: UpdateErrors) -> CommonOffset | None:
    """Return the offset that all tracks have in common from the reference, if it is most of it.

    Parameters
    ----------
    errors : UpdateErrors
        Errors of updates.

    Returns
    -------
    CommonOffset or None
        None where it is small, differs between aircraft, or few aircraft were compared.
    """
    aircraft, counts = np.unique(errors.aircraft, return_counts=True)
    medians_m = np.array(
        [
            np.median(errors.offset_m[errors.aircraft == one], axis=0)
            for one in aircraft[counts >= UPDATES_MIN]
        ]
    ).reshape(-1, 2)
    if len(medians_m) < AIRCRAFT_MIN:
        return None
    east_m, north_m = np.median(medians_m, axis=0).tolist()
    size_m = float(np.hypot(east_m, north_m))
    scatter_m = float(np.median(np.hypot(*(medians_m - [east_m, north_m]).T)))
    before_m = float(np.median(errors.position_m))
    after_m = float(np.median(np.hypot(*(errors.offset_m - [east_m, north_m]).T)))
    if size_m < OFFSET_MIN_M or scatter_m > SCATTER_MAX * size_m:
        return None
    if after_m > REMAINING_MAX * before_m:
        return None
    point = _POINTS[round(np.degrees(np.arctan2(east_m, north_m)) / 45.0) % 8]
    return CommonOffset(
        f"all tracks are displaced by about {size_m:.0f} m to the {point} of the reference "
        f"({east_m:+.0f} m east, {north_m:+.0f} m north; median error {before_m:.0f} m, with this "
        f"offset removed {after_m:.0f} m): check the positions of the reference (another datum or "
        "origin?) and the sensor sites",
        size_m >= ERROR_MIN_M,
    )


def time_offset(instants: Instants, gate_m: float) -> str | None:
    """Return the time offset with which the tracks match a reference that they rarely match.

    Parameters
    ----------
    instants : Instants
        Tracks and aircraft, and their assignment.
    gate_m : float
        Association radius, m.

    Returns
    -------
    str or None
        A sentence, with the offset; None where no offset explains it.
    """
    before = float(np.mean(instants.track_of >= 0))
    # Tracks that have their aircraft are at the right time: the reference has more than they do.
    if max(before, float(np.mean(instants.aircraft_of >= 0))) > 1.0 - MATCHED_MORE:
        return None
    near = int(LATE_MAX_S / instants.step_s)
    zones = [round(sign * one * HOUR_S / instants.step_s)
             for one in range(1, ZONES_MAX + 1) for sign in (1, -1)]  # fmt: skip
    found = [_shifted(instants, gate_m, steps) for steps in (*range(-near, near + 1), *zones)]
    matched, late_s = max(found, key=lambda one: one[0])
    if not matched >= max(MATCHED_MIN, before + MATCHED_MORE):
        return None
    # Once more from there: along the path behind a turn, the offset is another.
    _, late_s = _shifted(instants, gate_m, -round(late_s / instants.step_s))
    sense = "ahead of" if late_s > 0.0 else "behind"
    hours = round(late_s / HOUR_S)
    size = f"{abs(late_s):.1f} s"
    hint = gps_time(late_s)
    if hours:
        size, hint = f"{size} (about {abs(hours)} h)", ": another time zone?"
    return (
        f"the times of the reference are probably {size} {sense} those of the tracks{hint}: "
        f"without this offset its aircraft have a track within {gate_m:.12g} m (--gate) for "
        f"{matched:.0%} of their time ({before:.0%} as recorded); correct the times of the "
        "reference, or those of the tracked recording"
    )


# Fraction of the aircraft that have a track so many instants later, and the time offset of the
# reference that this implies, s.
def _shifted(instants: Instants, gate_m: float, steps: int) -> tuple[float, float]:
    count = len(instants.time_s)
    common = np.arange(max(0, -steps), min(count, count - steps))
    wanted = np.zeros(count + 1, np.bool_)
    wanted[common[np.linspace(0, len(common) - 1, min(TRIED_MAX, len(common))).astype(np.intp)]] = (
        True
    )
    own = np.flatnonzero(wanted[instants.aircraft_instant])
    at = instants.track_instant - steps
    other = np.flatnonzero(wanted[np.where((at >= 0) & (at < count), at, count)])
    if len(own) < POSITIONS_MIN:
        return 0.0, 0.0
    first, second, distance_m = near_pairs(
        instants.aircraft_m[own],
        instants.aircraft_instant[own],
        instants.track_m[other],
        at[other],
        gate_m,
    )
    order = np.lexsort((distance_m, first))
    _, nearest = np.unique(first[order], return_index=True)
    first, second = own[first[order][nearest]], other[second[order][nearest]]
    flown_mps: Floats = instants.aircraft_mps[first]
    speed_mps = np.hypot(*flown_mps.T)
    moved_m = instants.track_m[second] - instants.aircraft_m[first]
    fast = speed_mps >= _SPEED_MIN_MPS
    if not fast.any():
        return 0.0, 0.0
    ahead_s = np.sum(moved_m[fast] * flown_mps[fast], axis=1) / speed_mps[fast] ** 2
    return len(first) / len(own), float(np.median(ahead_s)) - steps * instants.step_s
