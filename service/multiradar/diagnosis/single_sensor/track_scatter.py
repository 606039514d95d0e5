"""Noise of a radar by the plots of its tracks, where the manoeuvres of aircraft do not hide it.

The residual of successive plots of a track about a polynomial in time is the noise alone where the
aircraft flies straight, or turns slowly. Noise is normal, and of the same size at all degrees; the
residuals of turns are a few large ones, or decrease with the degree.
"""

from collections.abc import Iterator

import numpy as np

from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.plots import Floats, Integers

#: Degrees of the polynomials; each is fitted to two plots more than its degree.
_DEGREES = (1, 2, 3)
#: Longest and shortest interval of successive plots, as a ratio, and their longest duration, s.
_INTERVALS_MAX, _SPAN_MAX_S = 2.5, 60.0
#: Number of residuals, at least.
_RESIDUALS_MIN = 150
#: Quantiles of the residuals, and their values for normal numbers of variance 1. The first one is
#: that of straight flight where a third of the plots are; the second one shows that most are.
_QUANTILES, _NORMAL = (1.0 / 3.0, 0.7), np.array([0.4307, 1.0364])
#: Noise if the second one is at most so many times the first, and that of the highest degree at
#: least this fraction of that of the lowest: 1 for noise alone, 2 and 0.4 for fighters in training.
_APART_MAX, _HIGHEST_MIN = 1.5, 0.75


def track_scatter(evidence: Evidence, number: int) -> tuple[float, float]:
    """Return the noise of a radar by the scatter of its plots about smooth paths.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    number : int
        The radar.

    Returns
    -------
    range_m, azimuth_deg : float
        Standard deviations, the least of those of all degrees; NaN where too few plots follow each
        other, and where most aircraft manoeuvre.

    References
    ----------
    The project's own, with differences of orders 2 to 4: J. von Neumann et al., "The mean square
    successive difference", The Annals of Mathematical Statistics 12 (1941), 153-162, for order 1.
    """
    tracked = evidence.tracked()
    rows = np.flatnonzero(tracked.measured.sensor == number)
    track, time_s = tracked.track_id[rows], tracked.measured.time_s[rows]
    order = np.lexsort((time_s, track))
    rows, track, time_s = rows[order], track[order], time_s[order]
    range_m, azimuth = tracked.measured.range_m[rows], tracked.measured.azimuth_rad[rows]
    place = np.column_stack([range_m * np.sin(azimuth), range_m * np.cos(azimuth)])
    of_degrees = [_residuals(track, time_s, place, degree) for degree in _DEGREES]
    along, across = (_noise([one[component] for one in of_degrees]) for component in (0, 1))
    return along, float(np.degrees(across))


# Noise by the residuals of each degree; NaN where they are not those of noise.
def _noise(residuals: list[Floats]) -> float:
    if min(map(len, residuals)) < _RESIDUALS_MIN:
        return np.nan
    scatters = np.array([np.quantile(np.abs(one), _QUANTILES) / _NORMAL for one in residuals])
    lowest, highest = scatters[0], scatters[-1]
    if lowest[1] > _APART_MAX * lowest[0] or highest[0] < _HIGHEST_MIN * lowest[0]:
        return np.nan
    return float(scatters[:, 0].min())


# Residuals along the range, m, and across it, rad, in units of the noise of one plot.
def _residuals(
    track: Integers, time_s: Floats, place: Floats, degree: int
) -> tuple[Floats, Floats]:
    count = degree + 2
    first = np.arange(len(time_s) - count + 1)
    first = first[track[first] == track[first + count - 1]]
    times = time_s[first[:, None] + np.arange(count)]
    apart = np.diff(times, axis=1)
    near = (apart.min(axis=1) * _INTERVALS_MAX >= apart.max(axis=1)) & (apart.min(axis=1) > 0.0)
    near &= times[:, -1] - times[:, 0] <= _SPAN_MAX_S
    first, times = first[near], times[near]
    # Divided differences of polynomials of the degree are 0.
    weights = np.stack([1.0 / np.prod(one, axis=1) for one in _to_others(times)], axis=1)
    weights /= np.linalg.norm(weights, axis=1, keepdims=True)
    middle = place[first + count // 2]
    distance = np.maximum(np.linalg.norm(middle, axis=1), 1.0)
    outward = middle / distance[:, None]
    residual = np.einsum("kn,knj->kj", weights, place[first[:, None] + np.arange(count)])
    along = np.sum(residual * outward, axis=1)
    across = residual[:, 0] * outward[:, 1] - residual[:, 1] * outward[:, 0]
    return along, across / distance


def _to_others(times: Floats) -> Iterator[Floats]:
    for one in range(times.shape[1]):
        yield times[:, [one]] - np.delete(times, one, axis=1)
