"""Where an aircraft will be whose heading walks at random: straight at first, anywhere in the end.

References
----------
Taylor, G. I., "Diffusion by continuous movements", Proceedings of the London Mathematical Society
s2-20 (1922), 196-212: the spread of what moves with a correlated velocity. The project's own: the
moments along and across the first heading, at constant speed.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def walked(
    mean: Floats, covariance: Floats, turning_per_s: float, density: float, ahead_s: Floats
) -> tuple[Floats, Floats]:
    """Propagate positions of aircraft at constant speed whose heading walks at random.

    Parameters
    ----------
    mean : (n, 4) ndarray
        East and north, m, and their rates, m/s.
    covariance : (n, 4, 4) ndarray
        Covariances of `mean`.
    turning_per_s : float
        Rate at which the expected velocity fades, above 0, 1/s: half the variance by which the
        heading walks in a second, rad²/s.
    density : float
        Spectral density of white acceleration beside it, m²/s³.
    ahead_s : (k,) or (n, k) ndarray
        Times after the states, s, not negative; the same for all, or those of each.

    Returns
    -------
    means : (n, k, 2) ndarray
        Expected positions.
    covariances : (n, k, 2, 2) ndarray
        Their covariances.

    Notes
    -----
    The first two moments are exact for a known velocity; that of the velocity is carried on as far
    as the expected velocity goes.
    """
    a, t = turning_per_s, np.asarray(ahead_s, np.float64)
    # Way of the mean for a velocity of 1; then E|r|² and E(along² − across²).
    way = -np.expm1(-a * t) / a
    whole = 2.0 * (t - way) / a
    apart = 2.0 / (3.0 * a) * (way + np.expm1(-4.0 * a * t) / (4.0 * a))
    along = np.maximum(0.5 * (whole + apart) - way**2, 0.0)
    across = np.maximum(0.5 * (whole - apart), 0.0)
    velocity = mean[:, 2:]
    forward = velocity[:, :, None] * velocity[:, None, :]
    left = np.stack([-velocity[:, 1], velocity[:, 0]], axis=-1)
    sideward = left[:, :, None] * left[:, None, :]
    means = mean[:, None, :2] + velocity[:, None] * way[..., None]
    known = carried(covariance, way)
    noise = density * t**3 / 3.0
    return means, (
        known
        + forward[:, None] * along[..., None, None]
        + sideward[:, None] * across[..., None, None]
        + noise[..., None, None] * np.eye(2)
    )


def straight_on(
    mean: Floats, covariance: Floats, densities: Floats, ahead_s: Floats
) -> tuple[Floats, Floats]:
    """Propagate positions of aircraft that keep their velocity, but for white acceleration.

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
        Expected positions.
    covariances : (n, k, 2, 2) ndarray
        Their covariances: the positions of `forecast.forecast`, for many aircraft at once.
    """
    t = np.asarray(ahead_s, np.float64)
    means = mean[:, None, :2] + mean[:, None, 2:] * t[..., None]
    noise = densities[:, None] * (t**3 / 3.0)[..., None, None]
    return means, carried(covariance, t) + noise


def carried(covariance: Floats, way: Floats) -> Floats:
    """Return covariances of position + way · velocity.

    Parameters
    ----------
    covariance : (n, 4, 4) ndarray
        Covariances of positions and velocities.
    way : (k,) or (n, k) ndarray
        Times, s.

    Returns
    -------
    (n, k, 2, 2) ndarray
        m².
    """
    place, cross, rate = covariance[:, :2, :2], covariance[:, :2, 2:], covariance[:, 2:, 2:]
    both = cross + cross.swapaxes(-1, -2)
    w = way[..., None, None]
    return np.asarray(place[:, None] + w * both[:, None] + w * w * rate[:, None])
