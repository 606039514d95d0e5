"""Compiled initiation of an aircraft at one measurement.

Symbols as in `_kernels`.

References
----------
The project's own: the limit of an uninformative prior of the position.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    BIASES_AS_NOISE,
    BIASES_KEPT,
    CONE,
    CONE_RATIO,
    SINGULAR,
    SLOPE_DETERMINANT_MIN,
    SPEED_SIGMA,
    STARTED,
    UNLOCATABLE,
    VALUE_MAX,
)
from multiradar.estimation.filters.arrays import Model, Sight
from multiradar.estimation.measurement._kernels import (
    bias_column,
    locate_measurement,
    predict_measurement,
)
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]


@kernel
def start_aircraft(
    mode: int, sight: Sight, s: int, model: Model, a: Floats, P: Floats, V: Floats, H: Floats,
    W: Floats,
) -> int:  # fmt: skip
    """Initiate an aircraft at a measurement: the limit of an uninformative prior of position.

    ``mode`` selects the treatment of the biases: `BIASES_KEPT` in V (two-stage), `BIASES_KNOWN`
    (Blom) or `BIASES_AS_NOISE` (covariance intersection). Returns the outcome of the measurement;
    a, P, V change only when it is `STARTED`; H and W are scratch.
    """
    kind, z0, z1, height, height_variance = sight
    plane, parameters, bias = model.plane, model.parameters, model.bias
    bias_covariance, options = model.bias_covariance, model.options
    site, noise = model.sites[s], model.noises[s]
    first, last = model.starts[s], model.starts[s + 1]
    b0 = 0.0
    b1 = 0.0
    for c in range(first, last):
        j0, j1 = bias_column(kind, parameters[c], site, z0, z1, 0.0, 0.0)
        b0 += j0 * bias[c]
        b1 += j1 * bias[c]
    ok, east, north = locate_measurement(kind, plane, site, z0 - b0, z1 - b1, height)
    if not (ok and abs(east) < VALUE_MAX and abs(north) < VALUE_MAX):  # NaN too
        return UNLOCATABLE
    p0, p1, ground = predict_measurement(
        kind, plane, site, noise, east, north, height, height_variance, H, W
    )
    if ground < options[CONE_RATIO] * (height - noise[3]):
        return CONE
    det = H[0, 0] * H[1, 1] - H[0, 1] * H[1, 0]
    if not abs(det) > SLOPE_DETERMINANT_MIN:
        return SINGULAR
    i00 = H[1, 1] / det
    i01 = -H[0, 1] / det
    i10 = -H[1, 0] / det
    i11 = H[0, 0] / det
    b00 = W[0]
    b01 = W[1]
    b11 = W[2]
    for c in range(first, last if mode == BIASES_AS_NOISE else first):
        j0, j1 = bias_column(kind, parameters[c], site, p0, p1, 0.0, 0.0)
        for d in range(first, last):
            k0, k1 = bias_column(kind, parameters[d], site, p0, p1, 0.0, 0.0)
            b00 += j0 * bias_covariance[c, d] * k0
            b01 += 0.5 * (j0 * k1 + j1 * k0) * bias_covariance[c, d]
            b11 += j1 * bias_covariance[c, d] * k1
    p00 = i00 * i00 * b00 + 2.0 * i00 * i01 * b01 + i01 * i01 * b11
    p01 = i00 * i10 * b00 + (i00 * i11 + i01 * i10) * b01 + i01 * i11 * b11
    p11 = i10 * i10 * b00 + 2.0 * i10 * i11 * b01 + i11 * i11 * b11
    if not np.isfinite(p00 + p11):
        return SINGULAR
    a[0] = east
    a[1] = north
    a[2] = 0.0
    a[3] = 0.0
    for i in range(4):
        for c in range(V.shape[1]):
            V[i, c] = 0.0
    for c in range(first, last if mode == BIASES_KEPT else first):
        j0, j1 = bias_column(kind, parameters[c], site, p0, p1, 0.0, 0.0)
        V[0, c] = -(i00 * j0 + i01 * j1)
        V[1, c] = -(i10 * j0 + i11 * j1)
        a[0] -= V[0, c] * bias[c]
        a[1] -= V[1, c] * bias[c]
    P[:] = 0.0
    P[0] = p00
    P[1] = p01
    P[4] = p11
    P[7] = options[SPEED_SIGMA] * options[SPEED_SIGMA]
    P[9] = P[7]
    return STARTED
