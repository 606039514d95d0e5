"""Conflict probabilities and intervals of the minimum distance against simulated motions."""

import numpy as np
import pytest

from multiradar.estimation.filters.height._height_kernels import CLIMB_DENSITY
from multiradar.tracking.encounters._relative_kernels import RARE, RARE_SHARE
from multiradar.tracking.encounters.approaches import (
    bounds,
    closest_approaches,
    conflict_probabilities,
    heights_between,
)
from multiradar.tracking.encounters.climbs import CLIMB_COUNT
from support.scenarios.encounter_paths import covariance, flown_distances, straight_paths

TIMES_S = np.arange(0.0, 121.0, 10.0)
DRAWN = 40_000
#: Accuracy of the lattice, and three sigmas of the simulation.
TOLERANCE = 0.005 + 3.0 * 0.5 / DRAWN**0.5
#: State of the second aircraft relative to the first, which flies east with 200 m/s.
MEETINGS = {
    "crossing": [12_000.0, -11_000.0, -200.0, 200.0],
    "head-on": [40_000.0, 1_000.0, -400.0, 0.0],
    "meeting exactly": [20_000.0, 0.0, -300.0, 0.0],
    "overtaking": [3_000.0, 500.0, -20.0, 0.0],
    "formation": [300.0, 300.0, 0.0, 0.0],
    "at one position": [0.0, 0.0, 0.0, 0.0],
    "side by side": [0.0, 3_000.0, 0.0, 0.0],
    "flying apart": [3_000.0, 0.0, -100.0, 200.0],
    "slow, at the end": [24_000.0, 0.0, -200.0, 0.0],
}
ERRORS = {"good": (50.0, 4.0), "poor": (300.0, 40.0), "unknown velocity": (100.0, 150.0)}


def _meeting(name: str, errors: str) -> tuple[np.ndarray, np.ndarray]:
    first = np.array([0.0, 0.0, 200.0, 0.0])
    return np.array([first, first + MEETINGS[name]]), np.array([covariance(*ERRORS[errors])] * 2)


@pytest.mark.parametrize("errors", ERRORS)
@pytest.mark.parametrize("name", MEETINGS)
def test_probability_and_interval_are_those_of_simulated_motions(name: str, errors: str) -> None:
    states, spreads = _meeting(name, errors)
    paths = straight_paths(states, spreads, TIMES_S)
    pair = np.array([[0, 1]])
    least = flown_distances(
        states[1] - states[0], spreads.sum(axis=0), 120.0, DRAWN, np.random.default_rng(5)
    )
    for distance_m in (500.0, 2_000.0, 9_260.0):
        found = closest_approaches(paths, pair, np.eye(2)[None], distance_m)
        within, both = conflict_probabilities(
            found, heights_between(paths, pair), distance_m, 300.0
        )
        assert within[0] == pytest.approx((least < distance_m).mean(), abs=TOLERANCE)
        assert np.isnan(both[0])
    low, high = bounds(found)
    # Three sigmas of a fraction of 2.5 %, and the accuracy of the lattice.
    tolerance = 3.0 * (0.025 * 0.975 / DRAWN) ** 0.5 + 0.005
    below, above = (least < low[0]).mean(), (least > high[0]).mean()
    assert below + above == pytest.approx(0.05, abs=2.0 * tolerance)
    # Symmetric, or from 0 if that is shorter.
    if low[0] == 0.0:
        lowest, highest = np.quantile(least, [0.025, 0.975])
        assert high[0] < (highest - lowest) + 0.05 * highest
    else:
        assert below == pytest.approx(0.025, abs=tolerance)


