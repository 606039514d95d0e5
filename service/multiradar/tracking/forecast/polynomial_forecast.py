"""Predicted position by extrapolation of a polynomial in time."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import TrajectoryError
from multiradar.estimation.filters.polynomial.polynomial_filter import estimate, observe, start

Floats = NDArray[np.float64]

#: Degree of the polynomial, and length of its window, s.
DEGREE, WINDOW_S = 2, 30.0
#: Minimum number of plots, and minimum time span, s, to estimate an acceleration.
PLOTS_MIN, SPAN_MIN_S = 4, 12.0
#: Prior standard deviations of position, speed and acceleration, m, m/s, m/s².
PRIOR_SIGMAS = (1e5, 400.0, 1.0)
#: Deviations from the polynomial: density of the white acceleration, m²/s³, and change of the
#: acceleration, m/s².
WANDER, CHANGE_MPS2 = 25.0, 0.7


class PolynomialForecast(NamedTuple):
    """Predicted positions at the requested times.

    Attributes
    ----------
    means : (k, 2) float64
        East and north, m.
    covariances : (k, 2, 2) float64
        Covariances of their errors, m².
    """

    means: Floats
    covariances: Floats


def polynomial_forecast(
    time_s: Floats, position_m: Floats, covariance_m2: Floats, at_s: Floats
) -> PolynomialForecast:
    """Return the predicted position of an aircraft by its last plots.

    Parameters
    ----------
    time_s : (n,) ndarray
        Ascending times of its plots, s; those more than `WINDOW_S` before the last one are ignored.
    position_m : (n, 2) ndarray
        East and north.
    covariance_m2 : (n, 2, 2) ndarray
        Covariances of the errors.
    at_s : (k,) ndarray
        Times, s. Times before the last plot are replaced by its time.

    Returns
    -------
    PolynomialForecast
        Positions at these times.

    Raises
    ------
    TrajectoryError
        `TOO_FEW_PLOTS`: fewer than `PLOTS_MIN`, or within less than `SPAN_MIN_S`.

    References
    ----------
    Koptev, Rozov, Romanovsky, the section on the forecast. Axes are those of the mean covariance,
    in which errors of radars are nearly independent; the deviation from the polynomial is the
    project's own.
    """
    if len(time_s):
        kept = time_s >= time_s[-1] - WINDOW_S
        time_s, position_m, covariance_m2 = time_s[kept], position_m[kept], covariance_m2[kept]
    if len(time_s) < PLOTS_MIN or time_s[-1] - time_s[0] < SPAN_MIN_S:
        raise TrajectoryError(
            "TOO_FEW_PLOTS",
            f"expected at least {PLOTS_MIN} plots spanning {SPAN_MIN_S:g} s within {WINDOW_S:g} "
            f"s, found {len(time_s)} plots",
        )
    last_s = float(time_s[-1])
    ahead_s = np.maximum(at_s - last_s, 0.0)
    axes = np.linalg.eigh(covariance_m2.mean(axis=0))[1]
    along = position_m @ axes
    means, variances = np.empty((len(at_s), 2)), np.empty((len(at_s), 2))
    for axis, unit in enumerate(axes.T):
        prior = np.zeros(DEGREE + 1)
        prior[0] = along[0, axis]
        state = start(DEGREE, prior, np.diag(np.square(PRIOR_SIGMAS)), float(time_s[0]))
        noise = np.einsum("i,kij,j->k", unit, covariance_m2, unit)
        found = estimate(observe(state, time_s, along[:, axis], noise), last_s + ahead_s)
        means[:, axis] = found.value
        left = WANDER * ahead_s**3 / 3.0 + (0.5 * CHANGE_MPS2 * ahead_s**2) ** 2
        variances[:, axis] = found.variance + left
    spread = np.einsum("ij,kj,lj->kil", axes, variances, axes)
    return PolynomialForecast(means @ axes.T, spread)
