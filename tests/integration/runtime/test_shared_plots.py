"""Scenarios of closely spaced aircraft, tracked with probabilistic association."""

from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.errors import ConfigurationError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame, truth_frame
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import EngineOutput, TrackUpdates
from multiradar.tracking.settings import TrackingSettings

HIDDEN = ("track_number", "mode_s_address", "mode_3a")
SHARED = TrackingSettings(association="probabilistic", hidden_fields=HIDDEN)
NEAREST = TrackingSettings(hidden_fields=HIDDEN)


@cache
def made(name: str, seed: int) -> tuple[SensorTable, MeasurementBatch, pl.DataFrame]:
    scene = replace(builtin_scenario(name), seed=seed)
    seen = observe(scene, np.random.Generator(np.random.PCG64(seed)))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "sensors.toml"
        path.write_text(sensors_text(scene), encoding="utf-8")
        table = load_sensor_table(path)
    batch, _ = wire.measurement_batch(measurements_frame(scene, seen), table)
    return table, batch, truth_frame(scene, seen)


def run(
    table: SensorTable, batch: MeasurementBatch, settings: TrackingSettings, rows: int = 10**9,
    workers: int = 1,
) -> tuple[list[EngineOutput], Engine]:  # fmt: skip
    engine = Engine(table, settings, workers)
    cuts = range(0, len(batch), rows)
    outputs = [engine.push(batch.select(slice(cut, cut + rows))) for cut in cuts]
    outputs.append(engine.flush())
    engine.close()
    return outputs, engine


def row_bytes(outputs: list[EngineOutput]) -> list[bytes]:
    """The bytes of all output, independent of the batches."""
    updates = TrackUpdates.concatenate([one.updates for one in outputs])
    estimates = np.concatenate([one.biases.estimate for one in outputs])
    ended = np.concatenate([one.ended.track_id for one in outputs])
    columns = [getattr(updates, field.name) for field in fields(updates)]
    return [np.ascontiguousarray(one).tobytes() for one in (*columns, estimates, ended)]


def confirmed(table: SensorTable, outputs: list[EngineOutput], truth: pl.DataFrame) -> pl.DataFrame:
    """Updates of confirmed tracks with the aircraft of their plots."""
    updates = TrackUpdates.concatenate([one.updates for one in outputs])
    keys = ["time_s", "sensor_id"]
    once = truth.select(*keys, "track_number").unique(keys, keep="none")
    frame = wire.tracks_frame(updates, table).drop("track_number")
    return frame.join(once, on=keys).filter(pl.col("state") != "tentative").sort("sequence")


@pytest.mark.parametrize("filter_name", ["two-stage", "imm"])
def test_the_output_does_not_depend_on_batches_or_workers(filter_name: str) -> None:
    table, batch, _ = made("unresolved", 1)
    middle = batch.select((batch.time_s > 250.0) & (batch.time_s < 420.0))
    settings = replace(SHARED, filter_name=filter_name)
    whole, engine = run(table, middle, settings)
    assert row_bytes(whole) == row_bytes(run(table, middle, settings, rows=7)[0])
    assert row_bytes(whole) == row_bytes(run(table, middle, settings, rows=1)[0])
    assert row_bytes(whole) == row_bytes(run(table, middle, settings, workers=3)[0])
    assert row_bytes(whole) != row_bytes(
        run(table, middle, replace(NEAREST, filter_name=filter_name))[0]
    )
    assert engine.counts["SINGULAR"] == 0


@pytest.mark.parametrize("filter_name", ["two-stage", "imm"])
def test_without_ambiguity_the_nearest_plot_is_used(filter_name: str) -> None:
    table, batch, truth = made("crossing", 1)
    # Three aircraft that are never close, and one radar, so that each has one track only.
    chosen = truth.select(
        pl.col("track_number").is_in([1, 5, 9]) & (pl.col("sensor_id") == "north")
    )
    alone = batch.select(chosen.to_series().to_numpy())
    assert len(alone) > 300
    settings = replace(SHARED, filter_name=filter_name)
    nearest = replace(NEAREST, filter_name=filter_name)
    assert row_bytes(run(table, alone, settings)[0]) == row_bytes(run(table, alone, nearest)[0])


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_aircraft_leaving_a_formation_gets_a_new_track_and_the_leader_keeps_its_own(
    seed: int,
) -> None:
    table, batch, truth = made("formation-split", seed)
    outputs, _ = run(table, batch, SHARED)
    rows = confirmed(table, outputs, truth)
    before = rows.filter(pl.col("time_s").is_between(200.0, 300.0))
    after = rows.filter(pl.col("time_s").is_between(400.0, 600.0))
    for group in ((1, 2), (3, 4), (5, 6), (7, 8, 9)):
        mine = before.filter(pl.col("track_number").is_in(group))
        first = mine["track_id"].mode()[0]
        late = {
            number: after.filter(pl.col("track_number") == number)["track_id"].mode()[0]
            for number in group
        }
        assert len(set(late.values())) == len(group)
        assert first in late.values()


def kept(rows: pl.DataFrame) -> int:
    """Number of crossing aircraft with the same track before and after."""
    same = 0
    for number in range(1, 13):
        mine = rows.filter(pl.col("track_number") == number)
        before = mine.filter(pl.col("time_s").is_between(200.0, 300.0))["track_id"].mode()[0]
        after = mine.filter(pl.col("time_s").is_between(450.0, 600.0))["track_id"].mode()[0]
        same += before == after
    return same


def test_tracks_that_cross_unresolved_are_not_merged() -> None:
    table, batch, truth = made("unresolved", 2)
    tracks = {}
    for settings in (NEAREST, SHARED):
        rows = confirmed(table, run(table, batch, settings)[0], truth)
        pairs = rows.filter(pl.col("track_number") <= 12)
        tracks[settings.association] = pairs["track_id"].n_unique()
    assert tracks["probabilistic"] == 12 < tracks["nearest"]


def test_an_unresolved_plot_of_two_aircraft_causes_no_track_swap() -> None:
    table, batch, truth = made("unresolved", 4)
    settings = replace(SHARED, filter_name="imm")
    assert kept(confirmed(table, run(table, batch, settings)[0], truth)) == 12
    # With each plot assigned to one aircraft, tracks that cross at 5° swap.
    nearest = replace(NEAREST, filter_name="imm")
    assert kept(confirmed(table, run(table, batch, nearest)[0], truth)) < 12


@pytest.mark.parametrize("name", ["blom", "blom-macro", "ci", "joint"])
def test_a_filter_that_cannot_share_plots_is_rejected(name: str) -> None:
    table, _, _ = made("unresolved", 1)
    with pytest.raises(ConfigurationError, match="two-stage or imm with probabilistic association"):
        Engine(table, replace(SHARED, filter_name=name))
