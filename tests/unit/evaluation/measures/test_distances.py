"""OSPA and GOSPA agree with the formulas of their papers."""

import itertools

import numpy as np
import pytest

from multiradar.evaluation.instants import assign_tracks
from multiradar.evaluation.measures.distances import SetDistances, set_distances
from multiradar.evaluation.settings import EvaluationSettings
from support.scenarios.skies import reference_of, straight, tracks_of

Point = tuple[float, float]


def between(
    aircraft: list[Point], tracks: list[Point], cutoff_m: float, order: float
) -> SetDistances:
    """Return the distances at one instant; a distant aircraft in both sets keeps them non-empty."""
    far = (1e6, 1e6)
    reference = reference_of(
        {
            f"{n:02d}": straight([0.0], *position, 0.0, 0.0)
            for n, position in enumerate([*aircraft, far])
        }
    )
    simulated = tracks_of(
        {n: straight([0.0], *position, 0.0, 0.0) for n, position in enumerate([*tracks, far])}
    )
    wide = EvaluationSettings(gate_m=1e5)
    return set_distances(assign_tracks(simulated, reference, wide), cutoff_m, order)


def by_hand(
    first: list[Point], second: list[Point], cutoff_m: float, order: float
) -> tuple[float, float]:
    """Return OSPA and GOSPA (α = 2) by trying every assignment."""
    few, many = sorted(([*first, (1e6, 1e6)], [*second, (1e6, 1e6)]), key=len)
    penalty = cutoff_m**order
    cost = (
        np.minimum(
            np.hypot(*(np.array(few)[:, None] - np.array(many)[None]).transpose(2, 0, 1)), cutoff_m
        )
        ** order
    )
    best = min(
        sum(cost[row, column] for row, column in enumerate(chosen))
        for chosen in itertools.permutations(range(len(many)), len(few))
    )
    extra = len(many) - len(few)
    ospa = ((best + penalty * extra) / len(many)) ** (1.0 / order)
    return ospa, (best + 0.5 * penalty * extra) ** (1.0 / order)


@pytest.mark.parametrize("order", [1.0, 2.0, 3.0])
def test_both_are_the_least_over_all_assignments(order: float) -> None:
    draw = np.random.Generator(np.random.PCG64(7))
    for _ in range(20):
        aircraft, tracks = (
            [tuple(position) for position in draw.uniform(-900.0, 900.0, (draw.integers(0, 5), 2))]
            for _ in range(2)
        )
        found = between(aircraft, tracks, 700.0, order)
        ospa, gospa = by_hand(aircraft, tracks, 700.0, order)
        assert found.ospa_m[0] == pytest.approx(ospa)
        assert found.gospa_m[0] == pytest.approx(gospa)
        parts = found.localisation + found.missed + found.false_
        assert parts[0] == pytest.approx(found.gospa_m[0] ** order)


def test_a_missed_aircraft_and_a_false_track_are_distinguished() -> None:
    found = between([(0.0, 0.0), (5000.0, 0.0)], [(30.0, 40.0)], 1000.0, 2.0)
    assert found.localisation[0] == pytest.approx(50.0**2)
    assert found.missed[0] == pytest.approx(0.5 * 1000.0**2)
    assert found.false_[0] == 0.0
    # Three aircraft with the distant one: one 50 m off, one missed, one exact.
    assert found.ospa_m[0] == pytest.approx(np.sqrt((50.0**2 + 1000.0**2) / 3.0))


def test_a_track_beyond_the_cut_off_is_a_miss_and_a_false_track() -> None:
    found = between([(0.0, 0.0)], [(1000.0, 0.0)], 1000.0, 2.0)
    assert (found.localisation[0], found.missed[0], found.false_[0]) == (0.0, 5e5, 5e5)
    assert found.gospa_m[0] == pytest.approx(1000.0)
