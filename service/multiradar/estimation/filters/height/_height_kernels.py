"""Compiled filter of height and rate of climb, and of the height of aircraft that report none.

Reported heights are quantised: the state (h, r) has a white vertical acceleration and is updated
with the middle of each quantisation step, with the variance of a uniform distribution over the
step. In level flight the quantisation error is the same at every plot, so averaging does not
reduce it.

Without reported heights: the height ĥ is one more bias of that aircraft alone, and the position of
the filter depends on it, χ(h) = χ(ĥ) + v (h − ĥ). For any gain K of the filter v ← A v and
v ← v − K (H v + s), with s = derivative of the slant range by the height; the innovation depends on
h − ĥ by u = H v + s. With one radar the position compensates the height, u = 0, and the height is
unobservable; two radars at different elevations determine it.

Symbols: h, r = height (m) and rate of climb (m/s), p00 p01 p11 = their covariance, R = variance of
a height as measured, S = p00 + R.

References
----------
Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and Navigation",
Wiley 2001, equation (6.2.2-4), for the motion; Friedland, B., "Treatment of bias in recursive
filtering", IEEE TAC 14 (1969), 359-367, for v. Quantisation, outlier tests and kinds of height are
the project's own.
"""

from math import floor

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    ASSUMED_HEIGHT,
    ASSUMED_HEIGHT_SIGMA,
    EXACT_HEIGHTS,
    HEIGHT_MAX,
    RESTARTED,
    STARTED,
    choose_height,
)
from multiradar.estimation.measurement._kernels import EARTH_DIAMETER_M
from multiradar.estimation.measurement.kinds import KIND_DIRECTION, KIND_POSITION, KIND_RADAR
from multiradar_compiled.kernels import in_loop

Floats = NDArray[np.float64]

# Columns of `Aircraft.vertical`; the height itself is in `Aircraft.height`.
RATE = 0
P00 = 1
P01 = 2
P11 = 3
# Bit s: sensor s, modulo `SENSOR_BITS`, has reported heights finer than 100 ft.
FINE = 4
SOURCE = 5
# Accepted heights, up to `CONFIRMED`; negative: consecutive mutually consistent outliers.
COUNT = 6
# Time of the last accepted height, s.
RECEIVED_AT = 7
# The last outlier, and its time; on the surface the last pressure altitude.
DOUBTED = 8
DOUBTED_AT = 9
# v, and the estimated height of an aircraft that reports none, with its variance.
BY_HEIGHT = 10
GUESS = 14
GUESS_VARIANCE = 15
VERTICAL_COUNT = 16

# In `SOURCE`: the kind of height. Mode C is a pressure altitude; the height of a reported position
# may be geometric, hundreds of metres different; that of the surface holds on the ground. They are
# not mixed.
REPORTED = 1.0
MODE_C = 2.0
SURFACE = 3.0
# In place of the kind of a measurement: its height is that of the surface.
KIND_SURFACE = -1
# Variance of the height of the surface, m²: antennas stand tens of metres above it.
SURFACE_VARIANCE = 50.0 * 50.0
# Time after the last Mode C height until a reported height replaces it, s.
MODE_C_KEPT_S = 60.0

