"""Track initiation times, update intervals and gaps."""

from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.instants import Instants
from multiradar.evaluation.measures.identity import Identity
from multiradar.evaluation.trajectories import (
    Floats,
    Indices,
    Reference,
    Tracks,
    joined,
    positions_at,
)


@dataclass(frozen=True, slots=True, eq=False)
class TrackedPeriods:
    """Periods in which the reference knows an aircraft and it should be tracked.

    Attributes
    ----------
    aircraft : (n,) int64
        The aircraft.
    begin_s, end_s : (n,) float64
        From the first update of the aircraft until the reference ends or has a gap.
    """

    aircraft: Indices
    begin_s: Floats
    end_s: Floats


@dataclass(frozen=True, slots=True, eq=False)
class AircraftUpdates:
    """Updates of the tracks of each aircraft while the reference knows it.

    Attributes
    ----------
    aircraft : (n,) int64
        Ascending.
    time_s : (n,) float64
        Ascending within an aircraft.
    """

    aircraft: Indices
    time_s: Floats


def aircraft_updates(tracks: Tracks, reference: Reference, aircraft: Indices) -> AircraftUpdates:
    """Return the measured updates of each aircraft.

    Parameters
    ----------
    tracks : Tracks
        Of n updates.
    reference : Reference
        What is known.
    aircraft : (n,) int64
        Aircraft of each update; −1 for none.

    Returns
    -------
    AircraftUpdates
        Updates at times at which the reference knows the aircraft.
    """
    update = np.flatnonzero(tracks.measured & (aircraft >= 0))
    positions = positions_at(reference, aircraft[update], tracks.time_s[update])
    update = update[np.isfinite(positions.position_m[:, 0])]
    of, when = aircraft[update], tracks.time_s[update]
    order = np.lexsort((when, of))
    return AircraftUpdates(of[order], when[order])


def tracked_periods(reference: Reference, updates: AircraftUpdates) -> TrackedPeriods:
    """Return the periods in which an aircraft should be tracked, from its first update on.

    Parameters
    ----------
    reference : Reference
        What is known.
    updates : AircraftUpdates
        Its updates; an aircraft without any has no period (its initiation failed).

    Returns
    -------
    TrackedPeriods
        By aircraft, then time.
    """
    ends = np.flatnonzero(~joined(reference))
    begins = np.append(0, ends[:-1] + 1)
    aircraft = reference.aircraft[begins]
    first = np.full(len(reference.names), np.inf)
    np.minimum.at(first, updates.aircraft, updates.time_s)
    begin = np.maximum(reference.time_s[begins], first[aircraft])
    end = reference.time_s[ends]
    kept = end > begin
    return TrackedPeriods(aircraft[kept], begin[kept], end[kept])


def intervals(updates: AircraftUpdates, where: TrackedPeriods) -> tuple[Floats, Indices]:
    """Return the intervals between successive updates, the last one to the end included.

    Parameters
    ----------
    updates : AircraftUpdates
        Updates by aircraft.
    where : TrackedPeriods
        Intervals do not extend beyond their ends.

    Returns
    -------
    interval_s : (n,) float64
        Lengths; their sum is the total length of the periods.
    aircraft : (n,) int64
        Aircraft of each interval.
    """
    aircraft = np.concatenate([updates.aircraft, where.aircraft, where.aircraft])
    time = np.concatenate([updates.time_s, where.begin_s, where.end_s])
    # At equal times a period starts before an update, and ends after it.
    kind = np.repeat([1, 0, 2], [len(updates.time_s), len(where.end_s), len(where.end_s)])
    order = np.lexsort((kind, time, aircraft))
    aircraft, time, kind = aircraft[order], time[order], kind[order]
    within = (kind[:-1] != 2) & (aircraft[:-1] == aircraft[1:]) & (kind[1:] != 0)
    length = np.diff(time)
    # A period that starts at the time of an update adds no interval.
    kept = within & (length > 0.0)
    return length[kept], aircraft[:-1][kept]


def detection(
    updates: AircraftUpdates, where: TrackedPeriods, interval_s: float
) -> tuple[int, int]:
    """Count the update intervals with an update, and all update intervals.

    Parameters
    ----------
    updates : AircraftUpdates
        Updates by aircraft.
    where : TrackedPeriods
        Divided into intervals from their start; an incomplete one at the end is not counted.
    interval_s : float
        Length of an interval, s.

    Returns
    -------
    hit, total : int
        Their quotient is the probability of detection.
    """
    count = np.floor((where.end_s - where.begin_s) / interval_s + 1e-9).astype(np.int64)
    if not len(count) or not len(updates.time_s):
        return 0, int(count.sum())
    length = float(max(where.end_s.max(), updates.time_s.max()) - where.begin_s.min()) + 1.0
    origin = where.begin_s.min()
    axis = where.aircraft * length + (where.begin_s - origin)
    asked = updates.aircraft * length + (updates.time_s - origin)
    row = np.searchsorted(axis, asked, side="right") - 1
    valid = row >= 0
    row = np.where(valid, row, 0)
    number = np.floor((updates.time_s - where.begin_s[row]) / interval_s).astype(np.int64)
    valid &= (where.aircraft[row] == updates.aircraft) & (number >= 0) & (number < count[row])
    before = np.cumsum(count) - count
    return len(np.unique((before[row] + number)[valid])), int(count.sum())


def tracked_since(tracks: Tracks, instants: Instants, identity: Identity) -> Floats:
    """Return the time from which each aircraft has had a track.

    Parameters
    ----------
    tracks : Tracks
        Those that count, without tentative tracks.
    instants : Instants
        The instants at which tracks were assigned.
    identity : Identity
        Aircraft followed by each track over time.

    Returns
    -------
    (m,) float64
        Initiation time of the first track that followed the aircraft, s; infinite for none. A track
        that followed another aircraft before counts from the instant at which it settled here.
    """
    since = np.full(len(identity.tracks_of_aircraft), np.inf)
    for track, runs in enumerate(identity.aircraft_of_track):
        for number, run in enumerate(runs):
            initiated_s = tracks.time_s[np.searchsorted(tracks.track, track)]
            time_s = instants.time_s[run.first] if number else initiated_s
            since[run.partner] = min(since[run.partner], time_s)
    return since
