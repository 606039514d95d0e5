"""Compiled interpolation between the points of forecasts by cubics.

Symbols: dt = time between two points, u = fraction of it that has passed, x, v = position and rate
at them, x, y = east and north.

References
----------
J. Stoer, R. Bulirsch, "Introduction to Numerical Analysis", Springer 2002, section 2.1.5: Hermite
interpolation. The project's own: the search for the closest point.
"""

from math import hypot

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop

Floats = NDArray[np.float64]

#: Initial points of the search for the closest point of a cubic, and Newton steps.
TRIED = 4
NEWTON_STEPS = 4


@in_loop
def cubic(u: float, dt: float, x0: float, x1: float, v0: float, v1: float) -> float:
    """Return the value of the cubic with these end values and rates."""
    w = 1.0 - u
    value: float = w * w * ((1.0 + 2.0 * u) * x0 + u * dt * v0) + u * u * (
        (3.0 - 2.0 * u) * x1 - w * dt * v1
    )
    return value


@in_loop
def cubic_rate(u: float, dt: float, x0: float, x1: float, v0: float, v1: float) -> float:
    """Return the rate of the cubic."""
    w = 1.0 - u
    rate: float = 6.0 * u * w * (x1 - x0) / dt + w * (w - 2.0 * u) * v0 + u * (u - 2.0 * w) * v1
    return rate


@in_loop
def cubic_bend(u: float, dt: float, x0: float, x1: float, v0: float, v1: float) -> float:
    """Return the second derivative of the cubic."""
    rise = 6.0 * (1.0 - 2.0 * u) * (x1 - x0) / dt
    bend: float = (rise + (6.0 * u - 4.0) * v0 + (6.0 * u - 2.0) * v1) / dt
    return bend


@in_loop
def is_within(
    distance: float, dt: float, x0: float, y0: float, x1: float, y1: float, vx0: float, vy0: float,
    vx1: float, vy1: float,
) -> bool:  # fmt: skip
    """Return whether a cubic in the plane may come within a distance of the origin.

    It lies within the hull of its Bézier points, and so in a circle around the middle of its ends.
    """
    third = dt / 3.0
    x, y = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
    reach = 0.5 * hypot(x1 - x0, y1 - y0)
    reach = max(reach, hypot(x0 + third * vx0 - x, y0 + third * vy0 - y))
    reach = max(reach, hypot(x1 - third * vx1 - x, y1 - third * vy1 - y))
    # Margin for rounding.
    return hypot(x, y) <= (distance + reach) * (1.0 + 1e-6)


@in_loop
def nearest_part(
    dt: float, x0: float, y0: float, x1: float, y1: float, vx0: float, vy0: float, vx1: float,
    vy1: float,
) -> tuple[float, float]:  # fmt: skip
    """Return where a cubic in the plane is closest to the origin, and the squared distance.

    Newton iteration from the closest point of the chord or a closer one of a few others; or an end
    point.
    """
    ex, ey = x1 - x0, y1 - y0
    length = ex * ex + ey * ey
    chord = 0.0
    if length > 0.0:
        chord = min(max(-(x0 * ex + y0 * ey) / length, 0.0), 1.0)
    u, best = chord, np.inf
    for number in range(TRIED + 1):
        part = number / TRIED if number > 0 else chord
        x, y = cubic(part, dt, x0, x1, vx0, vx1), cubic(part, dt, y0, y1, vy0, vy1)
        if x * x + y * y < best:
            u, best = part, x * x + y * y
    for _ in range(NEWTON_STEPS):
        x, y = cubic(u, dt, x0, x1, vx0, vx1), cubic(u, dt, y0, y1, vy0, vy1)
        vx, vy = cubic_rate(u, dt, x0, x1, vx0, vx1), cubic_rate(u, dt, y0, y1, vy0, vy1)
        ax, ay = cubic_bend(u, dt, x0, x1, vx0, vx1), cubic_bend(u, dt, y0, y1, vy0, vy1)
        curved = vx * vx + vy * vy + x * ax + y * ay
        if curved > 0.0:
            u = min(max(u - (x * vx + y * vy) / (curved * dt), 0.0), 1.0)
    x, y = cubic(u, dt, x0, x1, vx0, vx1), cubic(u, dt, y0, y1, vy0, vy1)
    best = x * x + y * y
    first, last = x0 * x0 + y0 * y0, x1 * x1 + y1 * y1
    # With equal distances the earlier end is returned.
    if first <= best:
        u, best = 0.0, first
    if last < best:
        u, best = 1.0, last
    return u, best
