"""Compiled positions of radar plots with heights, and their covariances.

Symbols: e, n, h = east and north of the foot and height; D = derivative of (e, n) by range and
azimuth, d = by the height, at the range and azimuth measured; r, a = variances of range and
azimuth, v = of the height. The covariance of (e, n) is D diag(r, a) Dᵀ + v d dᵀ, that with the
height v d.

References
----------
The derivatives are those of `multiradar.geodesy._kernels.predict_polar`; by the height they are the
project's own.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.geodesy._kernels import locate_polar, predict_polar
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]

# Step of the height for its derivative, m: the range is nonlinear by 1e-4 m over it at 1 km.
HEIGHT_STEP_M = 1.0


@kernel
def locate_polar_plot(
    plane: Floats,
    site: Floats,
    measured: Floats,
    variances: Floats,
    position: Floats,
    covariance: Floats,
) -> float:
    """Fill position and covariance of a plot (range, azimuth, height); return its ground range.

    The ground range is NaN if the plot has no position.
    """
    ok, e, n = locate_polar(plane, site, measured[0], measured[1], measured[2])
    if not ok:
        return np.nan
    h = measured[2]
    _, _, r_e, r_n, a_e, a_n, ground = predict_polar(plane, site, e, n, h)
    above_r, above_a, _, _, _, _, _ = predict_polar(plane, site, e, n, h + HEIGHT_STEP_M)
    below_r, below_a, _, _, _, _, _ = predict_polar(plane, site, e, n, h - HEIGHT_STEP_M)
    determinant = r_e * a_n - r_n * a_e
    if not abs(determinant) > 0.0:
        return np.nan
    r_h = (above_r - below_r) / (2.0 * HEIGHT_STEP_M)
    a_h = (above_a - below_a) / (2.0 * HEIGHT_STEP_M)
    e_r, e_a = a_n / determinant, -r_n / determinant
    n_r, n_a = -a_e / determinant, r_e / determinant
    e_h = -(e_r * r_h + e_a * a_h)
    n_h = -(n_r * r_h + n_a * a_h)
    r, a, v = variances[0], variances[1], variances[2]
    position[0], position[1], position[2] = e, n, h
    covariance[0, 0] = e_r * e_r * r + e_a * e_a * a + e_h * e_h * v
    covariance[0, 1] = e_r * n_r * r + e_a * n_a * a + e_h * n_h * v
    covariance[1, 1] = n_r * n_r * r + n_a * n_a * a + n_h * n_h * v
    covariance[0, 2] = e_h * v
    covariance[1, 2] = n_h * v
    covariance[2, 2] = v
    covariance[1, 0] = covariance[0, 1]
    covariance[2, 0] = covariance[0, 2]
    covariance[2, 1] = covariance[1, 2]
    return float(ground)
