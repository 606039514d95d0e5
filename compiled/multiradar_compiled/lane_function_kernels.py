"""Exponentials, sines and angles of eight numbers at once: see `lane_kernels`.

Each is accurate to some units in the last place, and the same on every processor: results of
mathematical libraries depend on the machine.

References
----------
Cody, W. J., Waite, W., "Software Manual for the Elementary Functions" (1980), chapters 6 and 8:
argument reduction by constants in parts. The project's own: series and polynomials.
"""

import math

from multiradar_compiled.kernels import in_both
from multiradar_compiled.lane_kernels import (
    Lanes,
    chosen,
    fused_lanes,
    larger,
    nearest_whole,
    polynomial,
    two_to_the,
)

# Lower bound of exponents: 1e-304.
EXPONENT_MIN = -700.0
LOG_TWO = math.log(2.0)
# ln 2 and π/2 in parts, the first with few digits so that small whole multiples are exact.
LOG_TWO_FIRST = float.fromhex("0x1.62e42fe000000p-1")
LOG_TWO_REST = 1.8206359985041462e-09
QUARTER_FIRST = float.fromhex("0x1.921fb40000000p+0")
QUARTER_NEXT = float.fromhex("0x1.4442d00000000p-24")
QUARTER_REST = 5.390302858158119e-15

# By series: the exponential up to the thirteenth power; sine(x) / x and cosine in x².
_exponential = polynomial(*(1.0 / math.factorial(power) for power in range(13, -1, -1)))
_sine = polynomial(*((-1.0) ** k / math.factorial(2 * k + 1) for k in range(7, -1, -1)))
_cosine = polynomial(*((-1.0) ** k / math.factorial(2 * k) for k in range(8, -1, -1)))
# Polynomial in x² of arctan(x) / x from 0 to 1 through its values at the Chebyshev points, accurate
# to 3e-16.
_arctangent = polynomial(
    2.9696356601657784e-05, -0.0003142007736680733, 0.0015739493241755758, -0.005000366453732649,
    0.011430023675054506, -0.02033087003302746, 0.02992405293802711, -0.03852606834610674,
    0.045668724719449945, -0.052025829246698206, 0.05867776001706719, -0.06664007607654046,
    0.07691950418796795, -0.09090875100099982, 0.11111108947215684, -0.14285714201153485,
    0.19999999998244405, -0.333333333333188, 0.9999999999999998,
)  # fmt: skip


@in_both
def exponential(x: Lanes) -> Lanes:
    """Return eˣ for numbers that are not positive."""
    x = larger(x, EXPONENT_MIN)
    twos = nearest_whole(x * (1.0 / LOG_TWO))
    rest = fused_lanes(twos, -LOG_TWO_FIRST, x)
    rest = fused_lanes(twos, -LOG_TWO_REST, rest)
    return _exponential(rest) * two_to_the(twos)


@in_both
def sine_and_cosine(x: Lanes) -> tuple[Lanes, Lanes]:
    """Return sine and cosine of angles, rad, up to a million turns."""
    quarters = nearest_whole(x * (2.0 / math.pi))
    rest = fused_lanes(quarters, -QUARTER_FIRST, x)
    rest = fused_lanes(quarters, -QUARTER_NEXT, rest)
    rest = fused_lanes(quarters, -QUARTER_REST, rest)
    squared = rest * rest
    sine = rest * _sine(squared)
    cosine = _cosine(squared)
    # Quadrant: −2 to 2; the first and the last are the same.
    quarter = quarters - 4.0 * nearest_whole(0.25 * quarters)
    swapped = chosen(quarter * quarter, 0.5, 1.0, 0.0) * chosen(2.0, quarter * quarter, 1.0, 0.0)
    left = chosen(quarter, 0.5, -1.0, chosen(-1.5, quarter, -1.0, 1.0))
    below = chosen(-0.5, quarter, -1.0, chosen(quarter, 1.5, -1.0, 1.0))
    return (
        below * chosen(swapped, 0.5, cosine, sine),
        left * chosen(swapped, 0.5, sine, cosine),
    )


@in_both
def angle_of(y: Lanes, x: Lanes, length: Lanes) -> Lanes:
    """Return the angle from the direction of x, rad, −π to π; ``length`` is √(x² + y²).

    For length zero the angle is zero.
    """
    ahead = length + chosen(x, 0.0, x, -x)
    # Half of the angle from the nearer direction of the x axis.
    tangent = y / chosen(ahead, 0.0, ahead, 1.0)
    angle = 2.0 * tangent * _arctangent(tangent * tangent)
    found: Lanes = chosen(0.0, x, chosen(0.0, y, -math.pi, math.pi) - angle, angle)
    return found