SENSOR_BITS = 32
FOOT_M = 0.3048
COARSE_STEP_M = 100.0 * FOOT_M
FINE_STEP_M = 25.0 * FOOT_M
# Recordings round heights to metres at worst: tolerance of a height on a step, m.
ROUNDING_M = 0.51
# Transponder error from reply to reply beside quantisation, m.
TRANSPONDER_SIGMA_M = 2.0
TRANSPONDER_VARIANCE = TRANSPONDER_SIGMA_M * TRANSPONDER_SIGMA_M
COARSE_VARIANCE = COARSE_STEP_M * COARSE_STEP_M / 12.0
FINE_VARIANCE = FINE_STEP_M * FINE_STEP_M / 12.0
# Density of the vertical acceleration, m²/s³: follows levelling off at 0.1 g within 10 s.
CLIMB_DENSITY = 0.5
# Prior sigma of the rate of climb, m/s, and the sigma below which the rate is reported.
RATE_SIGMA_MPS = 12.0
RATE_SIGMA_MAX_MPS = 5.0
# Variance of a reported rate of climb, (m/s)²: it follows the height with a lag of about a second.
REPORTED_RATE_VARIANCE = 1.0
# Time constant of the filter, s: steps passed in less time average out.
MEMORY_S = 8.0
# Decrease of the persistent variance with the rate of climb, m²/(m/s): to zero where a step is
# passed within the time constant.
COARSE_LOSS = COARSE_VARIANCE * MEMORY_S / COARSE_STEP_M
FINE_LOSS = FINE_VARIANCE * MEMORY_S / FINE_STEP_M
# A height is an outlier beyond five sigmas plus the effect of a vertical manoeuvre of 0.2 g since
# the last plot, at most some 200 ft (m/s² and m). Three consistent outliers initialise it again.
DOUBT_SQUARED = 25.0
HALF_PULL_MPS2 = 1.0
PULL_MAX_M = 60.0
CONFIRMED = 2.0
BELIEVED = -3.0
# Two outliers are consistent if the rate of climb between them is below this, m/s.
CLIMB_MAX_MPS = 40.0

# Growth of the variance of an unreported height, m²/s: most aircraft fly level, some climb.
GUESS_DENSITY = 1000.0
# An estimated height is reported when its sigma, m, is below this.
GUESS_SIGMA_MAX_M = 1000.0

# Result of the check of a height, `HeightCheck[0]`.
NOTHING = 0
ACCEPTED = 1
INITIATED = 2
REJECTED_HEIGHT = 3
EXACT = 4
ON_SURFACE = 5

# Result, height and its variance for the slant range.
HeightCheck = tuple[int, float, float]

# Maximum ratio of the variance of the range caused by the height to that of the noise. At 0.01 a
# hundred plots of an aircraft contribute to the biases before their information is overstated by a
# factor of two.
INFORMING_RATIO = 0.01
# The same for an elevation, which affects the biases of azimuths only through the position.
ELEVATION_INFORMING_RATIO = 0.1


@in_loop
def on_coarse_step(measured: float) -> bool:
    """Return whether a height is a multiple of 100 ft."""
    steps = measured * (1.0 / COARSE_STEP_M)
    return abs(steps - floor(steps + 0.5)) <= ROUNDING_M / COARSE_STEP_M


@in_loop
def gives_fine(s: int, marks: float) -> bool:
    """Return whether sensor s has reported heights in finer steps."""
    return (int(marks) >> (s & (SENSOR_BITS - 1))) & 1 == 1


@in_loop
def step_variance(measured: float, s: int, marks: float) -> float:
    """Return the quantisation variance of sensor s: steps of 100 ft until it reports finer ones."""
    fine = gives_fine(s, marks) or not on_coarse_step(measured)
    return FINE_VARIANCE if fine else COARSE_VARIANCE


@in_loop
def reset_height(k: int, heights: Floats, vertical: Floats) -> None:
    """Discard the height of aircraft k."""
    heights[k] = np.nan
    for column in range(VERTICAL_COUNT):
        vertical[k, column] = 0.0
    vertical[k, GUESS] = np.nan


@in_loop
def check_height(
    action: int,
    kind: int,
    measured: float,
    s: int,
    time: float,
    dt: float,
    k: int,
    heights: Floats,
    vertical: Floats,
    options: Floats,
) -> tuple[int, float, float]:
    """Return the height of aircraft k for a plot, dt after its state; changes nothing.

    ``action`` is that of the row, ``kind`` that of the measurement or `KIND_SURFACE`. The filter
    processes the plot at this height with this variance; `update_height` stores it if the plot is
    accepted.
    """
    # Before initiation there is no interval.
    known = not np.isnan(heights[k] + dt)
    starts = action in (STARTED, RESTARTED)
    if options[EXACT_HEIGHTS] != 0.0:
        result = EXACT
        height, variance = choose_height(measured, heights[k], options)
    elif abs(measured) < HEIGHT_MAX:
        result, height = INITIATED, measured
        variance = step_variance(measured, s, vertical[k, FINE]) + TRANSPONDER_VARIANCE
        if kind == KIND_SURFACE:
            result, variance = ON_SURFACE, SURFACE_VARIANCE
        elif known and not starts:
            result = evaluate_height(kind, measured, variance, time, dt, k, heights, vertical)
        if result in (NOTHING, REJECTED_HEIGHT):
            height, variance = predicted_height(dt, k, heights, vertical)
    elif known:
        result = NOTHING
        height, variance = predicted_height(dt, k, heights, vertical)
    else:
        result = NOTHING
        height, variance = guess_height(starts, dt, k, vertical, options)
    return result, height, variance


