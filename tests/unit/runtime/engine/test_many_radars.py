"""Radars that see no aircraft change nothing, however many there are."""

from dataclasses import fields, replace

import numpy as np
import pytest

from multiradar.estimation.filters._kernels import DENSE_MAX
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.scenes import Flight, make_scene, three_radars


@pytest.mark.parametrize("name", ["two-stage", "imm"])
def test_tracks_and_biases_are_the_same_with_many_radars_without_plots(name: str) -> None:
    seeing = three_radars()
    silent = [replace(one, detection=0.0) for one in seeing]
    # Sensors are sorted: the radars that see aircraft are last.
    many = [replace(silent[at % 3], identifier=f"0-{at:02d}") for at in range(DENSE_MAX)] + seeing
    flights = [
        Flight(0.0, 120.0, (east, -40e3, 150.0, 120.0)) for east in (-80e3, -40e3, 0.0, 40e3)
    ]
    scene = make_scene(np.random.default_rng(4), many, flights)
    few = make_scene(np.random.default_rng(4), seeing, flights).sensors
    settings = TrackingSettings(filter_name=name)
    engines = [Engine(scene.sensors, settings), Engine(few, settings)]
    engines[1] = Engine(few, settings, plane=engines[0].plane)
    batches = [scene.batch, replace(scene.batch, sensor=scene.batch.sensor - DENSE_MAX)]
    outputs = [
        [engine.push(batch), engine.flush()] for engine, batch in zip(engines, batches, strict=True)
    ]
    updates = [TrackUpdates.concatenate([one.updates for one in parts]) for parts in outputs]
    assert len(updates[0]) > 100
    for field in fields(TrackUpdates):
        wide, narrow = (getattr(one, field.name) for one in updates)
        if field.name == "sensor":
            wide = wide - DENSE_MAX
        # The sums of the covariance are the same terms, with zeros among them.
        if wide.dtype == np.float64:
            np.testing.assert_allclose(wide, narrow, rtol=1e-9, atol=1e-9, err_msg=field.name)
        else:
            np.testing.assert_array_equal(wide, narrow, err_msg=field.name)
