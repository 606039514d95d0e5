"""Aircraft reports that contradict radars are flagged, and not followed."""

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame, truth_frame
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.simulation.scenario.model import Sensor
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.simulation.traffic import run_generator
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings

#: Three scans of the slowest radar of the scenarios.
SCANS_3_S = 18.0
JUMPS, DRIFTS, WRONG, BEYOND, LOW = 1, 2, 3, 5, 6
JUMP_S, RIGHT_AGAIN_S, DRIFT_S, GHOST_S = 300.0, 600.0, 300.0, 200.0
EARTH_RADIUS_M = 6_371_000.0


@dataclass(frozen=True)
class Scene:
    """A simulated scenario as input of the tracker, and its truth."""

    table: SensorTable
    frame: pl.DataFrame
    truth: pl.DataFrame
    biases: pl.DataFrame


@cache
def scene(name: str) -> Scene:
    described = builtin_scenario(name)
    seen = observe(described, run_generator(described.seed))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "sensors.toml"
        path.write_text(sensors_text(described), encoding="utf-8")
        table = load_sensor_table(path)
    biases = [
        (one.identifier, kind, one.biases[kind].value)
        for one in described.sensors
        for kind in (0, 1)
        if one.kind == "radar"
    ]
    return Scene(
        table,
        measurements_frame(described, seen),
        truth_frame(described, seen),
        pl.DataFrame(biases, schema=["sensor_id", "kind", "value"], orient="row"),
    )


def batch_of(frame: pl.DataFrame, table: SensorTable) -> MeasurementBatch:
    batch, rejected = wire.measurement_batch(frame, table)
    assert len(rejected) == 0
    return batch


@cache
def tracked(name: str, filter_name: str, hidden: tuple[str, ...]) -> tuple[pl.DataFrame, Engine]:
    """Return the tracks of a scenario with the truth of their plots, and the engine."""
    one = scene(name)
    engine = Engine(one.table, TrackingSettings(filter_name=filter_name, hidden_fields=hidden))
    batch = batch_of(one.frame, one.table)
    updates = TrackUpdates.concatenate([engine.push(batch).updates, engine.flush().updates])
    keys = ["time_s", "sensor_id"]
    truth = one.truth.select(
        *keys, pl.col("track_number").alias("aircraft"), pl.col("latitude_deg").alias("true_lat"),
        pl.col("longitude_deg").alias("true_lon"),
    ).unique(keys, keep="none")  # fmt: skip
    east = (pl.col("longitude_deg") - pl.col("true_lon")) * pl.col("true_lat").radians().cos()
    north = pl.col("latitude_deg") - pl.col("true_lat")
    error = (east**2 + north**2).sqrt().radians() * EARTH_RADIUS_M
    tracks = wire.tracks_frame(updates, one.table).join(truth, on=keys, how="left")
    return tracks.with_columns(error.alias("error_m")).sort("sequence"), engine


CASES = pytest.mark.parametrize(
    ("filter_name", "hidden"),
    [("two-stage", ()), ("imm", ()), ("two-stage", ("track_number",)), ("blom", ())],
)


def flagged_s(tracks: pl.DataFrame, aircraft: int) -> "list[float]":
    mine = tracks.filter((pl.col("aircraft") == aircraft) & pl.col("adsb_implausible"))
    return mine["time_s"].to_list()


def worst_m(tracks: pl.DataFrame, aircraft: int, since_s: float) -> float:
    mine = tracks.filter((pl.col("aircraft") == aircraft) & (pl.col("time_s") >= since_s))
    return float(mine["error_m"].to_numpy().max())


@CASES
@pytest.mark.fault(19)
def test_reports_that_jump_are_flagged_within_three_scans_and_not_followed(
    filter_name: str, hidden: tuple[str, ...]
) -> None:
    tracks, _ = tracked("ghost-adsb", filter_name, hidden)
    times = flagged_s(tracks, JUMPS)
    assert JUMP_S < times[0] <= JUMP_S + SCANS_3_S
    # Six consistent comparisons clear the flag.
    assert RIGHT_AGAIN_S - 6.0 <= times[-1] <= RIGHT_AGAIN_S + SCANS_3_S
    assert worst_m(tracks, JUMPS, 60.0) <= 200.0
    assert tracks.filter(pl.col("aircraft") == JUMPS)["track_id"].n_unique() == 1


@CASES
def test_reports_that_drift_away_are_flagged_before_they_are_far_and_not_followed(
    filter_name: str, hidden: tuple[str, ...]
) -> None:
    tracks, _ = tracked("ghost-adsb", filter_name, hidden)
    times = flagged_s(tracks, DRIFTS)
    assert DRIFT_S < times[0] <= DRIFT_S + SCANS_3_S
    assert times[-1] >= 890.0
    assert worst_m(tracks, DRIFTS, 60.0) <= 400.0
    assert worst_m(tracks, DRIFTS, DRIFT_S + 60.0) <= 300.0


@CASES
def test_an_on_board_error_is_flagged_within_three_scans_of_the_first_report(
    filter_name: str, hidden: tuple[str, ...]
) -> None:
    tracks, _ = tracked("ghost-adsb", filter_name, hidden)
    assert flagged_s(tracks, WRONG)[0] <= SCANS_3_S
    assert worst_m(tracks, WRONG, 60.0) <= 300.0


