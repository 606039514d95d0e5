"""OSPA is a metric on sets, bounded by its cut-off."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from multiradar.evaluation.instants import assign_tracks
from multiradar.evaluation.measures.distances import set_distances
from multiradar.evaluation.settings import EvaluationSettings
from support.scenarios.skies import reference_of, straight, tracks_of

CUTOFF_M = 1000.0
position = st.floats(-2000.0, 2000.0).map(lambda value: round(value, 3))
points = st.lists(st.tuples(position, position), min_size=1, max_size=5)
Points = list[tuple[float, float]]


def ospa(first: Points, second: Points, order: float = 2.0) -> float:
    reference = reference_of(
        {f"{n}": straight([0.0], *one, 0.0, 0.0) for n, one in enumerate(first)}
    )
    simulated = tracks_of({n: straight([0.0], *one, 0.0, 0.0) for n, one in enumerate(second)})
    instants = assign_tracks(simulated, reference, EvaluationSettings(gate_m=1e5))
    return float(set_distances(instants, CUTOFF_M, order).ospa_m[0])


@settings(max_examples=60)
@given(points, points, points, st.sampled_from([1.0, 2.0]))
def test_it_is_a_metric_bounded_by_the_cut_off(
    first: Points, second: Points, third: Points, order: float
) -> None:
    ab, ba = ospa(first, second, order), ospa(second, first, order)
    assert ab == pytest.approx(ba, abs=1e-6)
    assert 0.0 <= ab <= CUTOFF_M + 1e-9
    assert ospa(first, first, order) == pytest.approx(0.0, abs=1e-6)
    assert ab <= ospa(first, third, order) + ospa(third, second, order) + 1e-6


@settings(max_examples=30)
@given(points, points, st.randoms(use_true_random=False))
def test_order_and_names_of_tracks_do_not_matter(
    first: Points, second: Points, draw: object
) -> None:
    order = np.random.Generator(np.random.PCG64(draw.randrange(1000))).permutation(len(second))  # type: ignore[attr-defined]
    assert ospa(first, second) == pytest.approx(ospa(first, [second[n] for n in order]), abs=1e-6)