@pytest.mark.parametrize("name", ["crossing", "formation", "flying apart"])
def test_probability_and_interval_include_rare_large_errors(name: str) -> None:
    """One in four of each has errors six times as large; all four cases are simulated."""
    states, spreads = _meeting(name, "good")
    far = spreads.copy()
    far[:, 2:, 2:] *= 36.0
    paths, rare = (straight_paths(states, one, TIMES_S) for one in (spreads, far))
    paths.velocity_spreads[..., RARE:] = rare.velocity_spreads[..., RARE:]
    rng = np.random.default_rng(6)
    least = np.concatenate(
        [
            flown_distances(states[1] - states[0], first + second, 120.0, round(share * DRAWN), rng)
            for first, of_first in ((spreads[0], 1.0 - RARE_SHARE), (far[0], RARE_SHARE))
            for second, of_second in ((spreads[1], 1.0 - RARE_SHARE), (far[1], RARE_SHARE))
            for share in (of_first * of_second,)
        ]
    )
    pair = np.array([[0, 1]])
    for distance_m in (500.0, 2_000.0):
        found = closest_approaches(paths, pair, np.eye(2)[None], distance_m)
        within, _ = conflict_probabilities(found, heights_between(paths, pair), distance_m, None)
        # The rarest of the four has 64 points.
        assert within[0] == pytest.approx((least < distance_m).mean(), abs=TOLERANCE)
    low, high = bounds(found)
    held = ((low[0] <= least) & (least <= high[0])).mean()
    assert held == pytest.approx(0.95, abs=0.01)


def test_an_exact_collision_is_within_its_interval() -> None:
    """Predicted paths that intersect are a possible collision."""
    states = np.array([[-12e3, 0.0, 200.0, 0.0], [0.0, -12e3, 0.0, 200.0]])
    spreads = np.array([covariance(300.0, 8.0)] * 2)
    paths = straight_paths(states, spreads, TIMES_S)
    found = closest_approaches(paths, np.array([[0, 1]]), np.eye(2)[None], 9_260.0)
    low, high = bounds(found)
    assert found.distance_m[0] == pytest.approx(0.0, abs=1.0)
    assert low[0] == 0.0
    assert high[0] > 100.0


#: Height of the second above the first, its rate, and their standard deviations.
CLIMBS = {
    "level, one above the other": [600.0, 0.0, 15.0, 0.3],
    "level, at one height": [30.0, 0.0, 15.0, 0.3],
    "through the other": [1500.0, -13.0, 20.0, 2.0],
    "away": [500.0, 8.0, 20.0, 2.0],
}


@pytest.mark.parametrize("climb", CLIMBS)
@pytest.mark.parametrize("name", ["crossing", "head-on", "formation", "slow, at the end"])
def test_the_vertical_probability_is_that_of_simulated_motions(name: str, climb: str) -> None:
    """Heights follow the model of their filter; proximity in both is checked every second.

    To 0.05: during the encounter vertical rates are taken as constant.
    """
    states, spreads = _meeting(name, "good")
    height, rate, sigma, rate_sigma = CLIMBS[climb]
    heights = np.zeros((2, CLIMB_COUNT))
    heights[1, :2] = height, rate
    heights[:, 2], heights[:, 4] = 0.5 * sigma**2, 0.5 * rate_sigma**2
    paths = straight_paths(states, spreads, TIMES_S)._replace(heights=heights)
    pair = np.array([[0, 1]])
    found = closest_approaches(paths, pair, np.eye(2)[None], 5_000.0)
    _, both = conflict_probabilities(found, heights_between(paths, pair), 5_000.0, 300.0)
    rng, count = np.random.default_rng(6), 4_000
    drawn = rng.multivariate_normal(states[1] - states[0], spreads.sum(axis=0), count)
    up = height + sigma * rng.normal(size=count)
    climbing = rate + rate_sigma * rng.normal(size=count)
    near = np.zeros(count, np.bool_)
    for time_s in range(121):
        position = drawn[:, :2] + time_s * drawn[:, 2:]
        near |= (np.hypot(*position.T) < 5_000.0) & (np.abs(up) < 300.0)
        # Two aircraft, each with the density of the filter of heights, through a second.
        push = rng.normal(size=(2, count)) * (2.0 * CLIMB_DENSITY) ** 0.5
        up += climbing + 0.5 * push[0] + push[1] / 12.0**0.5
        climbing += push[0]
    assert both[0] == pytest.approx(near.mean(), abs=0.05)
