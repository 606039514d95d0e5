"""Compiled slide of the window: plots that leave it are absorbed in the prior at the anchor.

Symbols: θ = first six parameters (east, north, speed, heading, lateral and longitudinal
acceleration), m, P = their mean and covariance without the plots of the window, F = derivatives of
the later state by θ.

A plot that leaves moves the anchor to its time and updates m, P, both linearised at the smoothed θ.
The weight of a track is preserved: sliding is not evidence.

References
----------
The project's own: a Kalman filter delayed by the length of the window.
"""

from math import exp

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks._functional_kernels import (
    factorise,
    first_parameter,
    h_by_u,
)
from multiradar.restoration.control_tracks._layout import (
    BEGIN,
    COUNT,
    EAST,
    EAST_EAST,
    EAST_NORTH,
    FLOOR,
    HEADING,
    KIND,
    LATERAL,
    LATERAL_MEAN,
    LATERAL_SIGMA,
    LONGITUDINAL,
    LONGITUDINAL_MEAN,
    LONGITUDINAL_SIGMA,
    NORTH,
    NORTH_NORTH,
    PLOT_EAST,
    PLOT_NORTH,
    PRIOR_COVARIANCE,
    PRIOR_INFORMATION,
    PRIOR_LOGARITHM,
    PRIOR_MEAN,
    SEGMENT_COUNT,
    SEGMENTS,
    SPEED,
    TIME,
    VELOCITY_DRIFT,
)
from multiradar.restoration.control_tracks._motion_kernels import fly_with_slopes
from multiradar_compiled.kernels import in_loop, inner_loop

Floats = NDArray[np.float64]

# Plots that are good with a lower probability are not absorbed.
GOOD_MIN = 1e-3


@inner_loop
def drop_plot(
    track: Floats, anchor_s: float, plots: Floats, row: int, kinds: Floats, rules: Floats,
    A: Floats, B: Floats,
) -> None:  # fmt: skip
    """Remove the oldest plot from the window; the anchor is at its time afterwards."""
    time_s = plots[row, TIME]
    while int(track[COUNT]) > 1 and track[SEGMENTS + SEGMENT_COUNT + BEGIN] <= time_s:
        begin = track[SEGMENTS + SEGMENT_COUNT + BEGIN]
        move(track, begin - anchor_s, rules, A, B)
        anchor_s = begin
        start_next_segment(track, kinds)
    move(track, time_s - anchor_s, rules, A, B)
    correct(track, plots, row)
    write_information(track, A, B)


@in_loop
def move(track: Floats, t: float, rules: Floats, F: Floats, B: Floats) -> None:
    """Predict state, mean and covariance by a time within the first segment."""
    v, heading = track[SPEED], track[HEADING]
    u, w = track[SEGMENTS + LATERAL], track[SEGMENTS + LONGITUDINAL]
    (de, dn, v1, h1, e_v, e_h, e_u, e_w, n_v, n_h, n_u, n_w, h_v, h_w) = fly_with_slopes(
        v, heading, u, w, t
    )
    for i in range(6):
        for j in range(6):
            F[i, j] = 1.0 if i == j else 0.0
    F[0, 2], F[0, 3], F[0, 4], F[0, 5] = e_v, e_h, e_u, e_w
    F[1, 2], F[1, 3], F[1, 4], F[1, 5] = n_v, n_h, n_u, n_w
    F[2, 5] = t
    F[3, 2], F[3, 4], F[3, 5] = h_v, h_by_u(v, w, t), h_w
    for i in range(6):
        B[i, 0] = track[PRIOR_MEAN + i] - first_parameter(track, i)
    track[EAST] += de
    track[NORTH] += dn
    track[SPEED] = v1
    track[HEADING] = h1
    for i in range(6):
        total = first_parameter(track, i)
        for j in range(6):
            total += F[i, j] * B[j, 0]
        track[PRIOR_MEAN + i] = total
    for i in range(6):
        for j in range(6):
            total = 0.0
            for k in range(6):
                total += F[i, k] * track[PRIOR_COVARIANCE + 6 * k + j]
            B[i, j] = total
    for i in range(6):
        for j in range(i + 1):
            total = 0.0
            for k in range(6):
                total += B[i, k] * F[j, k]
            track[PRIOR_COVARIANCE + 6 * i + j] = total
            track[PRIOR_COVARIANCE + 6 * j + i] = total
    # Flights do not consist of exact segments: isotropic noise of the velocity.
    drift = rules[VELOCITY_DRIFT] * t
    track[PRIOR_COVARIANCE + 14] += drift
    track[PRIOR_COVARIANCE + 21] += drift / (v1 * v1)


