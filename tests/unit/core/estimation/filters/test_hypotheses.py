"""The mixture of hypotheses has the moments computed by NumPy."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._hypothesis_kernels import copy_aircraft, mix_hypotheses
from multiradar.estimation.filters._kernels import NONE
from multiradar.estimation.filters.arrays import Aircraft, aircraft_arrays

Floats = NDArray[np.float64]

BIAS = np.array([120.0, 0.004, -60.0])
UPPER = np.triu_indices(4)


def random_aircraft(rng: np.random.Generator, slots: int, modes: int) -> Aircraft:
    made = aircraft_arrays(slots, len(BIAS), modes=modes)
    for mean, covariance, sensitivity in (
        (made.mean, made.covariance, made.sensitivity),
        (made.mode_mean, made.mode_covariance, made.mode_sensitivity),
    ):
        mean[:] = rng.normal(0.0, 100.0, mean.shape)
        sensitivity[:] = rng.normal(0.0, 1.0, sensitivity.shape)
        for row in covariance:
            root = rng.normal(0.0, 30.0, (4, 4))
            row[:] = (root @ root.T)[UPPER]
    chances = rng.uniform(0.1, 1.0, made.mode_probability.shape)
    made.mode_probability[:] = chances / np.maximum(chances.sum(axis=1, keepdims=True), 1e-9)
    made.time[:] = 100.0
    made.updates[:] = np.arange(slots)
    made.fading_nis[:] = rng.uniform(0.5, 3.0, slots)
    return made


def whole(mean: Floats, upper: Floats, sensitivity: Floats) -> tuple[Floats, Floats]:
    """State and second moments at the biases."""
    x = mean + sensitivity @ BIAS
    covariance = np.zeros((4, 4))
    covariance[UPPER] = upper
    covariance += np.triu(covariance, 1).T
    return x, covariance + np.outer(x, x)


def test_mean_and_covariance_are_those_of_the_mixture() -> None:
    rng = np.random.default_rng(1)
    copies, aircraft = random_aircraft(rng, 3, 0), random_aircraft(rng, 2, 0)
    beta = np.array([0.2, 0.5, 0.3])
    slots, bounds = np.array([1]), np.array([0, 3])
    mix_hypotheses(slots, np.array([2]), bounds[:-1], bounds, beta, copies, BIAS, aircraft)
    parts = [whole(copies.mean[h], copies.covariance[h], copies.sensitivity[h]) for h in range(3)]
    x, moment = whole(aircraft.mean[1], aircraft.covariance[1], aircraft.sensitivity[1])
    np.testing.assert_allclose(x, sum(b * p[0] for b, p in zip(beta, parts, strict=True)))
    np.testing.assert_allclose(
        moment, sum(b * p[1] for b, p in zip(beta, parts, strict=True)), rtol=1e-9, atol=1e-6
    )
    # Affine in the biases: later corrections of biases shift the mixture like its parts.
    np.testing.assert_allclose(
        aircraft.sensitivity[1], np.tensordot(beta, copies.sensitivity[:3], 1), rtol=1e-12
    )
    assert aircraft.updates[1] == 2
    assert aircraft.fading_nis[1] == beta @ copies.fading_nis[:3]


def test_modes_are_mixed_separately_and_add_up_to_the_whole() -> None:
    rng = np.random.default_rng(2)
    copies, aircraft = random_aircraft(rng, 2, 3), random_aircraft(rng, 1, 3)
    beta = np.array([0.35, 0.65])
    none, bounds = np.array([NONE]), np.array([0, 2])
    mix_hypotheses(np.array([0]), none, bounds[:-1], bounds, beta, copies, BIAS, aircraft)
    np.testing.assert_allclose(aircraft.mode_probability[0], beta @ copies.mode_probability[:2])
    for j in range(3):
        x, moment = whole(
            aircraft.mode_mean[j], aircraft.mode_covariance[j], aircraft.mode_sensitivity[j]
        )
        share = beta * copies.mode_probability[:2, j]
        share = share / share.sum()
        rows = [j, 3 + j]
        parts = [
            whole(copies.mode_mean[h], copies.mode_covariance[h], copies.mode_sensitivity[h])
            for h in rows
        ]
        np.testing.assert_allclose(x, share[0] * parts[0][0] + share[1] * parts[1][0])
        np.testing.assert_allclose(
            moment, share[0] * parts[0][1] + share[1] * parts[1][1], rtol=1e-9, atol=1e-6
        )


def test_an_aircraft_without_a_plot_keeps_its_bookkeeping_except_time() -> None:
    rng = np.random.default_rng(3)
    copies, aircraft = random_aircraft(rng, 2, 0), random_aircraft(rng, 1, 0)
    copies.time[:] = 107.0
    copies.updates[:] = 99
    aircraft.updates[0] = 12
    beta = np.array([0.5, 0.5])
    none, bounds = np.array([NONE]), np.array([0, 2])
    copies.height[:] = [8000.0, 8040.0]
    mix_hypotheses(np.array([0]), none, np.array([1]), bounds, beta, copies, BIAS, aircraft)
    assert aircraft.time[0] == 107.0
    assert aircraft.height[0] == 8040.0
    assert aircraft.updates[0] == 12


def test_a_single_hypothesis_changes_no_bit() -> None:
    rng = np.random.default_rng(4)
    aircraft, copies = random_aircraft(rng, 3, 3), random_aircraft(rng, 4, 3)
    before = [array.copy() for array in aircraft]
    slots, bounds = np.array([0, 2]), np.array([0, 1, 2])
    copy_aircraft(slots, bounds, aircraft, copies)
    mix_hypotheses(slots, bounds[:-1], bounds[:-1], bounds, np.ones(2), copies, BIAS, aircraft)
    for name, was, now in zip(Aircraft._fields, before, aircraft, strict=True):
        np.testing.assert_array_equal(now, was, err_msg=name)