@in_loop
def evaluate_height(
    kind: int, measured: float, variance: float, time: float, dt: float, k: int, heights: Floats,
    vertical: Floats,
) -> int:  # fmt: skip
    """Return the result of the check of a height of an initiated aircraft k."""
    height, spread = moved_height(dt, k, heights, vertical)
    e = max(0.0, abs(measured - height) - min(HALF_PULL_MPS2 * dt * dt, PULL_MAX_M))
    source = REPORTED if kind == KIND_POSITION else MODE_C
    result = ACCEPTED
    if source != vertical[k, SOURCE]:
        kept = source == REPORTED and vertical[k, SOURCE] == MODE_C
        kept = kept and time - vertical[k, RECEIVED_AT] <= MODE_C_KEPT_S
        result = NOTHING if kept else INITIATED
    elif not e * e <= DOUBT_SQUARED * (spread + variance):
        agreed = doubts(measured, time, k, vertical) <= BELIEVED
        result = INITIATED if agreed else REJECTED_HEIGHT
    return result


@in_loop
def lasting_variance(k: int, vertical: Floats) -> float:
    """Return the persistent part of the quantisation variance: all of it in level flight.

    The error changes from step to step and averages out within the time constant of the filter.
    """
    fine = vertical[k, FINE] != 0.0
    whole = FINE_VARIANCE if fine else COARSE_VARIANCE
    loss = FINE_LOSS if fine else COARSE_LOSS
    rate: float = vertical[k, RATE]
    return whole - abs(rate) * loss


@in_loop
def guess_height(
    starts: bool, dt: float, k: int, vertical: Floats, options: Floats
) -> tuple[float, float]:
    """Return the height of an aircraft that reports none, and its variance."""
    prior = options[ASSUMED_HEIGHT_SIGMA] * options[ASSUMED_HEIGHT_SIGMA]
    height, variance = vertical[k, GUESS], vertical[k, GUESS_VARIANCE] + GUESS_DENSITY * dt
    if starts or np.isnan(height):
        height, variance = options[ASSUMED_HEIGHT], prior
    return height, min(variance, prior)


@in_loop
def moved_height(dt: float, k: int, heights: Floats, vertical: Floats) -> tuple[float, float]:
    """Return the height dt after the state, and its variance."""
    p11 = vertical[k, P11] + CLIMB_DENSITY * (1.0 / 3.0) * dt
    return (
        heights[k] + dt * vertical[k, RATE],
        vertical[k, P00] + dt * (2.0 * vertical[k, P01] + dt * p11),
    )


@in_loop
def predicted_height(dt: float, k: int, heights: Floats, vertical: Floats) -> tuple[float, float]:
    """Return the height dt after the state, and its variance, at least the persistent part."""
    height, variance = moved_height(dt, k, heights, vertical)
    return height, max(variance, lasting_variance(k, vertical))


@in_loop
def doubts(measured: float, time: float, k: int, vertical: Floats) -> float:
    """Return minus the number of consecutive consistent outliers, this one included."""
    count = -1.0
    if vertical[k, COUNT] < 0.0:
        apart = CLIMB_MAX_MPS * (time - vertical[k, DOUBTED_AT]) + 2.0 * COARSE_STEP_M
        if abs(measured - vertical[k, DOUBTED]) <= apart:
            count += vertical[k, COUNT]
    return count


