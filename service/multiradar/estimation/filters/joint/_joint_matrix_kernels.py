"""Compiled algebra of the joint filter, on the upper triangle of the columns that are in use.

Symbols as in `_joint_kernels`.

References
----------
IMM UrO RAN report (2016), equations (1.28) and (1.30) to (1.33).
"""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import SINGULAR_RATIO, inverse, singular
from multiradar.estimation.filters.arrays import Aircraft
from multiradar.estimation.motion._kernels import Density, predict_motion
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@kernel
def active_runs(times: Floats, biases: int, capacity: int, runs: Integers) -> int:
    """Write the columns in use as ascending ranges from…to; return the number of ranges."""
    count = 0
    runs[0, 0] = 0
    runs[0, 1] = biases
    for k in range(capacity):
        if np.isnan(times[k]):
            continue
        first = biases + 4 * k
        if runs[count, 1] != first:
            count += 1
            runs[count, 0] = first
        runs[count, 1] = first + 4
    return count + 1


@kernel
def copy_block(P: Floats, first: int, upper: Floats) -> None:
    """Write the covariance of one aircraft as an upper triangle."""
    m = 0
    for i in range(4):
        for j in range(i, 4):
            upper[m] = P[first + i, first + j]
            m += 1


@kernel
def move(
    P: Floats,
    mean: Floats,
    upper: Floats,
    none: Floats,
    first: int,
    dt: float,
    density: Density,
    runs: Integers,
    count: int,
) -> None:
    """Predict one aircraft, (1.30): its own block, and its covariances with everything else."""
    copy_block(P, first, upper)
    predict_motion(mean, upper, none, dt, density)
    m = 0
    for i in range(4):
        for j in range(i, 4):
            P[first + i, first + j] = upper[m]
            m += 1
    for r in range(count):
        for x in range(runs[r, 0], min(runs[r, 1], first)):
            P[x, first] += dt * P[x, first + 2]
            P[x, first + 1] += dt * P[x, first + 3]
        for x in range(max(runs[r, 0], first + 4), runs[r, 1]):
            P[first, x] += dt * P[first + 2, x]
            P[first + 1, x] += dt * P[first + 3, x]


@kernel
def spread_of_position(
    P: Floats, first: int, H: Floats, runs: Integers, count: int, G: Floats
) -> None:
    """G ← P̄ Hᵀ for the aircraft whose columns begin at ``first``, as (2, N)."""
    for r in range(count):
        for x in range(runs[r, 0], min(runs[r, 1], first)):
            G[0, x] = H[0, 0] * P[x, first] + H[0, 1] * P[x, first + 1]
            G[1, x] = H[1, 0] * P[x, first] + H[1, 1] * P[x, first + 1]
        for x in range(max(runs[r, 0], first + 1), runs[r, 1]):
            G[0, x] = H[0, 0] * P[first, x] + H[0, 1] * P[first + 1, x]
            G[1, x] = H[1, 0] * P[first, x] + H[1, 1] * P[first + 1, x]
    G[0, first] = H[0, 0] * P[first, first] + H[0, 1] * P[first, first + 1]
    G[1, first] = H[1, 0] * P[first, first] + H[1, 1] * P[first, first + 1]


@kernel
def add_spread_of_bias(
    P: Floats, j: int, j0: float, j1: float, runs: Integers, count: int, G: Floats
) -> None:
    """G += P̄ Jᵀ for one bias."""
    for x in range(j):
        G[0, x] += j0 * P[x, j]
        G[1, x] += j1 * P[x, j]
    for r in range(count):
        for x in range(max(runs[r, 0], j), runs[r, 1]):
            G[0, x] += j0 * P[j, x]
            G[1, x] += j1 * P[j, x]


