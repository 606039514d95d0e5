"""The plain reference filters: equal where theory requires it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from multiradar.estimation.gaussian import normalised_squared, require_covariance
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
)
from support.references.measurement_models import EllipsoidPolar, FlatCartesian, FlatPolar
from support.references.reference_filters import (
    BlomSeparated,
    CovarianceIntersection,
    JointKalman,
    MeasurementModel,
    ReferenceFilter,
    TwoStage,
    intersect,
    intersection_bound,
)
from support.references.reference_runs import bias_prior, play, start_guesses
from support.scenarios.report_scene import (
    AZIMUTH_SIGMA_RAD,
    BIASES,
    RANGE_SIGMA_M,
    SITES_M,
    ReportScene,
    report_scene,
    start_all,
)
from support.scenarios.report_scene import bias_prior as report_prior
from support.scenarios.scenes import Scene, make_scene, random_flights, three_radars

CARTESIAN = FlatCartesian(SITES_M, RANGE_SIGMA_M, AZIMUTH_SIGMA_RAD)
POLAR = FlatPolar(SITES_M, RANGE_SIGMA_M, AZIMUTH_SIGMA_RAD)
MICROMETRE = 1e-6


def assert_equal_estimates(
    found: tuple[np.ndarray, np.ndarray], expected: tuple[np.ndarray, np.ndarray], unit: np.ndarray
) -> None:
    """Means to a micrometre (biases: their effect on a plot), variances to 1e-9."""
    np.testing.assert_allclose(found[0] / unit, expected[0] / unit, rtol=0, atol=MICROMETRE)
    sigmas = np.sqrt(np.diagonal(expected[1]))
    scale = np.outer(sigmas, sigmas)
    np.testing.assert_allclose(found[1] / scale, expected[1] / scale, rtol=0, atol=1e-9)


def lively_scene(seed: int, drift: float = 0.0) -> Scene:
    """Irregular and missing plots, new and removed aircraft, three radars, all kinds of biases."""
    rng = np.random.default_rng(seed)
    radars = [replace(one, detection=0.7) for one in three_radars()]
    more = {PARAMETER_RANGE_GAIN: 4e-4, PARAMETER_TIME_OFFSET: 0.2}
    radars[1] = replace(radars[1], biases=dict(radars[1].biases) | more)
    rates = {PARAMETER_RANGE_OFFSET: drift, PARAMETER_AZIMUTH_OFFSET: drift * np.radians(0.02)}
    if drift:
        radars = [replace(one, drifts=rates) for one in radars]
    flights = random_flights(rng, 5, 90.0, acceleration_density=0.3, lives_differ=True)
    return make_scene(rng, radars, flights)


@pytest.mark.parametrize("model", [CARTESIAN, POLAR], ids=["cartesian", "polar"])
def test_two_stage_equals_joint_on_the_report_s_scene(model: MeasurementModel) -> None:
    rng = np.random.default_rng(11)
    scene = report_scene(rng, tracks=4, duration_s=60)
    joint = JointKalman(model, report_prior(), 0.0)
    two_stage = TwoStage(model, report_prior(), 0.0)
    start_all(joint, scene, np.random.default_rng(12))
    start_all(two_stage, scene, np.random.default_rng(12))
    unit = np.tile([1.0, 1e-5], len(SITES_M))
    for count, observation in enumerate(scene.observations):
        joint.observe(observation)
        two_stage.observe(observation)
        if count % 37 == 0:
            assert_equal_estimates(two_stage.biases(), joint.biases(), unit)
            for aircraft in range(4):
                assert_equal_estimates(
                    two_stage.aircraft(aircraft), joint.aircraft(aircraft), np.ones(4)
                )


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_two_stage_equals_joint_with_gaps_births_and_deaths(seed: int) -> None:
    """Exact for constant biases of all kinds, process noise, and new and removed aircraft."""
    scene = lively_scene(seed)
    model = EllipsoidPolar(scene.plane, scene.sensors)
    joint = JointKalman(model, bias_prior(scene), 0.3)
    two_stage = TwoStage(model, bias_prior(scene), 0.3)
    guesses = start_guesses(np.random.default_rng(seed), scene)
    kinds = scene.sensors.parameter_kind
    # A unit of a parameter moves a plot by about a metre.
    unit = np.array([1.0, 1e-5, 1e-5, 5e-3])[kinds]
    rows = 0
    for _, observation in play(scene, [joint, two_stage], guesses, ends=True):
        rows += 1
        assert_equal_estimates(
            two_stage.aircraft(observation.aircraft),
            joint.aircraft(observation.aircraft),
            np.ones(4),
        )
        assert_equal_estimates(two_stage.biases(), joint.biases(), unit)
    assert rows > 100
    with pytest.raises(KeyError):
        two_stage.aircraft(int(scene.aircraft[-1]))


def test_bias_information_of_a_removed_aircraft_remains() -> None:
    scene = lively_scene(4)
    two_stage = TwoStage(EllipsoidPolar(scene.plane, scene.sensors), bias_prior(scene), 0.3)
    guesses = start_guesses(np.random.default_rng(4), scene)
    for _ in play(scene, [two_stage], guesses, ends=True):
        pass
    estimate, covariance = two_stage.biases()
    assert np.all(np.sqrt(np.diagonal(covariance)) < 0.9 * scene.sensors.prior_sigma)
    error = estimate - scene.biases_at(45.0)
    assert normalised_squared(error, covariance) < chi2.ppf(0.999, len(error))


def test_two_stage_with_drift_follows_the_joint_filter_within_a_percent() -> None:
    """With drift steps of a second at 1 m/√s and 0.02°/√s positions differ by at most 1 %."""
    scene = lively_scene(5, drift=1.0)
    model = EllipsoidPolar(scene.plane, scene.sensors)
    filters: list[ReferenceFilter] = [
        JointKalman(model, bias_prior(scene), 0.3),
        TwoStage(model, bias_prior(scene), 0.3),
    ]
    guesses = start_guesses(np.random.default_rng(5), scene)
    sigmas = []
    for _, observation in play(scene, filters, guesses, walk_s=1.0):
        joint, two_stage = (one.aircraft(observation.aircraft) for one in filters)
        sigma = np.sqrt(np.trace(joint[1][:2, :2]))
        assert np.hypot(*(joint[0] - two_stage[0])[:2]) < 0.1 * sigma
        sigmas.append([np.sqrt(np.trace(one[1][:2, :2])) for one in (joint, two_stage)])
    half = np.array(sigmas[len(sigmas) // 2 :])
    assert half[:, 1].mean() == pytest.approx(half[:, 0].mean(), rel=0.01)


def test_epochs_lose_only_linearisation_accuracy() -> None:
    """Published every 4 s instead of every plot, the two-stage filter ends within 0.3 sigma.

    The starts are off by 500 m and the biases by as much: the first epochs are linearised there.
    """
    scene = lively_scene(6)
    model = EllipsoidPolar(scene.plane, scene.sensors)
    at_once = TwoStage(model, bias_prior(scene), 0.3)
    by_epochs = TwoStage(model, bias_prior(scene), 0.3, by_epochs=True)
    guesses = start_guesses(np.random.default_rng(6), scene)
    epoch = 0
    for _, observation in play(scene, [at_once, by_epochs], guesses):
        if int(observation.time_s // 4.0) != epoch:
            epoch = int(observation.time_s // 4.0)
            by_epochs.publish()
    by_epochs.publish()
    expected, covariance = at_once.biases()
    sigma = np.sqrt(np.diagonal(covariance))
    np.testing.assert_allclose(by_epochs.biases()[0] / sigma, expected / sigma, rtol=0, atol=0.3)


@pytest.mark.slow
def test_polar_two_stage_is_consistent() -> None:
    """NEES over 40 seeded runs within its 95 % band, for the biases and for the aircraft."""
    biases, aircraft = [], []
    for seed in range(40):
        rng = np.random.default_rng(1000 + seed)
        flights = random_flights(rng, 4, 60.0, acceleration_density=0.3)
        # The prior is tested too: biases are drawn from it.
        drawn = rng.normal(size=(3, 2)) * [500.0, np.radians(0.5)]
        radars = [
            replace(one, biases=dict(enumerate(biases_of_one.tolist())))
            for one, biases_of_one in zip(three_radars(), drawn, strict=True)
        ]
        scene = make_scene(rng, radars, flights)
        two_stage = TwoStage(EllipsoidPolar(scene.plane, scene.sensors), bias_prior(scene), 0.3)
        last = {}
        for row, observation in play(scene, [two_stage], start_guesses(rng, scene)):
            last[observation.aircraft] = row
        # One aircraft per run, so that the samples are independent.
        chosen = observation.aircraft
        mean, covariance = two_stage.aircraft(chosen)
        aircraft.append(float(normalised_squared(mean - scene.truth[last[chosen]], covariance)))
        mean, covariance = two_stage.biases()
        biases.append(float(normalised_squared(mean - scene.biases_at(0.0), covariance)))
    for values, size in ((biases, 6), (aircraft, 4)):
        low, high = chi2.ppf([0.025, 0.975], size * len(values)) / len(values)
        assert low < np.mean(values) < high


def random_joint_covariance(rng: np.random.Generator) -> np.ndarray:
    """Covariance of (χ, ς) with any correlation from none to nearly full."""
    root = rng.normal(size=(6, rng.integers(2, 7)))
    units = np.array([100.0, 150.0, 10.0, 12.0, 200.0, 3e-3]) * 10 ** rng.uniform(-1, 1, 6)
    correlated = root @ root.T + 10 ** rng.uniform(-6, 0) * np.eye(6)
    return np.asarray(units[:, None] * correlated * units)


@pytest.mark.parametrize("seed", range(60))
def test_intersection_bounds_the_true_covariance_whatever_the_correlation(seed: int) -> None:
    """(1.46): P ⪯ R after a correction with K*, P by Joseph's formula with all correlations."""
    rng = np.random.default_rng(seed)
    joint = random_joint_covariance(rng)
    slack = rng.uniform(1.0, 1.5, 2)
    bound, other_bound = slack[0] * joint[:4, :4], slack[1] * joint[4:, 4:]
    azimuth, distance = rng.uniform(0, 2 * np.pi), 10 ** rng.uniform(3.5, 5.5)
    s, c = np.sin(azimuth), np.cos(azimuth)
    by_state = np.zeros((2, 4))
    by_state[:, :2] = [[s, c], [c / distance, -s / distance]]
    by_bias, noise = np.eye(2), np.diag([40.0**2, 1e-3**2])
    weights = np.array([1.0, 1.0, 100.0, 100.0])
    gain, corrected = intersect(bound, by_state, by_bias @ other_bound @ by_bias.T, noise, weights)
    kept = np.hstack([np.eye(4) - gain @ by_state, -gain @ by_bias])
    true = kept @ joint @ kept.T + gain @ noise @ gain.T  # Joseph, (1.26)
    sigmas = np.sqrt(np.diagonal(corrected))
    excess = (corrected - true) / np.outer(sigmas, sigmas)
    assert np.linalg.eigvalsh(excess).min() > -1e-9
    assert weights @ np.diagonal(corrected) <= weights @ np.diagonal(bound)
    require_covariance(corrected, "bound")


