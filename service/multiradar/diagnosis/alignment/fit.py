"""A robust fit of biases to pairs of plots, with the noise of each sensor.

Residuals follow a Student distribution, so wrong pairs have little weight (Lange, Little and
Taylor, *Robust statistical modeling using the t distribution*, JASA 84, 1989: iteratively
reweighted least squares). Noise variances follow by multiplicative steps for variance components
(Zhou, Hu, Zhou and Lange, *MM algorithms for variance components models*, J. Comput. Graph. Stat.
28, 2019). The covariance of the biases is that of the jackknife over aircraft, whose
transponder, height and track are common to its pairs (MacKinnon and White 1985; Bell and McCaffrey
2002 for clusters), but at least that of independent pairs.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.diagnosis.alignment.linear import (
    Group,
    Noise,
    configured_noise,
    covariances,
    groups_of,
    range_and_azimuth,
)
from multiradar.diagnosis.alignment.pairs import Pairs, pairs_of, without_biases
from multiradar.diagnosis.alignment.tracked_plots import TrackedPlots
from multiradar.diagnosis.plots import Floats
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.estimation.measurement.sensors import SensorTable

#: Degrees of freedom of the residuals: a usual compromise of efficiency and robustness.
FREEDOM = 4.0
# E[(ν + 2) x / (ν + x)] = 6 (1 − 2 e² E₁(2)) for x of two normal residuals (χ² of 2 degrees), whose
# mean is 2: with this factor the noise of normal residuals is their standard deviation.
_NORMAL = 2.0 / 1.6637
#: The configured noise of a sensor counts as so many pairs.
NOISE_PAIRS = 10.0
#: Clusters of the jackknife, at most; more aircraft share clusters.
_CLUSTERS_MAX = 500
# Rounds of noise, and steps of a fit in each; a step that moves no bias by more than this fraction
# of its sigma is the last.
_ROUNDS, _STEPS, _SETTLED = 4, 40, 0.01
_NOISE_STEPS = 30
# Noise below this fraction of the configured sigma is not credible from few pairs.
_NOISE_LEAST = 0.05


class _Direction(NamedTuple):
    """A direction of the pairs of a group.

    Attributes
    ----------
    columns : list of int
        Of the variances.
    shares : (c, k) float64
        Of each variance in that of the differences in this direction.
    rest : (k,) float64
        The variance of the rest, m².
    direction : (k, 2) float64
        Unit vectors.
    """

    columns: list[int]
    shares: Floats
    rest: Floats
    direction: Floats


@dataclass(frozen=True, slots=True)
class Alignment:
    """Biases of all sensors, measured minus true, in the order of the sensor table's parameters.

    Attributes
    ----------
    estimate : (c,) float64
        In m, rad, 1 or s.
    covariance : (c, c) float64
        Their covariance.
    noise : Noise
        Variances of the random errors.
    """

    estimate: Floats
    covariance: Floats
    noise: Noise


class Problem:
    """Pairs with everything that does not depend on the aircraft selected.

    Parameters
    ----------
    pairs : Pairs
        All pairs.
    sensors : SensorTable
        Sensors, with the priors of their biases.
    """

    def __init__(self, pairs: Pairs, sensors: SensorTable) -> None:
        self.pairs = pairs
        self.sensors = sensors
        self.groups = groups_of(pairs, sensors)

    @classmethod
    def of_plots(cls, plots: TrackedPlots, sensors: SensorTable) -> "Problem":
        """Return the pairs of plots, linearised at a first estimate of the biases.

        Parameters
        ----------
        plots : TrackedPlots
            Plots by track and time.
        sensors : SensorTable
            The sensors.
        """
        first = cls(pairs_of(plots, sensors), sensors)
        if not first.pairs.size:
            return first
        estimate = fit(first, np.ones(first.pairs.size, np.bool_)).estimate
        ordered = without_biases(plots, sensors, estimate)
        ordered = ordered.select(np.lexsort((ordered.time_s, ordered.track_id)))
        found = cls(pairs_of(ordered, sensors), sensors)
        # Positions as measured, but with the slopes where the biases are small.
        for one in found.groups:
            found.pairs.apart_m[one.rows] += one.effects @ estimate[one.columns]
        return found

    def selected(self, chosen: NDArray[np.bool_]) -> list[Group]:
        """Return the groups with the pairs of a mask only."""
        found = []
        for one in self.groups:
            kept = chosen[one.rows]
            if kept.any():
                found.append(
                    Group(one.first, one.second, one.rows[kept], one.columns, one.effects[kept])
                )
        return found

    def residuals(self, estimate: Floats) -> Floats:
        """Return what is left of `apart_m` without biases, (n, 2) m."""
        left = self.pairs.apart_m.copy()
        for one in self.groups:
            left[one.rows] -= one.effects @ estimate[one.columns]
        return left


def fit(problem: Problem, chosen: NDArray[np.bool_], noise: Noise | None = None) -> Alignment:
    """Fit the biases to the selected pairs.

    Parameters
    ----------
    problem : Problem
        The pairs.
    chosen : (n,) bool
        Which pairs to use.
    noise : Noise, optional
        Known variances; estimated by default.
    """
    sensors = problem.sensors
    groups = problem.selected(chosen)
    known = noise is not None
    variances = configured_noise(sensors) if noise is None else noise
    estimate = sensors.prior_mean.astype(np.float64)
    directions = [] if known else [_directions(problem.pairs, one, sensors) for one in groups]
    for _ in range(1 if known else _ROUNDS):
        weights = [_inverse(covariances(problem.pairs, one, variances, sensors)) for one in groups]
        estimate = _solve(problem, groups, weights, estimate)
        if not known:
            residuals = _residuals(problem, groups, weights, estimate)
            variances = _noise(sensors, directions, residuals, variances)
    covariance = _covariance(problem, groups, weights, estimate)
    return Alignment(estimate, covariance, variances)


def _inverse(matrices: Floats) -> Floats:
    return np.asarray(np.linalg.inv(matrices), np.float64)


def _prior(sensors: SensorTable) -> Floats:
    return np.diag(sensors.prior_sigma**-2.0)


def _solve(
    problem: Problem, groups: Sequence[Group], weights: Sequence[Floats], start: Floats
) -> Floats:
    """Return the biases with known noise."""
    prior, mean = _prior(problem.sensors), problem.sensors.prior_mean
    estimate = start
    for _ in range(_STEPS):
        information, right = prior.copy(), prior @ mean
        for one, weight in zip(groups, weights, strict=True):
            if not len(one.columns):
                continue
            apart = problem.pairs.apart_m[one.rows]
            trust = _trust(apart - one.effects @ estimate[one.columns], weight)
            weighted = np.einsum("k,kij,kja->kia", trust, weight, one.effects)
            place = np.ix_(one.columns, one.columns)
            information[place] += np.einsum("kia,kib->ab", weighted, one.effects)
            right[one.columns] += np.einsum("kia,ki->a", weighted, apart)
        before = estimate
        estimate = np.asarray(np.linalg.solve(information, right), np.float64)
        sigma = np.sqrt(np.diag(np.linalg.inv(information)))
        if np.all(np.abs(estimate - before) <= _SETTLED * sigma):
            break
    return estimate


# The weight of a pair by the Student distribution of two dimensions.
def _trust(residual: Floats, weight: Floats) -> Floats:
    distance = np.einsum("ki,kij,kj->k", residual, weight, residual)
    return np.asarray((FREEDOM + 2.0) / (FREEDOM + distance))


# Of each pair of a group, the residual and the residual as it is weighted.
def _residuals(
    problem: Problem, groups: Sequence[Group], weights: Sequence[Floats], estimate: Floats
) -> list[tuple[Floats, Floats]]:
    found = []
    for one, weight in zip(groups, weights, strict=True):
        residual = problem.pairs.apart_m[one.rows] - one.effects @ estimate[one.columns]
        found.append((residual, _NORMAL * _trust(residual, weight)[:, None] * residual))
    return found


def _noise(
    sensors: SensorTable,
    directions: Sequence[list[_Direction]],
    residuals: Sequence[tuple[Floats, Floats]],
    start: Noise,
) -> Noise:
    """Return the variances of the sensors with known biases.

    Each variance is multiplied until the residuals along and across both lines of sight are as
    large as expected.
    """
    count = len(sensors)
    # Columns: range, azimuth and position of each sensor.
    prior = configured_noise(sensors)
    first = np.concatenate([prior.range_m2, prior.azimuth_rad2, prior.position_m2])
    value = np.concatenate([start.range_m2, start.azimuth_rad2, start.position_m2])
    parts = [
        (one.columns, one.shares, one.rest, _squares(one.direction, *pair))
        for own, pair in zip(directions, residuals, strict=True)
        for one in own
    ]
    for _ in range(_NOISE_STEPS):
        above, below = NOISE_PAIRS * first / value**2, NOISE_PAIRS / value
        for columns, shares, rest, seen in parts:
            inverse = 1.0 / (rest + value[columns] @ shares)
            below[columns] += shares @ inverse
            inverse *= inverse
            inverse *= seen
            above[columns] += shares @ inverse
        value = np.maximum(value * np.sqrt(above / below), _NOISE_LEAST**2 * first)
    return Noise(value[:count], value[count : 2 * count], value[2 * count :])


# Along and across both lines of sight.
def _directions(pairs: Pairs, group: Group, sensors: SensorTable) -> list[_Direction]:
    count = len(sensors)
    one = Noise(np.ones(count), np.ones(count), np.ones(count))
    columns: list[int] = []
    parts: list[Floats] = []
    directions: list[Floats] = []
    none = Noise(np.zeros(count), np.zeros(count), np.zeros(count))
    rest = covariances(pairs, group, none, sensors)
    for number, side in ((group.first, pairs.first), (group.second, pairs.second)):
        own = side.select(group.rows)
        if sensors.kinds[number] == KIND_RADAR:
            parts += range_and_azimuth(own, one, number)
            columns += [number, count + number]
            directions += [own.along, own.across]
        else:
            parts.append(np.broadcast_to(np.eye(2), (len(group.rows), 2, 2)))
            columns.append(2 * count + number)
    return [
        _Direction(columns, np.stack([_within(each, part) for part in parts]),
                   _within(each, rest), each)
        for each in directions
    ]  # fmt: skip


# Variances in a direction.
def _within(direction: Floats, covariance: Floats) -> Floats:
    return np.asarray(np.einsum("ki,kij,kj->k", direction, covariance, direction))


def _squares(direction: Floats, residual: Floats, weighted: Floats) -> Floats:
    along = np.einsum("ki,ki->k", direction, residual)
    return np.asarray(along * np.einsum("ki,ki->k", direction, weighted))


def _covariance(
    problem: Problem, groups: Sequence[Group], weights: Sequence[Floats], estimate: Floats
) -> Floats:
    """Return the covariance by the jackknife over clusters of aircraft, to first order."""
    pairs, prior = problem.pairs, _prior(problem.sensors)
    _, place = np.unique(pairs.aircraft, return_inverse=True)
    place = place % _CLUSTERS_MAX
    count = int(place.max()) + 1
    pulls = np.zeros((count, len(estimate)))
    shares = np.zeros((count, len(estimate), len(estimate)))
    for one, weight in zip(groups, weights, strict=True):
        residual = pairs.apart_m[one.rows] - one.effects @ estimate[one.columns]
        trust = _trust(residual, weight)
        scaled = np.einsum("kij,kja->kia", weight, one.effects)
        rows, columns = place[one.rows], one.columns
        pull = np.einsum("k,kia,ki->ka", trust, scaled, residual)
        np.add.at(pulls, (rows[:, None], columns[None, :]), pull)
        # A step of the estimate changes the residual and its trust: slope of their product.
        slope = trust**2 * FREEDOM / (FREEDOM + 2.0)
        share = np.einsum("k,kia,kib->kab", slope, scaled, one.effects)
        np.add.at(shares, (rows[:, None, None], columns[:, None], columns[None, :]), share)
    information = shares.sum(axis=0) + prior
    # What the estimate changes by without each cluster.
    steps = np.linalg.solve(information - shares, pulls[:, :, None])[:, :, 0]
    used = int(np.any(pulls != 0.0, axis=1).sum())
    inverse = np.asarray(np.linalg.inv(information), np.float64)
    scatter = steps.T @ steps * (used - 1) / max(used, 1)
    clustered = scatter + inverse @ prior @ inverse
    # Few aircraft scatter less than their noise allows.
    sigma = np.sqrt(np.maximum(np.diag(clustered), np.diag(inverse)))
    correlation = clustered / np.sqrt(np.outer(np.diag(clustered), np.diag(clustered)))
    return np.asarray(correlation * np.outer(sigma, sigma))
