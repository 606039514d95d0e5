"""Statistical tests of a radar by its innovations: bias jumps, noise, site errors.

Functions of innovations in units of the expected standard deviation, without state.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.health._health_kernels import CLIP, CLIPPED_MEAN
from multiradar.tracking.health.health_sums import GAIN_SCALE_M, PATTERNS, SITE

Floats = NDArray[np.float64]

#: Shifts tested for, in standard deviations of a plot: the smaller one for lasting shifts, the
#: greater one for the first scan, before tracks follow.
JUMP_SIGMAS = np.array([1.0, 2.0])
#: Minimum number of aircraft of a test: fewer may all be turning.
AIRCRAFT_MIN = 4
#: Errors of the biases up to this number of standard deviations are no jump.
COMMON_SIGMAS = 3.0
#: Variance of the median of n normal numbers, times n.
MEDIAN_VARIANCE = np.pi / 2.0
#: Standard deviation of normal numbers over their median absolute deviation.
NORMAL_SPREAD = 1.4826
#: Minimum fraction of noise in the measured variance for an estimate.
NOISE_SHARE_MIN = 0.2

# Prior: a site error within 100 km, offsets and gain arbitrary.
_PATTERN_SIGMAS = np.array([1e3, 0.1, 0.01 * GAIN_SCALE_M, 1e5, 1e5])
_PATTERN_SCALE = np.outer(_PATTERN_SIGMAS, _PATTERN_SIGMAS)
_UPPER = np.triu_indices(PATTERNS)
_IDENTITY = np.eye(PATTERNS)
# As numbers: a test has four values, and arrays of four take ten times as long.
_SHIFTS = JUMP_SIGMAS.tolist()


def jump_evidence(values: Floats, common: float, scale: float) -> Floats:
    """Return the log likelihood ratios of a bias jump up, and down, to none.

    Parameters
    ----------
    values : (n,) float64
        Innovations of one component, one per aircraft, over their standard deviations.
    common : float
        Common variance by the uncertainty of the biases, in the same units.
    scale : float
        Variance of the innovations, 1 for the configured noise.

    Returns
    -------
    (2, 2) float64
        Up and down, for shifts of `JUMP_SIGMAS`.

    Notes
    -----
    The statistic is the median: turning aircraft, with large innovations, hardly affect it. Its
    variance is that of normal numbers, π σ² / 2 n, with the largest σ of the expected one, the
    measured one, and that by the median absolute deviation. The error of the biases is the same in
    successive tests and does not average out: only the excess over `COMMON_SIGMAS` of it counts.

    References
    ----------
    E. S. Page, "Continuous inspection schemes", Biometrika 41 (1954), 100-115, for the cumulative
    sums. G. Lorden, "Procedures for reacting to a change in distribution", The Annals of
    Mathematical Statistics 42 (1971), 1897-1908: with a threshold h false alarms are at least
    exp(h) tests apart on average. The median in place of the mean is the project's own.
    """
    median = _median(values)
    spread = NORMAL_SPREAD * _median(np.abs(values - median))
    variance = MEDIAN_VARIANCE / len(values) * max(scale, 1.0, spread * spread)
    error = COMMON_SIGMAS * float(np.sqrt(common))
    return np.array(
        [
            [shift * (moved - error - 0.5 * shift) / variance for shift in _SHIFTS]
            for moved in (median, -median)
        ]
    )


def scale_after(scale: float, clipped: float, count: float, weight: float) -> float:
    """Return the updated variance of innovations.

    Parameters
    ----------
    scale : float
        Variance before, in units of the expected one.
    clipped : float
        Sum of the squares of the new ones over ``scale``, each clipped at `CLIP`.
    count : float
        Number of new ones.
    weight : float
        Total weight, including the new ones.

    Returns
    -------
    float
        Variance at which the mean of the clipped squares is that of normal numbers.

    References
    ----------
    P. J. Huber, "Robust estimation of a location parameter", The Annals of Mathematical Statistics
    35 (1964), 73-101 (proposal 2), one step of it for each epoch.
    """
    excess = clipped / (count * CLIPPED_MEAN) - 1.0
    step = min(count / weight, 1.0)
    return scale * max(1.0 + step * excess, CLIPPED_MEAN / CLIP)


def noise_ratio(scale: float, noise_share: float) -> float:
    """Return the ratio of measured to configured standard deviation of the noise.

    Parameters
    ----------
    scale : float
        Variance of the innovations over the expected one.
    noise_share : float
        Fraction of the configured noise in the expected variance; the rest is the uncertainty of
        the tracks.

    Returns
    -------
    float
        √(x / noise_share) with x = scale − (1 − noise_share); NaN where the uncertainty of the
        tracks explains nearly all of the measured variance, or more.

    References
    ----------
    R. K. Mehra, "On the identification of variances and adaptive Kalman filtering", IEEE
    Transactions on Automatic Control 15 (1970), 175-184: E e eᵀ = H P Hᵀ + W solved for W.
    """
    noise = scale - (1.0 - noise_share)
    return float(np.sqrt(noise / noise_share)) if noise > NOISE_SHARE_MIN * scale else float("nan")


def shift_of_site(pattern: Floats, vector: Floats, scale: float) -> tuple[Floats, Floats]:
    """Return the estimated site error, beside offsets and a gain, and its covariance.

    Parameters
    ----------
    pattern : (NORMALS,) float64
        Upper triangle of the information on the innovation pattern.
    vector : (PATTERNS,) float64
        Its information vector.
    scale : float
        Variance of the innovations over the expected one; at least one is used.

    Returns
    -------
    shift : (2,) float64
        East and north, m: true minus configured.
    covariance : (2, 2) float64
        Covariance of its errors.

    References
    ----------
    The project's own: least squares with the first harmonics over azimuth caused by a site error.
    They are 90° apart in range and azimuth, and decrease with range in azimuth.
    """
    information = np.zeros((PATTERNS, PATTERNS))
    information[_UPPER] = pattern
    information.T[_UPPER] = pattern
    scaled = information * _PATTERN_SCALE + _IDENTITY
    inverse = np.linalg.inv(scaled)
    found: Floats = (inverse @ (vector * _PATTERN_SIGMAS)) * _PATTERN_SIGMAS
    covariance = inverse * _PATTERN_SCALE * max(scale, 1.0)
    spread: Floats = np.asarray(covariance[SITE:, SITE:], np.float64)
    return found[SITE:], spread


def _median(values: Floats) -> float:
    # Ten times faster than np.median, which checks for NaN and axes.
    ranked = np.sort(values)
    half = len(ranked) // 2
    return float(ranked[half] if len(ranked) % 2 else 0.5 * (ranked[half - 1] + ranked[half]))
