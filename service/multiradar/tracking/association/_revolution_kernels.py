"""Compiled checks of revolutions: an antenna detects an aircraft at one azimuth in each.

Symbols: t = time between two plots, T = scan period, Δα = difference of their azimuths. They are
n = t / T − Δα / 2π revolutions apart, to the nearest integer. In one revolution, from two azimuths
farther apart than a beam, they are of two aircraft, or one is a reflection.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Model, Rows
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.geodesy._kernels import wrap_angle
from multiradar.tracking.association._grid_kernels import locate_plot
from multiradar.tracking.association.track_grid import Candidates, TrackGrid
from multiradar.tracking.lifecycle.lifecycle import Lifecycle
from multiradar.tracking.roster import MISSING, OTHER_AZIMUTH, RowIdentities
from multiradar_compiled.kernels import in_loop, kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Width of a beam, rad: plots of one aircraft that a radar did not combine are this close.
BEAM_RAD = math.radians(5.0)


@in_loop
def is_second_azimuth(since: float, turned: float, period: float) -> bool:
    """Return whether two plots are from two azimuths in one revolution.

    ``turned`` is the azimuth of the later one minus that of the earlier one; ``period`` is 0 where
    the scan period is unknown.
    """
    angle = wrap_angle(turned)
    second = False
    if period > 0.0 and since < period:
        second = abs(angle) > BEAM_RAD and abs(since / period - angle / (2.0 * math.pi)) < 0.5
    return second


@in_loop
def are_apart(one: int, other: int, rows: Rows, periods: Floats) -> bool:
    """Return whether two rows, the second one later, are from two azimuths in one revolution."""
    s = rows.sensor[one]
    apart = False
    if s == rows.sensor[other] and rows.kind[one] == KIND_RADAR and rows.kind[other] == KIND_RADAR:
        turned = rows.z[other, 1] - rows.z[one, 1]
        apart = is_second_azimuth(rows.time[other] - rows.time[one], turned, periods[s])
    return apart


@kernel
def reject_second_azimuths(
    first: int,
    last: int,
    window_time: float,
    track_numbers: Integers,
    rows: Rows,
    model: Model,
    periods: Floats,
    grid: TrackGrid,
    life: Lifecycle,
    identities: RowIdentities,
) -> None:
    """Mark rows, assigned by address alone, from a second azimuth in a revolution of their radar.

    Of two in the window the one nearer to the predicted track is kept.
    """
    sigmas = np.sqrt(np.diag(model.bias_covariance))
    previous, used = np.full((2, last - first), MISSING, np.int64)
    for row in range(first, last):
        k = identities.slot[row]
        if k < 0 or track_numbers[row] >= 0 or rows.kind[row] != KIND_RADAR:
            continue
        s = rows.sensor[row]
        since = rows.time[row] - life.last_seen[k, s]
        if is_second_azimuth(since, rows.z[row, 1] - life.last_azimuth[k, s], periods[s]):
            identities.slot[row] = OTHER_AZIMUTH
            continue
        other = grid.owner[k]
        while other != MISSING and identities.slot[row] == k:
            if identities.slot[other] == k and are_apart(other, row, rows, periods):
                mine = distance_of(row, k, window_time, rows, model, grid, sigmas)
                theirs = distance_of(other, k, window_time, rows, model, grid, sigmas)
                identities.slot[other if mine < theirs else row] = OTHER_AZIMUTH
            other = previous[other - first]
        previous[row - first] = grid.owner[k]
        grid.owner[k] = row
        used[row - first] = k
    for k in used:
        if k >= 0:
            grid.owner[k] = MISSING


@kernel
def distance_of(
    row: int, k: int, window_time: float, rows: Rows, model: Model, grid: TrackGrid, sigmas: Floats
) -> float:
    """Return the distance, m, of a plot from a predicted track."""
    _, east, north, _ = locate_plot(
        rows.kind[row], rows.sensor[row], rows.z[row, 0], rows.z[row, 1], rows.height[row], model,
        sigmas,
    )  # fmt: skip
    ahead = rows.time[row] - window_time
    d0 = grid.state[k, 0] + ahead * grid.state[k, 2] - east
    d1 = grid.state[k, 1] + ahead * grid.state[k, 3] - north
    return math.sqrt(d0 * d0 + d1 * d1)


@kernel
def drop_second_azimuths(
    first: int,
    rows: Rows,
    periods: Floats,
    grid: TrackGrid,
    identities: RowIdentities,
    candidates: Candidates,
) -> None:
    """Drop candidates that another plot of the same revolution and window has by its identity."""
    n = candidates.number.shape[0]
    previous = np.full(n, MISSING, np.int64)
    named = False
    for i in range(n):
        k = identities.slot[first + i]
        if k >= 0:
            previous[i] = grid.owner[k]
            grid.owner[k] = first + i
            named = True
    if not named:
        return
    for i in range(n):
        row, kept = first + i, 0
        for c in range(max(candidates.number[i], 0)):
            k = candidates.slot[i, c]
            other, apart = grid.owner[k], False
            while other != MISSING and not apart:
                apart = are_apart(min(row, other), max(row, other), rows, periods)
                other = previous[other - first]
            if not apart:
                candidates.slot[i, kept] = k
                candidates.score[i, kept] = candidates.score[i, c]
                candidates.reinitialised[i, kept] = candidates.reinitialised[i, c]
                kept += 1
        if candidates.number[i] > kept:
            candidates.number[i] = kept
    for i in range(n):
        k = identities.slot[first + i]
        if k >= 0:
            grid.owner[k] = MISSING