@pytest.mark.parametrize("seed", range(20))
def test_intersection_takes_the_best_weight(seed: int) -> None:
    """No γ on a fine grid gives a smaller weighted trace, by (1.45) in full matrices."""
    rng = np.random.default_rng(seed)
    joint = random_joint_covariance(rng)
    matrix, noise = np.eye(2, 4), np.diag(10 ** rng.uniform(1, 4, 2))
    weights = np.array([1.0, 1.0, 100.0, 100.0])
    scale = np.diag([1.0, 1e5])
    other = scale @ joint[4:, 4:] @ scale
    _, corrected = intersect(joint[:4, :4], matrix, other, noise, weights)
    grid = [
        weights @ np.diagonal(intersection_bound(gamma, joint[:4, :4], matrix, other, noise)[1])
        for gamma in np.geomspace(1e-5, 90.0, 400)
    ]
    best = min(*grid, weights @ np.diagonal(joint[:4, :4]))
    assert weights @ np.diagonal(corrected) <= best * (1 + 1e-6)


def test_intersection_that_cannot_improve_leaves_the_bound_alone() -> None:
    """A nearly known aircraft learns nothing from a radar with unknown biases: K = 0, R stays."""
    bound = np.diag([1.0, 1.0, 0.01, 0.01])
    matrix, other = np.eye(2, 4), np.diag([500.0**2, 500.0**2])
    weights = np.array([1.0, 1.0, 100.0, 100.0])
    gain, kept = intersect(bound, matrix, other, np.eye(2), weights)
    np.testing.assert_array_equal(gain, np.zeros((4, 2)))
    np.testing.assert_array_equal(kept, bound)
    # Any γ would have increased the bound.
    for gamma in (1e-4, 1e-2, 1.0):
        grown = intersection_bound(gamma, bound, matrix, other, np.eye(2))[1]
        assert weights @ np.diagonal(grown) > weights @ np.diagonal(bound)


