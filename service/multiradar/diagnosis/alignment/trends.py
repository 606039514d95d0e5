"""Biases by time: a fit of its own for each interval, and whether they drift."""

from dataclasses import dataclass

import numpy as np

from multiradar.diagnosis.alignment.fit import Alignment, Problem, fit
from multiradar.diagnosis.plots import Floats

#: Intervals at most, and their least length, s.
INTERVALS_MAX, INTERVAL_MIN_S = 12, 300.0
#: An estimate whose sigma is a larger fraction of the prior's is not one of the interval.
PRIOR_RATIO_MAX = 0.5
#: A drift is significant above this many sigma: one in 16 000 of all biases by chance.
SIGMAS = 4.0
# Estimates below which there is no line through them.
_POINTS_MIN = 3
_HOUR_S = 3600.0


@dataclass(frozen=True, slots=True)
class Trend:
    """Biases by interval.

    Attributes
    ----------
    time_s : (t,) float64
        Middles of the intervals.
    estimate, sigma : (t, c) float64
        Of each parameter; NaN where the interval does not determine it.
    drift_per_h, drift_sigma : (c,) float64
        Slope of a line through the estimates and its standard deviation, in the unit of the
        parameter per hour; NaN with fewer than three.
    """

    time_s: Floats
    estimate: Floats
    sigma: Floats
    drift_per_h: Floats
    drift_sigma: Floats


def trend(problem: Problem, whole: Alignment) -> Trend:
    """Fit the biases in intervals of time.

    Parameters
    ----------
    problem : Problem
        The pairs.
    whole : Alignment
        Fit of all pairs, whose noise is used.
    """
    time_s = problem.pairs.time_s
    count = len(whole.estimate)
    first, last = (float(time_s.min()), float(time_s.max())) if len(time_s) else (0.0, 0.0)
    intervals = min(INTERVALS_MAX, int((last - first) / INTERVAL_MIN_S))
    if intervals < 2:
        nothing = np.full(count, np.nan)
        return Trend(np.empty(0), np.empty((0, count)), np.empty((0, count)), nothing, nothing)
    edges = np.linspace(first, last, intervals + 1)
    place = np.clip(np.searchsorted(edges, time_s, side="right") - 1, 0, intervals - 1)
    estimates, sigmas = [], []
    for one in range(intervals):
        found = fit(problem, place == one, whole.noise)
        sigma = np.sqrt(np.diag(found.covariance))
        known = sigma <= PRIOR_RATIO_MAX * problem.sensors.prior_sigma
        estimates.append(np.where(known, found.estimate, np.nan))
        sigmas.append(np.where(known, sigma, np.nan))
    estimate, sigma = np.array(estimates), np.array(sigmas)
    middles = (edges[:-1] + edges[1:]) / 2.0
    drift, drift_sigma = _lines(middles, estimate, sigma)
    return Trend(middles, estimate, sigma, drift, drift_sigma)


def _lines(time_s: Floats, estimate: Floats, sigma: Floats) -> tuple[Floats, Floats]:
    drift = np.full(estimate.shape[1], np.nan)
    spread = drift.copy()
    for column in range(estimate.shape[1]):
        known = np.isfinite(estimate[:, column])
        if known.sum() < _POINTS_MIN:
            continue
        weight = sigma[known, column] ** -2.0
        hours = time_s[known] / _HOUR_S
        hours = hours - np.average(hours, weights=weight)
        value = estimate[known, column]
        information = float(np.sum(weight * hours**2))
        drift[column] = np.sum(weight * hours * value) / information
        left = value - np.average(value, weights=weight) - drift[column] * hours
        # Estimates that scatter more than their sigma widen that of the line.
        excess = max(1.0, float(np.sum(weight * left**2)) / (known.sum() - 2))
        spread[column] = np.sqrt(excess / information)
    return drift, spread
