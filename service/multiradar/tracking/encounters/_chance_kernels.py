"""Compiled chance that two aircraft come within a distance, and what their least distance may be.

Two aircraft move straight relative to each other, p + w t, with (p, w) Gaussian. For one velocity w
and one place s along it they come within D of each other while 0 ≤ t ≤ end if the offset b of the
line from the other aircraft is at most √(D² − o²), where o is by how much the line begins past the
other, or ends before it, and zero where it passes by. b is Gaussian, given w and s: the chance is a
difference of two normal distributions, exact. Over w and s (three normal numbers) it is averaged at
the points of a lattice, the same for all pairs; the first number is spread evenly in the direction
in which the velocity moves the line across, where the chance changes most.

With heights, the same points have an offset and a difference of rates of climb too; while two
aircraft are within D the height between them runs through an interval, and the chance that it comes
within h of zero is again a difference of normal distributions.

V is one of four, by whether either of the two strays: each has its share of the points.

Symbols: A = covariance of p, C of p with w, V of w = L Lᵀ; G = C L⁻ᵀ; z = normal numbers, R turns
them; e along w, n across it.

References
----------
The project's own. Where errors of the velocity are small beside it, it is the formula of
R. A. Paielli, H. Erzberger, "Conflict probability estimation for free flight", Journal of Guidance,
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
from multiradar_compiled.kernels import in_loop, kernel, loop

Floats = NDArray[np.float64]

#: Columns of a line: mean and standard deviation of b, o, s and the speed.
OFFSET, OFFSET_SIGMA, BEYOND, ALONG, SPEED = range(5)
LINE_COUNT = 5
#: Columns of the height of the second above the first now: it, its rate, their covariance, and the
#: density of the vertical acceleration.
HEIGHT, RATE, HEIGHT_VARIANCE, HEIGHT_RATE, RATE_VARIANCE, CLIMB_NOISE = range(6)
#: Columns of the chances: across, and in height too.
WITHIN, WITHIN_BOTH = 0, 1
#: Of sixteen points those of each variant of a chord begin here; the last one ends here.
VARIANT_BEGINS = (0, 9, 12, 15, 16)
SIXTEEN = 16
#: Steps of the search for a bound of the least distance; it ends where the bound is so narrow, in
#: sigmas, or its chance so near.
BOUND_STEPS_MAX = 60
BOUND_WIDTH = 1e-3
BOUND_CHANCE = 1e-4
# Below these, m² and (m/s)², a variance is a rounding error.
_FLOOR = 1e-9
_HALF_ROOT = sqrt(0.5)


@kernel
def find_chances(
    chords: Floats, heights: Floats, points: Floats, distance: float, separation: float,
    chances: Floats,
) -> None:  # fmt: skip
    """Fill the rows of ``chances``: within the distance, and within the separation at that time.

    The second is NaN where the height is, or no separation is given (NaN).
    """
    lines = np.empty((points.shape[0], LINE_COUNT))
    fill_chances(chords, heights, points, distance, separation, lines, chances)


@kernel
def find_bounds(chords: Floats, points: Floats, low: float, high: float, bounds: Floats) -> None:
    """Fill the rows of ``bounds`` with an interval of the least distance.

    It is that between two quantiles, or from 0 on with as much probability if that is shorter.
    """
    lines = np.empty((points.shape[0], LINE_COUNT))
    fill_bounds(chords, points, low, high, lines, bounds)


@loop
def fill_chances(
    chords: Floats, heights: Floats, points: Floats, distance: float, separation: float,
    lines: Floats, chances: Floats,
) -> None:  # fmt: skip
    """Do as `find_chances`."""
    for row in range(chords.shape[0]):
        draw_lines(chords[row], points, lines)
        chance = chance_within(lines, distance)
        chances[row, WITHIN] = chance
        chances[row, WITHIN_BOTH] = np.nan
        if not np.isnan(heights[row, HEIGHT] + separation):
            end = chords[row, CHORD_END]
            level = chance_in_height(lines, points, heights[row], end, distance, separation)
            chances[row, WITHIN_BOTH] = chance * level


@loop
def fill_bounds(
    chords: Floats, points: Floats, low: float, high: float, lines: Floats, bounds: Floats
) -> None:
    """Do as `find_bounds`."""
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
        bounds[row, 0] = distance_of_chance(lines, low, farthest, width)
        bounds[row, 1] = distance_of_chance(lines, high, farthest, width)
        from_zero = distance_of_chance(lines, high - low, farthest, width)
        if from_zero < bounds[row, 1] - bounds[row, 0]:
            bounds[row, 0], bounds[row, 1] = 0.0, from_zero


@in_loop
def normal(x: float) -> float:
    """Return the normal distribution."""
    value: float = 0.5 + 0.5 * erf(x * _HALF_ROOT)
    return value


@in_loop
def across(px: float, py: float, wx: float, wy: float, end: float) -> tuple[float, float, float]:
    """Return the time at which p + w t is nearest, and the direction in which it errs across."""
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
    """Fill ``lines`` with the line of each point; the points of a variant follow each other."""
    for variant in range(VARIANTS):
        first = points.shape[0] * VARIANT_BEGINS[variant] // SIXTEEN
        last = points.shape[0] * VARIANT_BEGINS[variant + 1] // SIXTEEN
        draw_variant(chord, CHORD_V + 3 * variant, points, first, last, lines)


@in_loop
def draw_variant(
    chord: Floats, walk: int, points: Floats, first: int, last: int, lines: Floats
) -> None:
    """Fill ``lines`` from ``first`` to ``last``, V being in the columns from ``walk`` on."""
    px, py, wx, wy = chord[CHORD_P], chord[CHORD_P + 1], chord[CHORD_W], chord[CHORD_W + 1]
    end = chord[CHORD_END]
    l00 = sqrt(max(chord[walk], _FLOOR))
    l10 = chord[walk + 1] / l00
    l11 = sqrt(max(chord[walk + 2] - l10 * l10, _FLOOR))
    g00 = chord[CHORD_C] / l00
    g10 = chord[CHORD_C + 2] / l00
    g01 = (chord[CHORD_C + 1] - g00 * l10) / l11
    g11 = (chord[CHORD_C + 3] - g10 * l10) / l11
    m00 = chord[CHORD_A] - g00 * g00 - g01 * g01
    m01 = chord[CHORD_A + 1] - g00 * g10 - g01 * g11
    m11 = chord[CHORD_A + 2] - g10 * g10 - g11 * g11
    if min(m00, m11) < 0.0 or m00 * m11 < m01 * m01:
        # A mixture of motions: what position and velocity share is more than a chord can hold.
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
        place = ex * qx + ey * qy + sigma * points[m, 2]
        lines[m, OFFSET] = ex * qy - ey * qx + both / sigma * points[m, 2]
        rest = sideways - (both / sigma) * (both / sigma)
        lines[m, OFFSET_SIGMA] = sqrt(max(rest, _FLOOR))
        lines[m, BEYOND] = max(place, -place - speed * end, 0.0)
        lines[m, ALONG] = place
        lines[m, SPEED] = speed


@in_loop
def chance_within(lines: Floats, distance: float) -> float:
    """Return the chance that the least distance is below one."""
    count = lines.shape[0]
    total: float = 0.0
    for m in range(count):
        room = distance * distance - lines[m, BEYOND] * lines[m, BEYOND]
        if room > 0.0:
            half, scale = sqrt(room), 1.0 / lines[m, OFFSET_SIGMA]
            upper = normal((half - lines[m, OFFSET]) * scale)
            total += upper - normal((-half - lines[m, OFFSET]) * scale)
    mean: float = total / count
    return mean


@in_loop
def distance_of_chance(lines: Floats, chance: float, farthest: float, width: float) -> float:
    """Return the least distance that is not exceeded with a chance.

    By false position; the end that stays counts half, so that it does not stay for long (Illinois).
    """
    low, high = 0.0, farthest
    at_low, at_high = -chance, chance_within(lines, farthest) - chance
    middle = farthest
    step, side = 0, 0
    while step < BOUND_STEPS_MAX and high - low > width:
        middle = (low * at_high - high * at_low) / (at_high - at_low)
        at = chance_within(lines, middle) - chance
        if abs(at) < BOUND_CHANCE:
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
def chance_in_height(
    lines: Floats, points: Floats, height: Floats, end: float, distance: float, separation: float
) -> float:
    """Return the chance of pairs that come within the distance to be within the separation then.

    Of points none of which comes within the distance, the one that comes nearest to it is taken.
    """
    total, count = 0.0, 0
    nearest, excess = 0, np.inf
    for m in range(lines.shape[0]):
        offset = lines[m, OFFSET] + lines[m, OFFSET_SIGMA] * points[m, 3]
        beyond = hypot(offset, lines[m, BEYOND])
        if beyond < distance:
            total += chance_at_line(lines, points, m, offset, height, end, distance, separation)
            count += 1
        elif beyond < excess:
            nearest, excess = m, beyond
    if count == 0:
        total = chance_at_line(lines, points, nearest, distance, height, end, distance, separation)
        count = 1
    return total / count


@in_loop
def chance_at_line(
    lines: Floats, points: Floats, m: int, offset: float, height: Floats, end: float,
    distance: float, separation: float,
) -> float:  # fmt: skip
    """Return the chance to be within the separation while a line is within the distance."""
    half = sqrt(max(distance * distance - offset * offset, 0.0))
    first, last = 0.0, end
    if lines[m, SPEED] > 0.0:
        first = min(max(-(lines[m, ALONG] + half) / lines[m, SPEED], 0.0), end)
        last = min(max(-(lines[m, ALONG] - half) / lines[m, SPEED], 0.0), end)
    lasts, noise = last - first, height[CLIMB_NOISE]
    # At the first of these times; from there to the last one on a chord, as the way across is.
    variance = height[HEIGHT_VARIANCE] + first * (
        2.0 * height[HEIGHT_RATE] + first * (height[RATE_VARIANCE] + first * noise * (1.0 / 3.0))
    )
    common = height[HEIGHT_RATE] + first * (height[RATE_VARIANCE] + 0.5 * first * noise)
    rate_variance = height[RATE_VARIANCE] + noise * (first + lasts * (1.0 / 3.0))
    # In the middle between both.
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
