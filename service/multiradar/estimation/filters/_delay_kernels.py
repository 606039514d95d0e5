"""Compiled delay of the transponder of an aircraft: a bias of its own, beside those of the sensors.

A radar that measures the time until a reply arrives counts the turn-around time of the transponder
as distance. What it is off from the standard is a range offset d of the aircraft, common to all
such radars. Given the biases ς of the sensors, d and the state χ of the aircraft are Gaussian:

    d | ς ~ N(d̂ + V_d ς, B),    χ | d, ς ~ N(a + V ς + D (d − d̂ − V_d ς) / √B, P)

so a and V hold with d at its estimate, and D is the change of the state by one standard deviation
of d. D is a column of V, the last one, whose bias is 0 with variance 1: all that predicts, mixes or
reads states treats it as any other bias, and only these functions know whose it is. Each
measurement updates χ given d, then d by the innovation ν, with U = H V + J + j V_d, u = H D + j √B:

    d̂ += √B κ ν,  V_d −= √B κ U,  a += D κ ν,  V −= D κ U,  √B ← ρ √B,  D ← ρ D

with j = derivative of the measurement by d, κ = ρ² uᵀ S⁻¹ and ρ² = 1 / (1 + uᵀ S⁻¹ u). It informs
about ς with S + u uᵀ in place of S: the sum of that over the measurements is the Schur complement
of d in the information about ς and d, so sums over aircraft remain sums about ς alone. Measurements
that do not contribute to the biases do not change the knowledge of d either.

References
----------
Friedland, B., "Treatment of bias in recursive filtering", IEEE TAC 14 (1969), 359-367, applied
twice; biases private to aircraft beside shared ones are the project's own.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import DELAY_VARIANCE, STARTED
from multiradar.estimation.filters.arrays import (
    DELAY_BIASES,
    DELAY_MEAN,
    DELAY_SIGMA,
    Aircraft,
    BiasSums,
    Model,
)
from multiradar.estimation.filters.two_stage._information_kernels import inform
from multiradar.estimation.measurement.kinds import KIND_FLAT_POLAR, KIND_RADAR
from multiradar_compiled.kernels import in_loop, inner_loop

Floats = NDArray[np.float64]
Triple = tuple[float, float, float]


@in_loop
def measures_delay(kind: int, s: int, model: Model) -> bool:
    """Return whether a measurement by sensor s is a range with the delay of the transponder."""
    measures = False
    if kind in (KIND_RADAR, KIND_FLAT_POLAR):
        measures = model.delayed[s] != 0
    return measures


@inner_loop
def prepare_delay(k: int, kind: int, s: int, action: int, model: Model, delay: Floats) -> float:
    """Return the delay of aircraft k, at the published biases, in a measurement by sensor s, m.

    It has its prior before the first measurement; an aircraft that is reinitialised keeps it.
    """
    if action == STARTED or not delay[k, DELAY_SIGMA] > 0.0:
        delay[k] = 0.0
        delay[k, DELAY_SIGMA] = math.sqrt(model.options[DELAY_VARIANCE])
    estimate = 0.0
    if measures_delay(kind, s, model):
        estimate = delay[k, DELAY_MEAN] + by_biases(k, delay, model.bias)
    return estimate


@in_loop
def by_biases(k: int, delay: Floats, bias: Floats) -> float:
    """Return V_d ς̂."""
    total = 0.0
    for c in range(bias.shape[0]):
        total += delay[k, DELAY_BIASES + c] * bias[c]
    return total


@inner_loop
def add_delay_columns(k: int, delay: Floats, bias: Floats, U: Floats) -> float:
    """Add j V_d and j √B to the sensitivities of a range, (2, c), and return V_d ς̂."""
    n = bias.shape[0]
    for c in range(n):
        U[0, c] += delay[k, DELAY_BIASES + c]
    U[0, n - 1] += delay[k, DELAY_SIGMA]
    return by_biases(k, delay, bias)


@in_loop
def spread_of_delay(U: Floats) -> Triple:
    """Return u uᵀ: 00, 01, 11."""
    u0, u1 = U[0, U.shape[1] - 1], U[1, U.shape[1] - 1]
    return u0 * u0, u0 * u1, u1 * u1


@inner_loop
def initialise_with_delay(
    k: int, kind: int, s: int, H: Floats, model: Model, aircraft: Aircraft
) -> None:
    """Let the state of aircraft k, initiated at a range without its delay, depend on the delay."""
    if not measures_delay(kind, s, model):
        return
    a, V, delay, bias = aircraft.mean, aircraft.sensitivity, aircraft.delay, model.bias
    n = bias.shape[0]
    scale = 1.0 / (H[0, 0] * H[1, 1] - H[0, 1] * H[1, 0])
    for i in range(2):
        by_range = (H[1, 1] if i == 0 else -H[1, 0]) * scale
        for c in range(n):
            change = -by_range * delay[k, DELAY_BIASES + c]
            V[k, i, c] += change
            a[k, i] -= change * bias[c]
        V[k, i, n - 1] -= by_range * delay[k, DELAY_SIGMA]


@inner_loop
def inform_with_delay(
    i00: float, i01: float, i11: float, nu0: float, nu1: float, sums: BiasSums
) -> Triple:
    """Add the information of a measurement about ς, and return κ and ρ.

    The arguments are S⁻¹ and ν. The last column of U becomes 0.
    """
    Y, y, U, R = sums
    last = U.shape[1] - 1
    u0, u1 = U[0, last], U[1, last]
    U[0, last] = 0.0
    U[1, last] = 0.0
    g0, g1 = i00 * u0 + i01 * u1, i01 * u0 + i11 * u1
    part = 1.0 / (1.0 + g0 * u0 + g1 * u1)
    inform(
        i00 - part * g0 * g0, i01 - part * g0 * g1, i11 - part * g1 * g1, nu0, nu1, U, R, Y, y
    )  # fmt: skip
    return part * g0, part * g1, math.sqrt(part)


@inner_loop
def shift_with_delay(V: Floats, gain: Triple, U: Floats) -> None:
    """Set V −= D κ U and D ← ρ D of one state; ``gain`` is κ and ρ."""
    n = V.shape[1]
    for i in range(4):
        side = V[i, n - 1]
        for c in range(n - 1):
            V[i, c] -= side * (gain[0] * U[0, c] + gain[1] * U[1, c])
        V[i, n - 1] = gain[2] * side


@inner_loop
def correct_delay(k: int, gain: Triple, nu0: float, nu1: float, U: Floats, delay: Floats) -> None:
    """Set d̂ += √B κ ν, V_d −= √B κ U and √B ← ρ √B of aircraft k."""
    sigma = delay[k, DELAY_SIGMA]
    delay[k, DELAY_MEAN] += sigma * (gain[0] * nu0 + gain[1] * nu1)
    for c in range(U.shape[1] - 1):
        delay[k, DELAY_BIASES + c] -= sigma * (gain[0] * U[0, c] + gain[1] * U[1, c])
    delay[k, DELAY_SIGMA] = gain[2] * sigma


@inner_loop
def drift_of_delay(k: int, delay: Floats, spread: Floats) -> float:
    """Return √B of aircraft k after a drift of the biases: B + V_d G Q_ς V_dᵀ."""
    n = spread.shape[0]
    total = delay[k, DELAY_SIGMA] * delay[k, DELAY_SIGMA]
    for c in range(n):
        for d in range(n):
            total += delay[k, DELAY_BIASES + c] * spread[c, d] * delay[k, DELAY_BIASES + d]
    return math.sqrt(total)


@inner_loop
def drift_with_delay(
    k: int, sigma: float, delay: Floats, spread: Floats, P: Floats, V: Floats
) -> None:
    """Adjust D and P of one state, before V, to a drift that raises √B to ``sigma``.

    The covariance of χ and d becomes D √B + V G Q_ς V_dᵀ, and P that of χ given d.
    """
    n = spread.shape[0]
    old = delay[k, DELAY_SIGMA]
    m = 0
    for i in range(4):
        for j in range(i, 4):
            P[m] += V[i, n - 1] * V[j, n - 1]
            m += 1
    for i in range(4):
        shared = V[i, n - 1] * old
        for c in range(n - 1):
            for d in range(n - 1):
                part = 0.5 * (spread[c, d] + spread[d, c])
                shared += V[i, c] * part * delay[k, DELAY_BIASES + d]
        V[i, n - 1] = shared / sigma
    m = 0
    for i in range(4):
        for j in range(i, 4):
            P[m] -= V[i, n - 1] * V[j, n - 1]
            m += 1


@inner_loop
def apply_drift_to_delay(
    k: int, sigma: float, complement: Floats, G: Floats, delay: Floats, scratch: Floats
) -> None:
    """Set d̂ += V_d (I − G) ς̂, V_d ← V_d G and √B to ``sigma``; scratch is (1, c) at least."""
    n = complement.shape[0]
    for c in range(n):
        delay[k, DELAY_MEAN] += delay[k, DELAY_BIASES + c] * complement[c]
        x = 0.0
        for d in range(n):
            x += delay[k, DELAY_BIASES + d] * G[d, c]
        scratch[0, c] = x
    for c in range(n):
        delay[k, DELAY_BIASES + c] = scratch[0, c]
    delay[k, DELAY_SIGMA] = sigma
