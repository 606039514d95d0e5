"""Order in which shared plots are processed."""

import numpy as np

from multiradar.estimation.filters._kernels import NONE
from multiradar.estimation.filters.arrays import Rows
from multiradar.tracking.association.shared_plots import Shares, _rounds


def rows(*slots_and_times: tuple[int, float]) -> Rows:
    slot, time = (np.array(column) for column in zip(*slots_and_times, strict=True))
    none, nothing = np.zeros(len(slot), np.int64), np.full(len(slot), np.nan)
    return Rows(
        slot.astype(np.int64), time.astype(np.float64), none, none, np.zeros((len(slot), 2)),
        nothing, none, none - 1,
    )  # fmt: skip


def test_each_round_has_all_that_its_aircraft_may_have_by_time() -> None:
    """Track 4 may have rows 0 or 1 of one radar, then row 2 of another; track 5 has row 3 alone."""
    seen = rows((4, 10.1), (5, 10.2), (4, 10.3), (5, 10.0))
    shares = Shares(
        group=np.array([0, 0, 0, 3, 3]),
        slot=np.array([4, 4, 4, 4, 4]),
        own=np.array([0, 0, 0, 2, 2]),
        row=np.array([NONE, 0, 1, NONE, 2]),
        unresolved=np.array([0, 0, 1, 0, 0]),
        probability=np.array([0.1, 0.6, 0.3, 0.2, 0.8]),
    )
    first, second = _rounds(shares, np.array([0, 3]), seen)
    assert (first.slot.tolist(), first.own.tolist()) == ([4, 5], [0, 3])
    assert first.time.tolist() == [10.1, 10.0]
    assert first.bounds.tolist() == [0, 3, 4]
    assert first.row.tolist() == [NONE, 0, 1, 3]
    assert first.unresolved.tolist() == [0, 0, 1, 0]
    assert first.probability.tolist() == [0.1, 0.6, 0.3, 1.0]
    assert (second.slot.tolist(), second.own.tolist()) == ([4], [2])
    assert second.bounds.tolist() == [0, 2]
    assert second.row.tolist() == [NONE, 2]
    assert second.probability.tolist() == [0.2, 0.8]
