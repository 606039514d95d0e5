"""Compiled choice of the weight of covariance intersection.

Symbols: R, B = bounds of both parts, N = C R Cᵀ, W = covariance of the noise, T = scaling of the
trace, g = 1 + γ, h = 1 + 1/γ, S = g N + h B + W, F = tr T R̂(γ) of (1.45).

**One minimum.** With ω = 1/g the bound is R̂⁻¹ = ω R⁻¹ + Cᵀ (B/(1 − ω) + W)⁻¹ C. The last term is
concave in ω (a parallel sum), and the trace of an inverse is convex and falls: F is convex in ω. So
F' changes its sign once, and Newton's method in ln γ, within the bracket of that sign, finds it.

References
----------
IMM UrO RAN report (2016), equation (1.45). That parallel sums are concave: W. N. Anderson, R. J.
Duffin, "Series and parallel addition of matrices", J. Math. Anal. Appl. 26 (1969), 576-594. The
search is the project's own.
"""

from math import exp, log, sqrt

from multiradar_compiled.kernels import in_loop, kernel

Triple = tuple[float, float, float]

# Bounds of γ.
GAMMA_MIN = 1e-6
GAMMA_MAX = 1e2
LOG_MIN = log(GAMMA_MIN)
LOG_MAX = log(GAMMA_MAX)
# Newton stops at steps of ln γ below this; the remaining error is of the order of its square.
STEP_LAST = 1e-5
# Maximum Newton step of ln γ.
STEP_MAX = 3.0
# Lower bound of determinants, against rounding.
DETERMINANT_MIN = 1e-200
ROUNDS_MAX = 40


@in_loop
def scaled_trace(gamma: float, trace: float, m: Triple, n: Triple, b: Triple, w: Triple) -> float:
    """Return F(γ); trace = tr T R, m = C R T R Cᵀ, n = C R Cᵀ, b = the other, w = W."""
    g = 1.0 + gamma
    h = 1.0 + 1.0 / gamma
    s00 = g * n[0] + h * b[0] + w[0]
    s01 = g * n[1] + h * b[1] + w[1]
    s11 = g * n[2] + h * b[2] + w[2]
    det = max(s00 * s11 - s01 * s01, DETERMINANT_MIN)
    return g * (trace - g * (m[0] * s11 - 2.0 * m[1] * s01 + m[2] * s00) / det)


@in_loop
def slopes(
    gamma: float, trace: float, m: Triple, n: Triple, b: Triple, w: Triple
) -> tuple[float, float]:
    """Return first and second derivative of F by ln γ."""
    g = 1.0 + gamma
    q = 1.0 / gamma
    h = 1.0 + q
    s00 = g * n[0] + h * b[0] + w[0]
    s01 = g * n[1] + h * b[1] + w[1]
    s11 = g * n[2] + h * b[2] + w[2]
    # By ln γ: g' = g'' = γ, h' = −1/γ, h'' = 1/γ.
    d00 = gamma * n[0] - q * b[0]
    d01 = gamma * n[1] - q * b[1]
    d11 = gamma * n[2] - q * b[2]
    c00 = gamma * n[0] + q * b[0]
    c01 = gamma * n[1] + q * b[1]
    c11 = gamma * n[2] + q * b[2]
    inverse = 1.0 / max(s00 * s11 - s01 * s01, DETERMINANT_MIN)
    det1 = (d00 * s11 + s00 * d11 - 2.0 * s01 * d01) * inverse
    det2 = (c00 * s11 + s00 * c11 - 2.0 * s01 * c01 + 2.0 * (d00 * d11 - d01 * d01)) * inverse
    # φ = tr M adj(S) / det S, with both derivatives.
    top = (m[0] * s11 - 2.0 * m[1] * s01 + m[2] * s00) * inverse
    top1 = (m[0] * d11 - 2.0 * m[1] * d01 + m[2] * d00) * inverse
    top2 = (m[0] * c11 - 2.0 * m[1] * c01 + m[2] * c00) * inverse
    phi1 = top1 - top * det1
    phi2 = top2 - 2.0 * phi1 * det1 - top * det2
    first = gamma * trace - g * (2.0 * gamma * top + g * phi1)
    second = gamma * trace - 2.0 * gamma * (g + gamma) * top - 4.0 * g * gamma * phi1 - g * g * phi2
    return first, second


@in_loop
def one_component(trace: float, m: float, n: float, b: float, w: float) -> float:
    """Return approximately the best γ of one component alone, for small γ; 0 without a spread."""
    spread = n + b + w
    gamma = 0.0
    if trace > 0.0 and spread > 0.0:
        gamma = (sqrt(max(0.0, m * b / trace)) - b) / spread
    return gamma


@kernel
def best_gamma(trace: float, m: Triple, n: Triple, b: Triple, w: Triple) -> float:
    """Return the γ with the least F, to 1e-6 of it; 0 when no γ improves the bound (then K = 0).

    Where F is less than 2e-5 of the trace, differences of nearly equal numbers leave less.
    """
    start = max(
        one_component(trace, m[0], n[0], b[0], w[0]), one_component(trace, m[2], n[2], b[2], w[2])
    )
    gamma = GAMMA_MIN
    if start > GAMMA_MIN:
        gamma = min(start, GAMMA_MAX)
    t = log(gamma)
    low = LOG_MIN
    high = LOG_MAX
    for _ in range(ROUNDS_MAX):
        first, second = slopes(gamma, trace, m, n, b, w)
        # A limit that has been evaluated is excluded from the bracket.
        if first > 0.0:
            high = min(t, LOG_MAX - STEP_LAST)
        else:
            low = max(t, LOG_MIN + STEP_LAST)
        if low >= high:
            break  # The minimum is at a limit.
        step = STEP_MAX if first < 0.0 else -STEP_MAX
        if abs(first) < STEP_MAX * second:
            step = -first / second
        # A step out of the bracket goes to its limit, or to its middle if the limit was evaluated.
        if t + step <= low:
            step = (low if low == LOG_MIN else 0.5 * (low + high)) - t
        elif t + step >= high:
            step = (high if high == LOG_MAX else 0.5 * (low + high)) - t
        t += step
        gamma = exp(t)
        if abs(step) < STEP_LAST:
            break
    return gamma if scaled_trace(gamma, trace, m, n, b, w) < trace else 0.0
