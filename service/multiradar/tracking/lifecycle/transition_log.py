"""What became of each track, when and why: found by comparing what is told of it with before."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.lifecycle._transition_kernels import (
    NOBODY,
    STEPS_OF_ROW,
    Marks,
    Steps,
    Told,
    find_steps,
)
from multiradar.tracking.lifecycle.transitions import NO_TRACK, Ends
from multiradar.tracking.outputs import TrackTransitions

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Updated(NamedTuple):
    """Measurements of one release, and those of them that updated a track.

    Attributes
    ----------
    rows : (u,) int64
        Those that did, ascending.
    slot, track_id, outcome, judged : (n,) int64
        Of all: aircraft, track, what the filter made of it, and whether the association judged the
        track (negative: it is known by identity).
    time_s : (n,) float64
        Data times of all.
    confirmed : (u,) int64
        Whether the track is confirmed, of those that did.
    """

    rows: Integers
    slot: Integers
    track_id: Integers
    outcome: Integers
    judged: Integers
    time_s: Floats
    confirmed: Integers


class TransitionLog:
    """Notes the steps in the lives of tracks; owned by the engine.

    Parameters
    ----------
    coast_after_s : float
        A confirmed track coasts after this much data time without an update.

    Notes
    -----
    Silence is noticed when an epoch opens, or with the update that ends it, so that what is found
    is a function of the measurements, however they are cut.
    """

    def __init__(self, coast_after_s: float) -> None:
        self._coast_after_s = coast_after_s
        self._told = _told(0)
        self._marks: list[tuple[int, int, float, float, int, int, int]] = []

    def look_for_silence(self, row: int, time_s: float) -> None:
        """Note that before a row of the release a moment comes at which silence is noticed."""
        self._marks.append((row, -1, time_s, np.nan, NOBODY, 0, NO_TRACK))

    def end(self, row: int, time_s: float, ends: Ends) -> None:
        """Note that before a row of the release tracks end."""
        for slot, track, updated_s, reason, into in zip(
            *(one.tolist() for one in ends), strict=True
        ):
            self._marks.append((row, slot, time_s, updated_s, track, reason, into))

    def take(self, updated: Updated, slots: int) -> TrackTransitions:
        """Find the steps of the tracks that a release updated or that ended during it.

        Parameters
        ----------
        updated : Updated
            The release.
        slots : int
            Number of slots by now.

        Returns
        -------
        TrackTransitions
            The steps, in the order of the measurements.
        """
        if len(self._told.track_id) < slots:
            self._told = _grown(self._told, slots)
        marks = _marks(self._marks)
        self._marks = []
        room = _room(STEPS_OF_ROW * len(updated.rows) + len(marks.row) + slots)
        count = find_steps(
            updated.rows, updated.slot, updated.track_id, updated.time_s, updated.outcome,
            updated.confirmed, updated.judged, marks, self._coast_after_s, self._told, room,
        )  # fmt: skip
        return TrackTransitions(
            time_s=room.time[:count].copy(),
            track_id=room.track_id[:count].copy(),
            transition=room.transition[:count].astype(np.int8),
            reason=room.reason[:count].astype(np.int8),
            into_track_id=room.into[:count].copy(),
            last_update_s=room.before[:count].copy(),
        )


def _told(slots: int) -> Told:
    return Told(
        track_id=np.full(slots, NOBODY, np.int64),
        time=np.full(slots, np.nan),
        confirmed=np.zeros(slots, np.int64),
        coasting=np.zeros(slots, np.int64),
    )


def _grown(told: Told, slots: int) -> Told:
    grown = _told(slots)
    for new, old in zip(grown, told, strict=True):
        new[: len(old)] = old
    return grown


def _marks(noted: list[tuple[int, int, float, float, int, int, int]]) -> Marks:
    table = np.array(noted, np.float64).reshape(len(noted), len(Marks._fields))
    # Identifiers of tracks are exact in a float up to 2⁵³.
    row, slot, time_s, updated_s, track, reason, into = np.ascontiguousarray(table.T)
    return Marks(
        row.astype(np.int64), slot.astype(np.int64), time_s, updated_s, track.astype(np.int64),
        reason.astype(np.int64), into.astype(np.int64),
    )  # fmt: skip


def _room(steps: int) -> Steps:
    return Steps(
        time=np.empty(steps),
        before=np.empty(steps),
        track_id=np.empty(steps, np.int64),
        transition=np.empty(steps, np.int64),
        reason=np.empty(steps, np.int64),
        into=np.empty(steps, np.int64),
    )
