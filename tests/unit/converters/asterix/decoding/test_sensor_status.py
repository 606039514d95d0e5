"""Status of sensors: their names, and figures that are absent."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from multiradar_converters.asterix.decoding.sensor_status import last_status, read_status


def test_codes_of_zero_name_a_sensor_and_absent_ones_do_not() -> None:
    codes = {"SAC": np.array([0, 20, -1, 20]), "SIC": np.array([5, 0, 5, -1])}
    columns: Any = SimpleNamespace(
        integers=lambda _node, field: codes[field],
        numbers=lambda node, *_: np.array([1.0, np.nan, 3.0, 4.0]) * (1.0 if node == "070" else 2),
    )
    status = read_status(columns)
    assert status["sensor_id"].to_list() == ["0-5", "20-0", None, None]
    assert set(last_status(status)) == {"0-5", "20-0"}
    assert last_status(status)["0-5"]["time_stamping_bias_ms"] == 1
    assert last_status(status)["20-0"] == {}
