"""Plots without identity: independence of batches, evidence, track lifecycles."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.estimation.filters.bank import FILTERS
from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.memory.track_tally import TrackTally
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import STATE_CONFIRMED, TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.scenes import Flight, Radar, Scene, make_scene, random_flights, three_radars

NAMELESS = TrackingSettings(hidden_fields=("track_number", "mode_s_address", "mode_3a"))


def turning_scene(seed: int = 1, aircraft: int = 25, duration_s: float = 120.0) -> Scene:
    rng = np.random.default_rng(seed)
    radars = [replace(radar, rotation_s=turn, detection=0.95)
              for radar, turn in zip(three_radars(), (4.0, 5.0, 6.0), strict=True)]  # fmt: skip
    return make_scene(rng, radars, random_flights(rng, aircraft, duration_s))


@pytest.fixture(scope="module")
def scene() -> Scene:
    return turning_scene()


def played(
    scene: Scene, settings: TrackingSettings, size: int = 10**6, workers: int = 1
) -> tuple[str, TrackUpdates, Engine]:
    engine = Engine(scene.sensors, settings, workers)
    digest = OutputDigest()
    outputs = [
        engine.push(scene.batch.select(slice(first, first + size)))
        for first in range(0, len(scene.batch), size)
    ]
    outputs.append(engine.flush())
    for output in outputs:
        digest.add(output)
    engine.close()
    updates = TrackUpdates.concatenate([output.updates for output in outputs])
    return digest.hexdigest(), updates, engine


def transitions(engine: Engine, *batches: MeasurementBatch) -> dict[str, int]:
    tally = TrackTally()
    for output in [*map(engine.push, batches), engine.flush()]:
        tally.update(output)
    return tally.transitions


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two-stage", "blom", "blom-macro", "ci"])
def test_output_depends_neither_on_batches_nor_on_workers(scene: Scene, name: str) -> None:
    settings = replace(NAMELESS, filter_name=name)
    expected, updates, _ = played(scene, settings)
    assert len(updates) > 0.9 * len(scene.batch)
    for size, workers in [(1, 1), (13, 2), (700, 4)]:
        assert played(scene, settings, size, workers)[0] == expected


@pytest.mark.slow
def test_every_filter_tracks_without_identity(scene: Scene) -> None:
    # The sigma and gates of separated filters are too small while biases are being estimated: for
    # 25 aircraft `blom` has 26 to 69 tracks, depending on the scenario.
    for name in FILTERS.keys() - {"blom"}:
        _, updates, _ = played(scene, replace(NAMELESS, filter_name=name))
        confirmed = updates.state == STATE_CONFIRMED
        pairs = np.stack([updates.track_id, updates.track_number])[:, confirmed]
        assert len(np.unique(pairs, axis=1).T) <= 27, name


def test_hidden_fields_affect_no_track_and_are_published(scene: Scene) -> None:
    _, updates, _ = played(scene, NAMELESS)
    other = np.random.default_rng(2).permutation(1000)[scene.batch.track_number]
    renamed = replace(scene, batch=replace(scene.batch, track_number=other))
    _, again, _ = played(renamed, NAMELESS)
    np.testing.assert_array_equal(again.latitude_rad, updates.latitude_rad)
    np.testing.assert_array_equal(again.track_id, updates.track_id)
    assert set(again.track_number.tolist()) == set(other.tolist())


def test_a_field_that_is_not_hidden_is_published_as_the_tracker_has_it(scene: Scene) -> None:
    known = played(scene, TrackingSettings())[1]
    kept = played(scene, TrackingSettings(hidden_fields=("mode_3a", "callsign")))[1]
    np.testing.assert_array_equal(kept.track_number, known.track_number)
    np.testing.assert_array_equal(kept.track_id, known.track_id)


def test_tracks_and_biases_are_the_same_with_and_without_identity(scene: Scene) -> None:
    _, updates, engine = played(scene, NAMELESS)
    _, _, named = played(scene, TrackingSettings())
    sigma = np.sqrt(np.diagonal(named.biases.covariance))
    assert (np.abs(engine.biases.estimate - named.biases.estimate) < 2.0 * sigma).all()
    confirmed = updates.state == STATE_CONFIRMED
    pairs = np.stack([updates.track_id, updates.track_number])[:, confirmed]
    assert np.unique(pairs, axis=1).shape[1] == len(np.unique(updates.track_number))


def test_a_track_contributes_to_the_biases_after_confirmation_only(scene: Scene) -> None:
    never = replace(NAMELESS, confirm_updates=1000)
    _, updates, engine = played(scene, never)
    assert not (updates.state == STATE_CONFIRMED).any()
    np.testing.assert_array_equal(engine.biases.estimate, scene.sensors.prior_mean)


def test_scattered_plots_initiate_tracks_that_end_unconfirmed(scene: Scene) -> None:
    rng = np.random.default_rng(4)
    n = len(scene.batch)
    noise = replace(
        scene.batch,
        range_m=rng.uniform(20e3, 150e3, n), azimuth_rad=rng.uniform(0.0, 6.28, n),
        height_m=np.full(n, np.nan),
    )  # fmt: skip
    _, updates, _ = played(replace(scene, batch=noise), NAMELESS)
    assert (updates.state == STATE_CONFIRMED).mean() < 0.01
    counts = transitions(Engine(scene.sensors, NAMELESS), noise)
    assert counts["ended_unconfirmed"] > 0.8 * counts["started"]


def test_a_track_initiated_by_wrong_heights_ends_with_them() -> None:
    rng = np.random.default_rng(5)
    scene = make_scene(rng, three_radars()[:2], [Flight(0.0, 120.0, (2e4, 3e4, 150.0, 80.0))])
    batch = scene.batch
    # For a while the second radar reports another height, so that its plots initiate a track.
    early = (batch.sensor == 1) & (batch.time_s < batch.time_s[0] + 40.0)
    height_m = np.where(early, batch.height_m - 2500.0, batch.height_m)
    batch = replace(batch, height_m=height_m)
    _, updates, _ = played(replace(scene, batch=batch), NAMELESS)
    assert len(set(updates.track_id.tolist())) == 2
    assert transitions(Engine(scene.sensors, NAMELESS), batch)["started"] == 2
    late = updates.time_s > batch.time_s[0] + 80.0
    assert set(updates.track_id[late].tolist()) == {1}


def test_two_tracks_of_one_aircraft_are_merged_into_the_older_one() -> None:
    rng = np.random.default_rng(5)
    scene = make_scene(rng, three_radars(), [Flight(0.0, 120.0, (2e4, 3e4, 150.0, 80.0))])
    engine = Engine(scene.sensors, NAMELESS)
    half = len(scene.batch) // 2
    engine.push(scene.batch.select(slice(0, half)))
    pool = engine._pool
    old, new = int(pool.used()[0]), int(pool.roster.free[pool.roster.counters[1] - 1])
    for array in (*pool.aircraft, *pool.life):
        if len(array):
            array[new] = array[old]
    pool.roster.counters[:] += (1, -1)
    pool.roster.track_id[new] = pool.roster.counters[0]
    pool.life.last_seen[new] = -np.inf
    assert transitions(engine, scene.batch.select(slice(half, None)))["merged"] == 1
    assert pool.roster.track_id[pool.used()].tolist() == [1]


def test_an_address_of_two_transponders_gives_two_tracks() -> None:
    rng = np.random.default_rng(6)
    flights = [
        Flight(0.0, 90.0, (-6e4, 1e4, 200.0, 20.0)),
        Flight(0.0, 90.0, (7e4, 5e4, -180.0, 0.0)),
    ]
    scene = make_scene(rng, three_radars(), flights)
    shared = replace(scene.batch, mode_s_address=np.full(len(scene.batch), 0x4B1234))
    settings = TrackingSettings(hidden_fields=("track_number",))
    _, updates, _ = played(replace(scene, batch=shared), settings)
    settled = updates.time_s > updates.time_s[0] + 30.0
    pairs = np.stack([updates.track_id, updates.track_number])[:, settled]
    assert np.unique(pairs, axis=1).shape[1] == 2


def test_a_primary_plot_is_associated_with_a_track_of_known_identity() -> None:
    rng = np.random.default_rng(7)
    radars: list[Radar] = three_radars()
    scene = make_scene(rng, radars, random_flights(rng, 6, 120.0))
    first = scene.batch.sensor == 0
    batch: MeasurementBatch = replace(
        scene.batch,
        track_number=np.where(first, -1, scene.batch.track_number),
        mode_s_address=np.where(first, -1, scene.batch.mode_s_address),
        height_m=np.where(first, np.nan, scene.batch.height_m),
    )
    _, updates, engine = played(replace(scene, batch=batch), TrackingSettings())
    late = updates.time_s > updates.time_s[0] + 60.0
    assert (updates.track_number[late & (updates.sensor == 0)] >= 0).mean() > 0.98
    assert engine.counts["UNASSOCIATED"] < 0.02 * len(batch)


def test_a_frame_of_updates_with_hidden_identity_can_be_written(scene: Scene) -> None:
    frame = wire.tracks_frame(played(scene, NAMELESS)[1], scene.sensors)
    assert frame["track_number"].null_count() == 0
    assert frame.filter(pl.col("state") == "confirmed").height > 0


def test_an_anonymous_plot_beside_one_of_an_implausible_address_is_used_too() -> None:
    rng = np.random.default_rng(8)
    flights = [
        Flight(0.0, 60.0, (-6e4, 1e4, 200.0, 20.0)),
        Flight(0.0, 60.0, (7e4, 5e4, -180.0, 0.0)),
        Flight(0.0, 60.0, (1e4, -4e4, 100.0, 100.0)),
    ]
    scene = make_scene(rng, three_radars(), flights)
    batch = scene.batch
    first, far, nameless = (
        np.flatnonzero(batch.track_number == number) for number in np.unique(batch.track_number)
    )
    known = first[batch.time_s[first] < batch.time_s[0] + 40.0]
    # In one window: a distant plot with the address of the track, and one without address.
    end_s = float(np.floor(batch.time_s[known].max())) + 1.0
    late = np.array([far[0], nameless[0]])
    rows = batch.select(np.concatenate([known, late]))
    address = np.full(len(rows), 0x4B1234)
    address[-1] = -1
    time_s = rows.time_s.copy()
    time_s[-2:] = end_s + 0.1, end_s + 0.2
    settings = TrackingSettings(hidden_fields=("track_number", "mode_3a"))
    shown = replace(rows, mode_s_address=address, time_s=time_s)
    _, updates, engine = played(replace(scene, batch=shown), settings)
    assert engine.counts["UNASSOCIATED"] == 0
    assert len(updates) == len(rows)
    assert len(np.unique(updates.track_id)) == 3
