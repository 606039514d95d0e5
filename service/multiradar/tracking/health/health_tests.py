"""What innovations say of a radar: whether a bias jumped, how large its noise is, where it stands.

All of it is on innovations in units of what was expected; nothing here keeps a state.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.health._health_kernels import CLIP, CLIPPED_MEAN
from multiradar.tracking.health.health_sums import GAIN_SCALE_M, PATTERNS, SITE

Floats = NDArray[np.float64]

#: The shifts that the tests of jumps are made for, in standard deviations of a plot: the smaller
#: one for what goes on, the greater one for the first turn, before tracks follow.
JUMP_SIGMAS = np.array([1.0, 2.0])
#: Fewer aircraft than this cannot be told from aircraft that turn.
AIRCRAFT_MIN = 4
#: What the biases may be off by, in standard deviations, is no jump.
COMMON_SIGMAS = 3.0
#: Variance of the median of n normal numbers, times n.
MEDIAN_VARIANCE = np.pi / 2.0
#: Standard deviation of normal numbers over the median of their deviations.
NORMAL_SPREAD = 1.4826
#: Noise that is a smaller part of what is measured cannot be told from the rest.
NOISE_SHARE_MIN = 0.2

# Beforehand a site may be anywhere within 100 km, offsets and gain anything.
_PATTERN_SIGMAS = np.array([1e3, 0.1, 0.01 * GAIN_SCALE_M, 1e5, 1e5])


def jump_evidence(values: Floats, common: float, scale: float) -> Floats:
    """Return the log likelihood ratios of a bias that jumped up, and down, to one that did not.

    Parameters
    ----------
    values : (n,) float64
        Innovations of one component, one for each aircraft, over their standard deviations.
    common : float
        Variance that the uncertainty of the biases adds to all of them at once, in the same units.
    scale : float
        Variance of the innovations, 1 where the noise is as told.

    Returns
    -------
    (2, 2) float64
        Up and down, for shifts of `JUMP_SIGMAS`.

    Notes
    -----
    The statistic is the median: the aircraft that turn, of which each is far from its own
    expectation, leave little trace in it. Its variance is that of normal numbers, π σ² / 2 n, with
    the greatest of the σ expected, measured before, and told by the median deviation. The error of
    the biases is the same in test after test, so that no sum would lessen it: only what is beyond
    `COMMON_SIGMAS` of it counts.

    References
    ----------
    E. S. Page, "Continuous inspection schemes", Biometrika 41 (1954), 100-115, for the sums that
    these are added to. G. Lorden, "Procedures for reacting to a change in distribution", The Annals
    of Mathematical Statistics 42 (1971), 1897-1908: with a threshold h false alarms are at least
    exp(h) tests apart in the mean. The median in place of the mean is the project's own.
    """
    median = _median(values)
    spread = NORMAL_SPREAD * _median(np.abs(values - median))
    variance = MEDIAN_VARIANCE / len(values) * max(scale, 1.0, spread * spread)
    shifts = np.array([[median], [-median]]) - COMMON_SIGMAS * np.sqrt(common)
    evidence: Floats = JUMP_SIGMAS * (shifts - 0.5 * JUMP_SIGMAS) / variance
    return evidence


def scale_after(scale: float, clipped: float, count: float, weight: float) -> float:
    """Return the variance of innovations with some more of them in it.

    Parameters
    ----------
    scale : float
        The variance before, in units of what was expected.
    clipped : float
        Sum of the squares of the new ones over ``scale``, each clipped at `CLIP`.
    count : float
        How many are new.
    weight : float
        How many count altogether, the new ones included.

    Returns
    -------
    float
        The variance that makes the mean of the clipped squares what it is for normal numbers.

    References
    ----------
    P. J. Huber, "Robust estimation of a location parameter", The Annals of Mathematical Statistics
    35 (1964), 73-101 (proposal 2), one step of it for each epoch.
    """
    excess = clipped / (count * CLIPPED_MEAN) - 1.0
    step = min(count / weight, 1.0)
    return scale * max(1.0 + step * excess, CLIPPED_MEAN / CLIP)


def noise_ratio(scale: float, told: float) -> float:
    """Return the standard deviation of the noise over that told.

    Parameters
    ----------
    scale : float
        Variance of the innovations over what was expected.
    told : float
        Part of the noise as told in what was expected; the rest is the uncertainty of the tracks.

    Returns
    -------
    float
        √(x / told) with x = scale − (1 − told); NaN where the uncertainty of the tracks explains
        nearly all that is measured, or more.

    References
    ----------
    R. K. Mehra, "On the identification of variances and adaptive Kalman filtering", IEEE
    Transactions on Automatic Control 15 (1970), 175-184: E e eᵀ = H P Hᵀ + W solved for W.
    """
    noise = scale - (1.0 - told)
    return float(np.sqrt(noise / told)) if noise > NOISE_SHARE_MIN * scale else float("nan")


def shift_of_site(pattern: Floats, vector: Floats, scale: float) -> tuple[Floats, Floats]:
    """Return where the site seems to lie, beside offsets and a gain, and its covariance.

    Parameters
    ----------
    pattern : (NORMALS,) float64
        Upper triangle of the information on the pattern of innovations.
    vector : (PATTERNS,) float64
        Its vector.
    scale : float
        Variance of the innovations over what was expected; below one it counts as one.

    Returns
    -------
    shift : (2,) float64
        East and north, m: true minus told.
    covariance : (2, 2) float64
        Of its errors.

    References
    ----------
    The project's own: least squares with the first harmonics over azimuth that a site in a wrong
    place makes, which are 90° apart in range and azimuth and fade with range in azimuth.
    """
    information = np.zeros((PATTERNS, PATTERNS))
    information[np.triu_indices(PATTERNS)] = pattern
    information += np.triu(information, 1).T
    scaled = information * np.outer(_PATTERN_SIGMAS, _PATTERN_SIGMAS) + np.eye(PATTERNS)
    inverse = np.linalg.inv(scaled)
    found: Floats = (inverse @ (vector * _PATTERN_SIGMAS)) * _PATTERN_SIGMAS
    covariance = inverse * np.outer(_PATTERN_SIGMAS, _PATTERN_SIGMAS) * max(scale, 1.0)
    spread: Floats = np.asarray(covariance[SITE:, SITE:], np.float64)
    return found[SITE:], spread


def _median(values: Floats) -> float:
    # A tenth of the time of np.median, which looks for NaN and for axes.
    ranked = np.sort(values)
    half = len(ranked) // 2
    return float(ranked[half] if len(ranked) % 2 else 0.5 * (ranked[half - 1] + ranked[half]))
