"""Biases from simulated pairs of plots, against the truth."""

import numpy as np
import pytest

from multiradar.diagnosis.alignment.fit import Alignment, Problem, fit
from multiradar.diagnosis.alignment.linear import configured_noise
from multiradar.diagnosis.alignment.pairs import APART_MAX_S, pairs_of
from multiradar.diagnosis.plots import Floats
from multiradar.estimation.bias.observability import unobservable_combinations
from support.scenarios.pair_scene import (
    AZIMUTH_SIGMA_DEG,
    POSITION_SIGMA_M,
    RANGE_SIGMA_M,
    SITES,
    PairScene,
)

BIASES = {
    "A": (180.0, -0.19, 0.0, 0.0),
    "B": (-120.0, 0.17, 0.0, 0.0),
    "C": (60.0, -0.08, 0.0, 0.0),
}
#: Errors of this many sigma do not occur in tests of some hundred numbers.
SIGMAS = 4.5


def aligned(scene: PairScene, seed: int) -> tuple[Problem, Alignment]:
    sensors = scene.sensors()
    problem = Problem.of_plots(scene.plots(seed), sensors)
    return problem, fit(problem, np.ones(problem.pairs.size, np.bool_))


def truth(problem: Problem, scene: PairScene) -> Floats:
    table = problem.sensors
    found = []
    for sensor, kind in zip(table.parameter_sensor, table.parameter_kind, strict=True):
        offset_m, offset_deg, gain, late_s = scene.biases[table.ids[sensor]]
        found.append((offset_m, np.radians(offset_deg), gain, late_s)[kind])
    return np.array(found)


def errors(scene: PairScene, seed: int) -> Floats:
    problem, found = aligned(scene, seed)
    sigma = np.sqrt(np.diag(found.covariance))
    return np.asarray((found.estimate - truth(problem, scene)) / sigma)


@pytest.mark.slow
def test_biases_and_their_sigma() -> None:
    scene = PairScene(BIASES)
    normalised = np.array([errors(scene, seed) for seed in range(12)])
    assert np.abs(normalised).max() < SIGMAS
    # 72 correlated numbers: their mean square is 1 within 0.45.
    assert np.mean(normalised**2) == pytest.approx(1.0, abs=0.45)


def test_a_radar_without_plots_changes_no_bias_of_the_others() -> None:
    two = PairScene({name: BIASES[name] for name in ("A", "B")})
    found = []
    for scene in (two, PairScene(BIASES)):
        problem = Problem.of_plots(two.plots(11), scene.sensors())
        every = np.ones(problem.pairs.size, np.bool_)
        found.append(fit(problem, every, configured_noise(problem.sensors)))
    sigma = np.sqrt(np.diag(found[0].covariance))
    np.testing.assert_allclose(found[1].estimate[:4] / sigma, found[0].estimate / sigma, atol=1e-6)


@pytest.mark.slow
def test_range_gain_and_time_offset() -> None:
    biases = {"A": (100.0, 0.1, 0.001, 0.3), "B": (0.0, 0.0, 0.0, 0.0)}
    scene = PairScene(biases, ("range_gain", "time_offset_s"), reference=True, aircraft=60)
    problem, found = aligned(scene, 3)
    sigma = np.sqrt(np.diag(found.covariance))
    assert np.abs((found.estimate - truth(problem, scene)) / sigma).max() < SIGMAS
    # Far below the priors of 0.002 and 0.5 s.
    kinds = problem.sensors.parameter_kind
    assert sigma[kinds == 2].max() < 2e-4
    assert sigma[kinds == 3].max() < 0.05


