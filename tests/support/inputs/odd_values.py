"""Values at and beyond bounds, for tables of measurements."""

from dataclasses import replace
from typing import Any

import numpy as np
import polars as pl

from multiradar import wire
from support.inputs.messages import sensors

_TABLE = wire.sensor_table(sensors())
#: The last sensor is disabled, and ranges are bounded.
SENSORS = replace(
    _TABLE,
    range_max_m=np.full(len(_TABLE), 500_000.0),
    disabled=np.arange(len(_TABLE)) == len(_TABLE) - 1,
)
#: Values by type, at and beyond bounds.
NUMBERS = (
    0.0, -0.0, -1.0, 1e-9, 45.0, 90.0, 90.1, 180.0, 359.9, 360.0, 1_000.0, 1e6, 1e12, 1.7e9,
    float("nan"), float("inf"), -float("inf"), None,
)  # fmt: skip
TEXTS = (
    None, "", "41-10", "adsb", "radar", "bearing", "mlat", "sonar", "7000", "7000\n", "8000",
    "4b1234", "4B1234\n", "KLM 1", "\u017f", "psr", "mode_s", "none",
)  # fmt: skip
VALUES: dict[type[pl.DataType], tuple[Any, ...]] = {
    pl.Float64: NUMBERS,
    pl.String: TEXTS,
    pl.Int64: (None, -1, 0, 5, 2**62),
    pl.Boolean: (None, True, False),
}
