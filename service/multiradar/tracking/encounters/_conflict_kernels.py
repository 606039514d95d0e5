"""Compiled conflict probability of two aircraft, and quantiles of their least distance.

The relative motion is straight, p + w t, with (p, w) Gaussian. For one velocity w and one position
s along it the aircraft come within D of each other during 0 ≤ t ≤ end if the offset b of the line
from the other aircraft is at most √(D² − o²). Here o is the distance by which the line begins after
the other aircraft or ends before it, and zero if it passes it. Given w and s, b is Gaussian: the
probability is a difference of two normal distributions, exactly. It is averaged over w and s (three
normal variables) at the points of a lattice, the same for all pairs. The first variable is sampled
evenly in the direction in which the velocity moves the line sideways, where the probability changes
most.

With heights, the points also have a height offset and a difference of vertical rates. While two
aircraft are within D their height difference covers an interval; the probability that it comes
within h of zero is again a difference of normal distributions.

V is one of four, by whether each aircraft has rare errors; each variant has its fraction of the
points.

Symbols: A = covariance of p, C of p with w, V of w = L Lᵀ; G = C L⁻ᵀ; z = normal variables, rotated
by R; e along w, n across it.

References
----------
The project's own. For velocity errors small against the velocity it is the formula of R. A.
Paielli, H. Erzberger, "Conflict probability estimation for free flight", Journal of Guidance,
Control, and Dynamics 20 (1997), 588-596.
"""

from math import erf, hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.encounters._approach_kernels import (
    CHORD_A,
    CHORD_C,
    CHORD_END,
    CHORD_P,
    CHORD_V,
    CHORD_W,
    VARIANTS,
)
from multiradar_compiled.kernels import in_loop, inner_loop, kernel

Floats = NDArray[np.float64]

#: Columns of a line: mean and standard deviation of b, o, s and the speed.
OFFSET, OFFSET_SIGMA, BEYOND, ALONG, SPEED = range(5)
LINE_COUNT = 5
#: Columns of the height of the second above the first now: height, rate, their covariance, and the
#: density of the vertical acceleration.
HEIGHT, RATE, HEIGHT_VARIANCE, HEIGHT_RATE, RATE_VARIANCE, CLIMB_NOISE = range(6)
#: Columns of the probabilities: horizontal, and horizontal and vertical.
WITHIN, WITHIN_BOTH = 0, 1
#: Of every sixteen points, the first one of each variant of a chord, and the end of the last.
VARIANT_BEGINS = (0, 9, 12, 15, 16)
SIXTEEN = 16
#: Maximum number of steps of the search for a quantile of the least distance, and its tolerances:
#: width, in sigmas, and probability.
BOUND_STEPS_MAX = 60
BOUND_WIDTH = 1e-3
BOUND_PROBABILITY = 1e-4
# Below these, m² and (m/s)², a variance is a rounding error.
_FLOOR = 1e-9
_HALF_ROOT = sqrt(0.5)


@kernel
def find_probabilities(
    chords: Floats, heights: Floats, points: Floats, distance: float, separation: float,
    probabilities: Floats,
) -> None:  # fmt: skip
    """Fill ``probabilities``: within the distance, and within the separation at that time.

    The second is NaN without heights or without a separation (NaN).
    """
    lines = np.empty((points.shape[0], LINE_COUNT))
    fill_probabilities(chords, heights, points, distance, separation, lines, probabilities)


@kernel
def find_bounds(chords: Floats, points: Floats, low: float, high: float, bounds: Floats) -> None:
    """Fill the rows of ``bounds`` with an interval of the least distance.

    The interval between two quantiles, or from 0 with the same probability if that is shorter.
    """
    lines = np.empty((points.shape[0], LINE_COUNT))
    fill_bounds(chords, points, low, high, lines, bounds)


@inner_loop
def fill_probabilities(
    chords: Floats, heights: Floats, points: Floats, distance: float, separation: float,
    lines: Floats, probabilities: Floats,
) -> None:  # fmt: skip
    """As `find_probabilities`."""
    for row in range(chords.shape[0]):
        draw_lines(chords[row], points, lines)
        probability = probability_within(lines, distance)
        probabilities[row, WITHIN] = probability
        probabilities[row, WITHIN_BOTH] = np.nan
        if not np.isnan(heights[row, HEIGHT] + separation):
            end = chords[row, CHORD_END]
            level = probability_in_height(lines, points, heights[row], end, distance, separation)
            probabilities[row, WITHIN_BOTH] = probability * level


