"""What is known of each sensor at a data time."""

import numpy as np

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
