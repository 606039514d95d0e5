"""The Monte Carlo of the study of manoeuvre planes: circles, helices, and their noise.

References
----------
Korobochkin, the section on the example: a circle in the plane OXZ, flown with 500 m/s, its centre
5 km away at an elevation of 45°, seen for 10 s at 100 Hz with errors of 25 m on each axis. The
radius is not told.
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
#: When the algorithm begins, and the times at which it is read, s.
TIMES_S = (2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0)
#: Radii of the circle, m; the first is that of the figures.
RADII_M = (1500.0, 1000.0, 2000.0)
#: Speeds along the normal, m/s: above 0 the circle is a helix.
CLIMBS_MPS = (0.0, 2.0, 5.0, 10.0, 20.0, 50.0)
#: Radii of the helices, m: in 10 s half a turn and a bit, and four fifths of one.
HELIX_RADII_M = (1500.0, 1000.0)
#: What the paper reads from its figures 3 and 4 at the end.
PRINTED = {"normal_error_mrad": 1.4, "distance_error_m": 2.0}
#: Probability that a share lies in its band.
BAND = 0.999

# Errors along the axes of a source, m, and the azimuths from which two sources look, degrees.
_ACROSS_SIGMA_M = (10.0, 40.0, 20.0)
_LOOKS_DEG = (20.0, 110.0)


class Case(NamedTuple):
    """What is flown and how it is measured.

    Attributes
    ----------
    source : str
        `one source` (the paper's noise), `proportional` (three sources of one direction, whose
        sigmas are as 1, 2 and 3) or `two directions` (covariances that are not proportional).
    radius_m, climb_mps : float
        Of the circle, and the speed along its axis.
    """

    source: str
    radius_m: float
    climb_mps: float


SOURCES = ("one source", "proportional", "two directions")


@dataclass(frozen=True, slots=True)
class Noise:
    """How the points of a case are measured.

    Attributes
    ----------
    roots : (N, 3, 3) float64
        Roots of the covariances, m.
    fit : callable
        Lays a plane through the first points.
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
    """Return how the points of a source are measured.

    Parameters
    ----------
    source : str
        One of `SOURCES`.
    count : int
        How many points.

    Returns
    -------
    Noise
        Their covariances, and the fit that knows them.

    References
    ----------
    Korobochkin, equation (1.4). Two directions are the project's own.
    """
    if source == SOURCES[0]:
        d = VARIANCE_M2 * np.eye(3)
        return Noise(
            np.broadcast_to(np.sqrt(d), (count, 3, 3)), lambda points: fit_proportional(points, d)
        )
    looks = [_turned(np.radians(azimuth)) for azimuth in _LOOKS_DEG]
    if source == SOURCES[1]:
        scales = 1.0 + np.arange(count) % 3
        root = np.linalg.cholesky(looks[0])
        return Noise(
            scales[:, None, None] * root,
            lambda points: fit_proportional(points, looks[0], scales[: len(points)]),
        )
    covariances = np.array([looks[row % 2] for row in range(count)])
    return Noise(
        np.linalg.cholesky(covariances),
        lambda points: fit_plane(points, covariances[: len(points)]),
    )


def planes(
    case: Case, times_s: tuple[float, ...], runs: int, rng: np.random.Generator
) -> list[list[ManoeuvrePlane | None]]:
    """Lay planes through the points of independent runs, up to each time.

    Parameters
    ----------
    case : Case
        What is flown.
    times_s : tuple of float
        Ends of the observation, s.
    runs : int
        How many runs.
    rng : Generator
        Draws the noise.

    Returns
    -------
    list of list of ManoeuvrePlane or None
        A plane for each time, in a list for each run; None where a line explains the points.

    References
    ----------
    Korobochkin, the section on the example.
    """
    truth = path(case)
    noise = noise_of(case.source, len(truth))
    found = []
    for _ in range(runs):
        drawn = np.einsum("nij,nj->ni", noise.roots, rng.standard_normal(truth.shape))
        seen = truth + drawn
        found.append([_fitted(noise, seen[: round(time_s * RATE_HZ)]) for time_s in times_s])
    return found


def _fitted(noise: Noise, points: Floats) -> ManoeuvrePlane | None:
    try:
        return noise.fit(points)
    except PlaneError:
        return None


def normal_error_rad(plane: ManoeuvrePlane) -> float:
    """Return the angle between the normal found and that of the circle, rad.

    References
    ----------
    Korobochkin, figure 3.
    """
    # The sine, which keeps the digits that the cosine of a small angle loses.
    return math.asin(min(1.0, float(np.linalg.norm(np.cross(plane.normal, NORMAL)))))


def share_band(probability: float, runs: int) -> tuple[float, float]:
    """Return where the share of events among runs lies with the probability `BAND`.

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