@in_loop
def update_height(
    check: HeightCheck,
    kind: int,
    measured: float,
    s: int,
    time: float,
    dt: float,
    k: int,
    heights: Floats,
    vertical: Floats,
    options: Floats,
) -> None:
    """Predict the height of aircraft k by dt, and update it by the result of `check_height`.

    For accepted plots only; see `coast_height` for others.
    """
    result, height, variance = check
    if result == EXACT:
        if abs(measured) < HEIGHT_MAX:
            heights[k] = measured
        return
    if result == NOTHING and np.isnan(heights[k] + dt):
        heights[k] = np.nan
        vertical[k, GUESS] = height
        vertical[k, GUESS_VARIANCE] = variance
        return
    if result in (INITIATED, ON_SURFACE):
        initialise_height(kind, measured, variance, k, heights, vertical)
    else:
        predict_height(dt, k, heights, vertical)
    if result == ACCEPTED:
        p00, p01 = vertical[k, P00], vertical[k, P01]
        scale = 1.0 / (p00 + variance)
        e = measured - heights[k]
        heights[k] += p00 * scale * e
        vertical[k, RATE] += p01 * scale * e
        vertical[k, P00] = p00 * scale * variance
        vertical[k, P01] = p01 * scale * variance
        vertical[k, P11] -= p01 * p01 * scale
        vertical[k, COUNT] = CONFIRMED
    if result in (ACCEPTED, INITIATED, ON_SURFACE):
        vertical[k, RECEIVED_AT] = time
        if variance < COARSE_VARIANCE and not gives_fine(s, vertical[k, FINE]):
            vertical[k, FINE] += float(1 << (s & (SENSOR_BITS - 1)))
    elif result == REJECTED_HEIGHT:
        vertical[k, COUNT] = doubts(measured, time, k, vertical)
        vertical[k, DOUBTED] = measured
        vertical[k, DOUBTED_AT] = time
    elif not vertical[k, P00] <= options[ASSUMED_HEIGHT_SIGMA] * options[ASSUMED_HEIGHT_SIGMA]:
        # The variance exceeds the prior of an aircraft without reported heights.
        reset_height(k, heights, vertical)


@in_loop
def update_rate(reported: float, k: int, heights: Floats, vertical: Floats) -> None:
    """Update the rate of climb of aircraft k by the one that it reports, NaN for none."""
    e = reported - vertical[k, RATE]
    p01, p11 = vertical[k, P01], vertical[k, P11]
    S = p11 + REPORTED_RATE_VARIANCE
    # NaN, of the height too, fails this.
    if vertical[k, COUNT] > 0.0 and e * e + 0.0 * heights[k] <= DOUBT_SQUARED * S:
        scale = 1.0 / S
        heights[k] += p01 * scale * e
        vertical[k, RATE] += p11 * scale * e
        vertical[k, P00] -= p01 * p01 * scale
        vertical[k, P01] = p01 * scale * REPORTED_RATE_VARIANCE
        vertical[k, P11] = p11 * scale * REPORTED_RATE_VARIANCE


@in_loop
def initialise_height(
    kind: int, measured: float, variance: float, k: int, heights: Floats, vertical: Floats
) -> None:
    """Initialise the height of aircraft k at a reported one."""
    source = REPORTED if kind == KIND_POSITION else MODE_C
    if kind == KIND_SURFACE:
        source = SURFACE
    # Another kind of height may differ much, but has the same rate of climb.
    if np.isnan(heights[k]) or source == vertical[k, SOURCE]:
        vertical[k, RATE] = 0.0
        vertical[k, P11] = RATE_SIGMA_MPS * RATE_SIGMA_MPS
    heights[k] = measured
    vertical[k, P00] = variance
    vertical[k, P01] = 0.0
    vertical[k, SOURCE] = source
    # Two outliers are consistent with it.
    vertical[k, COUNT] = CONFIRMED if vertical[k, COUNT] <= BELIEVED + 1.0 else 1.0


@in_loop
def predict_height(dt: float, k: int, heights: Floats, vertical: Floats) -> None:
    """Predict the height of aircraft k by dt."""
    p01, p11 = vertical[k, P01], vertical[k, P11]
    q = CLIMB_DENSITY * dt
    heights[k] += dt * vertical[k, RATE]
    vertical[k, P00] += dt * (2.0 * p01 + dt * (p11 + q * (1.0 / 3.0)))
    vertical[k, P01] += dt * (p11 + 0.5 * q)
    vertical[k, P11] += q


