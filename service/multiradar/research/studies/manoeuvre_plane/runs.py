"""The Monte Carlo simulation of the manoeuvre-plane study: circles, helices, and their noise.

References
----------
Korobochkin, the section on the example: a circle in the plane OXZ, flown at 500 m/s, its centre
5 km away at an elevation of 45°, observed for 10 s at 100 Hz with errors of 25 m on each axis. The
radius is not published.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

from multiradar.errors import PlaneError
from multiradar.restoration.geometry.manoeuvre_plane import (
    ManoeuvrePlane,
    fit_plane,
    fit_proportional,
)

Floats = NDArray[np.float64]

SPEED_MPS = 500.0
CENTRE_M = 5000.0 * np.array([np.cos(np.pi / 4.0), 0.0, np.sin(np.pi / 4.0)])
NORMAL = np.array([0.0, 1.0, 0.0])
VARIANCE_M2 = 625.0
RATE_HZ = 100.0
#: Start of the algorithm, and evaluation times, s.
TIMES_S = (2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0)
#: Radii of the circle, m; the first is that of the figures.
RADII_M = (1500.0, 1000.0, 2000.0)
#: Speeds along the normal, m/s: above 0 the circle is a helix.
CLIMBS_MPS = (0.0, 2.0, 5.0, 10.0, 20.0, 50.0)
#: Radii of the helices, m: in 10 s slightly more than half a turn, and four fifths of one.
HELIX_RADII_M = (1500.0, 1000.0)
#: Published values of figures 3 and 4 at the end.
PUBLISHED = {"normal_error_mrad": 1.4, "distance_error_m": 2.0}
#: Probability of the band of a fraction.
BAND = 0.999

# Errors along the axes of a source, m, and the azimuths of the lines of sight of two, degrees.
_ACROSS_SIGMA_M = (10.0, 40.0, 20.0)
_AZIMUTHS_DEG = (20.0, 110.0)


class Case(NamedTuple):
    """A flight and its measurement.

    Attributes
    ----------
    source : str
        `one source` (the paper's noise), `proportional` (three sources of one direction, with
        sigmas as 1, 2 and 3) or `two directions` (covariances that are not proportional).
    radius_m, climb_mps : float
        Radius of the circle, and speed along its axis.
    """

    source: str
    radius_m: float
    climb_mps: float


SOURCES = ("one source", "proportional", "two directions")


@dataclass(frozen=True, slots=True)
class Noise:
    """Noise of the points of a case.

    Attributes
    ----------
    roots : (N, 3, 3) float64
        Square roots of the covariances, m.
    fit : callable
        Fits a plane to the first points.
    """

    roots: Floats
    fit: Callable[[Floats], ManoeuvrePlane]


def path(case: Case) -> Floats:
    """Return the true positions of a case, (N, 3), m.

    References
    ----------
    Korobochkin, the section on the example. The helix is the project's own.
    """
    time_s = np.arange(1, round(TIMES_S[-1] * RATE_HZ) + 1) / RATE_HZ
    angle = SPEED_MPS / case.radius_m * time_s
    circle = np.column_stack([np.cos(angle), np.zeros(len(angle)), np.sin(angle)])
    along = case.climb_mps * time_s[:, None] * NORMAL
    return np.asarray(CENTRE_M + case.radius_m * circle + along)


def noise_of(source: str, count: int) -> Noise:
    """Return the noise of the points of a source.

    Parameters
    ----------
    source : str
        One of `SOURCES`.
    count : int
        Number of points.

    Returns
    -------
    Noise
        Their covariances, and the fit with them.

    References
    ----------
    Korobochkin, equation (1.4). Two directions are the project's own.
    """
    if source == SOURCES[0]:
        d = VARIANCE_M2 * np.eye(3)
        return Noise(
            np.broadcast_to(np.sqrt(d), (count, 3, 3)), lambda points: fit_proportional(points, d)
        )
    covariances = [_turned(np.radians(azimuth)) for azimuth in _AZIMUTHS_DEG]
    if source == SOURCES[1]:
        scales = 1.0 + np.arange(count) % 3
        root = np.linalg.cholesky(covariances[0])
        return Noise(
            scales[:, None, None] * root,
            lambda points: fit_proportional(points, covariances[0], scales[: len(points)]),
        )
    alternating = np.array([covariances[row % 2] for row in range(count)])
    return Noise(
        np.linalg.cholesky(alternating),
        lambda points: fit_plane(points, alternating[: len(points)]),
    )


def planes(
    case: Case, times_s: tuple[float, ...], runs: int, rng: np.random.Generator
) -> list[list[ManoeuvrePlane | None]]:
    """Fit planes to the points of independent runs, up to each time.

    Parameters
    ----------
    case : Case
        The flight.
    times_s : tuple of float
        Ends of the observation, s.
    runs : int
        Number of runs.
    rng : Generator
        Random generator of the noise.

    Returns
    -------
    list of list of ManoeuvrePlane or None
        A plane for each time, in a list for each run; None where a line fits the points.

    References
    ----------
    Korobochkin, the section on the example.
    """
    truth = path(case)
    noise = noise_of(case.source, len(truth))
    found = []
    for _ in range(runs):
        drawn = np.einsum("nij,nj->ni", noise.roots, rng.standard_normal(truth.shape))
        measured = truth + drawn
        found.append([_fitted(noise, measured[: round(time_s * RATE_HZ)]) for time_s in times_s])
    return found


def _fitted(noise: Noise, points: Floats) -> ManoeuvrePlane | None:
    try:
        return noise.fit(points)
    except PlaneError:
        return None


def normal_error_rad(plane: ManoeuvrePlane) -> float:
    """Return the angle between the estimated and the true normal, rad.

    References
    ----------
    Korobochkin, figure 3.
    """
    # By the sine, which is accurate for small angles.
    return math.asin(min(1.0, float(np.linalg.norm(np.cross(plane.normal, NORMAL)))))


def fraction_band(probability: float, runs: int) -> tuple[float, float]:
    """Return the band of the fraction of events among runs, with the probability `BAND`.

    References
    ----------
    The project's own: quantiles of the binomial distribution.
    """
    outside = (1.0 - BAND) / 2.0
    low, high = binom.ppf([outside, 1.0 - outside], runs, probability) / runs
    return float(low), float(high)


def _turned(azimuth_rad: float) -> Floats:
    cosine, sine = np.cos(azimuth_rad), np.sin(azimuth_rad)
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn @ np.diag(np.array(_ACROSS_SIGMA_M) ** 2) @ turn.T)
