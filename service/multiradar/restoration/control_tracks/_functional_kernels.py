"""Compiled functional of a control track: its misfit to plots and priors, with derivatives.

Symbols: θ = parameters of a track (see `_layout`), s = state at the start of a segment, S = its
derivatives by θ, M, r = second and first derivatives by state and controls of a segment alone,
H, g = those by θ, ρ² = normalised squared distance of a plot, b = probability that a plot is good.

A plot is good, with the density of its noise, or an outlier, uniformly distributed: its part is
−ln(e^(−ρ²/2) + e^floor), at most −floor. H is that of least squares with plots weighted by b, so it
is never negative.

References
----------
IMM UrO RAN report (2016), sections 2.2.4 and 2.5: weight with outliers, and parameters. Priors and
derivatives are the project's own.
"""

from math import exp, log, sqrt

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks._layout import (
    BEGIN,
    COUNT,
    EAST,
    EAST_EAST,
    EAST_NORTH,
    EXPECTED,
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
    PRIOR_INFORMATION,
    PRIOR_MEAN,
    SEGMENT_COUNT,
    SEGMENTS,
    SPEED,
    TIME,
)
from multiradar.restoration.control_tracks._motion_kernels import fly_with_slopes
from multiradar_compiled.kernels import in_loop, inner_loop

Floats = NDArray[np.float64]


@inner_loop
def assess(
    track: Floats,
    anchor_s: float,
    plots: Floats,
    first: int,
    last: int,
    kinds: Floats,
    cell_sigma_s: float,
    H: Floats,
    g: Floats,
    S: Floats,
    T: Floats,
    M: Floats,
    r: Floats,
) -> float:
    """Return the functional and write H and g; plots first … last − 1 lie after the anchor."""
    count = int(track[COUNT])
    size = 6 + 3 * (count - 1)
    for i in range(size):
        g[i] = 0.0
        for j in range(i + 1):
            H[i, j] = 0.0
    for i in range(4):
        for j in range(size):
            S[i, j] = 0.0
        S[i, i] = 1.0
    value = prior_part(track, count, kinds, cell_sigma_s, H, g)
    east, north = track[EAST], track[NORTH]
    v, heading = track[SPEED], track[HEADING]
    row = first
    begin, u_before, w_before = anchor_s, 0.0, 0.0
    for i in range(count):
        at = SEGMENTS + SEGMENT_COUNT * i
        u, w = track[at + LATERAL], track[at + LONGITUDINAL]
        own = 4 if i == 0 else 7 + 3 * (i - 1)
        if i > 0:
            begin = track[at + BEGIN]
            # Derivative by the start of a segment: the one before it lasts longer.
            S[2, own - 1] = w_before - w
            S[3, own - 1] = (u_before - u) / v
        end = np.inf
        if i < count - 1:
            end = track[at + SEGMENT_COUNT + BEGIN]
        for p in range(6):
            r[p] = 0.0
            for q in range(p + 1):
                M[p, q] = 0.0
        seen = row
        while row < last and plots[row, TIME] < end:
            value += add_plot(plots, row, east, north, v, heading, u, w, begin, M, r)
            row += 1
        if row > seen:
            expand(own, H, g, S, T, M, r)
        if i < count - 1:
            t = end - begin
            (de, dn, v1, h1, e_v, e_h, e_u, e_w, n_v, n_h, n_u, n_w, h_v, h_w) = fly_with_slopes(
                v, heading, u, w, t
            )
            for j in range(own):
                s_v, s_h = S[2, j], S[3, j]
                S[0, j] += e_v * s_v + e_h * s_h
                S[1, j] += n_v * s_v + n_h * s_h
                S[3, j] = s_h + h_v * s_v
            S[0, own], S[1, own], S[2, own] = e_u, n_u, 0.0
            S[0, own + 1], S[1, own + 1], S[2, own + 1], S[3, own + 1] = e_w, n_w, t, h_w
            # The heading changes by u q.
            S[3, own] = h_by_u(v, w, t)
            east, north, v, heading = east + de, north + dn, v1, h1
            u_before, w_before = u, w
    return value


