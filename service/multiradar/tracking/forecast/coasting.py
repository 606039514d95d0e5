"""Uncertainty of a track between its last update and a later time."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def coasted_variances(
    sigma_m: Floats, velocity_sigma_mps: Floats, density: float, age_s: Floats
) -> Floats:
    """Return the variances of positions extrapolated at constant velocity.

    Parameters
    ----------
    sigma_m : (n, 2) ndarray
        Sigmas of the position along two orthogonal axes at the last update, m.
    velocity_sigma_mps : (n,) ndarray
        Square root of the trace of the covariance of the velocity, m/s.
    density : float
        Spectral density of the acceleration on each axis, m²/s³.
    age_s : (n,) ndarray
        Times since the last update, s, not negative.

    Returns
    -------
    (n, 2) ndarray
        Variances along the same axes, m².

    Notes
    -----
    The correlation of the errors of position and velocity is not retained: it is assumed to be the
    worst, so their sigmas add up. The white acceleration stands for small changes of course and
    speed; a turn that begins after the last update is not covered.
    """
    moved = (velocity_sigma_mps / np.sqrt(2.0) * age_s)[:, None]
    noise = (density * age_s**3 / 3.0)[:, None]
    return np.asarray((sigma_m + moved) ** 2 + noise)
