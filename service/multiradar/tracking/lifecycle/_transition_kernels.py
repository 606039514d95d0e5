"""Compiled search for the steps in the lives of tracks, in the order of the measurements.

References
----------
The project's own: what is told of a track is compared with what was told of it before.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import RESTARTED as BEGUN_ANEW
from multiradar.tracking.lifecycle import transitions as steps
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# No track has this identifier.
NOBODY = 0
# Steps that one measurement can make a track take: coasting, resumed, restarted, confirmed.
STEPS_OF_ROW = 4


class Told(NamedTuple):
    """What was told last of the track in each slot.

    Attributes
    ----------
    track_id : (s,) int64
        The track, `NOBODY` for none.
    time : (s,) float64
        Data time of its last update.
    confirmed, coasting : (s,) int64
        How it stood.
    """

    track_id: Integers
    time: Floats
    confirmed: Integers
    coasting: Integers


class Marks(NamedTuple):
    """What happens between the measurements, in order.

    Attributes
    ----------
    row : (n,) int64
        Before which measurement.
    slot : (n,) int64
        Slot of the track that ends, −1 where all tracks are looked at for silence.
    time, updated : (n,) float64
        Data time now, and that of the last update of the track.
    track_id, reason, into : (n,) int64
        Which track ends, why, and which stands for it.
    """

    row: Integers
    slot: Integers
    time: Floats
    updated: Floats
    track_id: Integers
    reason: Integers
    into: Integers


class Steps(NamedTuple):
    """Room for steps: time, time of the update before, track, transition, reason, other track."""

    time: Floats
    before: Floats
    track_id: Integers
    transition: Integers
    reason: Integers
    into: Integers


@kernel
def find_steps(
    rows: Integers,
    slots: Integers,
    tracks: Integers,
    times: Floats,
    outcomes: Integers,
    confirmed: Integers,
    judged: Integers,
    marks: Marks,
    coast_after: float,
    told: Told,
    found: Steps,
) -> int:
    """Fill ``found`` with the steps of tracks; return how many.

    ``rows`` are the measurements that updated a track, ascending; the arrays after it are of all
    measurements but ``confirmed``, which is of these. ``judged`` is negative where a track is known
    by its identity.
    """
    count = 0
    m = 0
    for i in range(rows.shape[0]):
        row = rows[i]
        while m < marks.row.shape[0] and marks.row[m] <= row:
            count = take_mark(m, marks, coast_after, told, found, count)
            m += 1
        k, time = slots[row], times[row]
        by_place = judged[row] >= 0
        if told.track_id[k] != tracks[row]:
            told.track_id[k] = tracks[row]
            told.confirmed[k] = 0
            told.coasting[k] = 0
            told.time[k] = np.nan
            reason = steps.NEW_PLACE if by_place else steps.NEW_IDENTITY
            count = add(time, k, steps.STARTED, reason, told, found, count)
        elif told.confirmed[k] != 0 and time - told.time[k] > coast_after:
            if told.coasting[k] == 0:
                count = add(time, k, steps.COASTING, steps.SILENT, told, found, count)
            count = add(time, k, steps.RESUMED, steps.HEARD, told, found, count)
            told.coasting[k] = 0
        if outcomes[row] == BEGUN_ANEW:
            count = add(time, k, steps.RESTARTED, steps.REFUSED, told, found, count)
        if confirmed[i] != 0 and told.confirmed[k] == 0:
            reason = steps.LIKELIHOOD if by_place else steps.UPDATES
            count = add(time, k, steps.CONFIRMED, reason, told, found, count)
        told.confirmed[k] = confirmed[i]
        told.time[k] = time
    while m < marks.row.shape[0]:
        count = take_mark(m, marks, coast_after, told, found, count)
        m += 1
    return count


@kernel
def take_mark(
    m: int, marks: Marks, coast_after: float, told: Told, found: Steps, count: int
) -> int:
    """End a track, or find those that fell silent; return how many steps there are."""
    k, time = marks.slot[m], marks.time[m]
    if k < 0:
        for j in range(told.track_id.shape[0]):
            silent = told.track_id[j] != NOBODY and time - told.time[j] > coast_after
            if silent and told.confirmed[j] != 0 and told.coasting[j] == 0:
                told.coasting[j] = 1
                count = add(time, j, steps.COASTING, steps.SILENT, told, found, count)
        return count
    told.track_id[k] = marks.track_id[m]
    told.time[k] = marks.updated[m]
    count = add(time, k, steps.ENDED, marks.reason[m], told, found, count)
    found.into[count - 1] = marks.into[m]
    told.track_id[k] = NOBODY
    return count


@kernel
def add(
    time: float, k: int, transition: int, reason: int, told: Told, found: Steps, count: int
) -> int:
    """Write down one step of the track in a slot; return how many there are."""
    found.time[count] = time
    found.before[count] = told.time[k]
    found.track_id[count] = told.track_id[k]
    found.transition[count] = transition
    found.reason[count] = reason
    found.into[count] = steps.NO_TRACK
    return count + 1
