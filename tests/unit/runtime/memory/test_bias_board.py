"""The board of biases: what was known at a time, found without reading all of it."""

import numpy as np
import pytest

from multiradar.runtime.memory.bias_board import BIAS_DTYPE, BiasBoard
from multiradar.tracking.outputs import BiasRecords
from support.scenarios.live_scene import sensors

EPOCH_S = 4.0
EPOCHS = 500


@pytest.mark.parametrize("rows_max", [150, 10_000])
@pytest.mark.parametrize("silent_from", [EPOCHS, 100])
def test_the_biases_at_a_time_are_the_last_row_of_each_parameter_until_then(
    rows_max: int, silent_from: int
) -> None:
    board = BiasBoard(sensors(), rows_max)
    rows = []
    for epoch in range(EPOCHS):
        # From some epoch on, there are no records of the last parameter.
        names = [(0, 0), (0, 1), (1, 0), (1, 1)][: 4 if epoch < silent_from else 3]
        count = len(names)
        records = BiasRecords(
            np.full(count, epoch), np.full(count, EPOCH_S * epoch),
            np.array([sensor for sensor, _ in names], np.int32),
            np.array([parameter for _, parameter in names], np.int8),
            np.arange(count, dtype=np.float64) + 10.0 * epoch, np.ones(count),
        )  # fmt: skip
        board.append(records)
        rows += [(epoch, EPOCH_S * epoch, *name, k + 10.0 * epoch) for k, name in enumerate(names)]
    kept = rows[-rows_max:]
    for time_s in (EPOCH_S * EPOCHS, EPOCH_S * (EPOCHS - 60) + 1.0, 700.0, 10.0):
        expected = {row[2:4]: row[4] for row in kept if row[1] <= time_s}
        found = board.at(time_s)
        assert found.dtype == BIAS_DTYPE
        known = zip(found["sensor"].tolist(), found["parameter"].tolist(), strict=True)
        assert dict(zip(known, found["estimate"].tolist(), strict=True)) == expected


def test_after_a_step_back_pages_go_on_by_time() -> None:
    board = BiasBoard(sensors(), 6)
    none, epochs = np.zeros(1, np.int64), (90, 100, 110, 50, 60, 70, 80)
    for epoch in epochs:
        if epoch == 50:
            board.set_back(196.0)
        time_s = np.array([4.0 * epoch])
        board.append(
            BiasRecords(none + epoch, time_s, none.astype(np.int32), none.astype(np.int8),
                        np.ones(1), np.ones(1))
        )  # fmt: skip
    name = sensors().ids[0]
    assert (board.history(name, 0.0, 9)["time_s"] / 4.0).tolist() == [50, 60, 70, 80, 100, 110]
    assert (board.history(name, 280.0, 2)["time_s"] / 4.0).tolist() == [70, 80]
    assert (board.history(name, None, 2)["time_s"] / 4.0).tolist() == [70, 80]
    # From the step on, everything is there.
    assert board.complete_from_s == 196.0
    assert BiasBoard(sensors(), 6).complete_from_s == -np.inf
