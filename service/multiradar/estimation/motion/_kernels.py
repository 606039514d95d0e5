"""Compiled constant-velocity motion; the plain form is `multiradar.estimation.motion`.

A covariance of four components is stored as its upper triangle, row by row: 00 01 02 03 11 12 13 22
23 33. Components: east, north (m), and their rates (m/s).

References
----------
IMM UrO RAN report (2016), equations (1.4) and (1.30); Y. Bar-Shalom, X. R. Li, T. Kirubarajan,
"Estimation with Applications to Tracking and Navigation", Wiley 2001, equation (6.2.2-4).
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import fused, in_loop, kernel
from multiradar_compiled.lane_kernels import Numbers

Floats = NDArray[np.float64]
PackedOf = tuple[
    Numbers, Numbers, Numbers, Numbers, Numbers, Numbers, Numbers, Numbers, Numbers, Numbers
]
DensityOf = tuple[Numbers, Numbers, Numbers]
Packed = PackedOf[float]
Density = DensityOf[float]


@in_loop
def moved_covariance(P: Packed, dt: float, density: Density) -> Packed:
    """Return A P Aᵀ + Q (report, (1.30)).

    ``density`` is that of the white acceleration on the plane, m²/s³: D00 D01 D11. Then Q has the
    blocks D dt³/3, D dt²/2 and D dt; the interval may be split anywhere. Rounding must not make a
    variance negative.
    """
    q00, q01, q11 = density[0] * dt, density[1] * dt, density[2] * dt
    half = 0.5 * dt
    third = dt * dt / 3.0
    return (
        max(0.0, P[0] + dt * (2.0 * P[2] + dt * P[7]) + q00 * third),
        P[1] + dt * (P[3] + P[5] + dt * P[8]) + q01 * third,
        P[2] + dt * P[7] + q00 * half,
        P[3] + dt * P[8] + q01 * half,
        max(0.0, P[4] + dt * (2.0 * P[6] + dt * P[9]) + q11 * third),
        P[5] + dt * P[8] + q01 * half,
        P[6] + dt * P[9] + q11 * half,
        P[7] + q00,
        P[8] + q01,
        P[9] + q11,
    )


@kernel
def predict_motion(a: Floats, P: Floats, V: Floats, dt: float, density: Density) -> None:
    """Predict one aircraft by dt: a ← A a, V ← A V, P ← A P Aᵀ + Q (report, (1.4), (1.30)).

    ``density`` as in `moved_covariance`.
    """
    a[0] += dt * a[2]
    a[1] += dt * a[3]
    for c in range(V.shape[1]):
        V[0, c] += dt * V[2, c]
        V[1, c] += dt * V[3, c]
    old = (P[0], P[1], P[2], P[3], P[4], P[5], P[6], P[7], P[8], P[9])
    moved = moved_covariance(old, dt, density)
    for i in range(10):
        P[i] = moved[i]


@in_loop
def move_aircraft(
    means: Floats, covariances: Floats, sensitivities: Floats, k: int, dt: float, density: Density
) -> None:
    """Do as `predict_motion` for aircraft k.

    Whole arrays and an index: reference counting of a row view costs as much as the arithmetic.
    """
    means[k, 0] += dt * means[k, 2]
    means[k, 1] += dt * means[k, 3]
    for c in range(sensitivities.shape[2]):
        sensitivities[k, 0, c] = fused(dt, sensitivities[k, 2, c], sensitivities[k, 0, c])
    for c in range(sensitivities.shape[2]):
        sensitivities[k, 1, c] = fused(dt, sensitivities[k, 3, c], sensitivities[k, 1, c])
    store_covariance(covariances, k, moved_covariance(load_covariance(covariances, k), dt, density))


@in_loop
def load_covariance(covariances: Floats, k: int) -> Packed:
    """Return the covariance of aircraft k."""
    return (
        covariances[k, 0],
        covariances[k, 1],
        covariances[k, 2],
        covariances[k, 3],
        covariances[k, 4],
        covariances[k, 5],
        covariances[k, 6],
        covariances[k, 7],
        covariances[k, 8],
        covariances[k, 9],
    )


@in_loop
def store_covariance(covariances: Floats, k: int, P: Packed) -> None:
    """Set the covariance of aircraft k."""
    covariances[k, 0] = P[0]
    covariances[k, 1] = P[1]
    covariances[k, 2] = P[2]
    covariances[k, 3] = P[3]
    covariances[k, 4] = P[4]
    covariances[k, 5] = P[5]
    covariances[k, 6] = P[6]
    covariances[k, 7] = P[7]
    covariances[k, 8] = P[8]
    covariances[k, 9] = P[9]