def test_separated_filters_update_only_one_aircraft_and_radar() -> None:
    """Plots of one pair change this aircraft and radar, nothing else; covariances stay such."""
    for separated in (BlomSeparated, CovarianceIntersection):
        scene = report_scene(np.random.default_rng(21), tracks=2, duration_s=40)
        one = separated(POLAR, report_prior(), 0.0)
        # Accurate initial state: with an uncertain aircraft CI does not update the biases.
        for aircraft in (0, 1):
            known = np.diag([50.0**2, 50.0**2, 1.0, 1.0])
            off = np.array([40.0, -30.0, 0.5, 0.5])
            one.start(aircraft, 0.0, scene.truth(aircraft, 0.0) + off, known)
        before, others = one.aircraft(1)[0].copy(), one.biases()[0].copy()
        for observation in scene.observations:
            if (observation.aircraft, observation.radar) == (0, 0):
                one.observe(observation)
        np.testing.assert_array_equal(one.aircraft(1)[0], before)
        np.testing.assert_array_equal(one.biases()[0][2:], others[2:])
        assert np.all(one.biases()[0][:2] != others[:2])
        require_covariance(one.aircraft(0)[1], "aircraft")
        require_covariance(one.biases()[1], "biases")


def mean_errors(one: ReferenceFilter, scene: ReportScene) -> dict[str, float]:
    """Mean final errors: position m, velocity m/s, azimuth bias degrees, range bias m."""
    off = np.array(
        [one.aircraft(i)[0] - scene.truth(i, scene.duration_s) for i in range(len(scene.states))]
    )
    bias = np.abs(one.biases()[0] - BIASES)
    return {
        "position": float(np.hypot(off[:, 0], off[:, 1]).mean()),
        "velocity": float(np.hypot(off[:, 2], off[:, 3]).mean()),
        "azimuth": float(np.degrees(bias[1::2].mean())),
        "range": float(bias[::2].mean()),
    }


