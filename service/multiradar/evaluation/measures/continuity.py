"""When tracks begin, how often they are updated, and where they have gaps."""

from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.instants import Instants
from multiradar.evaluation.measures.identity import Identity
from multiradar.evaluation.trajectories import Floats, Indices, Reference, Tracks, joined, places_at


@dataclass(frozen=True, slots=True, eq=False)
class Stretches:
    """Times over which the reference knows an aircraft and somebody tracks it or should.

    Attributes
    ----------
    aircraft : (n,) int64
        The aircraft.
    begin_s, end_s : (n,) float64
        From the first update of the aircraft on, until the reference ends or has a gap.
    """

    aircraft: Indices
    begin_s: Floats
    end_s: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Heard:
    """Updates that an aircraft's tracks had while the reference knew it.

    Attributes
    ----------
    aircraft : (n,) int64
        Ascending.
    time_s : (n,) float64
        Ascending within an aircraft.
    """

    aircraft: Indices
    time_s: Floats


def heard(tracks: Tracks, reference: Reference, aircraft: Indices) -> Heard:
    """Return the measured updates of each aircraft.

    Parameters
    ----------
    tracks : Tracks
        Of n updates.
    reference : Reference
        What is known.
    aircraft : (n,) int64
        Whose each update is; −1 for none.

    Returns
    -------
    Heard
        Those at times at which the reference knows the aircraft.
    """
    update = np.flatnonzero(tracks.measured & (aircraft >= 0))
    places = places_at(reference, aircraft[update], tracks.time_s[update])
    update = update[np.isfinite(places.position_m[:, 0])]
    of, when = aircraft[update], tracks.time_s[update]
    order = np.lexsort((when, of))
    return Heard(of[order], when[order])


def stretches(reference: Reference, updates: Heard) -> Stretches:
    """Return the times over which an aircraft that was tracked once should be tracked.

    Parameters
    ----------
    reference : Reference
        What is known.
    updates : Heard
        Its updates; an aircraft without any has no stretch (its initiation failed).

    Returns
    -------
    Stretches
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
    return Stretches(aircraft[kept], begin[kept], end[kept])


def intervals(updates: Heard, where: Stretches) -> tuple[Floats, Indices]:
    """Return the times between updates that follow each other, the last one to the end included.

    Parameters
    ----------
    updates : Heard
        Updates by aircraft.
    where : Stretches
        Intervals do not reach over their ends.

    Returns
    -------
    interval_s : (n,) float64
        Lengths; their sum is the time of the stretches.
    aircraft : (n,) int64
        Whose.
    """
    aircraft = np.concatenate([updates.aircraft, where.aircraft, where.aircraft])
    time = np.concatenate([updates.time_s, where.begin_s, where.end_s])
    # At equal times a stretch begins before an update, and ends after it.
    kind = np.repeat([1, 0, 2], [len(updates.time_s), len(where.end_s), len(where.end_s)])
    order = np.lexsort((kind, time, aircraft))
    aircraft, time, kind = aircraft[order], time[order], kind[order]
    within = (kind[:-1] != 2) & (aircraft[:-1] == aircraft[1:]) & (kind[1:] != 0)
    length = np.diff(time)
    # What begins with an update at the same time is no interval.
    kept = within & (length > 0.0)
    return length[kept], aircraft[:-1][kept]


def detection(updates: Heard, where: Stretches, interval_s: float) -> tuple[int, int]:
    """Count the update intervals with an update, and all of them.

    Parameters
    ----------
    updates : Heard
        Updates by aircraft.
    where : Stretches
        Cut into intervals from their beginning on; what is left over at the end does not count.
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
    """Return since when each aircraft has had a track.

    Parameters
    ----------
    tracks : Tracks
        Those that count: a tentative track is none.
    instants : Instants
        The instants at which tracks were assigned.
    identity : Identity
        Who followed whom.

    Returns
    -------
    (m,) float64
        The beginning of the first track that followed the aircraft, s; infinite for none. A track
        that was another aircraft's before counts from the instant at which it settled on this one.
    """
    since = np.full(len(identity.tracks_of_aircraft), np.inf)
    for track, runs in enumerate(identity.aircraft_of_track):
        for number, run in enumerate(runs):
            begun = tracks.time_s[np.searchsorted(tracks.track, track)]
            time_s = instants.time_s[run.first] if number else begun
            since[run.partner] = min(since[run.partner], time_s)
    return since
