"""Classification of tracks: true, duplicate, false or not evaluated."""

from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.instants import Instants
from multiradar.evaluation.trajectories import Flags, Floats, Tracks


@dataclass(frozen=True, slots=True, eq=False)
class TrackClasses:
    """Class of each track, by what it was most of the time.

    Attributes
    ----------
    true, duplicate, false_ : (k,) bool
        At most one is set for a track; none where the reference cannot classify it.
    life_s : (k,) float64
        Time from the first to the last update.
    """

    true: Flags
    duplicate: Flags
    false_: Flags
    life_s: Floats


def classify_tracks(tracks: Tracks, instants: Instants) -> TrackClasses:
    """Classify each track as a whole.

    Parameters
    ----------
    tracks : Tracks
        With k tracks.
    instants : Instants
        Assignment at each instant.

    Returns
    -------
    TrackClasses
        A tie is decided in favour of the track.
    """
    count = len(tracks.ids)
    matched, redundant, spurious = (
        np.bincount(instants.track[rows], minlength=count)
        for rows in (instants.aircraft_of >= 0, instants.redundant, instants.spurious)
    )
    true = (matched > 0) & (matched >= redundant) & (matched >= spurious)
    duplicate = ~true & (redundant > 0) & (redundant >= spurious)
    first = np.searchsorted(tracks.track, np.arange(count))
    last = np.searchsorted(tracks.track, np.arange(count), side="right") - 1
    life: Floats = tracks.time_s[last] - tracks.time_s[first]
    return TrackClasses(true, duplicate, ~true & ~duplicate & (spurious > 0), life)