@kernel
def correct_all(
    aircraft: Aircraft,
    bias: Floats,
    G: Floats,
    F: Floats,
    s00: float,
    s01: float,
    s11: float,
    e0: float,
    e1: float,
    runs: Integers,
    count: int,
) -> None:
    """ξ̂ = ξ̄ + F L⁻¹ e, P̂ = P̄ − F Fᵀ: (1.28), (1.31) on the upper triangle of the columns in use."""
    P, mean = aircraft.joint, aircraft.mean
    c = bias.shape[0]
    root0 = sqrt(s00)
    below = s01 / root0
    root1 = sqrt(s11 - below * below)
    u0 = e0 / root0
    u1 = (e1 - below * u0) / root1
    for r in range(count):
        for x in range(runs[r, 0], runs[r, 1]):
            F[0, x] = G[0, x] / root0
            F[1, x] = (G[1, x] - below * F[0, x]) / root1
            shift = F[0, x] * u0 + F[1, x] * u1
            if x < c:
                bias[x] += shift
            else:
                mean[(x - c) // 4, (x - c) % 4] += shift
    for r in range(count):
        for x in range(runs[r, 0], runs[r, 1]):
            f0 = F[0, x]
            f1 = F[1, x]
            line = P[x]
            for y in range(x, runs[r, 1]):
                line[y] -= f0 * F[0, y] + f1 * F[1, y]
            for q in range(r + 1, count):
                for y in range(runs[q, 0], runs[q, 1]):
                    line[y] -= f0 * F[0, y] + f1 * F[1, y]
            # Rounding must not make a variance negative.
            line[x] = max(0.0, line[x])


@kernel
def correct_one(
    aircraft: Aircraft,
    k: int,
    c: int,
    H: Floats,
    W: Floats,
    G: Floats,
    s00: float,
    s01: float,
    s11: float,
    e0: float,
    e1: float,
    runs: Integers,
    count: int,
) -> bool:
    """Update one aircraft by a measurement that does not contribute to the biases.

    Returns False, without any change, if the innovation covariance for given biases is singular.

    The gain is optimal for given biases, K = P_χ|ς Hᵀ (H P_χ|ς Hᵀ + W)⁻¹, and zero for all else;
    with it (1.26) needs the rows of this aircraft alone. The two-stage filter does the same.
    """
    P = aircraft.joint
    first = c + 4 * k
    B = np.empty((4, 2))
    conditional_spread(P, first, c, H, B)
    t00 = H[0, 0] * B[0, 0] + H[0, 1] * B[1, 0] + W[0]
    t01 = H[0, 0] * B[0, 1] + H[0, 1] * B[1, 1] + W[1]
    t11 = H[1, 0] * B[0, 1] + H[1, 1] * B[1, 1] + W[2]
    if singular(t00, t01, t11):
        return False
    i00, i01, i11 = inverse(t00, t01, t11)
    for i in range(4):
        k0 = B[i, 0] * i00 + B[i, 1] * i01
        k1 = B[i, 0] * i01 + B[i, 1] * i11
        B[i, 0], B[i, 1] = k0, k1
        aircraft.mean[k, i] += k0 * e0 + k1 * e1
        for r in range(count):
            for x in range(runs[r, 0], min(runs[r, 1], first)):
                P[x, first + i] -= k0 * G[0, x] + k1 * G[1, x]
            for x in range(max(runs[r, 0], first + 4), runs[r, 1]):
                P[first + i, x] -= k0 * G[0, x] + k1 * G[1, x]
    for i in range(4):
        k0, k1 = B[i, 0], B[i, 1]
        for j in range(i, 4):
            g0, g1 = B[j, 0], B[j, 1]
            P[first + i, first + j] += (
                k0 * (s00 * g0 + s01 * g1 - G[0, first + j])
                + k1 * (s01 * g0 + s11 * g1 - G[1, first + j])
                - G[0, first + i] * g0
                - G[1, first + i] * g1
            )
        P[first + i, first + i] = max(0.0, P[first + i, first + i])
    return True


@kernel
def conditional_spread(P: Floats, first: int, c: int, H: Floats, B: Floats) -> None:
    """B ← P_χ|ς Hᵀ of one aircraft, with P_χ|ς = P_χ − P_χς P_ς⁻¹ P_ςχ.

    A bias that is known, or determined by those before it, adds no information.
    """
    L = np.empty((c, c))
    X = np.empty((c, 4))
    units = np.empty(c)
    for i in range(c):
        # In units of the sigmas: metres and radians differ by many powers of ten.
        units[i] = sqrt(P[i, i])
        rest = 1.0
        for j in range(i):
            x = 0.0
            if units[i] > 0.0 and L[j, j] > 0.0:
                x = P[j, i] / (units[i] * units[j])
                for d in range(j):
                    x -= L[i, d] * L[j, d]
                x /= L[j, j]
            L[i, j] = x
            rest -= x * x
        informs = units[i] > 0.0 and rest > SINGULAR_RATIO
        L[i, i] = sqrt(rest) if informs else 0.0
        for m in range(4):
            x = 0.0
            if informs:
                x = P[i, first + m] / units[i]
                for d in range(i):
                    x -= L[i, d] * X[d, m]
                x /= L[i, i]
            X[i, m] = x
    for i in range(4):
        for m in range(2):
            B[i, m] = 0.0
        for j in range(2):
            x = P[first + min(i, j), first + max(i, j)]
            for d in range(c):
                x -= X[d, i] * X[d, j]
            B[i, 0] += x * H[0, j]
            B[i, 1] += x * H[1, j]