@in_loop
def start_next_segment(track: Floats, kinds: Floats) -> None:
    """Remove the first segment; the controls of the next have no information from the past."""
    count = int(track[COUNT])
    for i in range(1, count):
        at = SEGMENTS + SEGMENT_COUNT * i
        for part in range(SEGMENT_COUNT):
            track[at - SEGMENT_COUNT + part] = track[at + part]
    track[COUNT] = count - 1.0
    kind = int(track[SEGMENTS + KIND])
    track[PRIOR_MEAN + 4] = kinds[kind, LATERAL_MEAN]
    track[PRIOR_MEAN + 5] = kinds[kind, LONGITUDINAL_MEAN]
    for i in range(4, 6):
        for j in range(6):
            track[PRIOR_COVARIANCE + 6 * i + j] = 0.0
            track[PRIOR_COVARIANCE + 6 * j + i] = 0.0
    track[PRIOR_COVARIANCE + 28] = kinds[kind, LATERAL_SIGMA] ** 2
    track[PRIOR_COVARIANCE + 35] = kinds[kind, LONGITUDINAL_SIGMA] ** 2


@in_loop
def correct(track: Floats, plots: Floats, row: int) -> None:
    """Update mean and covariance by a plot at the anchor."""
    a, b, c = plots[row, EAST_EAST], plots[row, EAST_NORTH], plots[row, NORTH_NORTH]
    x = track[EAST] - plots[row, PLOT_EAST]
    y = track[NORTH] - plots[row, PLOT_NORTH]
    half = 0.5 * (a * x * x + 2.0 * b * x * y + c * y * y)
    good = 1.0 / (1.0 + exp(min(plots[row, FLOOR] + half, 700.0)))
    if good > GOOD_MIN:
        determinant = (a * c - b * b) * good
        at = PRIOR_COVARIANCE
        s00 = track[at] + c / determinant
        s01 = track[at + 1] - b / determinant
        s11 = track[at + 7] + a / determinant
        whole = s00 * s11 - s01 * s01
        i00, i01, i11 = s11 / whole, -s01 / whole, s00 / whole
        x = plots[row, PLOT_EAST] - track[PRIOR_MEAN]
        y = plots[row, PLOT_NORTH] - track[PRIOR_MEAN + 1]
        f0, f1 = i00 * x + i01 * y, i01 * x + i11 * y
        for i in range(6):
            track[PRIOR_MEAN + i] += track[at + 6 * i] * f0 + track[at + 6 * i + 1] * f1
        # Backwards, because the first two columns are those of the gain.
        for i in range(5, -1, -1):
            p0, p1 = track[at + 6 * i], track[at + 6 * i + 1]
            k0, k1 = p0 * i00 + p1 * i01, p0 * i01 + p1 * i11
            for j in range(i, -1, -1):
                q0, q1 = track[at + 6 * j], track[at + 6 * j + 1]
                track[at + 6 * i + j] -= k0 * q0 + k1 * q1
        for i in range(6):
            for j in range(i):
                track[at + 6 * j + i] = track[at + 6 * i + j]


@in_loop
def write_information(track: Floats, A: Floats, B: Floats) -> None:
    """Write information and its determinant beside the covariance."""
    for i in range(6):
        for j in range(6):
            A[i, j] = track[PRIOR_COVARIANCE + 6 * i + j]
    track[PRIOR_LOGARITHM] = -factorise(A, 6)
    # The inverse column by column: L Lᵀ x = e.
    for k in range(6):
        for i in range(6):
            total = 1.0 if i == k else 0.0
            for j in range(i):
                total -= A[i, j] * B[j, 0]
            B[i, 0] = total / A[i, i]
        for i in range(5, -1, -1):
            total = B[i, 0]
            for j in range(i + 1, 6):
                total -= A[j, i] * B[j, 0]
            B[i, 0] = total / A[i, i]
        for i in range(6):
            track[PRIOR_INFORMATION + 6 * i + k] = B[i, 0]
