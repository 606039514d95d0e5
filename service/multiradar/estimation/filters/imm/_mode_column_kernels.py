"""Compiled sensitivities of interacting modes to the biases: mixing, prediction and update.

Each mode has its own V, four rows with a column for each bias. Eight columns are processed at once;
the coefficients of a mode are in its lane of the scratch array (rows: `_mode_scratch_kernels`).

References
----------
Friedland, B., "Treatment of bias in recursive filtering", IEEE TAC 14 (1969), 359-367, for V; that
of interacting modes is the project's own.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import block_bit
from multiradar.estimation.filters.imm._mode_scratch_kernels import (
    COURSE,
    GAIN,
    POSTERIOR,
    PREDICTED,
    SHARES,
    SLOPE,
)
from multiradar_compiled.kernels import in_loop
from multiradar_compiled.lane_kernels import (
    LANES,
    every_lane,
    fused_lanes,
    load_lanes,
    store_lanes,
    store_row,
)

Floats = NDArray[np.float64]


@in_loop
def move_columns(
    k: int, count: int, probabilities: Floats, scratch: Floats, mode_V: Floats, blocks: int
) -> None:
    """Mix V of the modes of aircraft k, and predict it."""
    n = mode_V.shape[2]
    first = k * count
    for c in range(0, n, LANES):
        lanes = min(LANES, n - c)
        if blocks & block_bit(c) == 0:
            continue
        hub0 = load_lanes(mode_V, first, 0, c, lanes)
        hub1 = load_lanes(mode_V, first, 1, c, lanes)
        hub2 = load_lanes(mode_V, first, 2, c, lanes)
        hub3 = load_lanes(mode_V, first, 3, c, lanes)
        arms0 = every_lane(0.0)
        arms1, arms2, arms3 = arms0, arms0, arms0
        for row in range(first + 1, first + count):
            p = probabilities[k, row - first]
            arms0 = fused_lanes(p, load_lanes(mode_V, row, 0, c, lanes), arms0)
            arms1 = fused_lanes(p, load_lanes(mode_V, row, 1, c, lanes), arms1)
            arms2 = fused_lanes(p, load_lanes(mode_V, row, 2, c, lanes), arms2)
            arms3 = fused_lanes(p, load_lanes(mode_V, row, 3, c, lanes), arms3)
        for j in range(count):
            row = first + j
            u, v, w = scratch[SHARES, j], scratch[SHARES + 1, j], scratch[SHARES + 2, j]
            own0 = w * load_lanes(mode_V, row, 0, c, lanes)
            own1 = w * load_lanes(mode_V, row, 1, c, lanes)
            own2 = w * load_lanes(mode_V, row, 2, c, lanes)
            own3 = w * load_lanes(mode_V, row, 3, c, lanes)
            t0 = fused_lanes(u, hub0, fused_lanes(v, arms0, own0))
            t1 = fused_lanes(u, hub1, fused_lanes(v, arms1, own1))
            t2 = fused_lanes(u, hub2, fused_lanes(v, arms2, own2))
            t3 = fused_lanes(u, hub3, fused_lanes(v, arms3, own3))
            s, turn = scratch[COURSE, j], scratch[COURSE + 1, j]
            cosine, sine = scratch[COURSE + 2, j], scratch[COURSE + 3, j]
            store_lanes(mode_V, row, 0, c, lanes, fused_lanes(s, t2, fused_lanes(turn, t3, t0)))
            store_lanes(mode_V, row, 1, c, lanes, fused_lanes(s, t3, fused_lanes(-turn, t2, t1)))
            store_lanes(mode_V, row, 2, c, lanes, fused_lanes(cosine, t2, sine * t3))
            store_lanes(mode_V, row, 3, c, lanes, fused_lanes(cosine, t3, -sine * t2))


@in_loop
def predict_columns(
    k: int, count: int, scratch: Floats, mode_V: Floats, mode_U: Floats, U: Floats, blocks: int
) -> None:
    """Set U of each mode to H V, of some blocks, and U to their mean by c."""
    n = mode_V.shape[2]
    for c in range(0, n, LANES):
        lanes = min(LANES, n - c)
        mean0 = every_lane(0.0)
        mean1 = mean0
        if blocks & block_bit(c) == 0:
            store_row(U, 0, c, lanes, mean0)
            store_row(U, 1, c, lanes, mean0)
            continue
        for j in range(count):
            v0 = load_lanes(mode_V, k * count + j, 0, c, lanes)
            v1 = load_lanes(mode_V, k * count + j, 1, c, lanes)
            u0 = fused_lanes(scratch[SLOPE, j], v0, scratch[SLOPE + 1, j] * v1)
            u1 = fused_lanes(scratch[SLOPE + 2, j], v0, scratch[SLOPE + 3, j] * v1)
            store_lanes(mode_U, j, 0, c, lanes, u0)
            store_lanes(mode_U, j, 1, c, lanes, u1)
            mean0 = fused_lanes(scratch[PREDICTED, j], u0, mean0)
            mean1 = fused_lanes(scratch[PREDICTED, j], u1, mean1)
        store_row(U, 0, c, lanes, mean0)
        store_row(U, 1, c, lanes, mean1)


@in_loop
def correct_columns(
    k: int, count: int, scratch: Floats, mode_V: Floats, mode_U: Floats, blocks: int
) -> None:
    """Subtract K U from V of each mode of aircraft k."""
    n = mode_V.shape[2]
    for c in range(0, n, LANES):
        lanes = min(LANES, n - c)
        if blocks & block_bit(c) == 0:
            continue
        for j in range(count):
            u0 = load_lanes(mode_U, j, 0, c, lanes)
            u1 = load_lanes(mode_U, j, 1, c, lanes)
            for r in range(4):
                v = load_lanes(mode_V, k * count + j, r, c, lanes)
                v = fused_lanes(-scratch[GAIN + 2 * r, j], u0, v)
                v = fused_lanes(-scratch[GAIN + 2 * r + 1, j], u1, v)
                store_lanes(mode_V, k * count + j, r, c, lanes, v)


@in_loop
def combine_columns(
    k: int, count: int, scratch: Floats, mode_V: Floats, V: Floats, blocks: int
) -> None:
    """Set V of aircraft k to the mean of its modes by μ."""
    n = mode_V.shape[2]
    for c in range(0, n, LANES):
        lanes = min(LANES, n - c)
        if blocks & block_bit(c) == 0:
            continue
        mean0 = every_lane(0.0)
        mean1, mean2, mean3 = mean0, mean0, mean0
        for j in range(count):
            p = scratch[POSTERIOR, j]
            mean0 = fused_lanes(p, load_lanes(mode_V, k * count + j, 0, c, lanes), mean0)
            mean1 = fused_lanes(p, load_lanes(mode_V, k * count + j, 1, c, lanes), mean1)
            mean2 = fused_lanes(p, load_lanes(mode_V, k * count + j, 2, c, lanes), mean2)
            mean3 = fused_lanes(p, load_lanes(mode_V, k * count + j, 3, c, lanes), mean3)
        store_lanes(V, k, 0, c, lanes, mean0)
        store_lanes(V, k, 1, c, lanes, mean1)
        store_lanes(V, k, 2, c, lanes, mean2)
        store_lanes(V, k, 3, c, lanes, mean3)
