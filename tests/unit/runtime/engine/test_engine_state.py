"""An engine that continues from its state gives the same bytes, and the same next state."""

from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.estimation.filters.bank import FILTERS
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.digest import BLOCK_OCTETS, BlockDigest, OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.state import copied_state, encoded_state, restore_state
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.settings import BY_PROBABILITY, TrackingSettings
from support.scenarios import bearing_scene
from support.simulation import traffic

SENSORS = wire.sensor_table(traffic.sensors(traffic.SITES))


def seen() -> MeasurementBatch:
    """Return plots and reports of aircraft of which some have no address."""
    rows = [row for plots in traffic.plots(1, 48.0).values() for row in plots]
    rows.sort(key=lambda row: row["time_s"])
    for row in rows:
        if row["mode_s_address"] >= "4b0004" and row["kind"] == "radar":
            row["mode_s_address"] = None
    # Some come twice, and the last are late by more than others.
    frame = pl.DataFrame([*rows, *rows[100:120]], infer_schema_length=None)
    return _batch(frame, SENSORS)


def _batch(frame: pl.DataFrame, table: SensorTable) -> MeasurementBatch:
    batch, _ = wire.measurement_batch(frame, table)
    return batch


def shown(holder: object) -> tuple[Any, list[tuple[str, bytes]]]:
    """Return a state in a form that can be compared."""
    document, arrays = encoded_state(copied_state(holder))
    return document, [(f"{one.dtype}{one.shape}", one.tobytes()) for one in arrays]


def check(table: SensorTable, settings: TrackingSettings, batch: MeasurementBatch) -> None:
    """Stop in the middle, continue with another engine, and compare."""
    middle = int(np.random.default_rng(len(batch)).integers(len(batch) // 3, len(batch)))
    whole, digest = Engine(table, settings, sampling=Sampling.DRAWN), OutputDigest()
    digest.add(whole.push(batch.select(slice(None, middle))))
    states = [encoded_state(copied_state(one)) for one in (whole, digest)]
    other, other_digest = Engine(table, settings, sampling=Sampling.DRAWN), OutputDigest()
    for one, state in zip((other, other_digest), states, strict=True):
        restore_state(one, state)
    assert all(array.flags.c_contiguous for array in states[0].arrays)
    for engine, own in ((whole, digest), (other, other_digest)):
        own.add(engine.push(batch.select(slice(middle, None))))
        own.add(engine.flush())
    assert digest.hexdigest() == other_digest.hexdigest()
    assert shown(whole) == shown(other)


@pytest.mark.parametrize("name", FILTERS)
def test_a_filter_continues(name: str) -> None:
    check(SENSORS, TrackingSettings(filter_name=name), seen())


def test_probabilistic_association_continues() -> None:
    check(SENSORS, TrackingSettings(association=BY_PROBABILITY), seen())


def test_buffered_bearings_continue() -> None:
    scene = bearing_scene.make(aircraft=2, seconds=40.0, from_s=35.0)
    table = bearing_scene.sensors()
    check(table, TrackingSettings(filter_name="imm"), _batch(scene.frame.sort("time_s"), table))


def test_the_digest_of_many_octets_depends_on_them_alone() -> None:
    octets = np.random.default_rng(1).bytes(2 * BLOCK_OCTETS + 5)
    together, parts, apart = BlockDigest(), BlockDigest(), BlockDigest()
    together.update(octets)
    for first in range(0, len(octets), BLOCK_OCTETS // 3 + 1):
        state = encoded_state(copied_state(apart))
        apart = BlockDigest()
        restore_state(apart, state)
        apart.update(octets[first : first + BLOCK_OCTETS // 3 + 1])
        parts.update(octets[first : first + BLOCK_OCTETS // 3 + 1])
    assert apart.digest() == parts.digest() == together.digest()
    apart.update(b"!")
    assert apart.digest() != together.digest()
