"""Compiled sums of the information about the biases, and the effect of their uncertainty.

Symbols as in `_two_stage_kernels`.

References
----------
Friedland, B., "Treatment of bias in recursive filtering", IEEE TAC 14 (1969), 359-367.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import DENSE_MAX, are_zero
from multiradar_compiled.kernels import fused, in_loop
from multiradar_compiled.lane_kernels import (
    LANES,
    every_lane,
    fused_lanes,
    load_row,
    store_row,
)

Floats = NDArray[np.float64]


@in_loop
def inform(
    i00: float, i01: float, i11: float, nu0: float, nu1: float, U: Floats, R: Floats, Y: Floats,
    y: Floats,
) -> None:  # fmt: skip
    """Add the information of a measurement about the biases: y += Uᵀ S⁻¹ ν, Y += Uᵀ S⁻¹ U."""
    n = y.shape[0]
    for c in range(n):
        R[0, c] = i00 * U[0, c] + i01 * U[1, c]
    for c in range(n):
        R[1, c] = i01 * U[0, c] + i11 * U[1, c]
    for c in range(n):
        y[c] = fused(R[0, c], nu0, fused(R[1, c], nu1, y[c]))
    dense = n <= DENSE_MAX
    for d in range(0, n, LANES):
        lanes = min(LANES, n - d)
        u0, u1 = load_row(U, 0, d, lanes), load_row(U, 1, d, lanes)
        if not dense and are_zero(u0, u1):
            continue
        for begin in range(0, n, LANES):
            end = min(begin + LANES, n)
            if not dense and has_no_slope(U, begin, end - begin):
                continue
            for c in range(begin, end):
                more = fused_lanes(R[1, c], u1, load_row(Y, c, d, lanes))
                store_row(Y, c, d, lanes, fused_lanes(R[0, c], u0, more))


@in_loop
def spread_of_biases(U: Floats, bias_covariance: Floats, R: Floats) -> tuple[float, float, float]:
    """Return U P_ς Uᵀ: 00, 01, 11; R is overwritten."""
    n = U.shape[1]
    dense = n <= DENSE_MAX
    for d in range(0, n, LANES):
        lanes = min(LANES, n - d)
        r0 = every_lane(0.0)
        r1 = r0
        if not dense and has_no_slope(U, d, lanes):
            continue
        for begin in range(0, n, LANES):
            end = min(begin + LANES, n)
            if not dense and has_no_slope(U, begin, end - begin):
                continue
            for c in range(begin, end):
                p = load_row(bias_covariance, c, d, lanes)
                r0 = r0 + U[0, c] * p
                r1 = r1 + U[1, c] * p
        store_row(R, 0, d, lanes, r0)
        store_row(R, 1, d, lanes, r1)
    b00 = 0.0
    b01 = 0.0
    b11 = 0.0
    for begin in range(0, n, LANES):
        end = min(begin + LANES, n)
        if not dense and has_no_slope(U, begin, end - begin):
            continue
        for c in range(begin, end):
            b00 += R[0, c] * U[0, c]
            b01 += R[0, c] * U[1, c]
            b11 += R[1, c] * U[1, c]
    return b00, b01, b11


@in_loop
def has_no_slope(U: Floats, first: int, lanes: int) -> bool:
    """Return whether a measurement does not depend on eight biases."""
    return are_zero(load_row(U, 0, first, lanes), load_row(U, 1, first, lanes))
