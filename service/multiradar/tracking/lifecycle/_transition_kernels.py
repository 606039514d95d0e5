"""Compiled detection of lifecycle transitions of tracks, in the order of the measurements.

References
----------
The project's own: comparison of the present with the previous state of each track.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import RESTARTED as OUTCOME_RESTARTED
from multiradar.tracking.lifecycle import transitions as codes
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Identifier of no track.
VACANT = 0
# Maximum number of transitions by one measurement: coasting, resumed, restarted, confirmed.
TRANSITIONS_PER_ROW = 4


class LastStates(NamedTuple):
    """Previous state of the track in each slot.

    Attributes
    ----------
    track_id : (s,) int64
        The track, `VACANT` for none.
    time : (s,) float64
        Data time of its last update.
    confirmed, coasting : (s,) int64
        Its stage.
    """

    track_id: Integers
    time: Floats
    confirmed: Integers
    coasting: Integers


class Marks(NamedTuple):
    """Events between the measurements, in order.

    Attributes
    ----------
    row : (n,) int64
        Measurement before which it happens.
    slot : (n,) int64
        Slot of the terminated track, −1 for a check of all tracks for coasting.
    time, updated : (n,) float64
        Data time of the event, and of the last update of the track.
    track_id, reason, into : (n,) int64
        Terminated track, reason, and track into which it is merged.
    """

    row: Integers
    slot: Integers
    time: Floats
    updated: Floats
    track_id: Integers
    reason: Integers
    into: Integers


class TransitionRows(NamedTuple):
    """Transitions: time, time of the previous update, track, transition, reason, other track."""

    time: Floats
    before: Floats
    track_id: Integers
    transition: Integers
    reason: Integers
    into: Integers


@kernel
def find_transitions(
    rows: Integers,
    slots: Integers,
    tracks: Integers,
    times: Floats,
    outcomes: Integers,
    confirmed: Integers,
    associated: Integers,
    marks: Marks,
    coast_after: float,
    previous: LastStates,
    found: TransitionRows,
) -> int:
    """Fill ``found`` with the transitions of tracks; return how many.

    ``rows`` are the measurements that updated a track, ascending; ``confirmed`` is of these, the
    other arrays are of all measurements. ``associated`` is negative for tracks known by identity.
    """
    count = 0
    m = 0
    for i in range(rows.shape[0]):
        row = rows[i]
        while m < marks.row.shape[0] and marks.row[m] <= row:
            count = apply_mark(m, marks, coast_after, previous, found, count)
            m += 1
        k, time = slots[row], times[row]
        by_place = associated[row] >= 0
        if previous.track_id[k] != tracks[row]:
            previous.track_id[k] = tracks[row]
            previous.confirmed[k] = 0
            previous.coasting[k] = 0
            previous.time[k] = np.nan
            reason = codes.NEW_PLACE if by_place else codes.NEW_IDENTITY
            count = add(time, k, codes.STARTED, reason, previous, found, count)
        elif previous.confirmed[k] != 0 and time - previous.time[k] > coast_after:
            if previous.coasting[k] == 0:
                count = add(time, k, codes.COASTING, codes.SILENT, previous, found, count)
            count = add(time, k, codes.RESUMED, codes.HEARD, previous, found, count)
            previous.coasting[k] = 0
        if outcomes[row] == OUTCOME_RESTARTED:
            count = add(time, k, codes.RESTARTED, codes.REJECTED, previous, found, count)
        if confirmed[i] != 0 and previous.confirmed[k] == 0:
            reason = codes.LIKELIHOOD if by_place else codes.UPDATES
            count = add(time, k, codes.CONFIRMED, reason, previous, found, count)
        previous.confirmed[k] = confirmed[i]
        previous.time[k] = time
    while m < marks.row.shape[0]:
        count = apply_mark(m, marks, coast_after, previous, found, count)
        m += 1
    return count


@kernel
def apply_mark(
    m: int,
    marks: Marks,
    coast_after: float,
    previous: LastStates,
    found: TransitionRows,
    count: int,
) -> int:
    """Terminate a track, or find those that coast; return the number of transitions."""
    k, time = marks.slot[m], marks.time[m]
    if k < 0:
        for j in range(previous.track_id.shape[0]):
            silent = previous.track_id[j] != VACANT and time - previous.time[j] > coast_after
            if silent and previous.confirmed[j] != 0 and previous.coasting[j] == 0:
                previous.coasting[j] = 1
                count = add(time, j, codes.COASTING, codes.SILENT, previous, found, count)
        return count
    previous.track_id[k] = marks.track_id[m]
    previous.time[k] = marks.updated[m]
    count = add(time, k, codes.ENDED, marks.reason[m], previous, found, count)
    found.into[count - 1] = marks.into[m]
    previous.track_id[k] = VACANT
    return count


@kernel
def add(
    time: float,
    k: int,
    transition: int,
    reason: int,
    previous: LastStates,
    found: TransitionRows,
    count: int,
) -> int:
    """Add one transition of the track in a slot; return their number."""
    found.time[count] = time
    found.before[count] = previous.time[k]
    found.track_id[count] = previous.track_id[k]
    found.transition[count] = transition
    found.reason[count] = reason
    found.into[count] = codes.NO_TRACK
    return count + 1
