"""Joint probabilities against an enumeration of all events."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from multiradar.tracking.association._probability_kernels import (
    CUT_ROWS_MAX,
    EXACT_MAX,
    joint_probabilities,
    losses,
    pair_probabilities,
)

Floats = NDArray[np.float64]
Event = tuple[tuple[int, ...], ...]

SEEDS = st.integers(0, 2**32 - 1)


def events(w: Floats, merged: Floats) -> dict[Event, float]:
    """Every event, as the tracks of each plot (none, one or two), with its weight."""
    rows, columns = w.shape
    singles: list[tuple[int, ...]] = [(), *((k,) for k in range(columns))]
    choices = [*singles, *itertools.combinations(range(columns), 2)]
    found = {}
    for event in itertools.product(choices, repeat=rows):
        used = [k for tracks in event for k in tracks]
        if len(set(used)) < len(used):
            continue
        weight = 1.0
        for i, tracks in enumerate(event):
            if len(tracks) == 1:
                weight *= w[i, tracks[0]]
            elif len(tracks) == 2:
                weight *= merged[i, tracks[0], tracks[1]]
        found[event] = weight
    return found


def likeliest(found: dict[Event, float]) -> dict[Event, float]:
    """The likeliest of the events with the same plots and the same tracks."""
    best: dict[tuple[frozenset[int], frozenset[int]], tuple[float, Event]] = {}
    for event, weight in found.items():
        plots = frozenset(i for i, tracks in enumerate(event) if tracks)
        tracks = frozenset(k for one in event for k in one)
        if weight > best.get((plots, tracks), (0.0, event))[0]:
            best[plots, tracks] = weight, event
    return {event: weight for weight, event in best.values()}


def expected(found: dict[Event, float], shape: tuple[int, int]) -> tuple[Floats, Floats]:
    beta, gamma = np.zeros(shape), np.zeros(shape)
    for event, weight in found.items():
        for i, tracks in enumerate(event):
            for k in tracks:
                (beta if len(tracks) == 1 else gamma)[i, k] += weight
    total = sum(found.values())
    return beta / total, gamma / total


@pytest.mark.parametrize("best", [True, False])
@settings(max_examples=60)
@given(seed=SEEDS, rows=st.integers(1, 4), columns=st.integers(1, 4), two=st.booleans())
def test_probabilities_are_those_of_all_events(
    best: bool, seed: int, rows: int, columns: int, two: bool
) -> None:
    rng = np.random.default_rng(seed)
    w = np.exp(rng.normal(0.0, 3.0, (rows, columns))) * (rng.uniform(size=(rows, columns)) < 0.7)
    merged = np.triu(np.exp(rng.normal(0.0, 3.0, (rows, columns, columns))), 1) * two
    beta, gamma = np.empty(w.shape), np.empty(w.shape)
    joint_probabilities(w, merged, best, beta, gamma)
    found = events(w, merged)
    known = expected(likeliest(found) if best else found, w.shape)
    np.testing.assert_allclose(beta, known[0], atol=1e-12)
    np.testing.assert_allclose(gamma, known[1], atol=1e-12)


def test_the_likeliest_events_avoid_the_track_coalescence_of_all_events() -> None:
    w = np.exp(np.array([[20.0, 19.5], [19.5, 20.0]]))
    beta, gamma = np.empty((2, 2)), np.empty((2, 2))
    joint_probabilities(w, np.zeros((2, 2, 2)), True, beta, gamma)
    np.testing.assert_allclose(beta, np.eye(2), atol=1e-6)
    joint_probabilities(w, np.zeros((2, 2, 2)), False, beta, gamma)
    assert beta[0, 1] == pytest.approx(1.0 / (1.0 + math.e), abs=1e-6)


@settings(max_examples=80)
@given(seed=SEEDS, rows=st.integers(1, 7), columns=st.integers(1, 7))
def test_no_pair_loses_more_than_it_must(seed: int, rows: int, columns: int) -> None:
    rng = np.random.default_rng(seed)
    scores = rng.normal(3.0, 5.0, (rows, columns))
    scores[rng.uniform(size=scores.shape) < 0.4] = -np.inf
    loss = losses(scores)

    def best(table: Floats) -> float:
        gains = np.hstack([np.where(np.isfinite(table), table, -1e6), np.zeros((len(table),) * 2)])
        return float(gains[linear_sum_assignment(gains, maximize=True)].sum())

    for i, k in itertools.product(range(rows), range(columns)):
        if scores[i, k] == -np.inf:
            assert loss[i, k] == np.inf
            continue
        others = np.delete(np.delete(scores, i, 0), k, 1)
        forced = scores[i, k] + (best(others) if others.size else 0.0)
        assert loss[i, k] <= best(scores) - forced + 1e-6
        assert loss[i, k] >= 0.0
    chosen = linear_sum_assignment(np.where(np.isfinite(scores), scores, -1e6), maximize=True)
    assert np.isfinite(loss).sum() == np.isfinite(scores).sum()
    assert len(chosen[0]) == min(rows, columns)


def chain(pairs: int, weak: float) -> Floats:
    """Ambiguous pairs of plots and tracks, each linked weakly to the next."""
    scores = np.full((2 * pairs, 2 * pairs), -np.inf)
    for one in range(pairs):
        scores[2 * one : 2 * one + 2, 2 * one : 2 * one + 2] = [[20.0, 19.0], [18.5, 20.0]]
        if one:
            scores[2 * one - 1, 2 * one] = weak
    return scores


@pytest.mark.parametrize("best", [True, False])
def test_a_cluster_is_split_at_weak_links(best: bool) -> None:
    scores = chain(7, 2.0)
    size = len(scores)
    assert size > EXACT_MAX
    none = np.full((size, size, size), -np.inf)
    beta, gamma = np.zeros((size, size)), np.zeros((size, size))
    assert pair_probabilities(scores, none, best, beta, gamma)
    alone, other = np.empty((2, 2)), np.empty((2, 2))
    joint_probabilities(np.exp(scores[:2, :2]), np.zeros((2, 2, 2)), best, alone, other)
    for one in range(0, size, 2):
        np.testing.assert_allclose(beta[one : one + 2, one : one + 2], alone, rtol=1e-12)
    assert beta.sum() == pytest.approx(alone.sum() * size / 2)


@pytest.mark.parametrize("size", [EXACT_MAX + 1, CUT_ROWS_MAX + 1])
def test_a_cluster_that_cannot_be_split_keeps_its_assignment(size: int) -> None:
    scores = np.full((size, size), 20.0)
    none = np.full((size, size, size), -np.inf)
    beta, gamma = np.zeros((size, size)), np.zeros((size, size))
    assert not pair_probabilities(scores, none, True, beta, gamma)
    assert not beta.any()
