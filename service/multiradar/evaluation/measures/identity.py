"""Assignment over time: identity swaps, changes of track number, longest segments."""

from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.instants import Instants
from multiradar.evaluation.trajectories import Indices


@dataclass(frozen=True, slots=True)
class Run:
    """A run of instants with the same partner.

    Attributes
    ----------
    partner : int
        The partner.
    first, last : int
        Numbers of its first and last instant.
    """

    partner: int
    first: int
    last: int


@dataclass(frozen=True, slots=True, eq=False)
class Identity:
    """The assignment over time.

    Attributes
    ----------
    aircraft_of_track : list of list of Run
        For each track the aircraft that it followed, in order of time.
    tracks_of_aircraft : list of list of Run
        For each aircraft the tracks that followed it, in order of time.
    longest_s : (m,) float64
        For each aircraft the longest time with the same track without a break.
    """

    aircraft_of_track: list[list[Run]]
    tracks_of_aircraft: list[list[Run]]
    longest_s: np.ndarray[tuple[int], np.dtype[np.float64]]

    @property
    def swaps(self) -> int:
        """Number of times a track changed from one aircraft to another."""
        return sum(max(0, len(runs) - 1) for runs in self.aircraft_of_track)

    @property
    def number_changes(self) -> int:
        """Number of times an aircraft changed from one track to another."""
        return sum(max(0, len(runs) - 1) for runs in self.tracks_of_aircraft)


def identity_over_time(instants: Instants, aircraft: int, tracks: int, dwell_s: float) -> Identity:
    """Return the assignment over time.

    Parameters
    ----------
    instants : Instants
        With their assignment.
    aircraft, tracks : int
        How many there are.
    dwell_s : float
        Shorter runs are skipped, s: where two aircraft cross, the nearest one changes for an
        instant without an identity swap.

    Returns
    -------
    Identity
        Runs in order of time.
    """
    matched = np.flatnonzero(instants.track_of >= 0)
    track_row = instants.track_of[matched]
    one, other = instants.aircraft[matched], instants.track[track_row]
    when = instants.aircraft_instant[matched]
    dwell = int(np.ceil(dwell_s / instants.step_s - 1e-9))
    followed = _settled(one, other, when, aircraft, dwell)
    # The rows of an aircraft are consecutive: a gap in the reference does not break a segment.
    longest = _longest(one, _settled_partner(followed, one, when), matched, aircraft)
    return Identity(
        aircraft_of_track=_settled(other, one, when, tracks, dwell),
        tracks_of_aircraft=followed,
        longest_s=longest * instants.step_s,
    )


def _runs(owner: Indices, partner: Indices, when: Indices) -> list[list[int]]:
    order = np.lexsort((when, owner))
    owner, partner, when = owner[order], partner[order], when[order]
    change = np.flatnonzero((np.diff(owner) != 0) | (np.diff(partner) != 0)) + 1
    begins = np.append(0, change) if len(owner) else np.zeros(0, np.int64)
    ends = np.append(change, len(owner))[: len(begins)] - 1
    columns = (owner[begins], partner[begins], when[begins], when[ends])
    return [list(map(int, row)) for row in zip(*columns, strict=True)]


def _settled(
    owner: Indices, partner: Indices, when: Indices, owners: int, dwell: int
) -> list[list[Run]]:
    found: list[list[Run]] = [[] for _ in range(owners)]
    for of, other, first, last in _runs(owner, partner, when):
        found[of].append(Run(other, first, last))
    return [_without_flicker(runs, dwell) for runs in found]


def _without_flicker(runs: list[Run], dwell: int) -> list[Run]:
    if len(runs) < 2:
        return runs
    kept = [run for run in runs if run.last - run.first + 1 >= dwell]
    # Without a settled run, the longest run counts.
    kept = kept or [max(runs, key=lambda run: run.last - run.first)]
    merged = kept[:1]
    for run in kept[1:]:
        if run.partner == merged[-1].partner:
            merged[-1] = Run(run.partner, merged[-1].first, run.last)
        else:
            merged.append(run)
    return merged


# The settled partner at each instant: that of the latest settled run.
def _settled_partner(runs: list[list[Run]], owner: Indices, when: Indices) -> Indices:
    table = np.array(
        [(of, run.first, run.partner) for of, own in enumerate(runs) for run in own], np.int64
    ).reshape(-1, 3)
    if not len(table):
        return np.zeros(0, np.int64)
    length = int(when.max()) + 2
    of, first, partner = table.T
    row = np.searchsorted(of * length + first, owner * length + when, side="right") - 1
    # Before the first settled run, its partner counts already.
    row = np.where((row < 0) | (of[np.maximum(row, 0)] != owner), row + 1, row)
    found: Indices = partner[row]
    return found


def _longest(
    owner: Indices, partner: Indices, row: Indices, owners: int
) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    broken = (np.diff(owner) != 0) | (np.diff(partner) != 0) | (np.diff(row) != 1)
    run = np.append(0, np.cumsum(broken)) if len(owner) else np.zeros(0, np.int64)
    longest = np.zeros(owners)
    lengths = np.bincount(run)
    np.maximum.at(longest, owner, lengths[run].astype(np.float64) if len(owner) else 0.0)
    return longest