@pytest.mark.slow
def test_orders_of_magnitude_of_section_1_6() -> None:
    """A plot every 4 s for 1000 s: errors of metres for Kalman, tens for CI, hundreds for Blom.

    Velocities count as the distance of 100 s in the trace of CI; with 10 s it converges later.
    """
    scene = report_scene(np.random.default_rng(0), tracks=4, duration_s=1000, interval_s=4)
    errors = {}
    filters: dict[str, ReferenceFilter] = {
        "joint": JointKalman(CARTESIAN, report_prior(), 0.0),
        "polar": TwoStage(POLAR, report_prior(), 0.0),
        "blom": BlomSeparated(CARTESIAN, report_prior(), 0.0),
        "ci": CovarianceIntersection(CARTESIAN, report_prior(), 0.0, 100.0),
    }
    for name, one in filters.items():
        start_all(one, scene, np.random.default_rng(99))
        for observation in scene.observations:
            one.observe(observation)
        errors[name] = mean_errors(one, scene)
    for name in ("joint", "polar"):
        assert errors[name]["position"] < 10.0
        assert errors[name]["velocity"] < 0.05
        assert errors[name]["range"] < 5.0
        assert errors[name]["azimuth"] < 0.005
    assert 50.0 < errors["blom"]["range"] < 2000.0
    assert 50.0 < errors["blom"]["position"] < 2000.0
    assert errors["ci"]["position"] / errors["joint"]["position"] > 3.0
    assert errors["ci"]["position"] < errors["blom"]["position"] / 3.0
    assert errors["ci"]["range"] < errors["blom"]["range"] / 3.0
