"""Straight flight with white acceleration, propagated by matrices, for one track."""

import numpy as np
from numpy.typing import NDArray

from support.references.constant_velocity import process_noise, transition


def forecast(
    mean: NDArray[np.float64],
    covariance: NDArray[np.float64],
    acceleration_density: float | NDArray[np.float64],
    ahead_s: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Propagate a state of constant velocity with white acceleration.

    Parameters
    ----------
    mean : (4,) ndarray
        East and north, m, and their rates, m/s.
    covariance : (4, 4) ndarray
        Covariance of `mean`.
    acceleration_density : float or (2, 2) ndarray
        Spectral density of the acceleration, m²/s³: q of each axis, or that of east and north.
    ahead_s : (k,) ndarray
        Times after the state, s, not negative.

    Returns
    -------
    means : (k, 4) ndarray
        Expected states.
    covariances : (k, 4, 4) ndarray
        Their covariances, symmetric.

    Raises
    ------
    ValueError
        If a time is negative or not finite.

    Notes
    -----
    Exact for the continuous white-noise acceleration model. A manoeuvre that begins after the state
    is covered only as far as q covers it.
    """
    ahead = np.asarray(ahead_s, np.float64)
    wrong = ahead[~((ahead >= 0.0) & np.isfinite(ahead))]
    if len(wrong):
        raise ValueError(f"expected times that are finite and not negative, was {wrong[0]} s")
    move = transition(ahead)
    density = np.asarray(acceleration_density) * np.eye(2)
    if np.ndim(acceleration_density) == 2:
        density = np.asarray(acceleration_density)
    # Each block of the noise is that of one axis times the density of both.
    unit = process_noise(ahead, 1.0)[:, ::2, ::2]
    noise = np.einsum("kab,ij->kaibj", unit, density).reshape(-1, 4, 4)
    covariances = move @ covariance @ move.transpose(0, 2, 1) + noise
    return move @ mean, 0.5 * (covariances + covariances.transpose(0, 2, 1))
