"""The scenarios are as specified, since other tests evaluate the tracker by them."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.estimation.measurement.sensors import PARAMETER_RANGE_GAIN, PARAMETER_TIME_OFFSET
from support.references.measurement_models import EllipsoidPolar
from support.references.reference_runs import observations
from support.scenarios.scenes import Flight, make_scene, random_flights, three_radars


def test_plots_are_the_truth_plus_biases_plus_noise_of_the_stated_sigma() -> None:
    rng = np.random.default_rng(1)
    more = {PARAMETER_RANGE_GAIN: -6e-4, PARAMETER_TIME_OFFSET: 0.3}
    radars = [replace(one, biases=dict(one.biases) | more) for one in three_radars()]
    flights = random_flights(rng, 12, 400.0, acceleration_density=0.2)
    scene = make_scene(rng, radars, flights)
    model = EllipsoidPolar(scene.plane, scene.sensors)
    misses = []
    for row, observation in enumerate(observations(scene)):
        seen = model.linearise(observation, scene.truth[row])
        left = seen.innovation - seen.by_bias @ scene.biases_at(observation.time_s)
        misses.append(left / np.sqrt(np.diagonal(seen.noise)))
    count = len(misses)
    assert count > 2000
    # Standard errors of mean and of sigma.
    np.testing.assert_allclose(np.mean(misses, axis=0), 0.0, rtol=0, atol=4 / np.sqrt(count))
    np.testing.assert_allclose(np.std(misses, axis=0), 1.0, rtol=0, atol=3 / np.sqrt(count))


def test_same_seed_same_scene() -> None:
    scenes = [
        make_scene(rng, three_radars(), random_flights(rng, 3, 60.0, lives_differ=True))
        for rng in (np.random.default_rng(5), np.random.default_rng(5))
    ]
    np.testing.assert_array_equal(scenes[0].batch.range_m, scenes[1].batch.range_m)
    np.testing.assert_array_equal(scenes[0].truth, scenes[1].truth)


def test_radars_turn_miss_and_err_as_often_as_asked() -> None:
    rng = np.random.default_rng(2)
    radars = [replace(one, detection=0.8, outliers=0.05) for one in three_radars()]
    scene = make_scene(rng, radars, random_flights(rng, 10, 600.0))
    assert np.all(np.diff(scene.batch.time_s) >= 0.0)
    turns = sum(600.0 / radar.rotation_s for radar in radars) * 10
    assert len(scene.batch) == pytest.approx(0.8 * turns, rel=0.03)
    assert scene.outlier.mean() == pytest.approx(0.05, abs=0.012)
    own = (scene.aircraft == 0) & (scene.batch.sensor == 0)
    gaps = np.diff(scene.batch.time_s[own]) / radars[0].rotation_s
    np.testing.assert_allclose(gaps, np.round(gaps), rtol=0, atol=0.1)


def test_aircraft_are_seen_only_while_they_live() -> None:
    rng = np.random.default_rng(3)
    flights = random_flights(rng, 8, 200.0, lives_differ=True)
    scene = make_scene(rng, three_radars(), flights)
    for row, aircraft in enumerate(scene.aircraft):
        flight = flights[aircraft]
        assert flight.start_s <= scene.batch.time_s[row] <= flight.end_s
        assert scene.batch.height_m[row] == flight.height_m


@pytest.mark.slow
def test_biases_walk_as_fast_as_asked() -> None:
    rng = np.random.default_rng(6)
    radars = [replace(one, drifts={0: 2.0}) for one in three_radars()]
    ends = []
    for _ in range(100):
        scene = make_scene(rng, radars, [Flight(0.0, 50.0, (5e3, -7e3, 100.0, 150.0))])
        ends.append(scene.biases_at(50.0) - scene.biases_at(0.0))
        assert np.all(scene.bias_values[:, 1] == scene.bias_values[0, 1])
    spread = np.std(np.array(ends)[:, ::2])
    assert spread == pytest.approx(2.0 * np.sqrt(50.0), rel=0.15)