@in_loop
def h_by_u(v: float, w: float, t: float) -> float:
    """Return q = ∫ dt / v, the derivative of the heading by the lateral acceleration."""
    out = fly_with_slopes(v, 0.0, 1.0, w, t)
    return out[3]


@in_loop
def add_plot(
    plots: Floats, row: int, east: float, north: float, v: float, heading: float,
    u: float, w: float, begin: float, M: Floats, r: Floats,
) -> float:  # fmt: skip
    """Add the contribution of one plot to M and r of its segment; return that to the functional."""
    (de, dn, _, _, e_v, e_h, e_u, e_w, n_v, n_h, n_u, n_w, _, _) = fly_with_slopes(
        v, heading, u, w, plots[row, TIME] - begin
    )
    x = east + de - plots[row, PLOT_EAST]
    y = north + dn - plots[row, PLOT_NORTH]
    a, b, c = plots[row, EAST_EAST], plots[row, EAST_NORTH], plots[row, NORTH_NORTH]
    fx, fy = a * x + b * y, b * x + c * y
    half = 0.5 * (x * fx + y * fy)
    floor = plots[row, FLOOR]
    # b = e^(−ρ²/2) / (e^(−ρ²/2) + e^floor)
    odds = exp(min(floor + half, 700.0))
    good = 1.0 / (1.0 + odds)
    part: float = half - log(1.0 + odds) if half < -floor else -floor - log(1.0 + 1.0 / odds)
    a, b, c, fx, fy = good * a, good * b, good * c, good * fx, good * fy
    r[0] += fx
    r[1] += fy
    r[2] += e_v * fx + n_v * fy
    r[3] += e_h * fx + n_h * fy
    r[4] += e_u * fx + n_u * fy
    r[5] += e_w * fx + n_w * fy
    M[0, 0] += a
    M[1, 0] += b
    M[1, 1] += c
    f, k = a * e_v + b * n_v, b * e_v + c * n_v
    M[2, 0] += f
    M[2, 1] += k
    M[2, 2] += e_v * f + n_v * k
    f, k = a * e_h + b * n_h, b * e_h + c * n_h
    M[3, 0] += f
    M[3, 1] += k
    M[3, 2] += e_v * f + n_v * k
    M[3, 3] += e_h * f + n_h * k
    f, k = a * e_u + b * n_u, b * e_u + c * n_u
    M[4, 0] += f
    M[4, 1] += k
    M[4, 2] += e_v * f + n_v * k
    M[4, 3] += e_h * f + n_h * k
    M[4, 4] += e_u * f + n_u * k
    f, k = a * e_w + b * n_w, b * e_w + c * n_w
    M[5, 0] += f
    M[5, 1] += k
    M[5, 2] += e_v * f + n_v * k
    M[5, 3] += e_h * f + n_h * k
    M[5, 4] += e_u * f + n_u * k
    M[5, 5] += e_w * f + n_w * k
    return part


