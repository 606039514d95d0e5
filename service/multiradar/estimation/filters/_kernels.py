"""What the compiled filters share: options, outcomes, the start of an aircraft, its correction.

Nothing is validated here; `multiradar.estimation.filters.bank` is the public side.

Symbols: a, P = mean and covariance of one aircraft (at bias zero for the two-stage filter), V =
sensitivity of a to the biases ς, H = derivative of the measurement by the position, W = variances
of the noise, S = innovation covariance, G = P Hᵀ, K = gain, e = innovation.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from multiradar.estimation.measurement._kernels import (
    bias_column,
    locate_measurement,
    predict_measurement,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# What became of a measurement; `multiradar.estimation.filters.bank.Outcome` names them.
UPDATED = 0
STARTED = 1
RESTARTED = 2
UNASSOCIATED = 3
REFUSED = 4
CONE = 5
UNLOCATABLE = 6
SINGULAR = 7
UNSUPPORTED = 8
NO_ROOM = 9

# In `Rows.slot`: no aircraft, for want of identity, or of a free slot.
NO_IDENTITY_SLOT = -1
NO_ROOM_SLOT = -2

# Positions in the vector of options.
ACCELERATION_DENSITY = 0
SPEED_SIGMA = 1
DOWNWEIGHT_NIS = 2
REFUSE_NIS = 3
REFUSALS_MAX = 4
CONE_RATIO = 5
ASSUMED_HEIGHT = 6
ASSUMED_HEIGHT_SIGMA = 7
SURPRISE_GAIN = 8
SURPRISE_FLOOR = 9
MANOEUVRE_FACTOR_MAX = 10
OPTION_COUNT = 11

# A normalised innovation squared (two degrees of freedom) that three in four stay below.
EXPECTED_NIS = 2.77

# Columns of the readout of an aircraft: see `read_out`.
READOUT_COUNT = 10

# Columns of a logged contribution: ν0 ν1 N00 N01 N11 W00 W01 W11, then J, column after column, of
# as many bias parameters as a sensor may have.
LOG_BIASES = 8
SENSOR_BIASES_MAX = 4
LOG_COUNT = LOG_BIASES + 2 * SENSOR_BIASES_MAX

# In `Aircraft.place`: measured from more than one place.
SEVERAL = -2

# How a new aircraft takes the biases: in V, as known, or as so much more noise.
BIASES_KEPT = 0
BIASES_KNOWN = 1
BIASES_AS_NOISE = 2


@njit(cache=True, nogil=True, error_model="numpy")
def choose_height(measured: float, last: float, options: Floats) -> tuple[float, float]:
    """Return height and its variance: the measured one, else the last heard, else the assumed."""
    if not np.isnan(measured):
        return measured, 0.0
    if not np.isnan(last):
        return last, 0.0
    return options[ASSUMED_HEIGHT], options[ASSUMED_HEIGHT_SIGMA] * options[ASSUMED_HEIGHT_SIGMA]


@njit(cache=True, nogil=True, error_model="numpy")
def squared_norm(s00: float, s01: float, s11: float, e0: float, e1: float) -> float:
    """Return eᵀ S⁻¹ e, infinite where S is not positive definite."""
    det = s00 * s11 - s01 * s01
    if not (det > 0.0 and s00 > 0.0):
        return np.inf  # NaN too
    return (s11 * e0 * e0 - 2.0 * s01 * e0 * e1 + s00 * e1 * e1) / det


@njit(cache=True, nogil=True, error_model="numpy")
def covariance_times_transposed(P: Floats, H: Floats, G: Floats) -> None:
    """G ← P Hᵀ, (4, 2); H acts on the position alone."""
    for i in range(2):
        h0 = H[i, 0]
        h1 = H[i, 1]
        G[0, i] = P[0] * h0 + P[1] * h1
        G[1, i] = P[1] * h0 + P[4] * h1
        G[2, i] = P[2] * h0 + P[5] * h1
        G[3, i] = P[3] * h0 + P[6] * h1


@njit(cache=True, nogil=True, error_model="numpy")
def correct_covariance(P: Floats, G: Floats, K: Floats) -> None:
    """P ← P − K Gᵀ with G = P Hᵀ, on the upper triangle, so that P stays symmetric."""
    n = 0
    for i in range(4):
        for j in range(i, 4):
            P[n] -= K[i, 0] * G[j, 0] + K[i, 1] * G[j, 1]
            n += 1


@njit(cache=True, nogil=True, error_model="numpy")
def gain_times_update(
    a: Floats,
    P: Floats,
    G: Floats,
    K: Floats,
    s00: float,
    s01: float,
    s11: float,
    e0: float,
    e1: float,
) -> None:
    """K ← G S⁻¹, a ← a + K e, P ← P − K Gᵀ."""
    scale = 1.0 / (s00 * s11 - s01 * s01)
    i00 = s11 * scale
    i01 = -s01 * scale
    i11 = s00 * scale
    for i in range(4):
        K[i, 0] = G[i, 0] * i00 + G[i, 1] * i01
        K[i, 1] = G[i, 0] * i01 + G[i, 1] * i11
        a[i] += K[i, 0] * e0 + K[i, 1] * e1
    correct_covariance(P, G, K)


@njit(cache=True, nogil=True, error_model="numpy")
def start_aircraft(
    mode: int,
    kind: int,
    z0: float,
    z1: float,
    height: float,
    height_variance: float,
    plane: Floats,
    site: Floats,
    noise: Floats,
    first: int,
    last: int,
    parameters: Integers,
    bias: Floats,
    bias_covariance: Floats,
    options: Floats,
    a: Floats,
    P: Floats,
    V: Floats,
    H: Floats,
    W: Floats,
) -> int:
    """Begin an aircraft at a measurement: the limit of a prior without any knowledge of position.

    ``mode`` says what becomes of the biases: `BIASES_KEPT` in V (two-stage), `BIASES_KNOWN` (Blom)
    or `BIASES_AS_NOISE` (covariance intersection). Returns what became of the measurement; a, P, V
    are changed only when it is `STARTED`.
    """
    b0 = 0.0
    b1 = 0.0
    for c in range(first, last):
        j0, j1 = bias_column(kind, parameters[c], site, z0, z1, 0.0, 0.0)
        b0 += j0 * bias[c]
        b1 += j1 * bias[c]
    ok, east, north = locate_measurement(kind, plane, site, z0 - b0, z1 - b1, height)
    if not (ok and np.isfinite(east) and np.isfinite(north)):
        return UNLOCATABLE
    p0, p1, ground = predict_measurement(
        kind, plane, site, noise, east, north, height, height_variance, H, W
    )
    if ground < options[CONE_RATIO] * (height - noise[3]):
        return CONE
    det = H[0, 0] * H[1, 1] - H[0, 1] * H[1, 0]
    if not abs(det) > 0.0:
        return SINGULAR
    i00 = H[1, 1] / det
    i01 = -H[0, 1] / det
    i10 = -H[1, 0] / det
    i11 = H[0, 0] / det
    b00 = W[0]
    b01 = W[1]
    b11 = W[2]
    a[0] = east
    a[1] = north
    a[2] = 0.0
    a[3] = 0.0
    for i in range(4):
        for c in range(V.shape[1]):
            V[i, c] = 0.0
    for c in range(first, last):
        j0, j1 = bias_column(kind, parameters[c], site, p0, p1, 0.0, 0.0)
        if mode == BIASES_KEPT:
            V[0, c] = -(i00 * j0 + i01 * j1)
            V[1, c] = -(i10 * j0 + i11 * j1)
            a[0] -= V[0, c] * bias[c]
            a[1] -= V[1, c] * bias[c]
        elif mode == BIASES_AS_NOISE:
            for d in range(first, last):
                k0, k1 = bias_column(kind, parameters[d], site, p0, p1, 0.0, 0.0)
                b00 += j0 * bias_covariance[c, d] * k0
                b01 += 0.5 * (j0 * k1 + j1 * k0) * bias_covariance[c, d]
                b11 += j1 * bias_covariance[c, d] * k1
    P[:] = 0.0
    P[0] = i00 * i00 * b00 + 2.0 * i00 * i01 * b01 + i01 * i01 * b11
    P[1] = i00 * i10 * b00 + (i00 * i11 + i01 * i10) * b01 + i01 * i11 * b11
    P[4] = i10 * i10 * b00 + 2.0 * i10 * i11 * b01 + i11 * i11 * b11
    P[7] = options[SPEED_SIGMA] * options[SPEED_SIGMA]
    P[9] = P[7]
    return STARTED


@njit(cache=True, nogil=True, error_model="numpy")
def read_out(a: Floats, P: Floats, V: Floats, bias: Floats, factor: Floats, out: Floats) -> None:
    """Write χ = a + V ς and the covariance P + V P_ς Vᵀ; ``factor`` is the transposed root of P_ς.

    Columns: east, north, their rates, variance east, covariance, variance north, sum of the
    variances of the rates; `finish_row` adds the height and the number of updates.
    """
    n = V.shape[1]
    for i in range(4):
        x = a[i]
        for c in range(n):
            x += V[i, c] * bias[c]
        out[i] = x
    v00 = P[0]
    v01 = P[1]
    v11 = P[4]
    vv = P[7] + P[9]
    for j in range(n):
        w0 = 0.0
        w1 = 0.0
        w2 = 0.0
        w3 = 0.0
        for c in range(j, n):
            f = factor[j, c]
            w0 += V[0, c] * f
            w1 += V[1, c] * f
            w2 += V[2, c] * f
            w3 += V[3, c] * f
        v00 += w0 * w0
        v01 += w0 * w1
        v11 += w1 * w1
        vv += w2 * w2 + w3 * w3
    out[4] = v00
    out[5] = v01
    out[6] = v11
    out[7] = vv


@njit(cache=True, nogil=True, error_model="numpy")
def manoeuvre_factor(surprise: float, options: Floats) -> float:
    """Return by how much the process noise of an aircraft is raised, 1 on a straight flight.

    The fourth power makes the step from straight flight to a turn of some m/s² a matter of two or
    three plots, and leaves what noise alone does to the mean without effect.
    """
    excess = surprise / options[SURPRISE_FLOOR]
    if excess <= 1.0:
        return 1.0
    return min(excess * excess * excess * excess, options[MANOEUVRE_FACTOR_MAX])


@njit(cache=True, nogil=True, error_model="numpy")
def surprise_after(surprise: float, nis: float, options: Floats) -> float:
    """Return the fading mean of half the normalised innovation squared with one more in it."""
    clipped = min(nis, options[REFUSE_NIS])
    if not clipped >= 0.0:  # NaN says nothing
        return surprise
    return surprise + options[SURPRISE_GAIN] * (0.5 * clipped - surprise)
