"""The engine: reproducible output, and consistent tracks and biases."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import ConfigurationError, UnknownFilterError
from multiradar.estimation.gaussian import normalised_squared
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_OFFSET,
)
from multiradar.runtime.engine import shared_biases
from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking._identity_kernels import describe
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import BiasRecords, EngineOutput, TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from support.inputs.batches import batch_of
from support.scenarios.scenes import Flight, Radar, Scene, make_scene, random_flights, three_radars

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

FILTERS = ("two-stage", "imm", "joint", "blom", "blom-macro", "ci")


def busy_scene(seed: int = 1, aircraft: int = 30, duration_s: float = 80.0) -> Scene:
    """More rows per epoch than the threshold for several workers."""
    rng = np.random.default_rng(seed)
    radars = [
        Radar(
            r.identifier, r.latitude_deg, r.longitude_deg, rotation_s=0.5, biases=r.biases,
            detection=0.9, outliers=0.01,
        )
        for r in three_radars()
    ]  # fmt: skip
    return make_scene(rng, radars, random_flights(rng, aircraft, duration_s))


def run(scene: Scene, settings: TrackingSettings, size: int, workers: int = 1) -> str:
    engine = Engine(scene.sensors, settings, workers)
    digest = OutputDigest()
    for first in range(0, len(scene.batch), size):
        digest.add(engine.push(scene.batch.select(slice(first, first + size))))
    digest.add(engine.flush())
    engine.close()
    return digest.hexdigest()


@pytest.fixture(scope="module")
def scene() -> Scene:
    return busy_scene()


@pytest.mark.slow
@pytest.mark.parametrize("name", FILTERS)
def test_output_depends_neither_on_batches_nor_on_workers(scene: Scene, name: str) -> None:
    settings = TrackingSettings(filter_name=name)
    expected = run(scene, settings, len(scene.batch))
    assert {
        run(scene, settings, size, workers) for size, workers in [(7, 1), (1000, 2), (10**6, 4)]
    } == {expected}


@pytest.mark.parametrize("size", [50, 120])
def test_an_epoch_that_is_closed_before_the_next_measurements_has_the_same_output(
    scene: Scene, size: int
) -> None:
    settings = TrackingSettings()
    engine = Engine(scene.sensors, settings, sampling=Sampling.ALL)
    digest, early, sampled = OutputDigest(), 0, 0
    for first in range(0, len(scene.batch), size):
        pushed = engine.push(scene.batch.select(slice(first, first + size)))
        completed = engine.complete()
        assert not len(completed.updates)
        assert not len(engine.complete().biases)
        early += len(completed.biases)
        sampled += len(completed.samples)
        digest.add(pushed)
        digest.add(completed)
    digest.add(engine.flush())
    engine.close()
    assert early > 0
    assert sampled > 0
    assert digest.hexdigest() == run(scene, settings, len(scene.batch))


def test_output_depends_on_the_measurements(scene: Scene) -> None:
    # The digest that the other tests compare differs for runs that differ in one row.
    settings = TrackingSettings()
    rows = np.delete(np.arange(len(scene.batch)), 500)
    engine = Engine(scene.sensors, settings)
    digest = OutputDigest()
    digest.add(engine.push(scene.batch.select(rows)))
    digest.add(engine.flush())
    assert digest.hexdigest() != run(scene, settings, len(scene.batch))


def test_the_ground_status_changes_the_digest_where_it_is_known(scene: Scene) -> None:
    unknown = np.full(len(scene.batch), -1, np.int8)
    digests = []
    for batch in (
        scene.batch, replace(scene.batch, on_ground=unknown),
        replace(scene.batch, on_ground=unknown + 1),
    ):  # fmt: skip
        engine, digest = Engine(scene.sensors, TrackingSettings()), OutputDigest()
        digest.add(engine.push(batch))
        digest.add(engine.flush())
        digests.append(digest.hexdigest())
    assert digests[0] == digests[1] != digests[2]


def all_output(scene: Scene, settings: TrackingSettings) -> tuple[Engine, EngineOutput]:
    engine = Engine(scene.sensors, settings)
    first = engine.push(scene.batch)
    last = engine.flush()
    updates = TrackUpdates.concatenate([first.updates, last.updates])
    return engine, EngineOutput(updates, last.biases, first.ended)


def test_biases_and_tracks_are_consistent_with_their_sigmas() -> None:
    rng = np.random.default_rng(5)
    scene = make_scene(rng, three_radars(), random_flights(rng, 25, 600.0))
    engine, output = all_output(
        scene, TrackingSettings(filter_name="two-stage", acceleration_density=0.5)
    )
    count = len(scene.sensors.parameter_kind)
    error = output.biases.estimate[-count:] - scene.biases_at(float(scene.batch.time_s[-1]))
    # Six parameters: the 99.9 % point of chi-squared over its degrees of freedom is 3.7.
    assert np.mean((error / output.biases.sigma[-count:]) ** 2) < 3.7
    metres = scene.sensors.parameter_kind == PARAMETER_RANGE_OFFSET
    assert np.abs(error[metres]).max() < 10.0
    azimuths = scene.sensors.parameter_kind == PARAMETER_AZIMUTH_OFFSET
    assert np.degrees(np.abs(error[azimuths])).max() < 0.005
    states = engine.tracks()
    assert len(states) > 0
    assert np.isfinite(states.mean).all()
    assert (np.linalg.eigvalsh(states.covariance) > 0.0).all()


def test_every_row_has_an_outcome(scene: Scene) -> None:
    engine, output = all_output(scene, TrackingSettings())
    assert sum(engine.counts.values()) == len(scene.batch)
    taken = sum(engine.counts[name] for name in ("UPDATED", "STARTED", "RESTARTED"))
    assert len(output.updates) == taken
    assert output.updates.sequence.tolist() == list(range(1, taken + 1))


def test_no_output_is_nan_except_an_unknown_height(scene: Scene) -> None:
    _, output = all_output(scene, TrackingSettings())
    for column in ("latitude_rad", "longitude_rad", "speed_mps", "heading_rad",
                   "position_sigma_m", "velocity_sigma_mps"):  # fmt: skip
        assert np.isfinite(getattr(output.updates, column)).all(), column


def test_aircraft_without_heights_are_tracked_with_a_consistent_sigma() -> None:
    rng = np.random.default_rng(6)
    flights = [Flight(0.0, 300.0, (20_000.0, 40_000.0, 150.0, -80.0), reports_height=False)]
    scene = make_scene(rng, three_radars(), flights)
    _, output = all_output(scene, TrackingSettings(assumed_height_m=6_000.0))
    assert np.isnan(output.updates.height_m).all()
    latitude, longitude = scene.plane.to_geodetic(scene.truth[-1:, 0], scene.truth[-1:, 1])
    east = (output.updates.longitude_rad[-1] - longitude[0]) * np.cos(latitude[0]) * 6.378e6
    north = (output.updates.latitude_rad[-1] - latitude[0]) * 6.37e6
    assert np.hypot(east, north) < 4.0 * output.updates.position_sigma_m[-1]


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("count", [1, 2])
def test_biases_of_a_single_site_keep_the_sigma_of_their_prior(name: str, count: int) -> None:
    # One radar, or two on one mast, cannot observe the azimuth bias. A filter that relinearises at
    # every plot once estimated 700 m at a published sigma of 300 m.
    site = three_radars()[0]
    radars = [
        Radar(f"radar-{index}", site.latitude_deg, site.longitude_deg, biases=site.biases)
        for index in range(count)
    ]
    rng = np.random.default_rng(8)
    scene = make_scene(rng, radars, random_flights(rng, 10, 600.0))
    _, output = all_output(scene, TrackingSettings(filter_name=name))
    last = slice(-len(scene.sensors.prior_sigma), None)
    np.testing.assert_allclose(output.biases.sigma[last], scene.sensors.prior_sigma, rtol=1e-9)
    np.testing.assert_allclose(output.biases.estimate[last], scene.sensors.prior_mean, atol=1e-12)


def test_a_flush_publishes_the_biases_of_an_epoch_once(scene: Scene) -> None:
    engine = Engine(scene.sensors, TrackingSettings())
    half = len(scene.batch) // 2
    outputs = [
        engine.push(scene.batch.select(slice(0, half))), engine.flush(), engine.flush(),
        engine.push(scene.batch.select(slice(half, None))), engine.flush(),
    ]  # fmt: skip
    epochs = [epoch for output in outputs for epoch in output.biases.epoch.tolist()]
    count = len(scene.sensors.parameter_kind)
    times_said = {epoch: epochs.count(epoch) / count for epoch in set(epochs)}
    split = np.floor(scene.batch.time_s[half] / TrackingSettings().epoch_s)
    assert times_said.pop(int(split)) == 2
    assert set(times_said.values()) == {1}


@pytest.mark.parametrize("name", FILTERS)
def test_plots_without_height_do_not_contribute_to_the_biases(name: str) -> None:
    rng = np.random.default_rng(7)
    flights = [Flight(0.0, 200.0, (20_000.0, 40_000.0, 150.0, -80.0), reports_height=False)]
    scene = make_scene(rng, three_radars(), flights)
    _, output = all_output(scene, TrackingSettings(filter_name=name))
    sigma = output.biases.sigma[-len(scene.sensors.prior_sigma) :]
    np.testing.assert_allclose(sigma, scene.sensors.prior_sigma, rtol=1e-9)


@pytest.mark.parametrize("name", FILTERS)
def test_a_rejected_plot_does_not_change_the_uncertainty(name: str) -> None:
    # A rejected outlier once counted as a manoeuvre: the process noise rose three hundredfold, and
    # the next outlier was accepted.
    rng = np.random.default_rng(9)
    scene = make_scene(rng, three_radars(), random_flights(rng, 3, 300.0))
    settings = TrackingSettings(filter_name=name)
    row = len(scene.batch) - 60
    outlier = scene.batch.select(slice(row, row + 1))
    object.__setattr__(outlier, "range_m", outlier.range_m + 6000.0)
    object.__setattr__(outlier, "time_s", outlier.time_s + 1e-3)
    engine, expected = all_output(scene, settings)
    with_outlier = Engine(scene.sensors, settings)
    first, last = (
        with_outlier.push(MeasurementBatch.concatenate([scene.batch, outlier])),
        (with_outlier.flush()),
    )
    updates = TrackUpdates.concatenate([first.updates, last.updates])
    assert with_outlier.counts["REFUSED"] == engine.counts["REFUSED"] + 1
    np.testing.assert_allclose(
        updates.position_sigma_m, expected.updates.position_sigma_m, rtol=1e-3
    )


def test_a_track_without_plots_is_dropped_once_and_reappears_as_a_new_one() -> None:
    scene = busy_scene(2, aircraft=1, duration_s=30.0)
    again = scene.batch.select(slice(None))
    object.__setattr__(again, "time_s", scene.batch.time_s + 1000.0)
    engine = Engine(scene.sensors, TrackingSettings())
    outputs = [engine.push(scene.batch), engine.push(again), engine.flush()]
    updates = TrackUpdates.concatenate([output.updates for output in outputs])
    assert set(updates.track_id.tolist()) == {1, 2}
    assert [i for output in outputs for i in output.ended.track_id.tolist()] == [1]


def test_a_second_flush_has_no_track_output(scene: Scene) -> None:
    engine = Engine(scene.sensors, TrackingSettings())
    engine.push(scene.batch)
    engine.flush()
    assert len(engine.flush().updates) == 0


def test_an_unknown_filter_is_rejected_with_the_known_names() -> None:
    with pytest.raises(UnknownFilterError, match="two-stage, imm, joint, blom, blom-macro, ci"):
        Engine(busy_scene(aircraft=1, duration_s=5.0).sensors, TrackingSettings(filter_name="x"))


@pytest.mark.parametrize("workers", [0, 17])
def test_a_number_of_workers_out_of_bounds_is_rejected(workers: int) -> None:
    with pytest.raises(ConfigurationError, match="workers: expected 1 to 16"):
        Engine(busy_scene(aircraft=1, duration_s=5.0).sensors, TrackingSettings(), workers)


def test_plots_without_identity_are_counted_and_not_used_with_association_by_identity() -> None:
    scene = busy_scene(3, aircraft=1, duration_s=10.0)
    engine = Engine(scene.sensors, TrackingSettings(association="identity"))
    engine.push(batch_of([1.0, 2.0], track_number=[-1, -1]))
    assert len(engine.flush().updates) == 0
    assert engine.counts["UNASSOCIATED"] == 2


@lru_cache(maxsize=8)
def drifting_scene(seed: int, duration_s: float = 150.0) -> Scene:
    """Radars with a scan period of 1 s, and biases that drift by 1 m and 0.02° per √s."""
    rng = np.random.default_rng(seed)
    drifts = {PARAMETER_RANGE_OFFSET: 1.0, PARAMETER_AZIMUTH_OFFSET: float(np.radians(0.02))}
    radars = [replace(radar, drifts=drifts, rotation_s=1.0) for radar in three_radars()]
    return make_scene(rng, radars, random_flights(rng, 12, duration_s, acceleration_density=0.3))


@pytest.mark.slow
@pytest.mark.parametrize("name", FILTERS)
def test_output_depends_neither_on_batches_nor_on_workers_where_biases_drift(name: str) -> None:
    scene, settings = drifting_scene(1, 60.0), TrackingSettings(filter_name=name)
    expected = run(scene, settings, len(scene.batch))
    assert {run(scene, settings, size, workers) for size, workers in [(13, 1), (999, 4)]} == {
        expected
    }


def drifted(seed: int) -> tuple[float, list[float]]:
    """Normalised squared error of all biases at once, and of each at the ends of epochs."""
    settings = TrackingSettings(
        filter_name="two-stage", acceleration_density=0.3, manoeuvre_factor_max=1.0
    )
    scene = drifting_scene(seed)
    engine = Engine(scene.sensors, settings)
    biases = BiasRecords.concatenate([engine.push(scene.batch).biases, engine.flush().biases])
    error = engine.biases.estimate - scene.biases_at(float(scene.batch.time_s[-1]))
    whole = float(normalised_squared(error, engine.biases.covariance)) / len(error)
    ends = []
    for row in np.flatnonzero((biases.time_s > 80.0) & (biases.time_s < 150.0)):
        column = int(biases.sensor[row]) * 2 + int(biases.parameter[row])
        truth = scene.biases_at(float(biases.time_s[row]))[column]
        ends.append(((biases.estimate[row] - truth) / biases.sigma[row]) ** 2)
    return whole, ends


@pytest.mark.slow
def test_biases_with_large_drift_within_an_epoch_have_a_consistent_sigma(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = [drifted(seed) for seed in range(8)]
    # 48 degrees of freedom, and many that are not independent.
    assert 0.6 < np.mean([whole for whole, _ in found]) < 1.5
    assert 0.6 < np.mean([ends for _, ends in found]) < 1.4
    # With one step per epoch, as for small drift, they do not.
    monkeypatch.setattr(shared_biases, "drift_steps", lambda *_: 1)
    assert np.mean([drifted(seed)[0] for seed in range(8)]) > 1.8


def test_the_sigma_at_the_end_of_an_epoch_includes_the_drift_since_the_last_plots() -> None:
    scene, epoch_s = drifting_scene(2), TrackingSettings().epoch_s
    early = np.flatnonzero(scene.batch.time_s % epoch_s < 0.25)
    engine = Engine(scene.sensors, TrackingSettings())
    engine.push(scene.batch.select(early))
    said = engine.flush().biases.sigma[-len(scene.sensors.drift) :]
    walked = (said**2 - engine.biases.sigma**2) / scene.sensors.drift**2
    np.testing.assert_allclose(walked, epoch_s, rtol=1e-6)


def test_an_estimate_without_a_latitude_is_counted_and_not_published(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    def beyond_the_edge(taken: Integers, readout: Floats, plane: Floats, described: Floats) -> None:
        describe(taken, readout, plane, described)
        described[:3] = np.nan

    monkeypatch.setattr("multiradar.runtime.engine.run_updates.describe", beyond_the_edge)
    engine = Engine(scene.sensors, TrackingSettings())
    assert not len(engine.push(scene.batch.select(slice(0, 200))).updates)  # Within the horizon.
    output = engine.flush()
    engine.close()
    counts = engine.counts
    assert counts["UNLOCATABLE"] == 3
    assert len(output.updates) == counts["UPDATED"] + counts["STARTED"] + counts["RESTARTED"]
    assert np.isfinite(output.updates.latitude_rad).all()
    assert output.updates.sequence.tolist() == list(range(1, len(output.updates) + 1))


def test_the_prior_of_drifting_biases_holds_at_the_first_measurement() -> None:
    """Not from second 0 of the day: hours of drift would have passed by the first."""
    radar = replace(three_radars()[0], drifts={PARAMETER_RANGE_OFFSET: 20.0})
    flight = Flight(0.0, 20.0, (2e4, 3e4, 150.0, 80.0))
    scene = make_scene(np.random.default_rng(9), [radar], [flight])
    engine = Engine(scene.sensors, TrackingSettings())
    engine.push(replace(scene.batch, time_s=scene.batch.time_s + 36_000.0))
    engine.flush()
    assert engine.biases.sigma[0] < 1.05 * scene.sensors.prior_sigma[0]