@in_loop
def expand(own: int, H: Floats, g: Floats, S: Floats, T: Floats, M: Floats, r: Floats) -> None:
    """Transform derivatives by state and controls of a segment to the parameters of the track.

    The state depends on the first `own` parameters by S; the controls are the next two.
    """
    for j in range(own):
        s0, s1, s2, s3 = S[0, j], S[1, j], S[2, j], S[3, j]
        g[j] += s0 * r[0] + s1 * r[1] + s2 * r[2] + s3 * r[3]
        T[0, j] = M[0, 0] * s0 + M[1, 0] * s1 + M[2, 0] * s2 + M[3, 0] * s3
        T[1, j] = M[1, 0] * s0 + M[1, 1] * s1 + M[2, 1] * s2 + M[3, 1] * s3
        T[2, j] = M[2, 0] * s0 + M[2, 1] * s1 + M[2, 2] * s2 + M[3, 2] * s3
        T[3, j] = M[3, 0] * s0 + M[3, 1] * s1 + M[3, 2] * s2 + M[3, 3] * s3
        H[own, j] += M[4, 0] * s0 + M[4, 1] * s1 + M[4, 2] * s2 + M[4, 3] * s3
        H[own + 1, j] += M[5, 0] * s0 + M[5, 1] * s1 + M[5, 2] * s2 + M[5, 3] * s3
    for i in range(own):
        s0, s1, s2, s3 = S[0, i], S[1, i], S[2, i], S[3, i]
        for j in range(i + 1):
            H[i, j] += s0 * T[0, j] + s1 * T[1, j] + s2 * T[2, j] + s3 * T[3, j]
    g[own] += r[4]
    g[own + 1] += r[5]
    H[own, own] += M[4, 4]
    H[own + 1, own] += M[5, 4]
    H[own + 1, own + 1] += M[5, 5]


@in_loop
def prior_part(
    track: Floats, count: int, kinds: Floats, cell_sigma_s: float, H: Floats, g: Floats
) -> float:
    """Add the contribution of the priors; return their part of the functional."""
    value = 0.0
    for i in range(6):
        total = 0.0
        for j in range(6):
            known = track[PRIOR_INFORMATION + 6 * i + j]
            total += known * (first_parameter(track, j) - track[PRIOR_MEAN + j])
            if j <= i:
                H[i, j] += known
        g[i] += total
        value += 0.5 * total * (first_parameter(track, i) - track[PRIOR_MEAN + i])
    for i in range(1, count):
        at = SEGMENTS + SEGMENT_COUNT * i
        kind = int(track[at + KIND])
        own = 6 + 3 * (i - 1)
        for part in range(3):
            if part == 0:
                off, sigma = track[at + BEGIN] - track[at + EXPECTED], cell_sigma_s
            elif part == 1:
                off, sigma = (
                    track[at + LATERAL] - kinds[kind, LATERAL_MEAN],
                    kinds[kind, LATERAL_SIGMA],
                )
            else:
                off = track[at + LONGITUDINAL] - kinds[kind, LONGITUDINAL_MEAN]
                sigma = kinds[kind, LONGITUDINAL_SIGMA]
            known = 1.0 / (sigma * sigma)
            value += 0.5 * known * off * off
            g[own + part] += known * off
            H[own + part, own + part] += known
    return value


@in_loop
def first_parameter(track: Floats, i: int) -> float:
    """Return one of the first six parameters: state at the anchor, controls of a segment."""
    found: float = track[EAST + i] if i < 4 else track[SEGMENTS + LATERAL + i - 4]
    return found


@in_loop
def factorise(H: Floats, size: int) -> float:
    """Turn the lower triangle of H into its Cholesky factor; return ln det H, NaN without one."""
    logarithm = 0.0
    for j in range(size):
        d = H[j, j]
        for k in range(j):
            d -= H[j, k] * H[j, k]
        if not d > 0.0:
            logarithm = np.nan
            break
        root = sqrt(d)
        logarithm += 2.0 * log(root)
        H[j, j] = root
        for i in range(j + 1, size):
            f = H[i, j]
            for k in range(j):
                f -= H[i, k] * H[j, k]
            H[i, j] = f / root
    return logarithm


@in_loop
def solve(H: Floats, g: Floats, size: int) -> None:
    """Replace g by the solution of L Lᵀ x = g."""
    for i in range(size):
        f = g[i]
        for k in range(i):
            f -= H[i, k] * g[k]
        g[i] = f / H[i, i]
    for i in range(size - 1, -1, -1):
        f = g[i]
        for k in range(i + 1, size):
            f -= H[k, i] * g[k]
        g[i] = f / H[i, i]
