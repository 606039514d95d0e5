"""Short tables, whose columns are checked and translated as lists: the same as long ones."""

import pickle
import random
from dataclasses import replace
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.wire import measurements
from multiradar_schemas.measurements import gates
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from support.inputs.messages import adsb, radar, sensors

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


def table(seed: int) -> pl.DataFrame:
    """Rows of which some are valid and others differ in one or two values."""
    drawn = random.Random(seed)
    rows = []
    for _ in range(drawn.randrange(1, 4)):
        row = {name: None for name in MEASUREMENT_SCHEMA} | drawn.choice([radar, adsb])()
        for name in drawn.sample(list(MEASUREMENT_SCHEMA), drawn.choice([0, 0, 1, 2])):
            row[name] = drawn.choice(VALUES[type(MEASUREMENT_SCHEMA[name])])
        rows.append(row)
    return pl.DataFrame(rows, schema=MEASUREMENT_SCHEMA)


def found(frame: pl.DataFrame) -> tuple[Any, ...]:
    batch, rejected = wire.measurement_batch(frame, SENSORS)
    # By content, with the types of all columns.
    return pickle.dumps(batch), rejected.index.tolist(), rejected.code, rejected.reason


@pytest.mark.parametrize("first", range(0, 900, 300))
def test_the_result_is_that_of_the_expressions(first: int, monkeypatch: pytest.MonkeyPatch) -> None:
    frames = [table(seed) for seed in range(first, first + 300)]
    listed = [found(frame) for frame in frames]
    for module in (gates, measurements):
        monkeypatch.setattr(module, "LISTED_ROWS_MAX", -1)
    assert listed == [found(frame) for frame in frames]
    rejected = [bool(index) for _, index, _, _ in listed]
    assert any(rejected)
    assert not all(rejected)
