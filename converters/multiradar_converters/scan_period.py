"""Scan period of a rotating radar from the times and azimuths of its plots.

An antenna rotating at frequency f points at azimuth 2πft + φ. At the true f the phases
2πft − azimuth of all plots agree, for any aircraft. The sum of the unit vectors of these phases,
over intervals short enough to tolerate clock drift, is largest at the true f. Longer intervals then
refine it.
"""

import math

import numpy as np
from numpy.typing import NDArray

#: Scan periods of surveillance radars, s.
PERIOD_MIN_S, PERIOD_MAX_S = 1.0, 30.0
#: Minimum number of plots.
PLOTS_MIN = 30
#: Maximum number of plots used; more do not improve the estimate.
PLOTS_MAX = 20_000
#: Minimum number of pairs of plots within an interval; fewer agree by chance at some frequency.
PAIRS_MIN = 400
#: Minimum agreement of phases: 1 if all are equal, about 1 / sqrt(plots per interval) if random.
AGREEMENT_MIN = 0.5
#: Among peaks of at least this height relative to the highest, the lowest frequency is selected:
#: plots in one direction fit any multiple of the frequency as well.
_PEAK_MIN = 0.9
_STRETCHES_S = (60.0, 240.0, 1200.0)
#: Steps of frequency in the width of a peak.
_STEPS = 6
#: Origin of a scan period from north marks or sectors, and the ratio to that of the plots from
#: which some of these messages are missing.
SERVICE_MESSAGES = "service messages"
_MISSING_MIN = 1.5

Floats = NDArray[np.float64]


def scan_period_s(time_s: Floats, azimuth_deg: Floats) -> float:
    """Estimate the scan period.

    Parameters
    ----------
    time_s : (n,) float64
        Times of plots of one radar, in any order, s.
    azimuth_deg : (n,) float64
        Their azimuths, clockwise, degrees.

    Returns
    -------
    float
        Scan period, s; NaN if there are too few plots or the antenna does not rotate.

    Notes
    -----
    Accurate to about 0.01 % with some minutes of plots whose times are accurate to 0.1 s. Antennas
    that rotate counter-clockwise or are steered electronically have none.
    """
    known = np.isfinite(time_s) & np.isfinite(azimuth_deg)
    order = np.argsort(time_s[known], kind="stable")[:PLOTS_MAX]
    times, phases = time_s[known][order], np.radians(azimuth_deg[known][order])
    if len(times) < PLOTS_MIN:
        return math.nan
    times = times - times[0]
    low, high = 1.0 / PERIOD_MAX_S, 1.0 / PERIOD_MIN_S
    found = math.nan
    if _pairs(times, _STRETCHES_S[0]) < PAIRS_MIN:
        return math.nan
    for stretch_s in _STRETCHES_S:
        step = 1.0 / (_STEPS * stretch_s)
        frequencies = np.arange(low, high + step, step)
        agreement = _agreement(times, phases, frequencies, stretch_s)
        best = _slowest_peak(agreement)
        if agreement[best] < AGREEMENT_MIN:
            break
        found = float(frequencies[best]) + step * _between(agreement, best)
        low, high = found - 1.0 / stretch_s, found + 1.0 / stretch_s
        if times[-1] < stretch_s:
            break
    return 1.0 / found


def preferred_period(stated_s: float, plots_s: float, plots_source: str) -> tuple[float, str]:
    """Return the scan period of service messages, or of the plots if messages are missing.

    Parameters
    ----------
    stated_s, plots_s : float
        Scan periods by service messages and by plots, s; NaN if unknown.
    plots_source : str
        Origin of the latter, or why there is none.

    Returns
    -------
    float
        The scan period, s; NaN if both are unknown.
    str
        Its origin, or why there is none.
    """
    if math.isnan(stated_s):
        return plots_s, plots_source
    if stated_s > _MISSING_MIN * plots_s:
        return plots_s, f"{plots_source}; north markers (every {stated_s:.4g} s) are incomplete"
    return stated_s, SERVICE_MESSAGES


def why_no_period(time_s: Floats, azimuth_deg: Floats) -> str:
    """Return why plots have no scan period, in words.

    Parameters
    ----------
    time_s, azimuth_deg : (n,) float64
        Plots for which `scan_period_s` finds none.

    Returns
    -------
    str
        Too few, or no rotation.
    """
    times = np.sort(time_s[np.isfinite(time_s) & np.isfinite(azimuth_deg)])[:PLOTS_MAX]
    if not len(times):
        return "no plots with a time and an azimuth"
    count = "1 plot" if len(times) == 1 else f"{len(times)} plots"
    if len(times) < PLOTS_MIN or _pairs(times - times[0], _STRETCHES_S[0]) < PAIRS_MIN:
        span_s = float(times[-1] - times[0])
        return f"only {count} in {span_s:.3g} s; at least {PLOTS_MIN} within a minute are needed"
    return f"{count} show no rotation"


def _pairs(times: Floats, stretch_s: float) -> float:
    _, counts = np.unique(times // stretch_s, return_counts=True)
    return float(np.sum(counts * (counts - 1.0)) / 2.0)


def _agreement(times: Floats, phases: Floats, frequencies: Floats, stretch_s: float) -> Floats:
    # RMS, over intervals, of the length of the mean unit vector of the phases.
    stretch = (times // stretch_s).astype(np.int64)
    begins = np.flatnonzero(np.diff(stretch, prepend=-1))
    counts = np.diff(np.append(begins, len(times)))
    powers = np.empty(len(frequencies))
    # Frequencies in equal steps are sums of coarse and fine ones, their vectors products.
    size = math.isqrt(len(frequencies)) + 1
    fine = frequencies[:size] - frequencies[0]
    further = np.exp(2j * np.pi * np.outer(fine, times))
    for first in range(0, len(frequencies), size):
        vectors = np.exp(1j * (2.0 * np.pi * frequencies[first] * times - phases))
        sums = np.add.reduceat(vectors * further[: len(frequencies) - first], begins, axis=1)
        # Minus the expectation for random vectors.
        powers[first : first + size] = np.sum(np.abs(sums) ** 2 - counts, axis=1)
    return np.sqrt(np.maximum(powers, 0.0) / max(1.0, float(np.sum(counts**2 - counts))))


# Position of a peak by parabolic interpolation, in steps from the highest of three values.
def _between(agreement: Floats, best: int) -> float:
    if not 0 < best < len(agreement) - 1:
        return 0.0
    before, here, after = agreement[best - 1 : best + 2].tolist()
    bend = before - 2.0 * here + after
    return 0.5 * (before - after) / bend if bend < 0.0 else 0.0


def _slowest_peak(agreement: Floats) -> int:
    padded = np.concatenate([[-1.0], agreement, [-1.0]])
    peaks = (padded[1:-1] >= padded[:-2]) & (padded[1:-1] > padded[2:])
    return int(np.flatnonzero(peaks & (agreement >= _PEAK_MIN * agreement.max()))[0])
