"""The compiled assignment against scipy's, on whole matrices and on sparse scans."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from multiradar.tracking.association._assignment_kernels import (
    EXACT_ROWS_MAX,
    assign_scan,
    least_cost,
)
from multiradar.tracking.association.track_grid import CANDIDATES_MAX, Candidates, TrackGrid

SEEDS = st.integers(0, 2**32 - 1)


@settings(max_examples=200)
@given(seed=SEEDS, rows=st.integers(1, 12), more=st.integers(0, 6), equal=st.booleans())
def test_no_assignment_costs_less(seed: int, rows: int, more: int, equal: bool) -> None:
    rng = np.random.default_rng(seed)
    costs = rng.normal(size=(rows, rows + more))
    if equal:  # Many of the same cost.
        costs = np.round(costs)
    chosen = np.full(rows, -1, np.int64)
    least_cost(costs, chosen)
    assert len(set(chosen.tolist())) == rows
    expected = costs[linear_sum_assignment(costs)].sum()
    np.testing.assert_allclose(costs[np.arange(rows), chosen].sum(), expected, atol=1e-9)


def scan(rng: np.random.Generator, plots: int, tracks: int, each: int) -> Candidates:
    """Plots with up to so many candidates each, the likeliest first."""
    candidates = Candidates.empty(plots)
    for row in range(plots):
        count = int(rng.integers(0, min(each, tracks, CANDIDATES_MAX) + 1))
        candidates.number[row] = count
        candidates.slot[row, :count] = rng.choice(tracks, count, replace=False)
        candidates.score[row, :count] = -np.sort(-rng.exponential(5.0, count))
    return candidates


def assigned(candidates: Candidates, tracks: int) -> np.ndarray:
    plots = np.arange(len(candidates.number))
    chosen = np.full(len(plots), -9, np.int64)
    grid = TrackGrid.empty(1 << int(tracks).bit_length())
    assign_scan(plots, candidates, grid, chosen)
    assert (grid.owner == -1).all()
    assert (grid.local == -1).all()
    return chosen


def total(candidates: Candidates, chosen: np.ndarray) -> float:
    taken = np.flatnonzero(chosen >= 0)
    slots = candidates.slot[taken, chosen[taken]].tolist()
    assert len(set(slots)) == len(slots)
    assert (chosen < candidates.number).all()
    return float(candidates.score[taken, chosen[taken]].sum())


@settings(max_examples=150)
@given(
    seed=SEEDS, plots=st.integers(1, 40), tracks=st.integers(1, 60), each=st.integers(1, 6)
)  # fmt: skip
def test_a_scan_divided_into_components_has_the_greatest_score(
    seed: int, plots: int, tracks: int, each: int
) -> None:
    candidates = scan(np.random.default_rng(seed), plots, tracks, each)
    scores = np.zeros((plots, tracks + plots))
    for row in range(plots):
        for c in range(candidates.number[row]):
            scores[row, candidates.slot[row, c]] = candidates.score[row, c]
    best = scores[linear_sum_assignment(scores, maximize=True)].sum()
    np.testing.assert_allclose(total(candidates, assigned(candidates, tracks)), best, atol=1e-9)


def test_greedy_assignment_of_a_large_component_assigns_each_track_once() -> None:
    plots, tracks = 3 * EXACT_ROWS_MAX, 2 * EXACT_ROWS_MAX
    candidates = scan(np.random.default_rng(1), plots, tracks, CANDIDATES_MAX)
    chosen = assigned(candidates, tracks)
    assert total(candidates, chosen) > 0.0
    assert (chosen >= 0).sum() > 0.9 * tracks
