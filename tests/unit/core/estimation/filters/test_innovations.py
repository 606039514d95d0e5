"""Innovations of all filters."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.estimation.filters._kernels import EXPECTED_NIS
from multiradar.estimation.filters.arrays import result_arrays
from multiradar.estimation.filters.bank import FILTERS, Outcome
from support.references.compiled_filters import CompiledFilter, plain_settings
from support.references.measurement_models import EllipsoidPolar
from support.references.reference_filters import JointKalman, Observation
from support.references.reference_runs import bias_prior, play, start_guesses
from support.scenarios.scenes import Scene, make_scene, random_flights, three_radars

ACCELERATION = 0.3
NAMES = sorted(FILTERS)
#: Blom is overconfident about biases, covariance intersection conservative.
WITHIN = {"blom": (1.0, 5.0), "ci": (0.02, 1.0)}


@pytest.fixture(scope="module")
def scene() -> Scene:
    rng = np.random.default_rng(31)
    radars = [replace(one, detection=0.7) for one in three_radars()]
    flights = random_flights(rng, 6, 150.0, acceleration_density=ACCELERATION, lives_differ=True)
    return make_scene(rng, radars, flights)


def matrix(upper: np.ndarray) -> np.ndarray:
    return np.array([[upper[0], upper[1]], [upper[1], upper[2]]])


@pytest.mark.parametrize("name", ["two-stage", "joint"])
def test_innovations_are_those_of_one_kalman_filter_over_everything(
    name: str, scene: Scene
) -> None:
    one = CompiledFilter(scene, plain_settings(name, ACCELERATION))
    reference = JointKalman(
        EllipsoidPolar(scene.plane, scene.sensors), bias_prior(scene), ACCELERATION
    )
    guesses = start_guesses(np.random.default_rng(31), scene)
    compared = 0
    for _ in play(scene, [reference, one], guesses):
        innovation, expected = reference.compared
        sigma = np.sqrt(np.diagonal(expected))
        np.testing.assert_allclose(one.innovation[:2] / sigma, innovation / sigma, atol=1e-6)
        own, biases = matrix(one.innovation[2:5]), matrix(one.innovation[5:])
        if np.isnan(biases[0, 0]):
            # Not computed below the limit.
            assert innovation @ np.linalg.solve(own, innovation) <= EXPECTED_NIS * (1.0 + 1e-9)
        elif name == "two-stage":
            scale = np.outer(sigma, sigma)
            np.testing.assert_allclose((own + biases) / scale, expected / scale, atol=1e-6)
        compared += 1
    assert compared > 50


@pytest.mark.parametrize("name", NAMES)
def test_innovations_are_consistent(name: str, scene: Scene) -> None:
    one = CompiledFilter(scene, plain_settings(name, ACCELERATION), by_epochs=True)
    guesses = start_guesses(np.random.default_rng(31), scene)
    squares = []
    for _ in play(scene, [one], guesses, walk_s=4.0):
        total = matrix(one.innovation[2:5]) + np.nan_to_num(matrix(one.innovation[5:]))
        squares.append(one.innovation[:2] @ np.linalg.solve(total, one.innovation[:2]))
    least, most = WITHIN.get(name, (0.6, 1.6))
    assert least < 0.5 * np.mean(squares[len(squares) // 4 :]) < most


@pytest.mark.parametrize("name", NAMES)
def test_there_is_no_innovation_without_a_comparison(name: str, scene: Scene) -> None:
    one = CompiledFilter(scene, plain_settings(name, ACCELERATION))
    plot = Observation(10.0, 0, 0, np.array([50_000.0, 1.0]), height_m=9000.0)
    assert one.process(plot) is Outcome.STARTED
    assert np.isnan(one.innovation[0])
    assert one.process(replace(plot, time_s=9.0)) is Outcome.REFUSED
    assert np.isnan(one.innovation[0])
    assert one.process(replace(plot, time_s=14.0)) is Outcome.UPDATED
    assert np.isfinite(one.innovation[:5]).all()


def test_a_gated_measurement_has_an_innovation(scene: Scene) -> None:
    settings = replace(plain_settings("two-stage", ACCELERATION), refuse_nis=9.0)
    one = CompiledFilter(scene, settings)
    one.process(Observation(10.0, 0, 0, np.array([50_000.0, 1.0]), height_m=9000.0))
    one.process(Observation(14.0, 0, 0, np.array([50_000.0, 1.0]), height_m=9000.0))
    far = Observation(18.0, 0, 0, np.array([90_000.0, 1.0]), height_m=9000.0)
    assert one.process(far) is Outcome.REFUSED
    assert one.innovation[0] == pytest.approx(40_000.0, rel=0.05)


def test_a_row_has_a_cache_line() -> None:
    assert result_arrays(3, 1, 2).innovation.strides == (64, 8)
