"""Which tracks each step back of the data time has terminated."""

import numpy as np

from multiradar.runtime.memory.set_backs import TRACK_STEPS_MAX, joined_steps, superseded_from_s


def test_steps_that_a_later_one_includes_are_discarded() -> None:
    steps = [(5, 300.0), (9, 400.0), (12, 350.0), (12, 360.0), (20, 800.0), (25, 900.0)]
    joined = [(5, 300.0), (12, 350.0), (20, 800.0), (25, 900.0)]
    assert joined_steps(steps[3:], steps[:4]) == joined
    assert joined_steps(joined, steps) == joined
    assert joined_steps(joined, [(30, 300.0)]) == [(30, 300.0)]
    ids = np.arange(1, 30)
    expected = [min([s for last, s in steps if one <= last], default=np.inf) for one in ids]
    assert superseded_from_s(ids, joined).tolist() == expected
    assert superseded_from_s(ids, []).tolist() == [np.inf] * len(ids)
    many = [(one, float(one)) for one in range(TRACK_STEPS_MAX + 5)]
    assert joined_steps(many) == many[5:]
