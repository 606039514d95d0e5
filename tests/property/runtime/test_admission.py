"""Admission is a function of the sequence of rows: cuts and restarts leave no trace."""

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from multiradar.runtime.admission.admission_by_time import Admission
from support.inputs.timed_batches import timed_batch

_STEPS = st.sampled_from([0.0, 0.5, 5.0, 13.0, -2.0, -30.0, 599.0, 601.0, 5000.0, -5000.0, 1e9])
_ROWS = st.lists(st.tuples(_STEPS, st.integers(0, 2)), min_size=1, max_size=60)
#: The third sensor may deliver a row in 3 s of data time, and be ahead by 10 s.
_PACES = np.array([[0.0, 0.0], [0.0, 0.0], [3.0, 10.0]])
_CUTS = st.lists(st.tuples(st.integers(0, 60), st.booleans()), max_size=12)


@given(_ROWS, _CUTS)
def test_cuts_and_restarts_leave_no_trace(
    rows: list[tuple[float, int]], cuts: list[tuple[int, bool]]
) -> None:
    times = [1000.0]
    for step, _ in rows:
        # Around the same clock and away from it.
        times.append(times[-1] + step if abs(step) < 1000.0 else 1000.0 + step)
    sensors = [0, *(sensor for _, sensor in rows)]
    whole = Admission(6.0, 3, paces=_PACES)
    expected = whole.admit(timed_batch(times, sensors)).tolist()

    pieces = Admission(6.0, 3, paces=_PACES)
    found: list[int] = []
    restarts = dict(cuts)
    edges = sorted({0, len(times), *(min(cut, len(times)) for cut in restarts)})
    for start, end in itertools.pairwise(edges):
        found += pieces.admit(timed_batch(times[start:end], sensors[start:end])).tolist()
        if restarts.get(end, False):
            state, pieces = pieces.state(), Admission(6.0, 3, paces=_PACES)
            pieces.restore(state)
    assert found == expected
    assert pieces.state() == whole.state()
