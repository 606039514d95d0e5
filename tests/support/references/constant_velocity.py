"""Constant velocity, disturbed by white acceleration.

The state of an aircraft on the system plane is ordered (east, north, velocity east, velocity
north), m and m/s.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import TimeOrderError
from multiradar.estimation.array_checks import require_numbers
from multiradar.estimation.motion.inputs import require_not_negative

STATE_SIZE = 4


def transition(interval_s: ArrayLike) -> NDArray[np.float64]:
    """Return the transition matrix over an interval, equation (1.4).

    Parameters
    ----------
    interval_s : (...) array_like
        Time from the old state to the new, s; negative for the past.

    Returns
    -------
    (..., 4, 4) ndarray
        A: position changes by velocity × interval, velocity is constant.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.4).
    """
    interval = require_numbers(interval_s, "prediction interval")
    result = np.zeros((*interval.shape, STATE_SIZE, STATE_SIZE))
    result[...] = np.eye(STATE_SIZE)
    result[..., 0, 2] = interval  # (1.4)
    result[..., 1, 3] = interval
    return result


def process_noise(interval_s: ArrayLike, acceleration_density: float) -> NDArray[np.float64]:
    """Return the covariance that white acceleration adds over an interval.

    Parameters
    ----------
    interval_s : (...) array_like
        Length of the interval, s, not negative.
    acceleration_density : float
        Spectral density of the acceleration for each axis, m²/s³: the variance of the velocity
        after one second.

    Returns
    -------
    (..., 4, 4) ndarray
        B V Bᵀ of equation (1.25): m², m²/s and (m/s)².

    Raises
    ------
    TimeOrderError
        If an interval is negative or NaN.
    MotionParameterError
        If the density is negative, NaN or unreasonably large.
    ShapeError
        If they are not numeric.

    Notes
    -----
    Exact for any interval: the integral of A(s) q Aᵀ(s), so that two successive intervals are
    equivalent to their sum, Q(s + t) = A(t) Q(s) Aᵀ(t) + Q(t). A piecewise constant acceleration,
    with the terms dt⁴/4, dt³/2 and dt², does not have this property: the result would depend on the
    number of plots per second.

    References
    ----------
    Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
    Navigation", Wiley 2001, equation (6.2.2-4).
    """
    interval = require_numbers(interval_s, "prediction interval")
    if not (interval >= 0.0).all():
        raise TimeOrderError("prediction interval", float(interval.min()), 0.0)
    require_not_negative(acceleration_density, "acceleration density")
    result = np.zeros((*interval.shape, STATE_SIZE, STATE_SIZE))
    for axis in (0, 1):
        result[..., axis, axis] = acceleration_density * interval**3 / 3.0  # (6.2.2-4)
        result[..., axis, axis + 2] = acceleration_density * interval**2 / 2.0
        result[..., axis + 2, axis] = result[..., axis, axis + 2]
        result[..., axis + 2, axis + 2] = acceleration_density * interval
    return result
