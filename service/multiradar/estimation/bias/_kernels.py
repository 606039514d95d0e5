"""Compiled update of the biases by logged measurements, by covariance intersection.

References
----------
IMM UrO RAN report (2016), equations (1.43) to (1.45) with χ and ς exchanged: the text after (1.46).
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import LOG_BIASES, SENSOR_BIASES_MAX, singular
from multiradar.estimation.filters.separated._intersection_kernels import best_gamma
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@kernel
def fold_biases(
    log: Floats,
    sensors: Integers,
    starts: Integers,
    scales: Floats,
    bias: Floats,
    covariance: Floats,
) -> None:
    """Update the biases by logged measurements one after the other, by covariance intersection.

    (1.43)-(1.45) for ς, with N from the uncertainty of the aircraft. ``scales`` (1/prior variance
    of each parameter) make the minimised trace dimensionless.
    """
    J = np.empty((2, SENSOR_BIASES_MAX))
    F = np.empty((SENSOR_BIASES_MAX, 2))
    for row in range(log.shape[0]):
        if not log[row, 5] > 0.0:
            continue
        s = sensors[row]
        first = starts[s]
        size = starts[s + 1] - first
        if size == 0:
            continue
        e0 = log[row, 0]
        e1 = log[row, 1]
        for c in range(size):
            J[0, c] = log[row, LOG_BIASES + 2 * c]
            J[1, c] = log[row, LOG_BIASES + 2 * c + 1]
            e0 -= J[0, c] * bias[first + c]
            e1 -= J[1, c] * bias[first + c]
        trace = 0.0
        b00 = 0.0
        b01 = 0.0
        b11 = 0.0
        m00 = 0.0
        m01 = 0.0
        m11 = 0.0
        for c in range(size):
            f0 = 0.0
            f1 = 0.0
            for d in range(size):
                p = covariance[first + c, first + d]
                f0 += p * J[0, d]
                f1 += p * J[1, d]
            F[c, 0] = f0
            F[c, 1] = f1
            b00 += J[0, c] * f0
            b01 += J[0, c] * f1
            b11 += J[1, c] * f1
            scale = scales[first + c]
            trace += scale * covariance[first + c, first + c]
            m00 += scale * f0 * f0
            m01 += scale * f0 * f1
            m11 += scale * f1 * f1
        n = (log[row, 2], log[row, 3], log[row, 4])
        w = (log[row, 5], log[row, 6], log[row, 7])
        gamma = best_gamma(trace, (m00, m01, m11), (b00, b01, b11), n, w)
        if gamma == 0.0:
            continue
        g = 1.0 + gamma
        h = 1.0 + 1.0 / gamma
        s00 = g * b00 + h * n[0] + w[0]
        s01 = g * b01 + h * n[1] + w[1]
        s11 = g * b11 + h * n[2] + w[2]
        if singular(s00, s01, s11):
            continue
        det = s00 * s11 - s01 * s01
        for c in range(size):
            k0 = g * (F[c, 0] * s11 - F[c, 1] * s01) / det
            k1 = g * (F[c, 1] * s00 - F[c, 0] * s01) / det
            bias[first + c] += k0 * e0 + k1 * e1
            for d in range(c, size):
                x = g * covariance[first + c, first + d] - g * (k0 * F[d, 0] + k1 * F[d, 1])
                covariance[first + c, first + d] = x
                covariance[first + d, first + c] = x
