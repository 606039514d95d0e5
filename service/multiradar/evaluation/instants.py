"""Tracks and aircraft at regular instants, and their assignment to each other.

At an instant the position of an aircraft is that of the reference. The position of a track is its
last update, extrapolated with its speed and heading, as on a display.
"""

from dataclasses import dataclass

import numpy as np

from multiradar.errors import InputError
from multiradar.evaluation.matching import best_pairs, near_pairs
from multiradar.evaluation.overlap import check_times
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.evaluation.trajectories import (
    Flags,
    Floats,
    Indices,
    Reference,
    Tracks,
    joined,
    positions_on,
)

#: Maximum number of instants of an evaluation.
INSTANTS_MAX = 1_000_000
#: A time off an instant by less than this, in steps, is at the instant (rounding).
_ROUNDING = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Instants:
    """Aircraft and tracks at each instant, and their assignment.

    Attributes
    ----------
    time_s : (t,) float64
        The instants.
    step_s : float
        Time between them.
    aircraft, aircraft_instant : (n,) int64
        Aircraft known to the reference at an instant, and its number; by aircraft, then time.
    track, track_instant : (k,) int64
        Tracks alive at an instant; by track, then time.
    aircraft_m, track_m, aircraft_mps, track_mps : (n, 2), (k, 2) float64
        Positions and velocities on the plane.
    track_of : (n,) int64
        Row of the track assigned to each aircraft; −1 for none.
    aircraft_of : (k,) int64
        Row of the aircraft assigned to each track; −1 for none.
    redundant : (k,) bool
        Not assigned, but within the gate of an aircraft: a duplicate.
    spurious : (k,) bool
        Not assigned, no aircraft within the gate, and the reference is complete there.
    """

    time_s: Floats
    step_s: float
    aircraft: Indices
    aircraft_instant: Indices
    track: Indices
    track_instant: Indices
    aircraft_m: Floats
    track_m: Floats
    aircraft_mps: Floats
    track_mps: Floats
    track_of: Indices
    aircraft_of: Indices
    redundant: Flags
    spurious: Flags

    @property
    def evaluated(self) -> Flags:
        """Rows of tracks that the reference can classify."""
        return (self.aircraft_of >= 0) | self.redundant | self.spurious


def assign_tracks(tracks: Tracks, reference: Reference, settings: EvaluationSettings) -> Instants:
    """Assign tracks to aircraft at every instant.

    Parameters
    ----------
    tracks : Tracks
        The tracks to evaluate.
    reference : Reference
        What is known.
    settings : EvaluationSettings
        Step, gate and maximum extrapolation time of a track.

    Returns
    -------
    Instants
        Assigned by position alone; names of tracks and aircraft are not used.

    Raises
    ------
    InputError
        Tracks and reference do not overlap in time, or there are too many instants.
    """
    times = _instants(tracks, reference, settings.step_s)
    here, here_instant = _spread(
        reference.time_s, _reference_ends(reference, settings.step_s), times, settings.step_s
    )
    _check_joined(reference, here)
    positions = positions_on(reference, here, times[here_instant])
    row, instant = _spread(
        tracks.time_s,
        _track_ends(tracks, settings.age_max_s, settings.step_s),
        times,
        settings.step_s,
    )
    age_s = (times[instant] - tracks.time_s[row])[:, None]
    track_m = tracks.position_m[row] + age_s * tracks.velocity_mps[row]
    first, second, distance = near_pairs(
        positions.position_m, here_instant, track_m, instant, settings.gate_m
    )
    best = best_pairs(first, second, distance, settings.gate_m, 1.0)
    track_of, aircraft_of = np.full(len(here), -1), np.full(len(row), -1)
    track_of[first[best]], aircraft_of[second[best]] = second[best], first[best]
    redundant = np.zeros(len(row), np.bool_)
    redundant[second] = True
    redundant &= aircraft_of < 0
    aircraft, track = reference.aircraft[here], tracks.track[row]
    own = _own_aircraft(track, np.where(aircraft_of >= 0, aircraft[aircraft_of], -1))
    alive = np.zeros((len(times), len(reference.names) + 1), np.bool_)
    alive[here_instant, aircraft] = True
    # The last column is for tracks that never match an aircraft.
    alive[:, -1] = not settings.partial
    spurious = (aircraft_of < 0) & ~redundant & alive[instant, own]
    return Instants(
        times, settings.step_s, aircraft, here_instant, track, instant, positions.position_m,
        track_m, positions.velocity_mps, tracks.velocity_mps[row], track_of, aircraft_of, redundant,
        spurious,
    )  # fmt: skip


