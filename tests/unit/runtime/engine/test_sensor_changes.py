"""Sensors of an engine change: tracks and biases continue, except those of a moved radar."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.errors import ConfigurationError
from multiradar.estimation.measurement.sensor_changes import SensorChange
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from support.cluster.shards import on_local_shards
from support.scenarios.scenes import Scene, make_scene, random_flights, three_radars

FILTERS = ("two-stage", "imm", "joint", "blom", "blom-macro", "ci")


@pytest.fixture(scope="module")
def scene() -> Scene:
    return make_scene(
        np.random.default_rng(5), three_radars(), random_flights(np.random.default_rng(5), 8, 90.0)
    )


def _without_last(table: SensorTable) -> SensorTable:
    """The table without its last sensor."""
    m, c = len(table) - 1, int((table.parameter_sensor < len(table) - 1).sum())
    values = {}
    for name in table.__dataclass_fields__:
        value = getattr(table, name)
        if name == "aliases":
            continue
        values[name] = value[: c if name in _BY_COLUMN else m]
    return SensorTable(**values)


_BY_COLUMN = ("parameter_sensor", "parameter_kind", "prior_mean", "prior_sigma", "drift")


def _digest(outputs: list[EngineOutput]) -> str:
    digest = OutputDigest()
    for one in outputs:
        digest.add(one)
    return digest.hexdigest()


@pytest.mark.parametrize("name", FILTERS)
def test_the_same_sensors_again_are_as_a_closed_epoch(scene: Scene, name: str) -> None:
    engine = Engine(scene.sensors, TrackingSettings(filter_name=name))
    half = len(scene.batch) // 2
    engine.push(scene.batch.select(slice(0, half)))
    before = engine.biases
    tracks = engine.tracks()
    engine.change_sensors(scene.sensors, SensorChange.between(scene.sensors, scene.sensors))
    after = engine.tracks()
    assert after.track_id.tolist() == tracks.track_id.tolist()
    assert (engine.biases.sigma <= before.sigma * (1 + 1e-12)).all()
    again = engine.push(scene.batch.select(slice(half, None)))
    assert not len(again.ended)
    # No track is initiated a second time.
    assert set(again.updates.track_id.tolist()) == set(tracks.track_id.tolist())


@pytest.mark.parametrize("name", FILTERS)
def test_a_moved_radar_has_its_priors_again_and_the_others_keep_their_biases(
    scene: Scene, name: str
) -> None:
    engine = Engine(scene.sensors, TrackingSettings(filter_name=name))
    engine.push(scene.batch)
    engine.flush()
    before, states = engine.biases, engine.tracks()
    moved = scene.sensors.latitude_rad.copy()
    moved[1] += 1e-5
    table = replace(scene.sensors, latitude_rad=moved)
    engine.change_sensors(table, SensorChange.between(scene.sensors, table))
    after = engine.biases
    own = table.parameter_sensor == 1
    assert after.estimate[own] == pytest.approx(table.prior_mean[own])
    assert after.sigma[own] == pytest.approx(table.prior_sigma[own])
    assert after.estimate[~own].tolist() == before.estimate[~own].tolist()
    others = np.ix_(~own, ~own)
    assert after.covariance[others].tolist() == before.covariance[others].tolist()
    assert not after.covariance[np.ix_(own, ~own)].any()
    now = engine.tracks()
    assert now.track_id.tolist() == states.track_id.tolist()
    # The tracks are where they were, and as certain.
    assert now.mean == pytest.approx(states.mean, rel=1e-9, abs=1e-6)
    assert now.covariance == pytest.approx(states.covariance, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("name", FILTERS)
def test_an_added_radar_starts_from_its_priors(scene: Scene, name: str) -> None:
    fewer, whole = _without_last(scene.sensors), scene.sensors
    engine = Engine(fewer, TrackingSettings(filter_name=name))
    seen = scene.batch.select(np.flatnonzero(scene.batch.sensor < len(fewer)))
    half_s = float(np.median(scene.batch.time_s))
    engine.push(seen.select(np.flatnonzero(seen.time_s < half_s)))
    engine.flush()
    before, states = engine.biases, engine.tracks()
    engine.change_sensors(whole, SensorChange.between(fewer, whole))
    after, count = engine.biases, len(before.estimate)
    assert after.estimate[:count].tolist() == before.estimate.tolist()
    assert after.covariance[:count, :count].tolist() == before.covariance.tolist()
    assert after.estimate[count:].tolist() == whole.prior_mean[count:].tolist()
    assert after.sigma[count:] == pytest.approx(whole.prior_sigma[count:])
    now = engine.tracks()
    assert now.mean.tolist() == states.mean.tolist()
    again = engine.push(scene.batch.select(np.flatnonzero(scene.batch.time_s >= half_s)))
    assert (again.updates.sensor == len(fewer)).any()
    if name != "blom-macro":
        engine.flush()
        assert (engine.biases.sigma[count:] < 0.9 * whole.prior_sigma[count:]).any()


def test_an_added_radar_gives_the_same_output_on_shards(scene: Scene) -> None:
    """The states have more columns then: the shards start again."""
    fewer, whole = _without_last(scene.sensors), scene.sensors
    seen = scene.batch.select(np.flatnonzero(scene.batch.sensor < len(fewer)))
    half_s = float(np.median(scene.batch.time_s))
    digests = set()
    for open_steps in (None, on_local_shards):
        engine = Engine(fewer, TrackingSettings(), open_steps=open_steps)
        outputs = [
            engine.push(seen.select(np.flatnonzero(seen.time_s < half_s))),
            engine.change_sensors(whole, SensorChange.between(fewer, whole)),
            engine.push(scene.batch.select(np.flatnonzero(scene.batch.time_s >= half_s))),
            engine.flush(),
        ]
        engine.close()
        digests.add(_digest(outputs))
    assert len(digests) == 1


@pytest.mark.parametrize("workers", [1, 3])
def test_the_output_does_not_depend_on_workers_or_batches(scene: Scene, workers: int) -> None:
    digests = set()
    table = replace(scene.sensors, range_sigma_m=scene.sensors.range_sigma_m * 2.0)
    change = SensorChange.between(scene.sensors, table)
    half = len(scene.batch) // 2
    for size in (half, 97):
        engine = Engine(scene.sensors, TrackingSettings(), workers)
        outputs = [
            engine.push(scene.batch.select(slice(first, min(first + size, half))))
            for first in range(0, half, size)
        ]
        outputs.append(engine.change_sensors(table, change))
        outputs.append(engine.push(scene.batch.select(slice(half, None))))
        outputs.append(engine.flush())
        engine.close()
        digests.add(_digest(outputs))
    assert len(digests) == 1


def test_what_cannot_change_is_named(scene: Scene) -> None:
    known = scene.sensors
    columns = {name: getattr(known, name)[1:] for name in _BY_COLUMN}
    with pytest.raises(ConfigurationError, match="A: the estimated biases cannot change while"):
        SensorChange.between(known, replace(known, **columns))
    delayed = np.array([100.0, np.nan, np.nan])
    with pytest.raises(ConfigurationError, match="transponder_delay_sigma_m cannot change"):
        SensorChange.between(known, replace(known, transponder_delay_sigma_m=delayed))
    fewer = _without_last(scene.sensors)
    with pytest.raises(ConfigurationError, match="must come first and in this order"):
        SensorChange.between(scene.sensors, fewer)
