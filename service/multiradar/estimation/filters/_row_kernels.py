"""Checks of a row before a compiled filter uses it, and bookkeeping afterwards.

All filters share them, so that they accept and reject the same rows.

References
----------
The project's own: only finite numbers within physical limits enter a filter.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    IMPLAUSIBLE,
    IMPLAUSIBLE_SLOT,
    INTERVAL_MAX_S,
    NO_ROOM,
    NO_ROOM_SLOT,
    READOUT_GROUND,
    READOUT_HEIGHT,
    READOUT_HEIGHT_VARIANCE,
    READOUT_RATE,
    READOUT_UPDATES,
    REJECTED,
    REJECTIONS_MAX,
    RESTARTED,
    SEVERAL,
    SINGULAR,
    STARTED,
    UNASSOCIATED,
    UNLOCATABLE,
    UNSUPPORTED,
    UPDATED,
    VALUE_MAX,
)
from multiradar.estimation.filters.height._height_kernels import (
    BY_HEIGHT,
    GUESS_VARIANCE,
    height_variance,
    reportable_guess,
    reportable_rate,
)
from multiradar.estimation.measurement._kernels import is_bearing
from multiradar.estimation.measurement.kinds import (
    KIND_DIRECTION,
    KIND_FLAT_POLAR,
    KIND_POSITION,
    KIND_RADAR,
)
from multiradar_compiled.kernels import in_loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


# A reported position does not re-initialise an aircraft that others measured within this time, s:
# two or three scans of most radars. Reports are more frequent than plots, so three rejections in a
# row are weak evidence.
REPORT_PATIENCE_S = 12.0


@in_loop
def check_row(k: int, kind: int, accepts_bearings: bool) -> int:
    """Return `UPDATED` for a row with an aircraft and a supported kind, else its outcome.

    Only then are its other columns defined.
    """
    outcome = UPDATED
    if kind < KIND_RADAR or kind > KIND_DIRECTION:
        outcome = UNSUPPORTED
    if is_bearing(kind) and not accepts_bearings:
        outcome = UNSUPPORTED
    if k < 0:
        outcome = NO_ROOM if k == NO_ROOM_SLOT else UNASSOCIATED
        if k == IMPLAUSIBLE_SLOT:
            outcome = IMPLAUSIBLE
    return outcome


@in_loop
def is_patient(
    kind: int, site_number: int, time: float, k: int, measured_from: Integers, updated: Floats
) -> bool:  # fmt: skip
    """Return whether the rejection of a row is not counted, since others confirm the aircraft.

    That holds for reported positions while others measure the aircraft: the last accepted
    measurement is at most `REPORT_PATIENCE_S` old, and not all came from the site of the row.
    """
    others = kind == KIND_POSITION and measured_from[k] != site_number
    return others and time - updated[k] < REPORT_PATIENCE_S


@in_loop
def choose_action(
    kind: int, z0: float, z1: float, time: float, state_time: float, rejections: int, patient: bool,
    options: Floats,
) -> int:  # fmt: skip
    """Return the action of a row on its aircraft with a state of ``state_time`` (NaN: none yet).

    `UPDATED`: update it. `STARTED` and `RESTARTED`: initiate it. `UNLOCATABLE` and `SINGULAR`: the
    numbers are not a measurement. `REJECTED`: the row is older than the state and cannot update it;
    such a rejection is not counted.
    """
    # NaN fails the bounds too.
    timely = abs(time) < VALUE_MAX
    fresh = np.isnan(state_time)
    interval = time - state_time if timely and not fresh else 0.0
    action = UPDATED
    if (rejections >= options[REJECTIONS_MAX] and not patient) or interval > INTERVAL_MAX_S:
        action = RESTARTED
    if fresh:
        action = STARTED
    # Ranges are not negative; coordinates may be.
    behind = z0 < 0.0 and kind in (KIND_RADAR, KIND_FLAT_POLAR)
    if behind or not (abs(z0) < VALUE_MAX and abs(z1) < VALUE_MAX):
        action = SINGULAR if action == UPDATED else UNLOCATABLE
    if not (timely and interval >= 0.0):
        action = REJECTED
    return action


@in_loop
def record_start(
    k: int,
    site_number: int,
    fading_nis: Floats,
    updates: Integers,
    measured_from: Integers,
    velocities: Floats,
) -> None:
    """Reset the bookkeeping of an aircraft initiated by a measurement from a site."""
    fading_nis[k] = 1.0
    updates[k] = 0
    measured_from[k] = site_number
    velocities[k, 0] = np.nan
    velocities[k, 1] = np.nan


@in_loop
def record_outcome(
    outcome: int,
    k: int,
    patient: bool,
    time: float,
    site_number: int,
    times: Floats,
    rejections: Integers,
    updates: Integers,
    updated: Floats,
    measured_from: Integers,
) -> bool:
    """Update the bookkeeping of an aircraft after a row; return whether the row was accepted."""
    accepted = outcome <= RESTARTED
    if accepted:
        rejections[k] = 0
        updates[k] += 1
        times[k] = time
        updated[k] = time
        if measured_from[k] != site_number:
            measured_from[k] = SEVERAL
    elif outcome in (REJECTED, SINGULAR) and not patient:
        rejections[k] += 1
    return accepted


@in_loop
def finish_readout(
    row: int, k: int, heights: Floats, vertical: Floats, updates: Integers, on_ground: Integers,
    options: Floats, readouts: Floats,
) -> None:  # fmt: skip
    """Add height and ground status, and the effect of an unknown height on the variances."""
    readouts[row, READOUT_UPDATES] = updates[k]
    readouts[row, READOUT_GROUND] = on_ground[k]
    readouts[row, READOUT_HEIGHT] = heights[k]
    readouts[row, READOUT_HEIGHT_VARIANCE] = height_variance(k, vertical)
    readouts[row, READOUT_RATE] = reportable_rate(k, vertical)
    if np.isnan(heights[k]):
        variance = vertical[k, GUESS_VARIANCE]
        readouts[row, READOUT_RATE] = np.nan
        readouts[row, READOUT_HEIGHT] = reportable_guess(k, vertical, options)
        readouts[row, READOUT_HEIGHT_VARIANCE] = variance
        v0, v1 = vertical[k, BY_HEIGHT], vertical[k, BY_HEIGHT + 1]
        v2, v3 = vertical[k, BY_HEIGHT + 2], vertical[k, BY_HEIGHT + 3]
        readouts[row, 4] += v0 * v0 * variance
        readouts[row, 5] += v0 * v1 * variance
        readouts[row, 6] += v1 * v1 * variance
        readouts[row, 7] += (v2 * v2 + v3 * v3) * variance
