"""Withheld aircraft and trends of an alignment."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.diagnosis.alignment.cross_validation import (
    cross_validate,
    distances,
    folds_of,
    side_of,
)
from multiradar.diagnosis.alignment.fit import Problem, fit
from multiradar.diagnosis.alignment.trends import SIGMAS, trend
from support.scenarios.pair_scene import PairScene

BIASES = {"A": (180.0, -0.19, 0.0, 0.0), "B": (-120.0, 0.17, 0.0, 0.0)}


def problem_of(scene: PairScene, seed: int = 1) -> Problem:
    sensors = scene.sensors()
    return Problem.of_plots(scene.plots(seed), sensors)


def test_an_aircraft_is_in_one_fold_and_folds_are_equal() -> None:
    aircraft = np.random.Generator(np.random.PCG64(1)).integers(0, 40, 5000)
    fold = folds_of(aircraft, 5)
    for one in np.unique(aircraft):
        assert len(set(fold[aircraft == one].tolist())) == 1
    counts = np.bincount(fold)
    assert len(counts) == 5
    assert counts.max() < 1.1 * counts.min()
    np.testing.assert_array_equal(fold, folds_of(aircraft, 5))


def test_residuals_are_of_fits_without_the_aircraft() -> None:
    problem = problem_of(PairScene(BIASES, aircraft=6))
    pairs = problem.pairs
    whole = fit(problem, np.ones(pairs.size, np.bool_))
    found = cross_validate(problem, whole, 3)
    for one in range(3):
        held = found.fold == one
        alone = fit(problem, ~held)
        np.testing.assert_allclose(found.after[held], problem.residuals(alone.estimate)[held])
    after, best, before = (distances(one) for one in (found.after, found.best, found.before))
    assert best.rms_m < after.rms_m < before.rms_m


def test_one_aircraft_cannot_be_withheld() -> None:
    problem = problem_of(PairScene(BIASES, aircraft=1))
    whole = fit(problem, np.ones(problem.pairs.size, np.bool_))
    found = cross_validate(problem, whole, 5)
    assert set(found.fold.tolist()) == {0}
    np.testing.assert_array_equal(found.after, found.before)


def test_residuals_of_a_radar_are_its_biases() -> None:
    problem = problem_of(PairScene({"A": (300.0, 0.4, 0.0, 0.0)}, reference=True))
    side = side_of(problem, 0)
    ranges, azimuths = side.polar(problem.residuals(np.zeros(2)))
    assert abs(np.median(ranges) - 300.0) < 10.0
    assert abs(np.degrees(np.median(azimuths)) - 0.4) < 0.02


@pytest.mark.slow
def test_a_drift_is_found_and_constant_biases_have_none() -> None:
    scene = PairScene(BIASES, aircraft=10, duration_s=2400.0, reference=True)
    for drift_m_per_h, drifts in ((0.0, False), (300.0, True)):
        problem = problem_of(replace(scene, drift_m_per_h=drift_m_per_h))
        whole = fit(problem, np.ones(problem.pairs.size, np.bool_))
        found = trend(problem, whole)
        assert len(found.time_s) == 7
        ratios = np.abs(found.drift_per_h / found.drift_sigma)
        assert bool(ratios[0] > SIGMAS) is drifts
        assert ratios[1:].max() < SIGMAS
        if drifts:
            assert abs(found.drift_per_h[0] - drift_m_per_h) < SIGMAS * found.drift_sigma[0]


def test_a_short_recording_has_no_trend() -> None:
    problem = problem_of(PairScene(BIASES, aircraft=4))
    found = trend(problem, fit(problem, np.ones(problem.pairs.size, np.bool_)))
    assert len(found.time_s) == 0
    assert np.isnan(found.drift_per_h).all()
