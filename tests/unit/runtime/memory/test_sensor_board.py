"""What is known of each sensor at a data time."""

import numpy as np

from multiradar.runtime.memory.history import UPDATE_DTYPE
from multiradar.runtime.memory.sensor_board import SATURATED_FOR_S, SensorBoard
from support.scenarios.live_scene import sensors


def test_a_sensor_counts_as_saturated_for_a_minute_after_its_last_rejection() -> None:
    table = sensors()
    board = SensorBoard(table)
    board.note_saturated(np.arange(len(table)) == 1, 100.0)
    end_s = 100.0 + SATURATED_FOR_S
    assert SATURATED_FOR_S == 60.0
    assert board.saturated(np.nextafter(end_s, 0.0)) == [table.ids[1]]
    assert board.saturated(end_s) == []
    assert board.saturated(None) == []


def test_after_a_step_back_ages_begin_with_its_time_and_no_sensor_is_saturated() -> None:
    table = sensors()
    board = SensorBoard(table)
    rows = np.zeros(2, UPDATE_DTYPE)
    rows["sensor"], rows["time_s"] = [0, 1], [3600.0, 900.0]
    board.count(rows)
    board.note_saturated(np.arange(len(table)) == 1, 3600.0)
    board.set_back(1000.0)
    assert board.ages_s(1030.0) == {table.ids[0]: 30.0, table.ids[1]: 130.0}
    assert board.saturated(1030.0) == []
    rows["time_s"] = 1010.0
    board.count(rows)
    assert board.ages_s(1030.0) == {table.ids[0]: 20.0, table.ids[1]: 20.0}
