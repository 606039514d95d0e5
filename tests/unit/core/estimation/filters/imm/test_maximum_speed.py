"""Interacting modes and the maximum speed of aircraft: unreachable plots are rejected."""

from dataclasses import replace

import numpy as np

from multiradar.estimation.filters.bank import Outcome
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from support.references.compiled_filters import CompiledFilter, plain_settings
from support.references.reference_filters import Observation
from support.scenarios.scenes import Flight, make_scene, random_flights, sensor_table, three_radars


def test_a_radar_at_a_wrong_site_does_not_accelerate_the_tracks() -> None:
    rng = np.random.default_rng(5)
    radars = three_radars()
    scene = make_scene(rng, radars, random_flights(rng, 12, 300.0))
    # The engine is given the second radar 3 km north of its true site.
    wrong = [radars[0], replace(radars[1], latitude_deg=radars[1].latitude_deg + 0.027), radars[2]]
    sensors = sensor_table(wrong)
    engine = Engine(sensors, TrackingSettings(filter_name="imm"))
    updates = TrackUpdates.concatenate([engine.push(scene.batch).updates, engine.flush().updates])
    assert updates.speed_mps.max() < 1000.0
    assert len(updates.time_s) > 0.6 * len(scene.batch.time_s)


def test_plots_beyond_the_maximum_speed_are_rejected_until_the_track_is_reinitialised() -> None:
    scene = make_scene(
        np.random.default_rng(5), three_radars(), [Flight(0.0, 9.0, (5e4, 0.0, 0.0, 0.0))]
    )
    settings = replace(plain_settings("imm", 0.3), speed_max_mps=250.0, refuse_nis=np.inf)
    one = CompiledFilter(scene, settings)
    # Radially at 200 m/s, then at 400 m/s.
    places = [50e3 + 800.0 * n for n in range(20)]
    places += [places[-1] + 1600.0 * n for n in range(1, 30)]
    outcomes = [
        one.process(Observation(10.0 + 4.0 * n, 0, 0, np.array([away_m, 1.0]), height_m=9000.0))
        for n, away_m in enumerate(places)
    ]
    assert set(outcomes[1:20]) == {Outcome.UPDATED}
    assert Outcome.REFUSED in outcomes[20:]
    assert Outcome.RESTARTED in outcomes[20:]
