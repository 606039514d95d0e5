"""What every compiled filter asks of a row before it looks at it, and what it notes afterwards.

All loops over rows ask here, so that no filter takes what another refuses.

References
----------
The project's own: what no measurement can be, so that nothing but numbers enters a filter.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    IMPLAUSIBLE,
    IMPLAUSIBLE_SLOT,
    INTERVAL_MAX_S,
    NO_ROOM,
    NO_ROOM_SLOT,
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
from multiradar.estimation.measurement._kernels import (
    KIND_DIRECTION,
    KIND_FLAT_POLAR,
    KIND_POSITION,
    KIND_RADAR,
    is_bearing,
)
from multiradar_compiled.kernels import in_loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


# A reported position begins no track anew that others measured within so long, s: two or three
# turns of most radars. Reports come faster than plots, so that three in a row tell little.
REPORT_PATIENCE_S = 12.0


@in_loop
def check_row(k: int, kind: int, accepts_bearings: bool) -> int:
    """Return `UPDATED` where a row has an aircraft and a kind to be taken, else what becomes of it.

    Only then do its other columns mean anything.
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
    """Return whether a refused row tells nothing against an aircraft, since others bear it out.

    That is so of reported positions while others measure the aircraft: what was taken last is at
    most `REPORT_PATIENCE_S` old, and not all of it came from the place of the row.
    """
    others = kind == KIND_POSITION and measured_from[k] != site_number
    return others and time - updated[k] < REPORT_PATIENCE_S


@in_loop
def choose_action(
    kind: int, z0: float, z1: float, time: float, state_time: float, rejections: int, patient: bool,
    options: Floats,
) -> int:  # fmt: skip
    """Return what a row may do to its aircraft, whose state is of ``state_time`` (NaN: none yet).

    `UPDATED`: correct it. `STARTED` and `RESTARTED`: begin it. `UNLOCATABLE` and `SINGULAR`: not
    a measurement, by its numbers. `REFUSED`: time goes on, and what was measured before the state
    cannot correct it; that tells nothing against the state, and is not to be counted.
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
    # No range is negative; places may be.
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
    """Open the books of an aircraft that was begun at a measurement from a place."""
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
    """Keep the books of an aircraft that has had its turn; return whether the row was taken."""
    accepted = outcome <= RESTARTED  # One of the first three.
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
    row: int, k: int, heights: Floats, vertical: Floats, updates: Integers,
    options: Floats, readouts: Floats,
) -> None:  # fmt: skip
    """Add the height, and to the variances what an unknown height does to position and velocity."""
    readouts[row, READOUT_UPDATES] = updates[k]
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
