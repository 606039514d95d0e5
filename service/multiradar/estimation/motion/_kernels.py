"""Compiled constant-velocity motion; the plain form is `multiradar.estimation.motion`.

A covariance of four components is kept as its upper triangle, row by row: 00 01 02 03 11 12 13 22
23 33. Components: east, north (m), and their rates (m/s).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def predict_motion(a: Floats, P: Floats, V: Floats, dt: float, q: float) -> None:
    """Move one aircraft on by dt: a ← A a, V ← A V, P ← A P Aᵀ + Q (report, (1.4), (1.30))."""
    a[0] += dt * a[2]
    a[1] += dt * a[3]
    for c in range(V.shape[1]):
        V[0, c] += dt * V[2, c]
        V[1, c] += dt * V[3, c]
    qdt = q * dt
    P[0] += dt * (2.0 * P[2] + dt * P[7]) + qdt * dt * dt / 3.0
    P[1] += dt * (P[3] + P[5] + dt * P[8])
    P[2] += dt * P[7] + 0.5 * qdt * dt
    P[3] += dt * P[8]
    P[4] += dt * (2.0 * P[6] + dt * P[9]) + qdt * dt * dt / 3.0
    P[5] += dt * P[8]
    P[6] += dt * P[9] + 0.5 * qdt * dt
    P[7] += qdt
    P[9] += qdt
