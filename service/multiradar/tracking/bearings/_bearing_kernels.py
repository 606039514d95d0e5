"""Compiled association of bearings that no identity names: by azimuth, where one track alone fits.

A bearing points at every track behind each other in its direction. It is given to the one that is
clearly likelier than all others and than a bearing of nothing, whose azimuth is anywhere; else to
none, for a wrong bearing bends a track as a wrong plot does.

References
----------
The project's own: likelihood ratios of `_association_kernels`, whose measurement has the empty
first component of a bearing.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Aircraft, Model, Rows
from multiradar.estimation.measurement._kernels import KIND_DIRECTION, is_bearing
from multiradar.tracking.association._association_kernels import LOG_TURN, judge
from multiradar.tracking.association.sky import Sky
from multiradar.tracking.lifecycle.lifecycle import TENTATIVE, Lifecycle
from multiradar.tracking.roster import MISSING, Roster, RowIdentities
from multiradar_compiled.kernels import kernel, loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Logarithm of the density of bearings of nothing: even over the circle, 1/rad; beside it that of
# the empty component at its middle.
LOG_ANYWHERE = -1.5 * LOG_TURN
# Of directions of nothing: the sine of the elevation is even from the horizon to the zenith.
LOG_ANYWHERE_ABOVE = -LOG_TURN
# By so much the likeliest track must be likelier than the next: twenty times.
LOG_CLEARLY = math.log(20.0)


@kernel
def give_bearings(
    first: int,
    last: int,
    window_time: float,
    track_numbers: Integers,
    addresses: Integers,
    codes: Integers,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    roster: Roster,
    life: Lifecycle,
    rules: Floats,
    sky: Sky,
    identities: RowIdentities,
) -> None:
    """Fill the slots of bearings first…last without identity for which one track alone fits."""
    n = model.bias.shape[0]
    search(
        first, last, window_time, track_numbers, addresses, codes, rows, model, aircraft, roster,
        life, rules, sky, identities, np.sqrt(np.diag(model.bias_covariance)),
        np.empty((2, n)), np.empty((2, n)),
    )  # fmt: skip


@loop
def search(
    first: int,
    last: int,
    window_time: float,
    track_numbers: Integers,
    addresses: Integers,
    codes: Integers,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    roster: Roster,
    life: Lifecycle,
    rules: Floats,
    sky: Sky,
    identities: RowIdentities,
    sigmas: Floats,
    U: Floats,
    R: Floats,
) -> None:
    """Do as `give_bearings`, in the room given."""
    for row in range(first, last):
        named = track_numbers[row] >= 0 or addresses[row] >= 0
        if not is_bearing(rows.kind[row]) or identities.slot[row] >= 0 or named:
            continue
        ahead = rows.time[row] - window_time
        anywhere = LOG_ANYWHERE_ABOVE if rows.kind[row] == KIND_DIRECTION else LOG_ANYWHERE
        best, second = 0.0, 0.0
        chosen = MISSING
        for k in range(roster.track_id.shape[0]):
            if (
                roster.track_id[k] == MISSING
                or np.isnan(aircraft.time[k])
                or life.stage[k] == TENTATIVE
            ):
                continue
            # The place of the bearing, which there is none of, is looked at of tentative ones only;
            # direction finders do not turn.
            score, _ = judge(
                row, k, ahead, 0.0, MISSING, MISSING, codes[row], 0.0, 0.0, 0.0, 0.0, rows, model,
                aircraft, roster, life, sky, rules, anywhere, sigmas, U, R,
            )  # fmt: skip
            if score > best:
                best, second = score, best
                chosen = k
            elif score > second:
                second = score
        if chosen != MISSING and best - second >= LOG_CLEARLY:
            identities.slot[row] = chosen
