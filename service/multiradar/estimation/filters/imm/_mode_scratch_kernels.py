"""Compiled access to the modes of an aircraft, all at once: one per lane.

a and x have lanes for each component, P for each element of its triangle. Lanes beyond the last
mode repeat the hub, with probability 0. Coefficients of single modes, for the columns of V, are in
rows of a scratch array.

Symbols as in `_mode_kernels`.

References
----------
The project's own.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import ALL_BLOCKS, DENSE_MAX, are_zero, block_bit
from multiradar.estimation.motion._kernels import PackedOf
from multiradar_compiled.kernels import in_both, in_loop
from multiradar_compiled.lane_kernels import (
    LANES,
    Lanes,
    Numbers,
    every_lane,
    fused_lanes,
    larger,
    load_lanes,
    load_row,
    store_row,
    sums_of,
    transposed,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: The four components of the state, of all modes.
State = tuple[Lanes, Lanes, Lanes, Lanes]
Covariances = PackedOf[Lanes]
CourseOf = tuple[Numbers, Numbers, Numbers, Numbers]

# Columns of `Model.modes`: acceleration across the velocity, m/s², right positive; densities of
# white acceleration along the velocity and across it, m²/s³; rate of leaving the mode, 1/s; whether
# it gets the additional noise of unmodelled manoeuvres, 1 or 0; share of the aircraft leaving the
# hub that enter the mode, 0 for the hub.
LATERAL = 0
ALONG = 1
ACROSS = 2
LEAVING = 3
UNMODELLED = 4
ENTERING = 5
MODE_COUNT = 6

# Rows of the scratch array: columns of `Model.modes`; flags (1) of the lanes of the hub (with those
# beyond the last mode), of the arms, of all modes; mixing weights of `transition_modes`; turn of
# each mode; H; K; c; μ; then scratch of `evaluate_modes`.
TABLE = 0
HUB = 6
ARMS = 7
MODES = 8
SHARES = 9
COURSE = 12
SLOPE = 16
GAIN = 20
PREDICTED = 28
POSTERIOR = 29
SUMS = 30
SCRATCH_ROWS = SUMS + 4 * LANES


class SlowScratch(NamedTuple):
    """Scratch of the slow states of one aircraft.

    Attributes
    ----------
    by_mode : (j, 2, SLOW_COUNT) float64
        Sensitivity of a measurement to the slow states, of each mode.
    U, R : (2, SLOW_COUNT) float64
        Its mean, and products with it.
    shift : (4, LANES) float64
        Change of the state of each mode.
    square : (2 SLOW_COUNT, SLOW_COUNT) float64
        Two matrices.
    """

    by_mode: Floats
    U: Floats
    R: Floats
    shift: Floats
    square: Floats


class ModeScratch(NamedTuple):
    """Scratch of the modes of one aircraft.

    Attributes
    ----------
    by_mode : (j, 2, c) float64
        Sensitivity of a measurement to all biases, of each mode.
    rows : (SCRATCH_ROWS, LANES) float64
        Rows named above.
    slow : SlowScratch
        That of the slow states.
    delay : (4,) float64
        Of the delay of the transponder: see `_mode_delay_kernels`.
    columns : (c,) int64
        The biases on which the aircraft depends: see `_column_list_kernels`.
    """

    by_mode: Floats
    rows: Floats
    slow: SlowScratch
    delay: Floats
    columns: Integers


@in_loop
def prepare_scratch(modes: Floats, scratch: Floats) -> None:
    """Write the parameters of the modes into the scratch array, once for all aircraft."""
    count = modes.shape[0]
    for j in range(LANES):
        for column in range(MODE_COUNT):
            scratch[TABLE + column, j] = modes[j if j < count else 0, column]
        scratch[HUB, j] = 0.0 if 0 < j < count else 1.0
        scratch[ARMS, j] = 1.0 if 0 < j < count else 0.0
        scratch[MODES, j] = 1.0 if j < count else 0.0


@in_both
def get_row(scratch: Floats, row: int) -> Lanes:
    """Return a row of the scratch array."""
    return load_row(scratch, row, 0, LANES)


@in_both
def set_row(scratch: Floats, row: int, lanes: Lanes) -> None:
    """Set a row of the scratch array."""
    store_row(scratch, row, 0, LANES, lanes)


@in_both
def mode_row(k: int, count: int, j: int) -> int:
    """Return the row of mode j of aircraft k; that of the hub beyond the last mode."""
    return k * count + (j if j < count else 0)


@in_both
def load_columns(
    k: int, count: int, first: int, columns: int, states: Floats
) -> tuple[Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes]:
    """Return columns of the rows of aircraft k, at most eight, each as lanes of its modes."""
    return transposed(
        load_row(states, mode_row(k, count, 0), first, columns),
        load_row(states, mode_row(k, count, 1), first, columns),
        load_row(states, mode_row(k, count, 2), first, columns),
        load_row(states, mode_row(k, count, 3), first, columns),
        load_row(states, mode_row(k, count, 4), first, columns),
        load_row(states, mode_row(k, count, 5), first, columns),
        load_row(states, mode_row(k, count, 6), first, columns),
        load_row(states, mode_row(k, count, 7), first, columns),
    )


@in_both
def load_modes(
    k: int, count: int, mode_means: Floats, mode_covariances: Floats
) -> tuple[State, Covariances]:
    """Return a and P of the modes of aircraft k."""
    a0, a1, a2, a3, _, _, _, _ = load_columns(k, count, 0, 4, mode_means)
    p0, p1, p2, p3, p4, p5, p6, p7 = load_columns(k, count, 0, 8, mode_covariances)
    p8, p9, _, _, _, _, _, _ = load_columns(k, count, 8, 2, mode_covariances)
    return (a0, a1, a2, a3), (p0, p1, p2, p3, p4, p5, p6, p7, p8, p9)


@in_both
def store_columns(
    k: int, count: int, first: int, columns: int, states: Floats, a: Lanes, b: Lanes, c: Lanes,
    d: Lanes, e: Lanes, f: Lanes, g: Lanes, h: Lanes,
) -> None:  # fmt: skip
    """Set columns of the rows of aircraft k: see `load_columns`."""
    r0, r1, r2, r3, r4, r5, r6, r7 = transposed(a, b, c, d, e, f, g, h)
    row = k * count
    # Lanes beyond the last mode repeat the hub; they are overwritten.
    store_row(states, mode_row(k, count, 7), first, columns, r7)
    store_row(states, mode_row(k, count, 6), first, columns, r6)
    store_row(states, mode_row(k, count, 5), first, columns, r5)
    store_row(states, mode_row(k, count, 4), first, columns, r4)
    store_row(states, mode_row(k, count, 3), first, columns, r3)
    store_row(states, mode_row(k, count, 2), first, columns, r2)
    store_row(states, mode_row(k, count, 1), first, columns, r1)
    store_row(states, row, first, columns, r0)


@in_both
def store_modes(
    k: int, count: int, a: State, P: Covariances, mode_means: Floats, mode_covariances: Floats
) -> None:
    """Set a and P of the modes of aircraft k."""
    none = every_lane(0.0)
    store_columns(
        k, count, 0, 4, mode_means, a[0], a[1], a[2], a[3], none, none, none, none
    )  # fmt: skip
    store_columns(
        k, count, 0, 8, mode_covariances, P[0], P[1], P[2], P[3], P[4], P[5], P[6], P[7]
    )  # fmt: skip
    store_columns(
        k, count, 8, 2, mode_covariances, P[8], P[9], none, none, none, none, none, none
    )  # fmt: skip


@in_both
def evaluate_modes(
    k: int, count: int, a: State, bias: Floats, mode_V: Floats, scratch: Floats, blocks: int
) -> State:
    """Return x of each mode at the published biases, (1, n)."""
    n = mode_V.shape[2]
    if n > DENSE_MAX:
        add_some_columns(k, count, bias, mode_V, scratch, blocks)
    for j in range(LANES if n <= DENSE_MAX else 0):
        row = mode_row(k, count, j)
        for r in range(4):
            total = every_lane(0.0)
            for c in range(0, n, LANES):
                lanes = min(LANES, n - c)
                total = fused_lanes(
                    load_lanes(mode_V, row, r, c, lanes), load_row(bias, 0, c, lanes), total
                )
            set_row(scratch, SUMS + r * LANES + j, total)
    return (
        a[0] + sums_of_rows(scratch, SUMS),
        a[1] + sums_of_rows(scratch, SUMS + LANES),
        a[2] + sums_of_rows(scratch, SUMS + 2 * LANES),
        a[3] + sums_of_rows(scratch, SUMS + 3 * LANES),
    )


@in_loop
def add_some_columns(
    k: int, count: int, bias: Floats, mode_V: Floats, scratch: Floats, blocks: int
) -> None:
    """Set the sums of `evaluate_modes`, of some blocks."""
    n = mode_V.shape[2]
    for total in range(4 * LANES):
        set_row(scratch, SUMS + total, every_lane(0.0))
    for c in range(0, n, LANES):
        lanes = min(LANES, n - c)
        if blocks & block_bit(c) == 0:
            continue
        biases = load_row(bias, 0, c, lanes)
        for j in range(LANES):
            row = mode_row(k, count, j)
            for r in range(4):
                at = SUMS + r * LANES + j
                v = load_lanes(mode_V, row, r, c, lanes)
                set_row(scratch, at, fused_lanes(v, biases, get_row(scratch, at)))


@in_both
def sums_of_rows(scratch: Floats, first: int) -> Lanes:
    """Return the sums over each of eight rows of the scratch array."""
    return sums_of(
        get_row(scratch, first), get_row(scratch, first + 1),
        get_row(scratch, first + 2), get_row(scratch, first + 3),
        get_row(scratch, first + 4), get_row(scratch, first + 5),
        get_row(scratch, first + 6), get_row(scratch, first + 7),
    )  # fmt: skip


@in_loop
def blocks_of_modes(k: int, count: int, mode_V: Floats, first: int, end: int) -> int:
    """Return the blocks on which aircraft k depends, and those of the columns first…end."""
    n = mode_V.shape[2]
    if n <= DENSE_MAX:
        return ALL_BLOCKS
    blocks = 0
    for c in range(0, n, LANES):
        own = c < end and c + LANES > first
        if own or not has_no_effect(k * count, c, min(LANES, n - c), mode_V):
            blocks |= block_bit(c)
    return blocks


@in_loop
def has_no_effect(row: int, first: int, lanes: int, mode_V: Floats) -> bool:
    """Return whether a mode does not depend on eight biases; then no mode of its aircraft does.

    A column of V becomes different from zero in all modes with the first plot of its sensor.
    """
    v0 = load_lanes(mode_V, row, 0, first, lanes)
    v1 = load_lanes(mode_V, row, 1, first, lanes)
    v2 = load_lanes(mode_V, row, 2, first, lanes)
    v3 = load_lanes(mode_V, row, 3, first, lanes)
    # At once: nearly all blocks are zero.
    return are_zero(larger(v0, -v0) + larger(v1, -v1), larger(v2, -v2) + larger(v3, -v3))