@inner_loop
def fill_bounds(
    chords: Floats, points: Floats, low: float, high: float, lines: Floats, bounds: Floats
) -> None:
    """As `find_bounds`."""
    for row in range(chords.shape[0]):
        draw_lines(chords[row], points, lines)
        farthest, sigma = 0.0, 0.0
        for m in range(points.shape[0]):
            farthest = max(
                farthest,
                hypot(abs(lines[m, OFFSET]) + 6.0 * lines[m, OFFSET_SIGMA], lines[m, BEYOND]),
            )
            sigma += lines[m, OFFSET_SIGMA] / points.shape[0]
        width = BOUND_WIDTH * sigma
        bounds[row, 0] = distance_quantile(lines, low, farthest, width)
        bounds[row, 1] = distance_quantile(lines, high, farthest, width)
        from_zero = distance_quantile(lines, high - low, farthest, width)
        if from_zero < bounds[row, 1] - bounds[row, 0]:
            bounds[row, 0], bounds[row, 1] = 0.0, from_zero


@in_loop
def normal(x: float) -> float:
    """Return the normal distribution function."""
    value: float = 0.5 + 0.5 * erf(x * _HALF_ROOT)
    return value


@in_loop
def across(px: float, py: float, wx: float, wy: float, end: float) -> tuple[float, float, float]:
    """Return the time at which p + w t is closest, and the direction of its cross error."""
    square = wx * wx + wy * wy
    time = 0.0
    if square > 0.0:
        time = min(max(-(px * wx + py * wy) / square, 0.0), end)
    x, y = px + time * wx, py + time * wy
    if 0.0 < time < end:
        x, y = -wy, wx
    size = hypot(x, y)
    if size == 0.0:
        x, size = 1.0, 1.0
    return time, x / size, y / size


@in_loop
def draw_lines(chord: Floats, points: Floats, lines: Floats) -> None:
    """Fill ``lines`` with the line of each point; points of a variant are contiguous."""
    for variant in range(VARIANTS):
        first = points.shape[0] * VARIANT_BEGINS[variant] // SIXTEEN
        last = points.shape[0] * VARIANT_BEGINS[variant + 1] // SIXTEEN
        draw_variant(chord, CHORD_V + 3 * variant, points, first, last, lines)


@in_loop
def draw_variant(
    chord: Floats, column: int, points: Floats, first: int, last: int, lines: Floats
) -> None:
    """Fill ``lines`` from ``first`` to ``last``, with V in the columns from ``column`` on."""
    px, py, wx, wy = chord[CHORD_P], chord[CHORD_P + 1], chord[CHORD_W], chord[CHORD_W + 1]
    end = chord[CHORD_END]
    l00 = sqrt(max(chord[column], _FLOOR))
    l10 = chord[column + 1] / l00
    l11 = sqrt(max(chord[column + 2] - l10 * l10, _FLOOR))
    g00 = chord[CHORD_C] / l00
    g10 = chord[CHORD_C + 2] / l00
    g01 = (chord[CHORD_C + 1] - g00 * l10) / l11
    g11 = (chord[CHORD_C + 3] - g10 * l10) / l11
    m00 = chord[CHORD_A] - g00 * g00 - g01 * g01
    m01 = chord[CHORD_A + 1] - g00 * g10 - g01 * g11
    m11 = chord[CHORD_A + 2] - g10 * g10 - g11 * g11
    if min(m00, m11) < 0.0 or m00 * m11 < m01 * m01:
        # In a mixture of motions the cross-covariance may exceed what a chord can represent.
        g00, g01, g10, g11 = 0.0, 0.0, 0.0, 0.0
        m00, m01, m11 = chord[CHORD_A], chord[CHORD_A + 1], chord[CHORD_A + 2]
    time, nx, ny = across(px, py, wx, wy, end)
    c = nx * (g00 + time * l00) + ny * (g10 + time * l10)
    s = nx * g01 + ny * (g11 + time * l11)
    size = hypot(c, s)
    if size == 0.0:
        c, size = 1.0, 1.0
    c, s = c / size, s / size
    for m in range(first, last):
        z0 = c * points[m, 0] - s * points[m, 1]
        z1 = s * points[m, 0] + c * points[m, 1]
        vx, vy = wx + l00 * z0, wy + l10 * z0 + l11 * z1
        qx, qy = px + g00 * z0 + g01 * z1, py + g10 * z0 + g11 * z1
        speed = hypot(vx, vy)
        ex, ey = 1.0, 0.0
        if speed > 0.0:
            ex, ey = vx / speed, vy / speed
        along = ex * ex * m00 + 2.0 * ex * ey * m01 + ey * ey * m11
        sideways = ey * ey * m00 - 2.0 * ex * ey * m01 + ex * ex * m11
        both = ex * ey * (m11 - m00) + (ex * ex - ey * ey) * m01
        sigma = sqrt(max(along, _FLOOR))
        start = ex * qx + ey * qy + sigma * points[m, 2]
        lines[m, OFFSET] = ex * qy - ey * qx + both / sigma * points[m, 2]
        rest = sideways - (both / sigma) * (both / sigma)
        lines[m, OFFSET_SIGMA] = sqrt(max(rest, _FLOOR))
        lines[m, BEYOND] = max(start, -start - speed * end, 0.0)
        lines[m, ALONG] = start
        lines[m, SPEED] = speed


