"""Compiled probability of a Gaussian mixture inside a circle, and its inverse.

References
----------
The project's own: Green's theorem converts the integral of a Gaussian over a disc into one around
its rim. The integrand is entire and periodic, so that the trapezoid rule converges like exp(−n² s²
/ 2 r²) for n points, the radius r and the smallest sigma s.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, inner_loop, kernel

Floats = NDArray[np.float64]

#: Points around the rim per radius over sigma: an error of 1e-8.
POINTS_PER_RATIO = 6.1
POINTS_MIN = 16.0
#: A Gaussian is negligible beyond this number of sigmas: 1e-9.
REACH = 6.5
#: Accepted error of the probability, and maximum number of steps.
PROBABILITY_ERROR = 1e-9
STEPS_MAX = 60


@kernel
def find_radii(
    weights: Floats, means: Floats, covariances: Floats, probability: float, out_radii: Floats
) -> None:
    """Fill ``out_radii`` with the radii of circles around 0 that contain a probability.

    ``weights`` (n, k), ``means`` (n, k, 2), ``covariances`` (n, k, 3) as s11, s12, s22: of mixtures
    with mean 0 and unit covariance.
    """
    search(weights, means, covariances, probability, out_radii)


@inner_loop
def search(
    weights: Floats, means: Floats, covariances: Floats, probability: float, out_radii: Floats
) -> None:
    """As `find_radii`: Newton steps, with bisection outside of the known bounds."""
    for i in range(weights.shape[0]):
        # E|y|² = 2 bounds the radius (Chebyshev).
        below, above = 0.0, np.sqrt(2.0 / (1.0 - probability))
        r = min(np.sqrt(-2.0 * np.log1p(-probability)), above)
        for _ in range(STEPS_MAX):
            inside, density = 0.0, 0.0
            for j in range(weights.shape[1]):
                p, d = disc(
                    r, means[i, j, 0], means[i, j, 1], covariances[i, j, 0], covariances[i, j, 1],
                    covariances[i, j, 2],
                )  # fmt: skip
                inside += weights[i, j] * p
                density += weights[i, j] * d
            if abs(inside - probability) < PROBABILITY_ERROR:
                break
            if inside < probability:
                below = r
            else:
                above = r
            following = r - (inside - probability) / density if density > 0.0 else below
            r = following if below < following < above else 0.5 * (below + above)
        out_radii[i] = r


@in_loop
def disc(r: float, m1: float, m2: float, s11: float, s12: float, s22: float) -> tuple[float, float]:
    """Return the probability of N(m, S) within r of 0, and its derivative by r."""
    determinant = s11 * s22 - s12 * s12
    trace = s11 + s22
    largest = 0.5 * (trace + np.sqrt((s11 - s22) ** 2 + 4.0 * s12 * s12))
    smallest = determinant / largest
    away, reach = np.sqrt(m1 * m1 + m2 * m2), REACH * np.sqrt(largest)
    inside, density = 0.0, 0.0
    if away + reach <= r:
        inside = 1.0
    elif away - reach < r:
        points = int(max(POINTS_MIN, np.ceil(POINTS_PER_RATIO * r / np.sqrt(smallest))))
        for n in range(points):
            angle = 2.0 * np.pi * n / points
            y1, y2 = r * np.cos(angle), r * np.sin(angle)
            d1, d2 = y1 - m1, y2 - m2
            q = (s22 * d1 * d1 - 2.0 * s12 * d1 * d2 + s11 * d2 * d2) / determinant
            # (1 − exp(−q/2)) / q, which is 1/2 at 0.
            part = -np.expm1(-0.5 * q) / q if q > 1e-12 else 0.5
            inside += part * (d1 * y1 + d2 * y2)
            density += np.exp(-0.5 * q)
        inside /= points * np.sqrt(determinant)
        density *= r / (points * np.sqrt(determinant))
    return inside, density