@CASES
@pytest.mark.fault(19)
def test_an_aircraft_that_radars_should_see_and_do_not_is_flagged_and_kept(
    filter_name: str, hidden: tuple[str, ...]
) -> None:
    tracks, _ = tracked("ghost-adsb", filter_name, hidden)
    ghost = tracks.filter(pl.col("aircraft").is_null() & (pl.col("sensor_id") == "adsb"))
    assert ghost["track_id"].n_unique() == 1
    flags = ghost.filter("adsb_implausible")["time_s"]
    assert GHOST_S < flags[0] <= GHOST_S + SCANS_3_S
    assert len(flags) == len(ghost.filter(pl.col("time_s") >= flags[0]))
    assert flags[-1] > 895.0


@CASES
def test_no_other_aircraft_is_flagged_even_outside_radar_coverage(
    filter_name: str, hidden: tuple[str, ...]
) -> None:
    tracks, engine = tracked("ghost-adsb", filter_name, hidden)
    flagged = tracks.filter("adsb_implausible")["aircraft"].drop_nulls().unique().to_list()
    assert sorted(flagged) == [JUMPS, DRIFTS, WRONG]
    for unseen in (BEYOND, LOW):
        assert len(tracks.filter(pl.col("aircraft") == unseen)) > 500
    assert engine.counts["IMPLAUSIBLE"] > 1000
    # By radars, of a track that its reports had initiated at a wrong position.
    assert engine.counts["RESTARTED"] <= 1


@pytest.mark.parametrize("filter_name", ["two-stage", "imm"])
@pytest.mark.fault(19)
def test_wrong_reports_do_not_change_the_biases(filter_name: str) -> None:
    _, engine = tracked("ghost-adsb", filter_name, ())
    table, truth = scene("ghost-adsb").table, scene("ghost-adsb").biases
    sigma = np.sqrt(np.diag(engine.biases.covariance))
    for column, (owner, kind) in enumerate(
        zip(table.parameter_sensor.tolist(), table.parameter_kind.tolist(), strict=True)
    ):
        own = truth.filter((pl.col("sensor_id") == table.ids[owner]) & (pl.col("kind") == kind))
        assert abs(engine.biases.estimate[column] - own["value"][0]) <= 4.0 * sigma[column]


@pytest.mark.parametrize("name", ["one-radar-adsb", "range-gain"])
def test_no_correct_report_is_flagged(name: str) -> None:
    tracks, engine = tracked(name, "two-stage", ())
    assert not tracks["adsb_implausible"].any()
    assert engine.counts["IMPLAUSIBLE"] == 0


def test_turns_between_reports_ten_seconds_apart_are_not_flagged() -> None:
    described = builtin_scenario("manoeuvring-traffic")
    receiver = Sensor("adsb", "adsb", position_sigma_m=25.0, interval_s=10.0)
    described = replace(described, sensors=(*described.sensors, receiver), duration_s=300.0)
    seen = observe(described, run_generator(described.seed))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "sensors.toml"
        path.write_text(sensors_text(described), encoding="utf-8")
        table = load_sensor_table(path)
    engine = Engine(table, TrackingSettings())
    updates = engine.push(batch_of(measurements_frame(described, seen), table)).updates
    assert np.count_nonzero(updates.sensor == table.ids.index("adsb")) > 700
    assert not updates.adsb_implausible.any()


def test_plausible_reports_restart_no_track_measured_by_radars() -> None:
    """Multilateration that jumps by 5 km and is received several times between two plots."""
    one = scene("ghost-adsb")
    table = replace(one.table, self_reported=np.zeros(len(one.table), np.bool_))
    frame = one.frame.filter(pl.col("track_number").is_in([JUMPS, 7, 8, 9, 10, 11, 12]))
    engine = Engine(table, TrackingSettings())
    batch = batch_of(frame.filter(pl.col("time_s").is_between(100.0, 500.0)), table)
    updates = engine.push(batch).updates
    mine = (updates.track_number == JUMPS) & (updates.time_s > 310.0)
    radar = updates.sensor[mine] != table.ids.index("adsb")
    assert radar.all()
    assert engine.counts["REFUSED"] > 100
    assert engine.counts["RESTARTED"] == 0


def test_a_radar_contradicted_by_most_aircraft_flags_no_reports() -> None:
    one = scene("one-radar-adsb")
    jumped = (pl.col("kind") == "radar") & (pl.col("time_s") > 450.0)
    frame = one.frame.with_columns(
        pl.when(jumped).then(pl.col("range_m") - 4000.0).otherwise("range_m").alias("range_m")
    ).filter(pl.col("range_m").is_null() | (pl.col("range_m") > 0.0))
    engine = Engine(one.table, TrackingSettings())
    updates = engine.push(batch_of(frame, one.table)).updates
    assert updates.time_s.max() > 880.0
    assert not updates.adsb_implausible.any()


def test_flags_depend_neither_on_batches_nor_on_workers() -> None:
    one = scene("ghost-adsb")
    rows = one.frame.filter(pl.col("time_s") < 360.0)
    batch = batch_of(rows, one.table)
    outputs = []
    for size, workers in ((len(batch), 1), (7, 1), (1001, 2)):
        engine = Engine(one.table, TrackingSettings(), workers=workers)
        parts = [
            engine.push(batch.select(slice(first, first + size))).updates
            for first in range(0, len(batch), size)
        ]
        outputs.append(TrackUpdates.concatenate([*parts, engine.flush().updates]))
        engine.close()
    assert outputs[0].adsb_implausible.any()
    for other in outputs[1:]:
        for name in outputs[0].__slots__:
            np.testing.assert_array_equal(getattr(outputs[0], name), getattr(other, name))
