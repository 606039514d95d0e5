"""Ever new identities of one sensor: bounded, cheap, and without effect on the other sensors."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.settings import TrackingSettings
from support.inputs.batches import batch_of
from support.scenarios.scenes import Scene, make_scene, random_flights, three_radars

STORM, TRACKS_MAX = 0, 60
SETTINGS = TrackingSettings()


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Twelve aircraft by three radars, which may initiate few tracks each."""
    random = np.random.default_rng(4)
    flown = make_scene(random, three_radars(), random_flights(random, 12, 100.0))
    bound = np.full(len(flown.sensors), float(TRACKS_MAX))
    sensors = replace(flown.sensors, plots_per_scan_max=bound)
    numbers = flown.batch.track_number
    unnumbered = replace(
        flown.batch, mode_s_address=0x4B0000 + numbers, track_number=np.full(len(numbers), -1)
    )
    return replace(flown, sensors=sensors, batch=unnumbered)


def storm(scene: Scene) -> MeasurementBatch:
    """Return the rows with 100 new addresses a second between 20 and 80 s."""
    begin_s = float(scene.batch.time_s[0])
    random = np.random.default_rng(5)
    times = begin_s + np.arange(20.0, 80.0, 0.01)
    false = replace(
        batch_of(
            times.tolist(), track_number=[-1] * len(times),
            mode_s_address=list(range(len(times))),
            range_m=random.uniform(2e4, 2e5, len(times)).tolist(),
        ),
        azimuth_rad=random.uniform(0.0, 6.28, len(times)),
        sensor=np.full(len(times), STORM, np.int32),
    )  # fmt: skip
    both = MeasurementBatch.concatenate([scene.batch, false])
    return both.select(np.argsort(both.time_s, kind="stable"))


def played(scene: Scene, batch: MeasurementBatch, size: int = 1000) -> tuple[Engine, str, int]:
    """Return the engine after all rows, its digest, and the most tracks that it had."""
    engine, digest, most = Engine(scene.sensors, SETTINGS), OutputDigest(), 0
    for first in range(0, len(batch), size):
        digest.add(engine.push(batch.select(slice(first, first + size))))
        most = max(most, len(engine.tracks()))
    digest.add(engine.flush())
    return engine, digest.hexdigest(), most


def test_a_sensor_initiates_a_bounded_number_of_tracks(scene: Scene) -> None:
    batch = storm(scene)
    engine, _, most = played(scene, batch)
    assert most <= TRACKS_MAX + 12
    counts = engine.counts
    assert counts["NO_ROOM"] > 5000
    assert sum(counts.values()) == len(batch)


@pytest.mark.fault(17)
def test_aircraft_that_are_tracked_stay_so_and_new_ones_of_other_sensors_are_tracked(
    scene: Scene,
) -> None:
    batch = storm(scene)
    known = batch.mode_s_address >= 0x4B0000
    # One aircraft is seen by the other radars only, and from the middle of the storm on.
    own = batch.mode_s_address == 0x4B0003
    hidden = own & ((batch.sensor == STORM) | (batch.time_s < batch.time_s[0] + 50.0))
    engine, _, _ = played(scene, batch.select(~hidden))
    alone, _, _ = played(scene, batch.select(known & ~hidden))
    assert engine.counts["UPDATED"] == alone.counts["UPDATED"]


def test_batches_leave_no_trace(scene: Scene) -> None:
    batch = storm(scene)
    digests = {played(scene, batch, size)[1] for size in (100_000, 777)}
    assert len(digests) == 1


def test_a_storm_is_reported_while_it_lasts(scene: Scene) -> None:
    engine = Engine(scene.sensors, SETTINGS)
    batch = storm(scene)
    begin_s = float(batch.time_s[0])
    early = engine.push(batch.select(batch.time_s < begin_s + 19.0))
    assert not early.saturated.any()
    late = engine.push(batch.select(np.abs(batch.time_s - begin_s - 30.0) <= 11.0))
    assert late.saturated.tolist() == [True, False, False]
