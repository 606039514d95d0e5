"""Small measurement batches for tests."""

from collections.abc import Sequence
from math import isnan

import numpy as np

from multiradar.tracking.input.measurements import COLUMNS, MeasurementBatch


def batch_of(
    time_s: Sequence[float],
    *,
    track_number: Sequence[int] | None = None,
    mode_s_address: Sequence[int] | None = None,
    height_m: Sequence[float] | None = None,
    range_m: Sequence[float] | None = None,
) -> MeasurementBatch:
    """Radar plots of sensor 0; what is not given is missing or the same for all."""
    n = len(time_s)
    nothing = np.full(n, np.nan)
    unknown = np.full(n, -1, np.int64)
    return MeasurementBatch(
        time_s=np.array(time_s, np.float64),
        sensor=np.zeros(n, np.int32),
        kind=np.zeros(n, np.int8),
        range_m=np.full(n, 50_000.0) if range_m is None else np.array(range_m, np.float64),
        azimuth_rad=np.full(n, 1.0),
        latitude_rad=nothing,
        longitude_rad=nothing,
        height_m=np.full(n, 9_000.0) if height_m is None else np.array(height_m, np.float64),
        mode_3a=np.full(n, -1, np.int32),
        mode_s_address=unknown if mode_s_address is None else np.array(mode_s_address, np.int64),
        track_number=np.zeros(n, np.int64)
        if track_number is None
        else np.array(track_number, np.int64),
        callsign=unknown,
    )


def rows_of(batch: MeasurementBatch) -> list[tuple[object, ...]]:
    """The rows as tuples that compare equal when all columns are; NaN becomes None."""
    columns = [getattr(batch, name).tolist() for name in COLUMNS]
    return [
        tuple(None if isinstance(value, float) and isnan(value) else value for value in row)
        for row in zip(*columns, strict=True)
    ]
