"""Predicted position of an aircraft with a random-walk heading.

References
----------
Taylor, G. I., "Diffusion by continuous movements", Proceedings of the London Mathematical Society
s2-20 (1922), 196-212: dispersion with a correlated velocity. The project's own: the moments along
and across the first heading, at constant speed.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def propagate_random_walk(
    mean: Floats, covariance: Floats, turning_per_s: float, density: float, ahead_s: Floats
) -> tuple[Floats, Floats]:
    """Propagate positions of aircraft with constant speed and random-walk heading.

    Parameters
    ----------
    mean : (n, 4) ndarray
        East and north, m, and their rates, m/s.
    covariance : (n, 4, 4) ndarray
        Covariances of `mean`.
    turning_per_s : float
        Fading rate of the mean velocity, above 0, 1/s: half the variance of the heading change per
        second, rad²/s.
    density : float
        Spectral density of additional white acceleration, m²/s³.
    ahead_s : (k,) or (n, k) ndarray
        Times after the states, s, not negative; the same for all, or those of each.

    Returns
    -------
    means : (n, k, 2) ndarray
        Predicted positions.
    covariances : (n, k, 2, 2) ndarray
        Their covariances.

    Notes
    -----
    The first two moments are exact for a known velocity; the covariance of the velocity is
    propagated over the same displacement.
    """
    a, t = turning_per_s, np.asarray(ahead_s, np.float64)
    # Displacement of the mean for unit velocity; then E|r|² and E(along² − across²).
    effective_s = -np.expm1(-a * t) / a
    whole = 2.0 * (t - effective_s) / a
    apart = 2.0 / (3.0 * a) * (effective_s + np.expm1(-4.0 * a * t) / (4.0 * a))
    along = np.maximum(0.5 * (whole + apart) - effective_s**2, 0.0)
    across = np.maximum(0.5 * (whole - apart), 0.0)
    velocity = mean[:, 2:]
    forward = velocity[:, :, None] * velocity[:, None, :]
    left = np.stack([-velocity[:, 1], velocity[:, 0]], axis=-1)
    sideward = left[:, :, None] * left[:, None, :]
    means = mean[:, None, :2] + velocity[:, None] * effective_s[..., None]
    known = propagated_covariance(covariance, effective_s)
    noise = density * t**3 / 3.0
    return means, (
        known
        + forward[:, None] * along[..., None, None]
        + sideward[:, None] * across[..., None, None]
        + noise[..., None, None] * np.eye(2)
    )


def propagate_straight(
    mean: Floats, covariance: Floats, densities: Floats, ahead_s: Floats
) -> tuple[Floats, Floats]:
    """Propagate positions of aircraft with constant velocity and white acceleration.

    Parameters
    ----------
    mean : (n, 4) ndarray
        East and north, m, and their rates, m/s.
    covariance : (n, 4, 4) ndarray
        Covariances of `mean`.
    densities : (n, 2, 2) ndarray
        Spectral densities of the accelerations, m²/s³.
    ahead_s : (k,) or (n, k) ndarray
        Times after the states, s, not negative; the same for all, or those of each.

    Returns
    -------
    means : (n, k, 2) ndarray
        Predicted positions.
    covariances : (n, k, 2, 2) ndarray
        Their covariances.
    """
    t = np.asarray(ahead_s, np.float64)
    means = mean[:, None, :2] + mean[:, None, 2:] * t[..., None]
    noise = densities[:, None] * (t**3 / 3.0)[..., None, None]
    return means, propagated_covariance(covariance, t) + noise


def propagated_covariance(covariance: Floats, effective_s: Floats) -> Floats:
    """Return covariances of position + effective_s · velocity.

    Parameters
    ----------
    covariance : (n, 4, 4) ndarray
        Covariances of positions and velocities.
    effective_s : (k,) or (n, k) ndarray
        Times, s.

    Returns
    -------
    (n, k, 2, 2) ndarray
        m².
    """
    position, cross, rate = covariance[:, :2, :2], covariance[:, :2, 2:], covariance[:, 2:, 2:]
    both = cross + cross.swapaxes(-1, -2)
    w = effective_s[..., None, None]
    return np.asarray(position[:, None] + w * both[:, None] + w * w * rate[:, None])
