"""Compiled states of tracks at many times, with covariances from those of the parameters.

Symbols: θ = parameters of a track, L = the Cholesky factor of H, the second derivatives of the
functional by θ; J = derivatives of the state by θ, by differences. The covariance of the state is
J H⁻¹ Jᵀ = Y Yᵀ with L Yᵀ = Jᵀ.

References
----------
The project's own.
"""

from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks._fit_kernels import copy_track, fit_track
from multiradar.restoration.control_tracks._layout import (
    BEGIN,
    COUNT,
    SEGMENT_COUNT,
    SEGMENTS,
    TIME,
    WEIGHT,
)
from multiradar.restoration.control_tracks._scratch import FitScratch
from multiradar.restoration.control_tracks._thinning_kernels import trace
from multiradar_compiled.kernels import in_loop, loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]


class PathScratch(NamedTuple):
    """Scratch arrays of `trace_with_spreads`.

    Attributes
    ----------
    moved : (TRACK_COUNT,) float64
        A track with one parameter moved.
    other : (k, 4) float64
        Its states.
    slopes : (k, 4, p) float64
        Derivatives of the states by the parameters.
    """

    moved: Floats
    other: Floats
    slopes: Floats


class TrackPaths(NamedTuple):
    """The motion of tracks at times, as `trace_with_spreads` writes it.

    Attributes
    ----------
    states : (m, k, 4) float64
        East and north (m) and their rates (m/s).
    spreads : (m, k, 4, 4) float64
        Their covariances.
    segments : (m, k) int64
        The segment at each time.
    sound : (m,) bool
        Tracks with covariances: those whose H has a Cholesky factor. The others are zero.
    """

    states: Floats
    spreads: Floats
    segments: Integers
    sound: Flags


@loop
def trace_with_spreads(
    tracks: Floats,
    many: int,
    anchor_s: float,
    time_s: Floats,
    plots: Floats,
    kinds: Floats,
    rules: Floats,
    columns: Integers,
    steps: Floats,
    fit: FitScratch,
    scratch: PathScratch,
    written: TrackPaths,
) -> None:
    """Write the paths of the first tracks, with derivatives by steps of columns of the tracks."""
    moved, other, slopes = scratch
    states, spreads, segments, sound = written
    last = len(plots)
    for i in range(many):
        copy_track(tracks[i], moved)
        fit_track(moved, anchor_s, plots, 0, last, plots[last - 1, TIME], kinds, rules, 0, fit)
        sound[i] = moved[WEIGHT] > -np.inf
        if not sound[i]:
            for k in range(len(time_s)):
                states[i, k] = 0.0
                spreads[i, k] = 0.0
                segments[i, k] = 0
            continue
        size = 6 + 3 * (int(moved[COUNT]) - 1)
        for j in range(size):
            value = moved[columns[j]]
            moved[columns[j]] = value + steps[j]
            velocities(moved, anchor_s, time_s, states[i])
            moved[columns[j]] = value - steps[j]
            velocities(moved, anchor_s, time_s, other)
            moved[columns[j]] = value
            for k in range(len(time_s)):
                for c in range(4):
                    slopes[k, c, j] = (states[i, k, c] - other[k, c]) / (2.0 * steps[j])
        velocities(moved, anchor_s, time_s, states[i])
        for k in range(len(time_s)):
            spread(fit.H, slopes[k], size, spreads[i, k])
            segments[i, k] = segment_at(moved, time_s[k])


@in_loop
def velocities(track: Floats, anchor_s: float, time_s: Floats, out: Floats) -> None:
    """Write positions and velocities (k, 4) of a track."""
    trace(track, anchor_s, time_s, out)
    for k in range(len(time_s)):
        speed, heading = out[k, 2], out[k, 3]
        out[k, 2] = speed * sin(heading)
        out[k, 3] = speed * cos(heading)


@in_loop
def spread(L: Floats, slopes: Floats, size: int, out: Floats) -> None:
    """Write the covariance of a state; its slopes (4, p) are overwritten by Y."""
    for c in range(4):
        for j in range(size):
            value = slopes[c, j]
            for m in range(j):
                value -= L[j, m] * slopes[c, m]
            slopes[c, j] = value / L[j, j]
    for c in range(4):
        for d in range(c + 1):
            total = 0.0
            for j in range(size):
                total += slopes[c, j] * slopes[d, j]
            out[c, d] = total
            out[d, c] = total


@in_loop
def segment_at(track: Floats, time_s: float) -> int:
    """Return the segment of a track at a time."""
    i = 0
    while i < int(track[COUNT]) - 1 and track[SEGMENTS + SEGMENT_COUNT * (i + 1) + BEGIN] <= time_s:
        i += 1
    return i
