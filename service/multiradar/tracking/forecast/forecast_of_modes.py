"""Predicted track positions: states propagated by the motion model of the filter."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.imm._mode_scratch_kernels import LEAVING
from multiradar.estimation.motion.velocity_frame_noise import acceleration_covariance
from multiradar.tracking.forecast._forecast_kernels import forecast_modes
from multiradar.tracking.modes import mode_table
from multiradar.tracking.settings import NOMINAL_INTERVAL_S, VELOCITY_FRAME, TrackingSettings

#: Step of the mode transitions, independent of the requested times, s.
MODE_STEP_S = 2.0
#: Mean durations of straight flight and of a manoeuvre, s. The filter keeps a manoeuvre ten times
#: longer (`imm_manoeuvre_s`), as plots show when it ends. A forecast has no plots, and would extend
#: a turn of a minute into a circle (validation/motion/check_forecasts.py).
STRAIGHT_S = 90.0
MANOEUVRE_S = 60.0


def forecast_of_modes(
    probability: NDArray[np.float64],
    mean: NDArray[np.float64],
    covariance: NDArray[np.float64],
    modes: NDArray[np.float64],
    ahead_s: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Propagate a state with several motion modes.

    Parameters
    ----------
    probability : (j,) ndarray
        Probabilities of the modes.
    mean : (j, 4) ndarray
        State in each mode: east and north, m, and their rates, m/s.
    covariance : (j, 10) ndarray
        Upper triangles of their covariances, row by row.
    modes : (j, MODE_COUNT) ndarray
        Motion and leaving rate of each mode: columns as in
        `estimation.filters._mode_scratch_kernels`.
    ahead_s : (k,) ndarray
        Times after the state, s, not negative, ascending.

    Returns
    -------
    means : (k, 4) ndarray
        Predicted states: means over the modes.
    covariances : (k, 4, 4) ndarray
        Their covariances, including the spread of the modes.

    Raises
    ------
    ValueError
        If a time is negative, not finite, or not ascending.

    Notes
    -----
    Each mode moves with its own motion and noise. Every `MODE_STEP_S` mode transitions take place
    and the modes are mixed, which preserves the first two moments.
    """
    ahead = _checked(ahead_s)
    if np.any(np.diff(ahead) < 0.0):
        raise ValueError(f"ahead_s: expected ascending times, was {ahead.tolist()} s")
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
    """Return the acceleration density of an aircraft without motion modes.

    Parameters
    ----------
    settings : TrackingSettings
        `motion` and its parameters.
    velocity : (2,) ndarray
        East and north, m/s.

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
        `motion` and its parameters.
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
    """Return the motion modes with the transition rates of forecasts.

    Parameters
    ----------
    settings : TrackingSettings
        Settings with the prefix `imm_`.

    Returns
    -------
    (j, MODE_COUNT) ndarray
        As `modes.mode_table`, except for the leaving rates.
    """
    modes = mode_table(settings)
    modes[0, LEAVING] = 1.0 / STRAIGHT_S
    modes[1:, LEAVING] = 1.0 / MANOEUVRE_S
    return modes


def _checked(ahead_s: NDArray[np.float64]) -> NDArray[np.float64]:
    ahead = np.asarray(ahead_s, np.float64)
    wrong = ahead[~((ahead >= 0.0) & np.isfinite(ahead))]
    if len(wrong):
        raise ValueError(f"ahead_s: expected finite times of at least 0 s, was {wrong[0]} s")
    return ahead
