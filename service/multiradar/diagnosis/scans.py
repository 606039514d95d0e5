"""The rotation of a radar, from the times and azimuths of its plots.

A rotating antenna points in one direction at a time: for the right period T, azimuth minus
2π t / T is the same for all plots of some scans, regardless of the traffic.
"""

import math
from typing import NamedTuple

import numpy as np

from multiradar.diagnosis.plots import Floats

#: Duration of the windows, s, and minimum number of plots in one; plots used per window, and
#: number of windows.
WINDOW_S, WINDOW_MIN, PLOTS_MAX, WINDOWS_MAX = 48.0, 25, 100, 5
#: Range of the period search, s.
PERIOD_MIN_S, PERIOD_MAX_S = 0.8, 20.0
#: Steps of frequency in the width of a peak, and steps in each of them about the highest one.
_STEPS, _FINE_STEPS = 6.0, 20
#: Minimum coherence of azimuth and time of a rotation (1: exact).
COHERENT_MIN = 0.9
#: Minimum coherence of the plots of two antennas, half width of the directions that count as those
#: of one, rad, and minimum relative difference of their periods: one antenna may have two faces.
MIXED_MIN, MIXED_WITHIN_RAD, PERIODS_APART_MIN = 0.3, 0.3, 0.01


class Rotation(NamedTuple):
    """How a radar rotates.

    Attributes
    ----------
    period_s : float
        Scan period, s; negative when azimuths are counted anticlockwise.
    coherence : float
        Mean length of the sum of unit vectors, from 0 to 1.
    """

    period_s: float
    coherence: float


NOT_SEEN = Rotation(np.nan, 0.0)


def rotation(time_s: Floats, azimuth_rad: Floats) -> Rotation:
    """Return the period of the highest coherence of azimuth and time.

    Parameters
    ----------
    time_s, azimuth_rad : (n,) float64
        Plots of a radar by time.
    """
    windows = windows_of(time_s, azimuth_rad)
    if not windows:
        return NOT_SEEN
    step = 1.0 / (_STEPS * WINDOW_S)
    size = np.arange(1.0 / PERIOD_MAX_S, 1.0 / PERIOD_MIN_S, step)
    frequency = np.concatenate([-size[::-1], size])
    found = np.concatenate([coherences(windows, one) for one in (-size[::-1], size)])
    near = frequency[found.argmax()] + np.linspace(-step, step, 2 * _FINE_STEPS + 1)
    finer = coherences(windows, near)
    return Rotation(1.0 / float(near[finer.argmax()]), float(finer.max()))


def two_rotations(time_s: Floats, azimuth_rad: Floats) -> tuple[Rotation, Rotation, float] | None:
    """Return the rotations of two antennas whose plots are mixed, None where there is one.

    Parameters
    ----------
    time_s, azimuth_rad : (n,) float64
        Plots by time.

    Returns
    -------
    first, second : Rotation
        Of the plots near the direction of the first antenna, and of the others.
    share : float
        Fraction of the plots of the first one.
    """
    both = rotation(time_s, azimuth_rad)
    if not MIXED_MIN <= both.coherence < COHERENT_MIN:
        return None
    turned = np.exp(1j * (azimuth_rad - 2.0 * np.pi * (time_s - time_s[0]) / both.period_s))
    _, number = np.unique(np.floor((time_s - time_s[0]) / WINDOW_S), return_inverse=True)
    sums = np.bincount(number, turned.real) + 1j * np.bincount(number, turned.imag)
    near = np.abs(np.angle(turned * np.conj(sums[number]))) <= MIXED_WITHIN_RAD
    parts = [rotation(time_s[one], azimuth_rad[one]) for one in (near, ~near)]
    apart = abs(parts[0].period_s / parts[1].period_s - 1.0)
    if min(one.coherence for one in parts) < COHERENT_MIN or not apart > PERIODS_APART_MIN:
        return None
    return parts[0], parts[1], float(np.mean(near))


def coherence_at(time_s: Floats, azimuth_rad: Floats, period_s: float) -> float:
    """Return the highest coherence of azimuth and time within 3 % of a period, s."""
    windows = windows_of(time_s, azimuth_rad)
    if not windows:
        return 0.0
    count = max(61, math.ceil(0.06 / period_s * _FINE_STEPS * _STEPS * WINDOW_S))
    return float(coherences(windows, np.linspace(0.97, 1.03, count) / period_s).max())


def coherences(windows: list[tuple[Floats, Floats]], frequency: Floats) -> Floats:
    """Return the coherence at two or more frequencies, 1/s, in equal steps."""
    # Frequencies are the sums of coarse and fine ones, and the exponentials their products: so
    # there are √n exponentials for each plot instead of n.
    size = math.isqrt(len(frequency)) + 1
    coarse, fine = frequency[::size], (frequency[1] - frequency[0]) * np.arange(size)
    total = np.zeros(len(frequency))
    for time_s, azimuth in windows:
        turned = np.exp(1j * (azimuth - 2.0 * np.pi * np.outer(coarse, time_s)))
        further = np.exp(-2j * np.pi * np.outer(fine, time_s))
        sums = np.abs(turned @ further.T).ravel()[: len(frequency)]
        total += sums / len(time_s)
    return total / len(windows)


def windows_of(time_s: Floats, azimuth_rad: Floats) -> list[tuple[Floats, Floats]]:
    """Return the times, from its first one, and azimuths of some windows of a recording."""
    if len(time_s) == 0:
        return []
    number = np.floor((time_s - time_s[0]) / WINDOW_S)
    windows = []
    for one in np.unique(number):
        rows = np.flatnonzero(number == one)
        if len(rows) >= WINDOW_MIN:
            rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), PLOTS_MAX)).astype(np.intp)]
            windows.append((time_s[rows] - time_s[rows[0]], azimuth_rad[rows]))
    chosen = np.unique(np.linspace(0, len(windows) - 1, WINDOWS_MAX).astype(np.intp))
    return [windows[one] for one in chosen] if windows else []
