"""Heights of live tracks with their vertical rates, as estimated by the height filter."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.estimation.filters.arrays import Aircraft
from multiradar.estimation.filters.height._height_kernels import (
    BY_HEIGHT,
    CLIMB_DENSITY,
    COUNT,
    GUESS_VARIANCE,
    P01,
    P11,
    RATE,
    RATE_SIGMA_MPS,
    SOURCE,
    height_variance,
)

#: Columns: height, m, and its rate, m/s; their covariance, upper triangle; kind of height.
CLIMB_HEIGHT, CLIMB_RATE, CLIMB_VARIANCE, CLIMB_COMMON, CLIMB_RATE_VARIANCE, CLIMB_KIND = range(6)
CLIMB_COUNT = 6

Floats = NDArray[np.float64]


def climbs(aircraft: Aircraft, slots: NDArray[np.intp]) -> Floats:
    """Return the heights of aircraft and their rates.

    Parameters
    ----------
    aircraft : Aircraft
        The aircraft.
    slots : (n,) int
        Their slots.

    Returns
    -------
    (n, CLIMB_COUNT) ndarray
        At the times of their states; NaN without a received height. The variance of a height
        includes the lasting part of its quantisation error. The rate of exact heights is not
        estimated: it is zero, with the initial variance.
    """
    vertical = aircraft.vertical[slots]
    found = np.empty((len(slots), CLIMB_COUNT))
    found[:, CLIMB_HEIGHT] = aircraft.height[slots]
    found[:, CLIMB_RATE] = vertical[:, RATE]
    found[:, CLIMB_VARIANCE] = [height_variance(slot, aircraft.vertical) for slot in slots]
    found[:, CLIMB_COMMON] = vertical[:, P01]
    estimated = vertical[:, COUNT] != 0.0
    found[:, CLIMB_RATE_VARIANCE] = np.where(estimated, vertical[:, P11], RATE_SIGMA_MPS**2)
    found[:, CLIMB_KIND] = vertical[:, SOURCE]
    found[np.isnan(found[:, CLIMB_HEIGHT])] = np.nan
    return found


def spread_of_heights(aircraft: Aircraft, slots: NDArray[np.intp]) -> Floats:
    """Return the covariance that an unknown height adds to states: v p vᵀ.

    Parameters
    ----------
    aircraft : Aircraft
        The aircraft.
    slots : (n,) int
        Their slots.

    Returns
    -------
    (n, 4, 4) ndarray
        Part of their covariances, zero for aircraft with a received height.
    """
    by_height = aircraft.vertical[slots, BY_HEIGHT : BY_HEIGHT + 4]
    variance = np.where(
        np.isnan(aircraft.height[slots]), aircraft.vertical[slots, GUESS_VARIANCE], 0.0
    )
    spread: Floats = by_height[:, :, None] * by_height[:, None, :] * variance[:, None, None]
    return spread


def moved_climbs(states: Floats, ahead_s: Floats) -> Floats:
    """Return heights and rates at later times.

    Parameters
    ----------
    states : (n, CLIMB_COUNT) ndarray
        As `climbs`.
    ahead_s : (n,) ndarray
        Times after the states, s, not negative.

    Returns
    -------
    (n, CLIMB_COUNT) ndarray
        The same, predicted with a white vertical acceleration.
    """
    moved = states.copy()
    rate_variance = states[:, CLIMB_RATE_VARIANCE]
    noise = CLIMB_DENSITY * ahead_s
    moved[:, CLIMB_HEIGHT] += ahead_s * states[:, CLIMB_RATE]
    covariance = states[:, CLIMB_VARIANCE : CLIMB_RATE_VARIANCE + 1]
    moved[:, CLIMB_VARIANCE] = later_variance(covariance, CLIMB_DENSITY, ahead_s)
    moved[:, CLIMB_COMMON] += ahead_s * (rate_variance + 0.5 * noise)
    moved[:, CLIMB_RATE_VARIANCE] += noise
    return moved


def later_variance(covariance: Floats, density: ArrayLike, ahead_s: Floats) -> Floats:
    """Return the variances of heights after a time.

    Parameters
    ----------
    covariance : (n, 3) ndarray
        Of height and rate at the start, upper triangle: m², m²/s, m²/s².
    density : array_like
        Of the white vertical acceleration, m²/s³: one for all, or (n,).
    ahead_s : (n,) ndarray
        The times, s.

    Returns
    -------
    (n,) ndarray
        Variances, m².
    """
    variance, common, rate_variance = covariance.T
    noise = np.asarray(density, np.float64) * ahead_s
    later: Floats = variance + ahead_s * (2.0 * common + ahead_s * (rate_variance + noise / 3.0))
    return later
