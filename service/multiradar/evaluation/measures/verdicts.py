"""What each track is: an aircraft's, a duplicate, false, or one that cannot be judged."""

from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.instants import Instants
from multiradar.evaluation.trajectories import Flags, Floats, Tracks


@dataclass(frozen=True, slots=True, eq=False)
class Verdicts:
    """What each track is, by what it was most of the time.

    Attributes
    ----------
    true, duplicate, false_ : (k,) bool
        At most one of them is set for a track; none where the reference says nothing of it.
    life_s : (k,) float64
        From its first to its last update.
    """

    true: Flags
    duplicate: Flags
    false_: Flags
    life_s: Floats


def verdicts(tracks: Tracks, instants: Instants) -> Verdicts:
    """Judge each track as a whole.

    Parameters
    ----------
    tracks : Tracks
        With k tracks.
    instants : Instants
        What it was at each instant.

    Returns
    -------
    Verdicts
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
    return Verdicts(true, duplicate, ~true & ~duplicate & (spurious > 0), life)
