"""Where a track is expected to be: the state propagated with its covariance."""

import numpy as np
from numpy.typing import NDArray


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

    References
    ----------
    Bar-Shalom, Li, Kirubarajan: Estimation with Applications to Tracking and Navigation (2001),
    eqs. (6.2.2-4) and (6.2.2-9).
    """
    ahead = np.asarray(ahead_s, np.float64)
    if not np.all((ahead >= 0.0) & np.isfinite(ahead)):
        msg = f"expected times that are finite and not negative, was {ahead.min()} s at least"
        raise ValueError(msg)
    identity = np.eye(2)
    transition = np.zeros((len(ahead), 4, 4))
    transition[:] = np.eye(4)
    transition[:, :2, 2:] = ahead[:, None, None] * identity  # eq. (6.2.2-4)
    noise = np.zeros((len(ahead), 4, 4))
    noise[:, :2, :2] = (ahead**3 / 3.0)[:, None, None] * identity  # eq. (6.2.2-9)
    noise[:, :2, 2:] = (ahead**2 / 2.0)[:, None, None] * identity
    noise[:, 2:, :2] = noise[:, :2, 2:]
    noise[:, 2:, 2:] = ahead[:, None, None] * identity
    means = transition @ mean
    covariances = (
        transition @ covariance @ transition.transpose(0, 2, 1) + acceleration_density * noise
    )
    return means, 0.5 * (covariances + covariances.transpose(0, 2, 1))