def _instants(tracks: Tracks, reference: Reference, step_s: float) -> Floats:
    check_times(tracks, reference)
    begin, end = float(reference.time_s.min()), float(reference.time_s.max())
    if (end - begin) / step_s > INSTANTS_MAX:
        msg = (
            f"expected at most {INSTANTS_MAX} instants, found {(end - begin) / step_s:.0f} "
            f"({end - begin:.0f} s of reference in steps of {step_s:g} s); increase the step"
        )
        raise InputError(msg)
    start = np.ceil(begin / step_s - _ROUNDING) * step_s
    times: Floats = start + step_s * np.arange(int((end - start) / step_s + _ROUNDING) + 1)
    return times


# Positions that are not joined count at their own times only, which are hardly ever instants.
def _check_joined(reference: Reference, here: Indices) -> None:
    if len(here):
        return
    apart_s = np.diff(reference.time_s)[np.diff(reference.aircraft) == 0]
    gap_s = f"{np.median(apart_s):.1f} s apart (median)" if len(apart_s) else "single"
    msg = (
        f"no position of the reference can be compared: the positions of an aircraft are {gap_s}, "
        f"and are not joined over more than --reference-gap ({reference.gap_s:g} s); specify a "
        "longer gap, or a reference with more positions"
    )
    raise InputError(msg)


# Rows valid from their time until an end, at the instants between: row and instant of each.
def _spread(
    time_s: Floats, end_s: Floats, instants: Floats, step_s: float
) -> tuple[Indices, Indices]:
    first = np.ceil((time_s - instants[0]) / step_s - _ROUNDING).astype(np.int64)
    last = np.ceil((end_s - instants[0]) / step_s - _ROUNDING).astype(np.int64)
    first = np.clip(first, 0, len(instants))
    count = np.maximum(np.clip(last, 0, len(instants)) - first, 0)
    row = np.repeat(np.arange(len(time_s)), count)
    before = np.repeat(np.cumsum(count) - count, count)
    return row, first[row] + np.arange(len(row)) - before


def _reference_ends(reference: Reference, step_s: float) -> Floats:
    following = np.append(reference.time_s[1:], 0.0)
    # The last position before a gap is valid at its own time only.
    alone = reference.time_s + 2.0 * _ROUNDING * step_s
    ends: Floats = np.where(joined(reference), following, alone)
    return ends


def _track_ends(tracks: Tracks, age_max_s: float, step_s: float) -> Floats:
    following = np.append(tracks.time_s[1:], np.inf)
    same = np.append(np.diff(tracks.track) == 0, np.zeros(1, np.bool_))
    limit = tracks.time_s + age_max_s + 2.0 * _ROUNDING * step_s
    ends: Floats = np.where(same, np.minimum(following, limit), limit)
    return ends


# The aircraft of a track at each row: that of its last match, or else of its first; −1 where it
# never matches.
def _own_aircraft(track: Indices, matched: Indices) -> Indices:
    own = matched.copy()
    for rows in (slice(None), slice(None, None, -1)):
        values, of = own[rows], track[rows]
        number = np.arange(len(values))
        begin = np.append(True, np.diff(of) != 0) if len(of) else np.zeros(0, np.bool_)
        known = np.maximum.accumulate(np.where((values >= 0) | begin, number, 0))
        own[rows] = values[known] if len(values) else values
    return own
