"""Paths of aircraft for tests of encounters, and plain forms to compare with."""

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.encounters.climbs import CLIMB_COUNT
from multiradar.tracking.encounters.pairs import Paths, velocity_spreads_of
from support.references.straight_forecast import forecast

Floats = NDArray[np.float64]
UPPER = np.triu_indices(4)


def straight_paths(
    states: Floats, covariances: Floats, times_s: Floats, density: float = 0.0
) -> Paths:
    """Return forecasts of constant velocity with white acceleration, without heights."""
    found = [forecast(x, p, density, times_s) for x, p in zip(states, covariances, strict=True)]
    count = len(states)
    now = np.array([one[0][UPPER] for _, one in found]).reshape(count, 10)
    spreads = np.array([one[:, [0, 0, 1], [0, 1, 1]] for _, one in found])
    spreads = spreads.reshape(count, len(times_s), 3)
    return Paths(
        times_s,
        np.array([means for means, _ in found]).reshape(count, len(times_s), 4),
        now,
        np.tile(velocity_spreads_of(times_s, now, spreads), 2),
        np.full(count, len(times_s)),
        np.full((count, CLIMB_COUNT), np.nan),
        np.zeros((count, 4, 0)),
    )


def covariance(position_m: float, velocity_mps: float, correlation: float = 0.5) -> Floats:
    """Return the covariance of a state that errs alike in every direction."""
    common = correlation * position_m * velocity_mps
    block = np.array([[position_m**2, common], [common, velocity_mps**2]])
    return np.kron(block, np.eye(2))


def least_distances(paths: Paths) -> tuple[Floats, Floats]:
    """Return for all pairs (n, n) the minimum distance and its time, by trying times densely.

    Plain and slow: a cubic through the points of each piece, at 64 times, the best one refined.
    """
    count = len(paths.means)
    nearest, when = np.full((count, count), np.inf), np.zeros((count, count))
    good = np.minimum.outer(paths.points, paths.points)
    between = paths.means[None] - paths.means[:, None]
    for k, dt in enumerate(np.diff(paths.times_s).tolist()):
        ends = between[:, :, k], between[:, :, k + 1]
        tried = np.linspace(0.0, 1.0, 64)
        found = np.array([_distance(u, dt, *ends) for u in tried])
        best = np.argmin(found, axis=0)
        low, high = tried[np.maximum(best - 1, 0)], tried[np.minimum(best + 1, 63)]
        for _ in range(60):
            third = (high - low) / 3.0
            left = _distance(low + third, dt, *ends) <= _distance(high - third, dt, *ends)
            low, high = np.where(left, low, low + third), np.where(left, high - third, high)
        part = 0.5 * (low + high)
        distance = _distance(part, dt, *ends)
        nearer = (distance < nearest - 1e-9) & (good >= k + 2)
        nearest = np.where(nearer, distance, nearest)
        when = np.where(nearer, paths.times_s[k] + part * dt, when)
    return nearest, when


def _distance(u: Floats | float, dt: float, first: Floats, last: Floats) -> Floats:
    u = np.asarray(u)[..., None]
    rest = 1.0 - u
    place = (
        rest**2 * (1.0 + 2.0 * u) * first[..., :2]
        + u**2 * (3.0 - 2.0 * u) * last[..., :2]
        + u * rest**2 * dt * first[..., 2:]
        - u**2 * rest * dt * last[..., 2:]
    )
    return np.asarray(np.hypot(place[..., 0], place[..., 1]))


def flown_distances(
    state: Floats, spread: Floats, end_s: float, count: int, rng: np.random.Generator
) -> Floats:
    """Return the least distances of straight relative motions drawn from a state, (count,)."""
    drawn = rng.multivariate_normal(state, spread, count)
    square = np.maximum((drawn[:, 2:] ** 2).sum(axis=1), 1e-300)
    time_s = np.clip(-(drawn[:, :2] * drawn[:, 2:]).sum(axis=1) / square, 0.0, end_s)
    place = drawn[:, :2] + time_s[:, None] * drawn[:, 2:]
    return np.asarray(np.hypot(place[:, 0], place[:, 1]))
