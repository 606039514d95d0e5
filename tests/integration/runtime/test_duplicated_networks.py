"""A radar received through two networks counts once, and the tracks stay consistent."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.observation.observe import Observation, observe
from multiradar.simulation.output import measurements_frame, truth_frame
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.simulation.scenario.model import Scenario
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.input.duplicates import Duplicates
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import STATE_CONFIRMED, EngineOutput
from multiradar.tracking.settings import TrackingSettings

NAME = "duplicated-networks"
EARTH_M = 6.371e6
SETTLED_S = 60.0
# Noise that fits aircraft with an acceleration density of 0.3 m²/s³.
KNOWN = TrackingSettings(filter_name="two-stage", acceleration_density=0.3)
NAMELESS = replace(KNOWN, hidden_fields=("track_number", "mode_3a", "mode_s_address"))


def seen(scene: Scenario) -> Observation:
    return observe(scene, np.random.Generator(np.random.PCG64(scene.seed)))


@pytest.fixture(scope="module")
def twice() -> Scenario:
    return builtin_scenario(NAME)


@pytest.fixture(scope="module")
def once(twice: Scenario) -> Scenario:
    return replace(twice, sensors=tuple(replace(one, second_feed=None) for one in twice.sensors))


@pytest.fixture(scope="module")
def table(twice: Scenario, tmp_path_factory: pytest.TempPathFactory) -> SensorTable:
    path = tmp_path_factory.mktemp("sensors") / "sensors.toml"
    path.write_text(sensors_text(twice), encoding="utf-8")
    return load_sensor_table(path)


def played(
    batch: MeasurementBatch, table: SensorTable, settings: TrackingSettings, size: int = 10**6
) -> tuple[list[EngineOutput], dict[str, int]]:
    engine = Engine(table, settings)
    starts = range(0, len(batch), size)
    outputs = [engine.push(batch.select(slice(first, first + size))) for first in starts]
    return [*outputs, engine.flush()], engine.counts


def joined(outputs: list[EngineOutput]) -> Duplicates:
    return Duplicates.concatenate([output.duplicates for output in outputs])


def rows(scene: Scenario, table: SensorTable) -> tuple[Observation, MeasurementBatch]:
    found = seen(scene)
    return found, wire.measurement_batch(measurements_frame(scene, found), table)[0]


def normalised(
    scene: Scenario, found: Observation, outputs: list[EngineOutput], table: SensorTable
) -> float:
    """Mean of error² / sigma² of the positions of settled, confirmed tracks: 1 if consistent."""
    updates = wire.tracks_frame(outputs[0].updates, table).vstack(
        wire.tracks_frame(outputs[-1].updates, table)
    )
    truth = truth_frame(scene, found).select(
        "time_s", "sensor_id", "track_number", "latitude_deg", "longitude_deg"
    )
    keys = ["time_s", "sensor_id", "track_number"]
    both = updates.join(truth.unique(keys), on=keys, suffix="_true")
    both = both.filter(both["time_s"] > scene.start_time_s + SETTLED_S)
    north = np.radians((both["latitude_deg"] - both["latitude_deg_true"]).to_numpy()) * EARTH_M
    east = np.radians((both["longitude_deg"] - both["longitude_deg_true"]).to_numpy()) * EARTH_M
    east = east * np.cos(np.radians(both["latitude_deg"].to_numpy()))
    assert len(both) > 3000
    return float(np.mean((east**2 + north**2) / both["position_sigma_m"].to_numpy() ** 2))


@pytest.mark.parametrize("settings", [KNOWN, NAMELESS])
def test_errors_are_as_claimed_with_copies_as_without(
    once: Scenario, twice: Scenario, table: SensorTable, settings: TrackingSettings
) -> None:
    found, batch = rows(once, table)
    single = normalised(once, found, played(batch, table, settings)[0], table)
    found, batch = rows(twice, table)
    outputs, counts = played(batch, table, settings)
    copies = int(found.copies.sum())
    assert copies > 2000
    # A scan ends at north: an aircraft there may be detected twice within 0.01 s.
    assert copies <= counts["DUPLICATE"] <= copies + 3
    double = normalised(twice, found, outputs, table)
    assert 0.7 < single < 1.3
    assert double < 1.15 * single
    # Without a configured rotation period all plots are used, and the sigma is too small.
    unknown = replace(table, rotation_period_s=np.full(len(table), np.nan))
    if settings is KNOWN:
        deceived = normalised(twice, found, played(batch, unknown, settings)[0], table)
        assert deceived > 1.3 * single


@pytest.mark.fault(5)
def test_no_duplicate_plot_initiates_a_track(twice: Scenario, table: SensorTable) -> None:
    _, batch = rows(twice, table)
    outputs, _ = played(batch, table, NAMELESS)
    for output in outputs:
        confirmed = output.updates.state == STATE_CONFIRMED
        assert len(np.unique(output.updates.track_id[confirmed])) <= 31


def test_what_is_left_out_does_not_depend_on_batches(twice: Scenario, table: SensorTable) -> None:
    _, batch = rows(twice, table)
    batch = batch.select(slice(0, 1500))
    expected = [
        sorted(zip(one.arrival.tolist(), one.reasons(), strict=True))
        for outputs, _ in (played(batch, table, NAMELESS, size) for size in (10**6, 1, 7, 250))
        for one in [joined(outputs)]
    ]
    assert len(expected[0]) > 300
    assert expected[1:] == expected[:1] * 3
    # Each is one of the measurements handed in.
    first = joined(played(batch, table, NAMELESS, 7)[0])
    np.testing.assert_array_equal(batch.time_s[first.arrival], first.batch.time_s)
    assert (first.twin_time_s <= first.batch.time_s).all()