@pytest.mark.slow
def test_eccentric_antenna_and_late_adsb() -> None:
    scene = PairScene(
        {"A": (100.0, 0.1, 0.0, 0.0), "B": (-50.0, -0.1, 0.0, 0.0)},
        ("azimuth_sine_deg", "azimuth_cosine_deg"), reference=True, aircraft=60,
        eccentric_deg=(0.08, -0.05), late_s=0.4,
    )  # fmt: skip
    problem, found = aligned(scene, 9)
    table = problem.sensors
    sigma = np.sqrt(np.diag(found.covariance))
    expected = {
        ("A", 0): 100.0, ("A", 1): np.radians(0.1), ("A", 4): np.radians(0.08),
        ("A", 5): np.radians(-0.05), ("B", 0): -50.0, ("B", 1): np.radians(-0.1),
        ("B", 4): 0.0, ("B", 5): 0.0, ("G", 3): 0.4,
    }  # fmt: skip
    names = [table.ids[one] for one in table.parameter_sensor]
    true = [expected[one] for one in zip(names, table.parameter_kind.tolist(), strict=True)]
    assert np.abs((found.estimate - np.array(true)) / sigma).max() < SIGMAS
    assert np.degrees(sigma[table.parameter_kind == 4]).max() < 0.02
    assert sigma[table.parameter_kind == 3].max() < 0.05


def test_a_radar_alone_beside_adsb() -> None:
    scene = PairScene({"A": (150.0, 0.2, 0.0, 0.0)}, reference=True)
    assert np.abs(errors(scene, 5)).max() < SIGMAS


@pytest.mark.slow
def test_noise_is_that_of_the_plots() -> None:
    _, found = aligned(PairScene(BIASES, reference=True, aircraft=60), 7)
    np.testing.assert_allclose(np.sqrt(found.noise.range_m2[:3]), RANGE_SIGMA_M, rtol=0.15)
    azimuth_deg = np.degrees(np.sqrt(found.noise.azimuth_rad2[:3]))
    np.testing.assert_allclose(azimuth_deg, AZIMUTH_SIGMA_DEG, rtol=0.15)
    position_m = np.sqrt(found.noise.position_m2[3])
    assert position_m == pytest.approx(POSITION_SIGMA_M, rel=0.3)


def test_wrong_plots_have_little_effect() -> None:
    scene = PairScene(BIASES, outliers=0.1)
    problem, found = aligned(scene, 11)
    apart = found.estimate - truth(problem, scene)
    ranges = problem.sensors.parameter_kind == 0
    assert np.abs(apart[ranges]).max() < 15.0
    assert np.degrees(np.abs(apart[~ranges])).max() < 0.015


def test_what_is_common_to_radars_of_one_site_is_not_observable() -> None:
    sites = {"A": SITES["A"], "B": SITES["A"]}
    problem, found = aligned(PairScene({"A": BIASES["A"], "B": BIASES["B"]}, sites=sites), 1)
    names = [one.name for one in unobservable_combinations(problem.sensors, found.covariance)]
    assert any("azimuth offsets of A and B together" in name for name in names)


def test_pairs_are_of_two_sensors_and_no_other_plot_lies_between() -> None:
    scene = PairScene(BIASES, reference=True)
    plots = scene.plots(2)
    pairs = pairs_of(plots, scene.sensors())
    assert pairs.size > 1000
    assert np.all(pairs.first_sensor < pairs.second_sensor)
    assert np.abs(pairs.apart_s).max() <= APART_MAX_S
    for row in range(0, pairs.size, 97):
        own = plots.select(plots.aircraft == pairs.aircraft[row])
        late = pairs.time_s[row]
        early = late - abs(pairs.apart_s[row])
        between = (own.time_s > early + 1e-9) & (own.time_s < late - 1e-9)
        sensors = {pairs.first_sensor[row], pairs.second_sensor[row]}
        assert not sensors & set(own.sensor[between].tolist())


def test_without_biases_and_noise_positions_of_both_radars_agree() -> None:
    scene = PairScene({"A": (0.0, 0.0, 0.0, 0.0), "B": (0.0, 0.0, 0.0, 0.0)}, reference=True)
    pairs = pairs_of(scene.plots(4), scene.sensors())
    # Median, not mean: noise of 40 m and of 0.06° at 100 km.
    assert np.abs(np.median(pairs.apart_m, axis=0)).max() < 5.0
