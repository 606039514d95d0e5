"""Batches of which only times and sensors matter."""

from typing import Any

import numpy as np

from multiradar.tracking.input.measurements import COLUMNS, MeasurementBatch

_EMPTY = MeasurementBatch.empty()
_TYPES = {name: getattr(_EMPTY, name).dtype for name in COLUMNS}


def timed_batch(times: list[float], sensor: int | list[int] = 0) -> MeasurementBatch:
    """Return measurements at these times, of one sensor or one sensor each."""
    count = len(times)
    columns: dict[str, Any] = {name: np.zeros(count, dtype) for name, dtype in _TYPES.items()}
    columns["time_s"] = np.array(times, np.float64)
    columns["sensor"] = np.broadcast_to(np.array(sensor, np.int32), count).copy()
    return MeasurementBatch(**columns)
