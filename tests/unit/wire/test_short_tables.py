"""Short tables, whose columns are checked and translated as lists: the same as long ones."""

import pickle
import random
from typing import Any

import polars as pl
import pytest

from multiradar import wire
from multiradar.wire import measurements
from multiradar_schemas.measurements import gates
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from support.inputs.messages import adsb, radar
from support.inputs.odd_values import SENSORS, VALUES


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
