"""The search by cells finds the same pairs as an exhaustive search."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from multiradar.tracking.encounters.approaches import closest_approaches
from multiradar.tracking.encounters.pairs import Paths, near_pairs
from support.scenarios.encounter_paths import covariance, least_distances, straight_paths

SEEDS = st.integers(0, 2**32 - 1)
#: Accuracy of distances, m; a pair this close to the threshold may be included or not.
TOLERANCE_M = 1e-3


def traffic(rng: np.random.Generator, count: int, area_m: float) -> Paths:
    """Straight or turning aircraft, some at one position or in formation, some off the plane."""
    states = np.column_stack(
        [rng.uniform(-area_m, area_m, (count, 2)), rng.normal(0.0, 150.0, (count, 2))]
    )
    kind = rng.integers(0, 5, count)
    others = rng.integers(0, count, count)
    states[kind == 1] = states[others[kind == 1]]
    states[kind == 2, 2:] = states[others[kind == 2], 2:]
    states[kind == 3, 2:] *= 8.0
    times_s = np.array([0.0, 10.0, 20.0, 30.0, 37.5])
    paths = straight_paths(states, np.array([covariance(50.0, 5.0)] * count), times_s, 1.0)
    turning = np.flatnonzero(rng.random(count) < 0.5)
    rate = rng.uniform(-0.05, 0.05, len(turning))[:, None] * times_s
    speed = states[turning, None, 2] + 1j * states[turning, None, 3]
    velocity = speed * np.exp(1j * rate)
    # A turn of constant rate: the path is the integral of the velocity.
    turned = speed * times_s * np.exp(0.5j * rate) * np.sinc(rate / (2.0 * np.pi))
    paths.means[turning, :, 0] = states[turning, None, 0] + turned.real
    paths.means[turning, :, 1] = states[turning, None, 1] + turned.imag
    paths.means[turning, :, 2], paths.means[turning, :, 3] = velocity.real, velocity.imag
    leaves = rng.random(count) < 0.2
    return paths._replace(points=np.where(leaves, rng.integers(0, 6, count), 5))


@settings(max_examples=40)
@given(seed=SEEDS, count=st.integers(0, 40), distance_km=st.floats(0.1, 30.0))
def test_cells_find_the_pairs_of_an_exhaustive_search(
    seed: int, count: int, distance_km: float
) -> None:
    rng = np.random.default_rng(seed)
    paths = traffic(rng, count, 60e3)
    distance_m = 1000.0 * distance_km
    nearest, when = least_distances(paths)
    first, second = np.triu_indices(count, 1)
    least = nearest[first, second]
    found = near_pairs(paths, distance_m)
    pairs = {tuple(pair) for pair in found.tracks.tolist()}
    sure = least < distance_m - TOLERANCE_M
    possible = least < distance_m + TOLERANCE_M
    assert set(zip(first[sure].tolist(), second[sure].tolist(), strict=True)) <= pairs
    assert pairs <= set(zip(first[possible].tolist(), second[possible].tolist(), strict=True))
    assert len(found.tracks) == len(pairs)
    assert found.left_out == 0
    flat = np.broadcast_to(np.eye(2), (len(pairs), 2, 2))
    approaches = closest_approaches(paths, found.tracks, flat, distance_m)
    apart = ~approaches.together
    at = tuple(found.tracks[apart].T)
    np.testing.assert_allclose(approaches.distance_m[apart], nearest[at], atol=TOLERANCE_M)
    # Where the distance hardly changes the time is undefined.
    sharp = apart & (approaches.time_sigma_s < 5.0)
    np.testing.assert_allclose(
        approaches.time_s[sharp], when[tuple(found.tracks[sharp].T)], atol=0.1
    )


@pytest.mark.parametrize("limit", ["pairs_max", "comparisons_max"])
def test_pairs_beyond_a_limit_are_counted(limit: str) -> None:
    """Sixty aircraft at one position are 1770 pairs in each piece."""
    states = np.zeros((60, 4))
    paths = straight_paths(
        states, np.array([covariance(50.0, 5.0)] * 60), np.array([0.0, 10.0, 20.0])
    )
    everything = near_pairs(paths, 1000.0)
    assert len(everything.tracks) == 1770
    assert everything.compared == 2 * 1770
    assert everything.left_out == 0
    bounded = near_pairs(paths, 1000.0, **{limit: 500})
    assert len(bounded.tracks) <= 500
    missing = 2 * 1770 - bounded.compared if limit == "comparisons_max" else 2 * (1770 - 500)
    assert bounded.left_out == missing > 0