@in_loop
def probability_within(lines: Floats, distance: float) -> float:
    """Return the probability that the least distance is below a threshold."""
    count = lines.shape[0]
    total: float = 0.0
    for m in range(count):
        margin = distance * distance - lines[m, BEYOND] * lines[m, BEYOND]
        if margin > 0.0:
            half, scale = sqrt(margin), 1.0 / lines[m, OFFSET_SIGMA]
            upper = normal((half - lines[m, OFFSET]) * scale)
            total += upper - normal((-half - lines[m, OFFSET]) * scale)
    mean: float = total / count
    return mean


@in_loop
def distance_quantile(lines: Floats, probability: float, farthest: float, width: float) -> float:
    """Return a quantile of the least distance.

    By false position with halving of the retained end (Illinois algorithm).
    """
    low, high = 0.0, farthest
    at_low, at_high = -probability, probability_within(lines, farthest) - probability
    middle = farthest
    step, side = 0, 0
    while step < BOUND_STEPS_MAX and high - low > width:
        middle = (low * at_high - high * at_low) / (at_high - at_low)
        at = probability_within(lines, middle) - probability
        if abs(at) < BOUND_PROBABILITY:
            low, high = middle, middle
        elif at < 0.0:
            low, at_low = middle, at
            if side == -1:
                at_high *= 0.5
            side = -1
        else:
            high, at_high = middle, at
            if side == 1:
                at_low *= 0.5
            side = 1
        step += 1
    return middle


@in_loop
def probability_in_height(
    lines: Floats, points: Floats, height: Floats, end: float, distance: float, separation: float
) -> float:
    """Return the probability of vertical proximity, given horizontal proximity.

    If no point comes within the distance, the closest one is used.
    """
    total, count = 0.0, 0
    nearest, excess = 0, np.inf
    for m in range(lines.shape[0]):
        offset = lines[m, OFFSET] + lines[m, OFFSET_SIGMA] * points[m, 3]
        beyond = hypot(offset, lines[m, BEYOND])
        if beyond < distance:
            total += probability_on_line(
                lines, points, m, offset, height, end, distance, separation
            )
            count += 1
        elif beyond < excess:
            nearest, excess = m, beyond
    if count == 0:
        total = probability_on_line(
            lines, points, nearest, distance, height, end, distance, separation
        )
        count = 1
    return total / count


@in_loop
def probability_on_line(
    lines: Floats, points: Floats, m: int, offset: float, height: Floats, end: float,
    distance: float, separation: float,
) -> float:  # fmt: skip
    """Return the probability of vertical proximity while a line is within the distance."""
    half = sqrt(max(distance * distance - offset * offset, 0.0))
    first, last = 0.0, end
    if lines[m, SPEED] > 0.0:
        first = min(max(-(lines[m, ALONG] + half) / lines[m, SPEED], 0.0), end)
        last = min(max(-(lines[m, ALONG] - half) / lines[m, SPEED], 0.0), end)
    lasts, noise = last - first, height[CLIMB_NOISE]
    # At the first of these times; from there to the last one on a chord, as horizontally.
    variance = height[HEIGHT_VARIANCE] + first * (
        2.0 * height[HEIGHT_RATE] + first * (height[RATE_VARIANCE] + first * noise * (1.0 / 3.0))
    )
    common = height[HEIGHT_RATE] + first * (height[RATE_VARIANCE] + 0.5 * first * noise)
    rate_variance = height[RATE_VARIANCE] + noise * (first + lasts * (1.0 / 3.0))
    # In the middle of both times.
    variance += lasts * (common + 0.25 * lasts * rate_variance)
    common += 0.5 * lasts * rate_variance
    time = 0.5 * (first + last)
    rate_sigma = sqrt(max(rate_variance, _FLOOR))
    rate = height[RATE] + rate_sigma * points[m, 4]
    mean = height[HEIGHT] + time * height[RATE] + common / rate_sigma * points[m, 4]
    rest = variance - (common / rate_sigma) * (common / rate_sigma)
    scale = 1.0 / sqrt(max(rest, _FLOOR))
    swept = separation + 0.5 * abs(rate) * lasts
    return normal((swept - mean) * scale) - normal((-swept - mean) * scale)
