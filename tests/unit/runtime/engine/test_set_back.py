"""The engine after the data clock was set back: new tracks, the same biases, numbers that go on."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.scenes import make_scene, random_flights, three_radars


@pytest.mark.parametrize("name", ["two-stage", "joint"])
def test_earlier_times_follow(name: str) -> None:
    rng = np.random.default_rng(8)
    scene = make_scene(rng, three_radars(), random_flights(rng, 6, 60.0))
    engine = Engine(scene.sensors, TrackingSettings(filter_name=name))
    ahead = replace(scene.batch, time_s=scene.batch.time_s + 600.0)
    first = engine.push(ahead).updates
    ended = engine.restart()
    biases = engine.biases
    assert (biases.sigma < 0.9 * scene.sensors.prior_sigma).any()
    assert set(ended.ended.track_id.tolist()) == set(first.track_id.tolist())
    assert not len(engine.tracks().track_id)
    again = engine.push(scene.batch).updates
    every = [first, ended.updates, again]
    sequence = np.concatenate([one.sequence for one in every])
    assert sequence.tolist() == list(range(1, len(sequence) + 1))
    assert again.track_id.min() > first.track_id.max()
    # They start from what was known.
    assert (engine.biases.sigma <= 1.01 * biases.sigma).all()
    assert engine.counts["LATE"] == 0
