"""Compiled motion with constant lateral and longitudinal acceleration, and its derivatives.

Symbols: v, φ = speed and heading at the start, u, w = lateral and longitudinal acceleration,
t = time, V = v + w t, q = ∫ dt / v, Z = displacement (ahead, to the right) as a complex number.

**One form for all u and w.** With q for the time the speed is v e^(w q) and the heading u q, so
that Z = v² ∫ e^((2w + iu) q) dq = v² q E((2w + iu) q) with E(z) = (e^z − 1) / z, and
q = t / v · λ(w t / v) with λ(a) = ln(1 + a) / a. E and λ have no poles: where (2.3) loses its
digits they are power series.

References
----------
IMM UrO RAN report (2016), equations (2.1) to (2.3). The form by E and l, and the derivatives, are
the project's own.
"""

from math import cos, exp, expm1, log1p, sin

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, inner_loop, loop

Floats = NDArray[np.float64]

# Minimum speed, m/s: below it the heading of (2.1) is undefined.
SPEED_MIN = 10.0
# Below it a quotient is its power series: the first omitted term is below 1e-17 of the sum.
SERIES_BELOW = 0.03


@in_loop
def logarithm_quotient(a: float) -> float:
    """Return ln(1 + a) / a."""
    return 1.0 - 0.5 * a if abs(a) < 1e-8 else log1p(a) / a


@in_loop
def logarithm_slope(a: float) -> float:
    """Return the derivative of ln(1 + a) / a."""
    if abs(a) < SERIES_BELOW:
        total = 0.0
        for power in range(12, 0, -1):
            # The sum of (−1)^k k / (k + 1) a^(k − 1), from the smallest term on.
            sign = -1.0 if power % 2 else 1.0
            total = total * a + sign * power / (power + 1.0)
        found = total
    else:
        found = (1.0 / (1.0 + a) - log1p(a) / a) / a
    return found


@in_loop
def exponential_quotient(x: float, y: float) -> tuple[float, float]:
    """Return real and imaginary part of E(z) = (e^z − 1) / z at z = x + i y."""
    square = x * x + y * y
    if square < SERIES_BELOW * SERIES_BELOW:
        real, imaginary = 0.0, 0.0
        for power in range(10, 0, -1):
            # 1 + z/2 · (1 + z/3 · (1 + …)).
            lift = 1.0 / (power + 1.0)
            real, imaginary = (
                1.0 + lift * (real * x - imaginary * y),
                lift * (real * y + imaginary * x),
            )
    else:
        half = sin(0.5 * y)
        top_real = expm1(x) * cos(y) - 2.0 * half * half
        top_imaginary = exp(x) * sin(y)
        real = (top_real * x + top_imaginary * y) / square
        imaginary = (top_imaginary * x - top_real * y) / square
    return real, imaginary


@in_loop
def exponential_slope(x: float, y: float, e_real: float, e_imaginary: float) -> tuple[float, float]:
    """Return the derivative of E at z = x + i y, where E is known."""
    square = x * x + y * y
    if square < SERIES_BELOW * SERIES_BELOW:
        real, imaginary = 0.0, 0.0
        for power in range(10, 0, -1):
            # 1/2 + z/3 + z²/8 + …: the terms k / (k + 1)! z^(k − 1).
            lift = (power + 1.0) / (power * (power + 2.0))
            real, imaginary = (
                1.0 + lift * (real * x - imaginary * y),
                lift * (real * y + imaginary * x),
            )
        real, imaginary = 0.5 * real, 0.5 * imaginary
    else:
        size = exp(x)
        top_real, top_imaginary = size * cos(y) - e_real, size * sin(y) - e_imaginary
        real = (top_real * x + top_imaginary * y) / square
        imaginary = (top_imaginary * x - top_real * y) / square
    return real, imaginary


@in_loop
def possible(w: float, v: float, t: float) -> float:
    """Return w, limited so that the speed does not fall below its minimum."""
    least = (SPEED_MIN - v) / t if v > SPEED_MIN and t != 0.0 else 0.0
    return least if v + w * t < SPEED_MIN else w


@inner_loop
def fly(
    east: float, north: float, v: float, heading: float, u: float, w: float, t: float
) -> tuple[float, float, float, float]:
    """Return position, speed and heading after a time, (2.3)."""
    w = possible(w, v, t)
    a = w * t / v
    q = t / v * logarithm_quotient(a)
    real, imaginary = exponential_quotient(2.0 * w * q, u * q)
    size = v * v * q
    ahead, right = size * real, size * imaginary
    c, s = cos(heading), sin(heading)
    return (
        east + ahead * s + right * c,
        north + ahead * c - right * s,
        v + w * t,
        heading + u * q,
    )


@inner_loop
def fly_with_slopes(
    v: float, heading: float, u: float, w: float, t: float
) -> tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float, float
]:
    """Return the displacement east and north, speed and heading, and derivatives.

    After these four: those of east by v, heading, u, w; of north by the same; of the heading by v
    and w. (That by u is q, the change of heading over u; those of the speed are 1 and t.)
    """
    w = possible(w, v, t)
    a = w * t / v
    q = t / v * logarithm_quotient(a)
    x, y = 2.0 * w * q, u * q
    e_real, e_imaginary = exponential_quotient(x, y)
    d_real, d_imaginary = exponential_slope(x, y, e_real, e_imaginary)
    square = v * v
    ahead, right = square * q * e_real, square * q * e_imaginary
    speed = v + w * t
    # By q: v² e^z. By u and w at the same q: i v² q² E' and 2 v² q² E'.
    turn = u * q
    by_q_ahead, by_q_right = speed * speed * cos(turn), speed * speed * sin(turn)
    q_by_v = -t / (v * speed)
    q_by_w = t * t / square * logarithm_slope(a)
    grown = square * q * q
    v_ahead = 2.0 * ahead / v + by_q_ahead * q_by_v
    v_right = 2.0 * right / v + by_q_right * q_by_v
    u_ahead, u_right = -grown * d_imaginary, grown * d_real
    w_ahead = 2.0 * grown * d_real + by_q_ahead * q_by_w
    w_right = 2.0 * grown * d_imaginary + by_q_right * q_by_w
    c, s = cos(heading), sin(heading)
    east, north = ahead * s + right * c, ahead * c - right * s
    return (
        east,
        north,
        speed,
        heading + turn,
        v_ahead * s + v_right * c,
        north,
        u_ahead * s + u_right * c,
        w_ahead * s + w_right * c,
        v_ahead * c - v_right * s,
        -east,
        u_ahead * c - u_right * s,
        w_ahead * c - w_right * s,
        u * q_by_v,
        u * q_by_w,
    )


@loop
def fly_all(states: Floats, u: Floats, w: Floats, t: Floats) -> None:
    """Propagate states (n, 4) in place."""
    for i in range(len(states)):
        states[i, 0], states[i, 1], states[i, 2], states[i, 3] = fly(
            states[i, 0], states[i, 1], states[i, 2], states[i, 3], u[i], w[i], t[i]
        )
