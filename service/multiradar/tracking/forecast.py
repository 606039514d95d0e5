"""Where a track is expected to be: the state propagated with its covariance."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.motion.constant_velocity import process_noise, transition


def forecast(
    mean: NDArray[np.float64],
    covariance: NDArray[np.float64],
    acceleration_density: float,
    ahead_s: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Propagate a state of constant velocity with white acceleration.

    Parameters
    ----------
    mean : (4,) ndarray
        East and north, m, and their rates, m/s.
    covariance : (4, 4) ndarray
        Covariance of `mean`.
    acceleration_density : float
        Spectral density q of the acceleration of each axis, m²/s³.
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
    noise = process_noise(ahead, acceleration_density)
    covariances = move @ covariance @ move.transpose(0, 2, 1) + noise
    return move @ mean, 0.5 * (covariances + covariances.transpose(0, 2, 1))
