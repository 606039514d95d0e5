"""Common parts of the compiled filters: options, outcomes, initiation and update of an aircraft.

Nothing is validated here; `multiradar.estimation.filters.bank` is the public interface.

Symbols: a, P = mean and covariance of one aircraft (at bias zero for the two-stage filter), V =
sensitivity of a to the biases ς, H = derivative of the measurement by the position, W = variances
of the noise, S = innovation covariance, G = P Hᵀ, K = gain, e = innovation.

References
----------
IMM UrO RAN report (2016), equations (1.28), (1.29) and (1.31); Vasiliev, Mattis, equation (7).
Initiation, gates, outlier weights and adaptive process noise are the project's own.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement._kernels import (
    NoiseOf,
    SlopeOf,
)
from multiradar.estimation.motion._kernels import Packed, PackedOf, store_covariance
from multiradar.estimation.motion.velocity_frame_noise import SLOW_SPEED_MPS
from multiradar_compiled.kernels import in_both, in_loop, kernel
from multiradar_compiled.lane_kernels import (
    LANES,
    Lanes,
    Numbers,
    every_lane,
    lane_of,
    larger,
    load_row,
    sum_of,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

GainOf = tuple[Numbers, Numbers, Numbers, Numbers, Numbers, Numbers, Numbers, Numbers]
Gain = GainOf[float]
Triple = tuple[float, float, float]

# Limit of NIS in any case (1e15 sigmas): a larger square would overflow.
ABSURD_NIS = 1e30

# Limits of ranges, coordinates, azimuths and times, and of heights, m: larger squares could
# overflow.
VALUE_MAX = 1e12
HEIGHT_MAX = 1e6

# Outcomes of a measurement; `multiradar.estimation.filters.bank.Outcome` names them.
UPDATED = 0
STARTED = 1
RESTARTED = 2
UNASSOCIATED = 3
REJECTED = 4
CONE = 5
UNLOCATABLE = 6
SINGULAR = 7
UNSUPPORTED = 8
NO_ROOM = 9
IMPLAUSIBLE = 10

# In place of an index (of a row, a slot, a plot): none.
NONE = -1

# In `Rows.slot`: no aircraft, for lack of an identity, of a free slot, or of plausibility of a
# self-reported position.
NO_IDENTITY_SLOT = -1
NO_ROOM_SLOT = -2
IMPLAUSIBLE_SLOT = -4

# Positions in the vector of options.
ACCELERATION_DENSITY = 0
SPEED_SIGMA = 1
DOWNWEIGHT_NIS = 2
REJECT_NIS = 3
REJECTIONS_MAX = 4
CONE_RATIO = 5
ASSUMED_HEIGHT = 6
ASSUMED_HEIGHT_SIGMA = 7
FADING_NIS_GAIN = 8
FADING_NIS_FLOOR = 9
MANOEUVRE_FACTOR_MAX = 10
# Time, s, that converts a velocity into a distance in the trace of covariance intersection.
SCALE_TIME = 11
# Noise in the velocity frame: whether (0 or 1), and its densities along (m²/s³) and of the course
# (rad²/s); see `acceleration_density`.
VELOCITY_FRAME = 12
DENSITY_ALONG = 13
DENSITY_OF_COURSE = 14
# Of interacting modes: the fading mean of NIS above which the noise is raised, and the density,
# m²/s³, of which the raised noise is a multiple.
MODES_NIS_FLOOR = 15
MODES_NIS_DENSITY = 16
# Whether heights are exact: each is used unfiltered until the next one.
EXACT_HEIGHTS = 17
# Prior variance of the delay of a transponder, m².
DELAY_VARIANCE = 18
# Of interacting modes: maximum speed of aircraft, m/s.
SPEED_MAX = 19
OPTION_COUNT = 20

# 75th percentile of NIS (two degrees of freedom).
EXPECTED_NIS = 2.77

# A covariance of two components counts as singular when 1 − correlation² is below this.
SINGULAR_RATIO = 1e-13

# With nearly parallel derivatives of both components no position can be computed.
SLOPE_DETERMINANT_MIN = 1e-30

# After this time without a measurement, s, a state is discarded.
INTERVAL_MAX_S = 86_400.0

# Square of the speed, (m/s)², below which the course is increasingly uncertain.
SLOW_SPEED_SQUARED = SLOW_SPEED_MPS * SLOW_SPEED_MPS

# Columns of the readout of an aircraft: see `read_out`.
READOUT_HEIGHT = 8
READOUT_UPDATES = 9
# Probabilities of a right turn, a left one and a change of speed, by filters with modes.
READOUT_MODES = 10
READOUT_RATE = 13
READOUT_HEIGHT_VARIANCE = 14
READOUT_GROUND = 15
READOUT_COUNT = 16

# Columns of a logged contribution: ν0 ν1 N00 N01 N11 W00 W01 W11, then J, column after column, of
# as many bias parameters as a sensor may have.
LOG_BIASES = 8
SENSOR_BIASES_MAX = 8
LOG_COUNT = LOG_BIASES + 2 * SENSOR_BIASES_MAX

# Columns of an innovation, at the published biases: e, S = H P Hᵀ + W, and B, the contribution of
# the uncertain biases to S. e is NaN without a comparison, B where it was not computed.
INNOVATION_COVARIANCE = 2
INNOVATION_BIASES = 5
INNOVATION_COUNT = 8

# In `Aircraft.measured_from`: measured from more than one site.
SEVERAL = -2

# Biases of a new aircraft: in V, known exactly, or as additional noise.
BIASES_KEPT = 0
BIASES_KNOWN = 1
BIASES_AS_NOISE = 2

#: Up to so many biases, all columns are processed. An aircraft depends on the biases of the few
#: sensors that have seen it: of more columns, zeros are skipped. Terms of zero change no sum.
DENSE_MAX = 32

#: Blocks of eight columns as bits of a number: all of them, and the last bit, which stands for all
#: further blocks.
ALL_BLOCKS = -1
BLOCK_LAST = 62


@in_loop
def choose_height(measured: float, last: float, options: Floats) -> tuple[float, float]:
    """Return height and variance: the measured height, else the last one, else the assumed one."""
    height, variance = measured, 0.0
    if not abs(measured) < HEIGHT_MAX:
        height = last
        if np.isnan(last):
            height = options[ASSUMED_HEIGHT]
            variance = options[ASSUMED_HEIGHT_SIGMA] * options[ASSUMED_HEIGHT_SIGMA]
    return height, variance


@in_loop
def squared_norm(s00: float, s01: float, s11: float, e0: float, e1: float) -> float:
    """Return eᵀ S⁻¹ e, infinite where S is not positive definite beyond rounding."""
    norm = np.inf
    if not singular(s00, s01, s11):
        norm = (s11 * e0 * e0 - 2.0 * s01 * e0 * e1 + s00 * e1 * e1) / (s00 * s11 - s01 * s01)
    return norm


@in_loop
def singular(s00: float, s01: float, s11: float) -> bool:
    """Return whether S is not positive definite beyond rounding; true for NaN."""
    return not (s00 > 0.0 and s00 * s11 - s01 * s01 > SINGULAR_RATIO * s00 * s11)


@in_loop
def inverse(s00: float, s01: float, s11: float) -> Triple:
    """Return S⁻¹: 00, 01, 11; zero where S is singular."""
    scale = 0.0
    if not singular(s00, s01, s11):
        scale = 1.0 / (s00 * s11 - s01 * s01)
    return s11 * scale, -s01 * scale, s00 * scale


@in_loop
def gated(nis: float, gate: float) -> int:
    """Return the outcome of a measurement with this NIS."""
    outcome = REJECTED
    if nis <= min(gate, ABSURD_NIS):  # NaN fails this.
        outcome = UPDATED
    if not nis < np.inf:
        outcome = SINGULAR
    return outcome


@in_both
def covariance_times_transposed(P: PackedOf[Numbers], h: SlopeOf[Numbers]) -> GainOf[Numbers]:
    """Return P Hᵀ, (4, 2), row by row; H acts on the position alone."""
    return (
        P[0] * h[0] + P[1] * h[1],
        P[0] * h[2] + P[1] * h[3],
        P[1] * h[0] + P[4] * h[1],
        P[1] * h[2] + P[4] * h[3],
        P[2] * h[0] + P[5] * h[1],
        P[2] * h[2] + P[5] * h[3],
        P[3] * h[0] + P[6] * h[1],
        P[3] * h[2] + P[6] * h[3],
    )


@in_both
def position_part(h: SlopeOf[Numbers], G: GainOf[Numbers]) -> NoiseOf[Numbers]:
    """Return H G = H P Hᵀ: 00, 01, 11."""
    return h[0] * G[0] + h[1] * G[2], h[0] * G[1] + h[1] * G[3], h[2] * G[1] + h[3] * G[3]


@in_both
def gain_of(G: GainOf[Numbers], i00: Numbers, i01: Numbers, i11: Numbers) -> GainOf[Numbers]:
    """Return K = G S⁻¹; the last three arguments are S⁻¹."""
    return (
        G[0] * i00 + G[1] * i01,
        G[0] * i01 + G[1] * i11,
        G[2] * i00 + G[3] * i01,
        G[2] * i01 + G[3] * i11,
        G[4] * i00 + G[5] * i01,
        G[4] * i01 + G[5] * i11,
        G[6] * i00 + G[7] * i01,
        G[6] * i01 + G[7] * i11,
    )


@in_loop
def correct_state(
    means: Floats, covariances: Floats, k: int, P: Packed, G: Gain, K: Gain, e0: float, e1: float
) -> None:
    """Set a ← a + K e and P ← P − K Gᵀ with G = P Hᵀ."""
    means[k, 0] += K[0] * e0 + K[1] * e1
    means[k, 1] += K[2] * e0 + K[3] * e1
    means[k, 2] += K[4] * e0 + K[5] * e1
    means[k, 3] += K[6] * e0 + K[7] * e1
    store_covariance(covariances, k, corrected_covariance(P, G, K))


@in_both
def corrected_covariance(
    P: PackedOf[Numbers], G: GainOf[Numbers], K: GainOf[Numbers]
) -> PackedOf[Numbers]:
    """Return P − K Gᵀ with G = P Hᵀ, on one triangle, so that P stays symmetric.

    Rounding must not make a variance negative.
    """
    return (
        larger(P[0] - (K[0] * G[0] + K[1] * G[1]), 0.0),
        P[1] - (K[0] * G[2] + K[1] * G[3]),
        P[2] - (K[0] * G[4] + K[1] * G[5]),
        P[3] - (K[0] * G[6] + K[1] * G[7]),
        larger(P[4] - (K[2] * G[2] + K[3] * G[3]), 0.0),
        P[5] - (K[2] * G[4] + K[3] * G[5]),
        P[6] - (K[2] * G[6] + K[3] * G[7]),
        larger(P[7] - (K[4] * G[4] + K[5] * G[5]), 0.0),
        P[8] - (K[4] * G[6] + K[5] * G[7]),
        larger(P[9] - (K[6] * G[6] + K[7] * G[7]), 0.0),
    )


@kernel
def read_out(
    a: Floats, P: Floats, V: Floats, blocks: int, bias: Floats, factor: Floats, out: Floats
) -> None:
    """Write χ = a + V ς and the covariance P + V P_ς Vᵀ; ``factor`` is L with L Lᵀ = P_ς.

    V is zero outside of some ``blocks``: see `blocks_in_use`.

    Columns: east, north, their rates, variance east, covariance, variance north, sum of the
    variances of the rates; `finish_readout` adds the height and the number of updates.
    """
    n = V.shape[1]
    for i in range(4):
        x = a[i]
        for begin in range(0, n, LANES):
            if blocks & block_bit(begin) == 0:
                continue
            for c in range(begin, min(begin + LANES, n)):
                x += V[i, c] * bias[c]
        out[i] = x
    v = (P[0], P[1], P[4], P[7] + P[9])
    for j in range(0, n, LANES):
        # Eight columns of V L at once; L is zero above the diagonal.
        count = min(LANES, n - j)
        w0 = every_lane(0.0)
        w1, w2, w3 = w0, w0, w0
        for begin in range(j, n, LANES):
            if blocks & block_bit(begin) == 0:
                continue
            for c in range(begin, min(begin + LANES, n)):
                f = load_row(factor, c, j, count)
                w0 = w0 + V[0, c] * f
                w1 = w1 + V[1, c] * f
                w2 = w2 + V[2, c] * f
                w3 = w3 + V[3, c] * f
        v = add_squares(v, w0, w1, w2, w3, count)
    set_readout(v, out)


@in_loop
def add_squares(
    v: tuple[float, float, float, float], w0: Lanes, w1: Lanes, w2: Lanes, w3: Lanes, count: int
) -> tuple[float, float, float, float]:
    """Add columns of V L to the variances of `set_readout`: V P_ς Vᵀ = (V L) (V L)ᵀ."""
    v00, v01, v11, vv = v
    for i in range(count):
        v00 += lane_of(w0, i) * lane_of(w0, i)
        v01 += lane_of(w0, i) * lane_of(w1, i)
        v11 += lane_of(w1, i) * lane_of(w1, i)
        vv += lane_of(w2, i) * lane_of(w2, i) + lane_of(w3, i) * lane_of(w3, i)
    return v00, v01, v11, vv


@in_loop
def set_readout(v: tuple[float, float, float, float], out: Floats) -> None:
    """Set variance east, covariance, variance north and the sum of those of the rates."""
    out[4] = v[0]
    out[5] = v[1]
    out[6] = v[2]
    out[7] = v[3]


@in_loop
def acceleration_density(
    east_rate: float, north_rate: float, factor: float, options: Floats
) -> Triple:
    """Return the density of the acceleration on the plane, m²/s³: 00, 01, 11.

    Isotropic, or that of Vasiliev and Mattis (7) for level flight with the nominal interval of the
    options; at an uncertain course as in `multiradar.estimation.motion.velocity_frame_noise`.
    ``factor`` is `manoeuvre_factor`.
    """
    d00 = factor * options[ACCELERATION_DENSITY]
    d01 = 0.0
    d11 = d00
    if options[VELOCITY_FRAME] != 0.0:
        course = factor * options[DENSITY_OF_COURSE]
        ee = east_rate * east_rate
        nn = north_rate * north_rate
        a = factor * options[DENSITY_ALONG]
        m = max(ee + nn, SLOW_SPEED_SQUARED)
        d00 = a * (1.0 - nn / m) + course * nn
        d01 = (a / m - course) * east_rate * north_rate
        d11 = a * (1.0 - ee / m) + course * ee
    return d00, d01, d11


@in_loop
def record_innovation(
    row: int,
    e0: float,
    e1: float,
    s00: float,
    s01: float,
    s11: float,
    b00: float,
    b01: float,
    b11: float,
    innovations: Floats,
) -> None:
    """Store the innovation of a measurement: see `INNOVATION_COUNT`."""
    innovations[row, 0] = e0
    innovations[row, 1] = e1
    innovations[row, INNOVATION_COVARIANCE] = s00
    innovations[row, INNOVATION_COVARIANCE + 1] = s01
    innovations[row, INNOVATION_COVARIANCE + 2] = s11
    innovations[row, INNOVATION_BIASES] = b00
    innovations[row, INNOVATION_BIASES + 1] = b01
    innovations[row, INNOVATION_BIASES + 2] = b11


@in_loop
def manoeuvre_factor(fading_nis: float, options: Floats) -> float:
    """Return the factor of the process noise of an aircraft, 1 in straight flight.

    With the fourth power the noise rises within two or three plots of a turn of some m/s², while
    fluctuations of the fading mean by noise alone have no effect.
    """
    return excess_factor(fading_nis, options[FADING_NIS_FLOOR], options[MANOEUVRE_FACTOR_MAX])


@in_loop
def excess_factor(fading_nis: float, floor: float, most: float) -> float:
    """Return the fourth power of fading_nis / floor, between 1 and most."""
    excess = max(1.0, fading_nis / floor)
    return min(excess * excess * excess * excess, most)


@in_loop
def updated_fading_nis(fading_nis: float, nis: float, options: Floats) -> float:
    """Return the fading mean of NIS/2 after another innovation."""
    clipped = min(nis, options[REJECT_NIS])
    if clipped >= 0.0:  # NaN has no effect.
        fading_nis += options[FADING_NIS_GAIN] * (0.5 * clipped - fading_nis)
    return fading_nis


@in_loop
def are_zero(first: Lanes, second: Lanes) -> bool:
    """Return whether all numbers of two vectors are 0; NaN is not."""
    return sum_of(larger(first, -first) + larger(second, -second)) == 0.0


@in_loop
def blocks_in_use(V: Floats) -> int:
    """Return the blocks of eight biases on which an aircraft depends, as bits."""
    n = V.shape[1]
    if n <= DENSE_MAX:
        return ALL_BLOCKS
    blocks = 0
    for begin in range(0, n, LANES):
        if not has_no_columns(V, begin, min(LANES, n - begin)):
            blocks |= block_bit(begin)
    return blocks


@in_loop
def block_bit(first: int) -> int:
    """Return the bit of the eight columns from one on."""
    return 1 << min(first // LANES, BLOCK_LAST)


@in_loop
def has_no_columns(V: Floats, first: int, lanes: int) -> bool:
    """Return whether an aircraft does not depend on eight biases."""
    v0, v1 = load_row(V, 0, first, lanes), load_row(V, 1, first, lanes)
    v2, v3 = load_row(V, 2, first, lanes), load_row(V, 3, first, lanes)
    return are_zero(v0, v1) and are_zero(v2, v3)
