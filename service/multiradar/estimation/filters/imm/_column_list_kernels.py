"""Compiled lists of the biases on which an aircraft depends, and products over them alone.

Of many biases, an aircraft depends on those of the few sensors that have seen it: with a hundred
radars on 10 of 208, which lie in four or five of 26 blocks of eight. The other terms of a sum over
columns are zero and do not change it, so that the sums here have the same bits as those over whole
blocks in `_kernels` and `_information_kernels`.

Symbols as in `_imm_kernels`.

References
----------
Friedland, B., "Treatment of bias in recursive filtering", IEEE TAC 14 (1969), 359-367.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import add_squares, block_bit, set_readout
from multiradar.estimation.filters.imm._mode_scratch_kernels import blocks_of_modes
from multiradar_compiled.kernels import fetch_ahead, fused, in_loop
from multiradar_compiled.lane_kernels import LANES, every_lane, fused_lanes, load_row, store_row

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: In place of the number of columns in a list: all columns.
NOT_LISTED = -1


@in_loop
def list_columns(
    k: int, count: int, mode_V: Floats, blocks: int, first: int, end: int, columns: Integers
) -> int:
    """List the biases on which aircraft k depends, ascending, and first…end; return their number.

    V is zero outside of some ``blocks``. As in `blocks_of_modes`, the first mode stands for all.
    """
    n, row = mode_V.shape[2], k * count
    listed = 0
    for begin in range(0, n, LANES):
        if blocks & block_bit(begin) == 0:
            continue
        for c in range(begin, min(begin + LANES, n)):
            columns[listed] = c
            is_zero = mode_V[row, 0, c] == 0.0 and mode_V[row, 1, c] == 0.0
            is_zero = is_zero and mode_V[row, 2, c] == 0.0 and mode_V[row, 3, c] == 0.0
            if not is_zero or first <= c < end:
                listed += 1
    return listed


@in_loop
def spread_of_columns(
    U: Floats, bias_covariance: Floats, R: Floats, columns: Integers, listed: int
) -> tuple[float, float, float]:
    """Return U P_ς Uᵀ: 00, 01, 11; as `spread_of_biases`, with U zero outside of a list."""
    n = U.shape[1]
    last = NOT_LISTED
    for at in range(listed):
        d = columns[at] - columns[at] % LANES
        if d == last:
            continue
        last = d
        lanes = min(LANES, n - d)
        r0 = every_lane(0.0)
        r1 = r0
        for i in range(listed):
            c = columns[i]
            p = load_row(bias_covariance, c, d, lanes)
            r0 = r0 + U[0, c] * p
            r1 = r1 + U[1, c] * p
        store_row(R, 0, d, lanes, r0)
        store_row(R, 1, d, lanes, r1)
    b00 = 0.0
    b01 = 0.0
    b11 = 0.0
    for i in range(listed):
        c = columns[i]
        b00 += R[0, c] * U[0, c]
        b01 += R[0, c] * U[1, c]
        b11 += R[1, c] * U[1, c]
    return b00, b01, b11


@in_loop
def inform_of_columns(
    i00: float, i01: float, i11: float, nu0: float, nu1: float, U: Floats, R: Floats, Y: Floats,
    y: Floats, columns: Integers, listed: int,
) -> None:  # fmt: skip
    """Add the information of a measurement: as `inform`, with U zero outside of a list.

    Of Y, only blocks on and above the diagonal are changed: its upper triangle is used.
    """
    n = y.shape[0]
    for i in range(listed):
        c = columns[i]
        R[0, c] = i00 * U[0, c] + i01 * U[1, c]
        R[1, c] = i01 * U[0, c] + i11 * U[1, c]
        y[c] = fused(R[0, c], nu0, fused(R[1, c], nu1, y[c]))
    last = NOT_LISTED
    for at in range(listed):
        d = columns[at] - columns[at] % LANES
        if d == last:
            continue
        last = d
        lanes = min(LANES, n - d)
        u0, u1 = load_row(U, 0, d, lanes), load_row(U, 1, d, lanes)
        for i in range(listed):
            c = columns[i]
            if c >= d + LANES:
                break
            more = fused_lanes(R[1, c], u1, load_row(Y, c, d, lanes))
            store_row(Y, c, d, lanes, fused_lanes(R[0, c], u0, more))


@in_loop
def read_out_columns(
    a: Floats, P: Floats, V: Floats, bias: Floats, factor: Floats, columns: Integers, listed: int,
    out: Floats,
) -> None:  # fmt: skip
    """Write the readout of an aircraft: as `read_out`, with V zero outside of a list."""
    n = V.shape[1]
    for i in range(4):
        x = a[i]
        for at in range(listed):
            c = columns[at]
            x += V[i, c] * bias[c]
        out[i] = x
    v = (P[0], P[1], P[4], P[7] + P[9])
    begin = 0
    for j in range(0, n, LANES):
        count = min(LANES, n - j)
        while begin < listed and columns[begin] < j:
            begin += 1
        if begin == listed:
            break
        w0 = every_lane(0.0)
        w1, w2, w3 = w0, w0, w0
        for at in range(begin, listed):
            c = columns[at]
            f = load_row(factor, c, j, count)
            w0 = w0 + V[0, c] * f
            w1 = w1 + V[1, c] * f
            w2 = w2 + V[2, c] * f
            w3 = w3 + V[3, c] * f
        v = add_squares(v, w0, w1, w2, w3, count)
    set_readout(v, out)


@in_loop
def blocks_between(first: int, end: int) -> int:
    """Return the blocks of the columns first…end."""
    blocks = 0
    for c in range(first - first % LANES, end, LANES):
        blocks |= block_bit(c)
    return blocks


@in_loop
def fetch_information(Y: Floats, columns: Integers, listed: int) -> None:
    """Prefetch what `inform_of_columns` changes of Y."""
    last = NOT_LISTED
    for at in range(listed):
        block = columns[at] // LANES
        if block == last:
            continue
        last = block
        for i in range(listed):
            if columns[i] >= (block + 1) * LANES:
                break
            fetch_ahead(Y, columns[i], block)


@in_loop
def fetch_columns(k: int, count: int, mode_V: Floats, V: Floats) -> int:
    """Prefetch the sensitivities of an aircraft, of which the first mode already was.

    Returns the blocks on which it depends.
    """
    n = mode_V.shape[2]
    blocks = blocks_of_modes(k, count, mode_V, 0, 0)
    for c in range(0, n, LANES):
        if blocks & block_bit(c) == 0:
            continue
        for r in range(4):
            line = (r * n + c) // LANES
            fetch_ahead(V, k, line)
            for j in range(1, count):
                fetch_ahead(mode_V, k * count + j, line)
    return blocks
