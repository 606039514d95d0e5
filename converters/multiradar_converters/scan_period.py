"""The scan period of a rotating radar, found from nothing but the times and azimuths of its plots.

An antenna that turns with frequency f points at azimuth 2πft + φ: with the right f the phases
2πft − azimuth of all plots agree, whatever aircraft they are of. The sum of unit vectors of these
phases is taken over stretches of the recording, in which a clock that runs unevenly does no harm,
and is largest at the right f. Longer stretches then make it sharper.
"""

import math

import numpy as np
from numpy.typing import NDArray

#: Scan periods of surveillance radars, s.
PERIOD_MIN_S, PERIOD_MAX_S = 1.0, 30.0
#: Fewer plots do not say it.
PLOTS_MIN = 30
#: More do not say it better.
PLOTS_MAX = 20_000
#: Nor do fewer pairs of plots within a stretch: by chance they agree at one of so many frequencies.
PAIRS_MIN = 400
#: How well phases must agree: 1 for all alike, about 1 / sqrt(plots of a stretch) for none.
AGREEMENT_MIN = 0.5
#: Of peaks so high, relative to the highest, the slowest is meant: from plots of one direction, any
#: multiple of the frequency explains them as well.
_PEAK_MIN = 0.9
_STRETCHES_S = (60.0, 240.0, 1200.0)
#: Steps of frequency in the width of a peak.
_STEPS = 6

Floats = NDArray[np.float64]


def scan_period_s(time_s: Floats, azimuth_deg: Floats) -> float:
    """Find the scan period.

    Parameters
    ----------
    time_s : (n,) float64
        Times of plots of one radar, in any order, s.
    azimuth_deg : (n,) float64
        Their azimuths, clockwise, degrees.

    Returns
    -------
    float
        Scan period, s; NaN where the plots are too few or do not come from a rotating antenna.

    Notes
    -----
    To about 0.01 % of the period over some minutes of plots whose times are true to 0.1 s. Antennas
    that turn counter-clockwise, or look where they like, have none.
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


def _pairs(times: Floats, stretch_s: float) -> float:
    _, counts = np.unique(times // stretch_s, return_counts=True)
    return float(np.sum(counts * (counts - 1.0)) / 2.0)


def _agreement(times: Floats, phases: Floats, frequencies: Floats, stretch_s: float) -> Floats:
    # Root mean square, over stretches, of how long the mean unit vector of the phases is.
    stretch = (times // stretch_s).astype(np.int64)
    begins = np.flatnonzero(np.diff(stretch, prepend=-1))
    counts = np.diff(np.append(begins, len(times)))
    powers = np.empty(len(frequencies))
    for k, frequency in enumerate(frequencies.tolist()):
        vectors = np.exp(1j * (2.0 * np.pi * frequency * times - phases))
        sums = np.add.reduceat(vectors, begins)
        # Less what vectors without any order add up to.
        powers[k] = np.sum(np.abs(sums) ** 2 - counts)
    return np.sqrt(np.maximum(powers, 0.0) / max(1.0, float(np.sum(counts**2 - counts))))


# Where the top of a peak lies, in steps from the highest of three values: that of a parabola.
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
