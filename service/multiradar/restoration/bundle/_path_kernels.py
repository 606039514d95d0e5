"""Compiled states of tracks at many times, with covariances from those of the parameters.

Symbols: θ = parameters of a track, L = the Cholesky factor of H, the second derivatives of the
functional by θ; J = derivatives of the state by θ, by differences. The covariance of the state is
J H⁻¹ Jᵀ = Y Yᵀ with L Yᵀ = Jᵀ.

References
----------
The project's own.
"""

from math import cos, sin

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
from multiradar.restoration.control_tracks._thinning_kernels import trace
from multiradar_compiled.kernels import in_loop, loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]


@loop
def trace_with_spreads(
    tracks: Floats, many: int, anchor_s: float, time_s: Floats, plots: Floats, kinds: Floats,
    rules: Floats, columns: Integers, steps: Floats, spare: Floats, H: Floats, g: Floats,
    H2: Floats, g2: Floats, S: Floats, T: Floats, M: Floats, r: Floats, moved: Floats,
    other: Floats, slopes: Floats, states: Floats, spreads: Floats, segments: Integers,
    sound: Flags,
) -> None:  # fmt: skip
    """Write states (m, k, 4), covariances (m, k, 4, 4) and segments (m, k) of the first tracks.

    `sound` (m) marks the tracks with covariances: those whose H has a Cholesky factor. The output
    of the others is zero.
    """
    last = len(plots)
    for i in range(many):
        copy_track(tracks[i], moved)
        fit_track(
            moved, spare, anchor_s, plots, 0, last, plots[last - 1, TIME], kinds, rules, 0,
            H, g, H2, g2, S, T, M, r,
        )  # fmt: skip
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
            spread(H, slopes[k], size, spreads[i, k])
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
