"""Where a track is expected to be: the state propagated as its filter takes it to move."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.imm._mode_scratch_kernels import LEAVING
from multiradar.estimation.motion.constant_velocity import process_noise, transition
from multiradar.estimation.motion.velocity_frame_noise import acceleration_covariance
from multiradar.tracking.forecast._forecast_kernels import forecast_modes
from multiradar.tracking.modes import mode_table
from multiradar.tracking.settings import NOMINAL_INTERVAL_S, VELOCITY_FRAME, TrackingSettings

#: Modes pass into each other in steps of this, whatever times are asked for, s.
MODE_STEP_S = 2.0
#: Mean times of straight flight and of a manoeuvre, s. The filter holds on to a manoeuvre ten times
#: longer (`imm_manoeuvre_s`), for its plots tell when it ends; a forecast has none, and would lead
#: a turn of a minute on into a circle (validation/motion/check_forecasts.py).
STRAIGHT_S = 90.0
MANOEUVRE_S = 60.0


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
    ahead = _checked(ahead_s)
    move = transition(ahead)
    density = np.asarray(acceleration_density) * np.eye(2)
    if np.ndim(acceleration_density) == 2:
        density = np.asarray(acceleration_density)
    # Each block of the noise is that of one axis times the density of both.
    unit = process_noise(ahead, 1.0)[:, ::2, ::2]
    noise = np.einsum("kab,ij->kaibj", unit, density).reshape(-1, 4, 4)
    covariances = move @ covariance @ move.transpose(0, 2, 1) + noise
    return move @ mean, 0.5 * (covariances + covariances.transpose(0, 2, 1))


def forecast_of_modes(
    probability: NDArray[np.float64],
    mean: NDArray[np.float64],
    covariance: NDArray[np.float64],
    modes: NDArray[np.float64],
    ahead_s: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Propagate a state that is in one of several modes of motion.

    Parameters
    ----------
    probability : (j,) ndarray
        Probabilities of the modes.
    mean : (j, 4) ndarray
        State in each mode: east and north, m, and their rates, m/s.
    covariance : (j, 10) ndarray
        Upper triangles of their covariances, row by row.
    modes : (j, MODE_COUNT) ndarray
        How each mode moves and how fast it is left: columns as in
        `estimation.filters._mode_scratch_kernels`.
    ahead_s : (k,) ndarray
        Times after the state, s, not negative, ascending.

    Returns
    -------
    means : (k, 4) ndarray
        Expected states: means of the modes.
    covariances : (k, 4, 4) ndarray
        Their covariances, what the modes differ by included.

    Raises
    ------
    ValueError
        If a time is negative, not finite or before the one before it.

    Notes
    -----
    Each mode moves with its own motion and noise; every `MODE_STEP_S` the modes pass into each
    other and are mixed, which keeps the first two moments.
    """
    ahead = _checked(ahead_s)
    if np.any(np.diff(ahead) < 0.0):
        raise ValueError(f"expected ascending times, was {ahead.tolist()} s")
    times = len(ahead)
    means, packed = np.zeros((times, 4)), np.zeros((times, 10))
    forecast_modes(
        ahead, MODE_STEP_S, modes, probability[None].copy(), mean.copy(), covariance.copy(),
        means, packed,
    )  # fmt: skip
    upper = np.triu_indices(4)
    covariances = np.empty((times, 4, 4))
    covariances[:, upper[0], upper[1]] = packed
    covariances[:, upper[1], upper[0]] = packed
    return means, covariances


def density_of(settings: TrackingSettings, velocity: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how an aircraft without modes of motion is taken to accelerate.

    Parameters
    ----------
    settings : TrackingSettings
        `motion` and what belongs to it.
    velocity : (2,) ndarray
        East and north, m/s: a forecast keeps it.

    Returns
    -------
    (2, 2) ndarray
        Spectral density, m²/s³.
    """
    if settings.motion != VELOCITY_FRAME:
        return settings.acceleration_density * np.eye(2)
    return NOMINAL_INTERVAL_S * acceleration_covariance(
        velocity, settings.longitudinal_acceleration_mps2, settings.turn_rate_rad_per_s
    )


def densities_of(
    settings: TrackingSettings, velocities: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return `density_of` for velocities (n, 2), m/s: (n, 2, 2), m²/s³.

    Parameters
    ----------
    settings : TrackingSettings
        `motion` and what belongs to it.
    velocities : (n, 2) ndarray
        East and north, m/s.

    Returns
    -------
    (n, 2, 2) ndarray
        Spectral densities, m²/s³.
    """
    if settings.motion != VELOCITY_FRAME:
        return np.tile(density_of(settings, np.zeros(2)), (len(velocities), 1, 1))
    return np.array([density_of(settings, one) for one in velocities]).reshape(-1, 2, 2)


def forecast_modes_of(settings: TrackingSettings) -> NDArray[np.float64]:
    """Return the modes of motion as forecasts take them to begin and end.

    Parameters
    ----------
    settings : TrackingSettings
        The settings whose names begin with `imm_`.

    Returns
    -------
    (j, MODE_COUNT) ndarray
        As `modes.mode_table`, but for the rates.
    """
    modes = mode_table(settings)
    modes[0, LEAVING] = 1.0 / STRAIGHT_S
    modes[1:, LEAVING] = 1.0 / MANOEUVRE_S
    return modes


def _checked(ahead_s: NDArray[np.float64]) -> NDArray[np.float64]:
    ahead = np.asarray(ahead_s, np.float64)
    wrong = ahead[~((ahead >= 0.0) & np.isfinite(ahead))]
    if len(wrong):
        raise ValueError(f"expected times that are finite and not negative, was {wrong[0]} s")
    return ahead
