"""Lifecycle transitions of tracks: time and reason of each."""

from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.state import Fields
from multiradar.tracking.lifecycle._transition_kernels import (
    TRANSITIONS_PER_ROW,
    VACANT,
    LastStates,
    Marks,
    TransitionRows,
    find_transitions,
)
from multiradar.tracking.lifecycle.transitions import (
    NO_TRACK,
    TerminatedTracks,
    TrackTransitions,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Updated(NamedTuple):
    """Measurements of one release, and those that updated a track.

    Attributes
    ----------
    rows : (u,) int64
        Rows that updated a track, ascending.
    slot, track_id, outcome, associated : (n,) int64
        Of all rows: aircraft, track, outcome in the filter, and whether the association decides on
        confirmation (negative: the track is known by identity).
    time_s : (n,) float64
        Data times of all rows.
    confirmed : (u,) int64
        Whether the track is confirmed, for `rows`.
    """

    rows: Integers
    slot: Integers
    track_id: Integers
    outcome: Integers
    associated: Integers
    time_s: Floats
    confirmed: Integers


_NONE: Integers = np.empty(0, np.int64)
#: A release without measurements.
NOT_UPDATED = Updated(_NONE, _NONE, _NONE, _NONE, _NONE, np.empty(0), _NONE)


class TransitionLog:
    """Records the lifecycle transitions of tracks; owned by the engine.

    Parameters
    ----------
    coast_after_s : float
        A confirmed track coasts after this much data time without an update.

    Notes
    -----
    Coasting is detected when an epoch opens, or with the next update, so that the result does not
    depend on batches.
    """

    STATE: ClassVar[Fields] = {
        "_previous": LastStates,
        "_marks": list[tuple[int, int, float, float, int, int, int]],
    }

    def __init__(self, coast_after_s: float) -> None:
        self._coast_after_s = coast_after_s
        self._previous = _no_states(0)
        self._marks: list[tuple[int, int, float, float, int, int, int]] = []

    def check_coasting(self, row: int, time_s: float) -> None:
        """Mark a check for coasting tracks before a row of the release."""
        self._marks.append((row, -1, time_s, np.nan, VACANT, 0, NO_TRACK))

    def terminate(self, row: int, time_s: float, ends: TerminatedTracks) -> None:
        """Mark terminations of tracks before a row of the release."""
        for slot, track, updated_s, reason, into in zip(
            *(one.tolist() for one in ends), strict=True
        ):
            self._marks.append((row, slot, time_s, updated_s, track, reason, into))

    def update(self, updated: Updated, slots: int) -> TrackTransitions:
        """Return the transitions of the tracks of a release.

        Parameters
        ----------
        updated : Updated
            The release.
        slots : int
            Present number of slots.

        Returns
        -------
        TrackTransitions
            The transitions, in the order of the measurements.
        """
        if len(self._previous.track_id) < slots:
            self._previous = _grown(self._previous, slots)
        marks = _marks(self._marks)
        self._marks = []
        scratch = _scratch(TRANSITIONS_PER_ROW * len(updated.rows) + len(marks.row) + slots)
        count = find_transitions(
            updated.rows, updated.slot, updated.track_id, updated.time_s, updated.outcome,
            updated.confirmed, updated.associated, marks, self._coast_after_s, self._previous,
            scratch,
        )  # fmt: skip
        return TrackTransitions(
            time_s=scratch.time[:count].copy(),
            track_id=scratch.track_id[:count].copy(),
            transition=scratch.transition[:count].astype(np.int8),
            reason=scratch.reason[:count].astype(np.int8),
            into_track_id=scratch.into[:count].copy(),
            last_update_s=scratch.before[:count].copy(),
        )


def _no_states(slots: int) -> LastStates:
    return LastStates(
        track_id=np.full(slots, VACANT, np.int64),
        time=np.full(slots, np.nan),
        confirmed=np.zeros(slots, np.int64),
        coasting=np.zeros(slots, np.int64),
    )


def _grown(previous: LastStates, slots: int) -> LastStates:
    grown = _no_states(slots)
    for new, old in zip(grown, previous, strict=True):
        new[: len(old)] = old
    return grown


def _marks(noted: list[tuple[int, int, float, float, int, int, int]]) -> Marks:
    table = np.array(noted, np.float64).reshape(len(noted), len(Marks._fields))
    # Track identifiers are exact in a float up to 2⁵³.
    row, slot, time_s, updated_s, track, reason, into = np.ascontiguousarray(table.T)
    return Marks(
        row.astype(np.int64), slot.astype(np.int64), time_s, updated_s, track.astype(np.int64),
        reason.astype(np.int64), into.astype(np.int64),
    )  # fmt: skip


def _scratch(count: int) -> TransitionRows:
    return TransitionRows(
        time=np.empty(count),
        before=np.empty(count),
        track_id=np.empty(count, np.int64),
        transition=np.empty(count, np.int64),
        reason=np.empty(count, np.int64),
        into=np.empty(count, np.int64),
    )
