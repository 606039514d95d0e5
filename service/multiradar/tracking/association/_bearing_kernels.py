"""Compiled association of bearings without identity, by azimuth, where one track alone fits.

A bearing fits every track in its direction. It is assigned to a track that is clearly likelier than
all others and than a false bearing of random azimuth; otherwise to none, as a wrong bearing
corrupts a track like a wrong plot.

References
----------
The project's own: likelihood ratios of `_association_kernels`; the measurement has the empty first
component of a bearing.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Aircraft, Model, Rows
from multiradar.estimation.measurement._kernels import is_bearing
from multiradar.estimation.measurement.kinds import KIND_DIRECTION
from multiradar.tracking.association._association_kernels import LOG_TWO_PI, association_score
from multiradar.tracking.association.track_grid import BiasScratch, PlotPosition, TrackGrid
from multiradar.tracking.lifecycle.lifecycle import TENTATIVE, Lifecycle
from multiradar.tracking.roster import MISSING, ReportedIdentities, Roster, RowIdentities
from multiradar_compiled.kernels import inner_loop, kernel

Floats = NDArray[np.float64]

# Log density of false bearings: uniform over the circle, 1/rad, times that of the empty component
# at its centre.
LOG_ANYWHERE = -1.5 * LOG_TWO_PI
# Of false directions: the sine of the elevation is uniform from the horizon to the zenith.
LOG_ANYWHERE_ABOVE = -LOG_TWO_PI
# Minimum difference of log likelihood to the second likeliest track: a factor of twenty.
LOG_CLEARLY = math.log(20.0)


@kernel
def assign_bearings(
    first: int,
    last: int,
    window_time: float,
    reported: ReportedIdentities,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    roster: Roster,
    life: Lifecycle,
    rules: Floats,
    grid: TrackGrid,
    identities: RowIdentities,
) -> None:
    """Assign bearings first…last without identity for which one track alone fits."""
    n = model.bias.shape[0]
    sigmas = np.sqrt(np.diag(model.bias_covariance))
    search(
        first, last, window_time, reported, rows, model, aircraft, roster, life, rules, grid,
        identities, BiasScratch(sigmas, np.empty((2, n)), np.empty((2, n))),
    )  # fmt: skip


@inner_loop
def search(
    first: int,
    last: int,
    window_time: float,
    reported: ReportedIdentities,
    rows: Rows,
    model: Model,
    aircraft: Aircraft,
    roster: Roster,
    life: Lifecycle,
    rules: Floats,
    grid: TrackGrid,
    identities: RowIdentities,
    scratch: BiasScratch,
) -> None:
    """As `assign_bearings`, with given scratch arrays."""
    for row in range(first, last):
        named = reported.track_number[row] >= 0 or reported.mode_s_address[row] >= 0
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
            # The position of a plot, which a bearing has not, matters for tentative tracks only;
            # direction finders do not rotate.
            score, _ = association_score(
                row, k, ahead, PlotPosition(0.0, 0.0, 0.0, 0.0), 0.0, reported, rows, model,
                aircraft, roster, life, grid, rules, anywhere, scratch,
            )  # fmt: skip
            if score > best:
                best, second = score, best
                chosen = k
            elif score > second:
                second = score
        if chosen != MISSING and best - second >= LOG_CLEARLY:
            identities.slot[row] = chosen
