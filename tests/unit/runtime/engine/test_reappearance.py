"""An aircraft near a lost track is a new track; one that continues keeps its track."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.scenario.model import Leg
from multiradar.tracking.outputs import STATE_CONFIRMED, TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.scenes import Flight, Scene, make_scene, three_radars

NAMELESS = TrackingSettings(hidden_fields=("track_number", "mode_s_address", "mode_3a"))
CODED = replace(NAMELESS, hidden_fields=("track_number", "mode_s_address"))


def confirmed(scene: Scene, settings: TrackingSettings) -> TrackUpdates:
    engine = Engine(scene.sensors, settings)
    parts = [engine.push(scene.batch).updates, engine.flush().updates]
    updates = TrackUpdates.concatenate(parts)
    assert np.any(updates.state == STATE_CONFIRMED)
    return updates


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two-stage", "imm"])
def test_an_aircraft_near_a_lost_track_initiates_a_track(name: str) -> None:
    """A real case: at the edge of its cover the one slowed down, and its velocity was open; 50 s
    later another came in there, and took its track."""
    rng = np.random.default_rng(3)
    radars = [replace(one, detection=0.97) for one in three_radars()[:2]]
    leaving = Flight(
        0.0, 200.0, (20e3, 10e3, -225.0, -28.0), 10_668.0,
        legs=(Leg(180.0), Leg(18.0, acceleration_mps2=-6.0)),
    )  # fmt: skip
    coming = Flight(250.0, 400.0, (-23e3, 5.6e3, 225.0, 30.0), 11_269.0)
    others = [Flight(0.0, 400.0, (east, -40e3, 150.0, 120.0)) for east in (-80e3, -40e3, 0.0, 40e3)]
    scene = make_scene(rng, radars, [leaving, coming, *others])
    for hidden in (NAMELESS, CODED):
        updates = confirmed(scene, replace(hidden, filter_name=name))
        # Aircraft are numbered from 1 in the order of the flights.
        own, other = (set(updates.track_id[updates.track_number == k].tolist()) for k in (1, 2))
        assert len(own) == 1
        assert not own & other


@pytest.mark.parametrize("name", ["two-stage", "imm"])
def test_an_aircraft_that_continues_after_a_gap_keeps_its_track(name: str) -> None:
    rng = np.random.default_rng(4)
    flights = [
        Flight(0.0, 300.0, (east, -40e3, 150.0, 120.0)) for east in (-80e3, -40e3, 0.0, 40e3)
    ]
    scene = make_scene(rng, three_radars(), flights)
    silent = (scene.batch.time_s > 150.0) & (scene.batch.time_s < 190.0)
    heard = replace(scene, batch=scene.batch.select(~silent))
    updates = confirmed(heard, replace(NAMELESS, filter_name=name))
    for number in range(1, 5):
        assert len(set(updates.track_id[updates.track_number == number].tolist())) == 1