@in_loop
def coast_height(dt: float, k: int, heights: Floats, vertical: Floats, options: Floats) -> None:
    """Predict the height of aircraft k by dt after a rejected plot."""
    if options[EXACT_HEIGHTS] != 0.0:
        return
    if np.isnan(heights[k]):
        guess, variance = guess_height(False, dt, k, vertical, options)
        vertical[k, GUESS] = guess
        vertical[k, GUESS_VARIANCE] = variance
        vertical[k, BY_HEIGHT] += dt * vertical[k, BY_HEIGHT + 2]
        vertical[k, BY_HEIGHT + 1] += dt * vertical[k, BY_HEIGHT + 3]
    else:
        predict_height(dt, k, heights, vertical)


@in_loop
def height_variance(k: int, vertical: Floats) -> float:
    """Return the variance of the reported height, 0 where heights are exact."""
    variance = 0.0
    if vertical[k, COUNT] != 0.0:
        variance = max(vertical[k, P00], lasting_variance(k, vertical))
    return variance


@in_loop
def reportable_rate(k: int, vertical: Floats) -> float:
    """Return the rate of climb, NaN while its sigma is too large to report."""
    reportable = (
        vertical[k, COUNT] != 0.0 and vertical[k, P11] <= RATE_SIGMA_MAX_MPS * RATE_SIGMA_MAX_MPS
    )
    return vertical[k, RATE] if reportable else np.nan


@in_loop
def reportable_guess(k: int, vertical: Floats, options: Floats) -> float:
    """Return the estimated height, NaN while its sigma is too large to report."""
    sigma = min(GUESS_SIGMA_MAX_M, 0.5 * options[ASSUMED_HEIGHT_SIGMA])
    reportable = vertical[k, GUESS_VARIANCE] <= sigma * sigma
    return vertical[k, GUESS] if reportable else np.nan


@in_loop
def height_informs(
    check: HeightCheck, kind: int, z0: float, k: int, s: int, heights: Floats, vertical: Floats,
    noises: Floats,
) -> bool:  # fmt: skip
    """Return whether the height is accurate enough for a plot to contribute to the biases.

    The error of an unknown height is the same at every plot, and so is that of the range. Only the
    slant range of a radar and an elevation depend on the height. A single height, or an outlier, is
    not enough.
    """
    result, height, variance = check
    informs = True
    if kind in (KIND_RADAR, KIND_DIRECTION):
        sure = result in (ACCEPTED, ON_SURFACE)
        if result == NOTHING:
            sure = not np.isnan(heights[k]) and vertical[k, COUNT] == CONFIRMED
        if result == EXACT:
            sure = variance == 0.0
        # Slope times range: without a division.
        rise = height - noises[s, 3]
        if kind == KIND_RADAR:
            rise += z0 * z0 * (1.0 / EARTH_DIAMETER_M)
            informs = sure and rise * rise * variance <= INFORMING_RATIO * noises[s, 0] * z0 * z0
        else:
            slant = slant_of_direction(z0, rise)
            most = ELEVATION_INFORMING_RATIO * noises[s, 0] * slant * slant
            informs = sure and variance <= most
    return informs


@in_loop
def slant_of_direction(sine: float, rise: float) -> float:
    """Return the slant range at a sine of the elevation to a point ``rise`` above the source.

    The nearer of two points if it is below the source; NaN or negative if there is none.
    """
    drop = 0.5 * EARTH_DIAMETER_M * sine
    half: float = np.sqrt(drop * drop + rise * (EARTH_DIAMETER_M + rise))
    return (half if rise >= 0.0 else -half) - drop


@in_loop
def range_slope(height: float, slant: float, site_height: float) -> float:
    """Return s, the derivative of the slant range by the height, see `expected_measurement`."""
    return (height - site_height) / max(slant, 1.0) + slant * (1.0 / EARTH_DIAMETER_M)
