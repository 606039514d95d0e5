"""The engine reports unobservable biases; an anchor makes them observable."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.estimation.bias.observability import UnobservableBias
from multiradar.estimation.measurement.kinds import KIND_POSITION
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.scenes import Radar, Scene, make_scene, random_flights, three_radars

EXACT = ["two-stage", "joint"]


def scene_of(radars: list[Radar], duration_s: float = 200.0) -> Scene:
    rng = np.random.default_rng(8)
    return make_scene(rng, radars, random_flights(rng, 6, duration_s))


def tracked(
    name: str, scene: Scene, batch: MeasurementBatch
) -> tuple[tuple[UnobservableBias, ...], Engine]:
    engine = Engine(scene.sensors, TrackingSettings(filter_name=name, acceleration_density=0.5))
    engine.push(batch)
    engine.flush()
    return engine.unobservable_biases(), engine


def ratios(engine: Engine, scene: Scene) -> np.ndarray:
    state = engine.biases
    return state.sigma / scene.sensors.prior_sigma


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.fault(11)
def test_biases_of_a_single_radar_are_unobservable(name: str) -> None:
    scene = scene_of(three_radars()[:1])
    unobservable, engine = tracked(name, scene, scene.batch)
    assert [one.name for one in unobservable] == ["range offset of A", "azimuth offset of A"]
    np.testing.assert_allclose(ratios(engine, scene), 1.0, rtol=1e-9)


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.fault(11)
def test_biases_of_two_radars_at_one_site_are_unobservable(name: str) -> None:
    first = three_radars()[0]
    scene = scene_of([first, replace(first, identifier="A2")])
    unobservable, engine = tracked(name, scene, scene.batch)
    assert len(unobservable) == 4
    np.testing.assert_allclose(ratios(engine, scene), 1.0, rtol=1e-9)


@pytest.mark.parametrize("name", EXACT)
def test_common_biases_of_two_close_radars_are_unobservable(name: str) -> None:
    first = three_radars()[0]
    near = replace(first, identifier="A2", latitude_deg=first.latitude_deg + 0.011)
    scene = scene_of([first, near], duration_s=60.0)
    unobservable, engine = tracked(name, scene, scene.batch)
    assert {one.name for one in unobservable} == {
        "range offsets of A and A2 together (a common offset of all ranges)",
        "azimuth offsets of A and A2 together (a common rotation)",
    }
    assert min(one.prior_ratio for one in unobservable) > 0.7
    assert ratios(engine, scene).max() < 0.75


@pytest.mark.parametrize("name", EXACT)
def test_biases_of_three_radars_are_observable(name: str) -> None:
    scene = scene_of(three_radars())
    unobservable, engine = tracked(name, scene, scene.batch)
    assert unobservable == ()
    assert ratios(engine, scene).max() < 0.05


# A radar and a receiver of reported positions, whose station is ``apart_deg`` of latitude away.
def anchored(apart_deg: float) -> tuple[Scene, MeasurementBatch]:
    radar = three_radars()[0]
    station = Radar(
        "adsb", radar.latitude_deg + apart_deg, radar.longitude_deg, biases={}, detection=0.0
    )
    scene = scene_of([radar, station])
    kinds = scene.sensors.kinds.copy()
    kinds[1] = KIND_POSITION
    scene = replace(scene, sensors=replace(scene.sensors, kinds=kinds))
    rows = np.arange(0, len(scene.batch), 2)
    rng = np.random.default_rng(9)
    place = scene.truth[rows, :2] + 30.0 * rng.normal(size=(len(rows), 2))
    latitude, longitude = scene.plane.to_geodetic(place[:, 0], place[:, 1])
    reports = replace(
        scene.batch.select(rows),
        sensor=np.full(len(rows), 1, np.int32),
        kind=np.full(len(rows), KIND_POSITION, np.int8),
        latitude_rad=latitude,
        longitude_rad=longitude,
    )
    both = MeasurementBatch.concatenate([scene.batch, reports])
    return scene, both.select(np.argsort(both.time_s, kind="stable"))


# A position has no origin of measurement: a station on the mast of the radar anchors it too.
@pytest.mark.parametrize("apart_deg", [0.0, 1.0])
@pytest.mark.parametrize("name", [*EXACT, "imm", "blom-macro"])
def test_reported_positions_anchor_a_radar(name: str, apart_deg: float) -> None:
    scene, both = anchored(apart_deg)
    unobservable, engine = tracked(name, scene, both)
    assert unobservable == ()
    assert ratios(engine, scene).max() < 0.1
    error = engine.biases.estimate - scene.biases_at(0.0)
    assert np.abs(error / engine.biases.sigma).max() < 4.0


@pytest.mark.parametrize("name", EXACT)
def test_no_contribution_has_a_reason(name: str) -> None:
    scene = scene_of(three_radars())
    batch = scene.batch
    alone, _ = tracked(name, scene_of(three_radars()[:1]), batch.select(batch.sensor == 0))
    assert {one.reason[:41] for one in alone} == {"all aircraft were observed from one site;"}
    # Each radar sees aircraft of its own.
    apart = batch.select(batch.track_number % 3 == batch.sensor)
    unobservable, _ = tracked(name, scene, apart)
    assert {one.reason.split(";")[0] for one in unobservable} == {
        "none of its aircraft was observed from another site"
    }
    two = batch.select(batch.sensor < 2)
    silent = {one.name: one.reason for one in tracked(name, scene, two)[0]}
    assert silent["range offset of C"] == "none of its measurements has updated a track"
    unheard = replace(batch, height_m=np.full(len(batch), np.nan))
    unobservable, _ = tracked(name, scene, unheard)
    assert len(unobservable) == 6
    assert all("heights of its aircraft are unknown" in one.reason for one in unobservable)


def test_partly_observable_biases_have_no_reason() -> None:
    first = three_radars()[0]
    near = replace(first, identifier="A2", latitude_deg=first.latitude_deg + 0.011)
    scene = scene_of([first, near], duration_s=60.0)
    assert {one.reason for one in tracked("two-stage", scene, scene.batch)[0]} == {""}


def test_biases_without_measurements_drift_and_are_unobservable() -> None:
    radar = replace(three_radars()[0], drifts={0: 20.0, 1: 2e-4})
    scene = scene_of([radar])
    unobservable, engine = tracked("two-stage", scene, scene.batch)
    assert [one.prior_ratio for one in unobservable] == pytest.approx([1.0, 1.0])
    assert ratios(engine, scene).min() > 1.02
