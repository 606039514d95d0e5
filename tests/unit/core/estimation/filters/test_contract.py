"""Contract of all filters; each registered filter passes the same tests."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.stats import chi2

from multiradar.errors import UnknownFilterError
from multiradar.estimation.filters._kernels import READOUT_RATE
from multiradar.estimation.filters.bank import FILTERS, Outcome, find_filter
from multiradar.estimation.gaussian import normalised_squared, require_covariance
from multiradar.estimation.measurement.sensors import (
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
)
from multiradar.tracking.modes import mode_table
from support.bands import tails
from support.references.compiled_filters import CompiledFilter, Form, plain_settings
from support.references.measurement_models import EllipsoidPolar, Flat
from support.references.reference_filters import (
    BiasPrior,
    BlomMacro,
    BlomSeparated,
    CovarianceIntersection,
    JointKalman,
    MeasurementModel,
    Observation,
    ReferenceFilter,
    TwoStage,
)
from support.references.reference_modes import Imm
from support.references.reference_runs import START_SIGMA, bias_prior, play, start_guesses
from support.scenarios.scenes import (
    Radar,
    Scene,
    flat_sites,
    flattened,
    make_scene,
    random_flights,
    three_radars,
)

ACCELERATION = 0.3
NAMES = sorted(FILTERS)
FORMS: tuple[Form, ...] = ("ellipsoid", "polar", "place")
Plain = Callable[[MeasurementModel, BiasPrior, float], ReferenceFilter]


def plain_modes(model: MeasurementModel, prior: BiasPrior, acceleration: float) -> Imm:
    return Imm(model, prior, mode_table(plain_settings("imm", acceleration)))


PLAIN: dict[str, Plain] = {
    "two-stage": TwoStage,
    "imm": plain_modes,
    "joint": JointKalman,
    "blom": BlomSeparated,
    "blom-macro": BlomMacro,
    "ci": CovarianceIntersection,
}
# It estimates biases by stacked plots only: nothing with epochs of one measurement.
STACKS = "blom-macro"


@cache
def lively_scene(seed: int, drift: float = 0.0, length_s: float = 90.0) -> Scene:
    """Irregular and missing plots, aircraft initiated and removed, all kinds of bias parameters."""
    rng = np.random.default_rng(seed)
    radars = [replace(one, detection=0.7) for one in three_radars()]
    # Time offsets have plain forms and tests of their own: test_time_offsets.
    more = {PARAMETER_RANGE_GAIN: 4e-4}
    radars[1] = replace(radars[1], biases=dict(radars[1].biases) | more)
    # A sensor without plots and biases, for position reports.
    radars.append(Radar("adsb", 56.0, 61.0, biases={}, detection=0.0))
    if drift:
        radars[2] = replace(radars[2], drifts={PARAMETER_RANGE_OFFSET: drift})
    flights = random_flights(rng, 5, length_s, acceleration_density=ACCELERATION, lives_differ=True)
    return make_scene(rng, radars, flights)


def compiled(
    name: str, scene: Scene, *, by_epochs: bool = False, form: Form = "ellipsoid"
) -> CompiledFilter:
    by_epochs = by_epochs or name == STACKS
    return CompiledFilter(scene, plain_settings(name, ACCELERATION), by_epochs=by_epochs, form=form)


def measured(scene: Scene, form: Form) -> MeasurementModel:
    if form == "ellipsoid":
        return EllipsoidPolar(scene.plane, scene.sensors)
    return Flat(scene.plane, scene.sensors, as_places=form == "place")


def in_form(scene: Scene, form: Form, seed: int) -> Scene:
    return scene if form == "ellipsoid" else flattened(np.random.default_rng(seed), scene)


def plain(name: str, scene: Scene, form: Form = "ellipsoid") -> ReferenceFilter:
    return PLAIN[name](measured(scene, form), bias_prior(scene), ACCELERATION)


def played(
    scene: Scene, filters: list[ReferenceFilter], seed: int, walk_s: float | None = None
) -> Iterator[tuple[int, Observation]]:
    guesses = start_guesses(np.random.default_rng(seed), scene)
    return play(scene, filters, guesses, walk_s=walk_s)


def assert_equal_estimates(
    found: tuple[np.ndarray, np.ndarray],
    expected: tuple[np.ndarray, np.ndarray],
    *,
    sigmas: float,
    variance: float,
) -> None:
    """Means in units of their sigmas; variances relative."""
    scale = np.sqrt(np.diagonal(expected[1]))
    np.testing.assert_allclose(found[0] / scale, expected[0] / scale, rtol=0, atol=sigmas)
    outer = np.outer(scale, scale)
    np.testing.assert_allclose(found[1] / outer, expected[1] / outer, rtol=0, atol=variance)


def test_every_filter_has_a_plain_form() -> None:
    assert set(PLAIN) == set(FILTERS)


def test_an_unknown_filter_is_reported_with_the_known_ones() -> None:
    with pytest.raises(UnknownFilterError, match=r"unknown filter 'kalman'.*two-stage"):
        find_filter("kalman")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(("form", "seed"), [*zip(FORMS, [1, 1, 1], strict=True), ("ellipsoid", 2)])
def test_compiled_equals_plain(name: str, form: Form, seed: int) -> None:
    """Epochs of one measurement: exact, except for the weight of CI, found by iteration in both."""
    # The plain form of the modes takes 20 ms for a plot.
    scene = in_form(lively_scene(seed, length_s=45.0 if name == "imm" else 90.0), form, seed)
    filters = [compiled(name, scene, form=form), plain(name, scene, form)]
    sigmas, variance = (0.0025, 0.001) if name == "ci" else (1e-8, 1e-9)
    walk_s = 4.0 if name == STACKS else None
    for _, observation in played(scene, [*filters], seed, walk_s):
        one = observation.aircraft
        found, expected = (each.aircraft(one) for each in filters)
        assert_equal_estimates(found, expected, sigmas=sigmas, variance=variance)
        assert_equal_estimates(
            *(each.biases() for each in filters), sigmas=sigmas, variance=variance
        )


@pytest.mark.parametrize("form", FORMS)
def test_two_stage_equals_the_joint_kalman_filter(form: Form) -> None:
    """To 1e-6 m and 1e-9 of the variances, with gaps, new and removed aircraft, all parameters."""
    scene = in_form(lively_scene(3), form, 3)
    joint = plain("joint", scene, form)
    two_stage = compiled("two-stage", scene, form=form)
    for _, observation in played(scene, [joint, two_stage], 3):
        found = two_stage.aircraft(observation.aircraft)
        expected = joint.aircraft(observation.aircraft)
        np.testing.assert_allclose(found[0], expected[0], rtol=0, atol=1e-6)
        assert_equal_estimates(found, expected, sigmas=1e-8, variance=1e-9)
        assert_equal_estimates(two_stage.biases(), joint.biases(), sigmas=1e-8, variance=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_two_stage_equals_the_joint_filter_after_initiation_at_plots(form: Form) -> None:
    """Plots contribute to the biases from the first plot of a second radar, in both filters."""
    scene = in_form(lively_scene(13), form, 13)
    joint, two_stage = (compiled(name, scene, form=form) for name in ("joint", "two-stage"))
    outcomes = set()
    alone = 0
    for row, observation in played(scene, [], 13):
        if observation.aircraft in (0, 1) and observation.radar and row < 80:
            continue  # Only one radar detects these for a while.
        alone += joint.arrays.measured_from[observation.aircraft] == observation.radar
        outcome = joint.process(observation)
        assert two_stage.process(observation) == outcome
        outcomes.add(outcome)
        found, expected = (one.aircraft(observation.aircraft) for one in (two_stage, joint))
        np.testing.assert_allclose(found[0], expected[0], rtol=0, atol=1e-6)
        assert_equal_estimates(found, expected, sigmas=1e-8, variance=1e-9)
        assert_equal_estimates(two_stage.biases(), joint.biases(), sigmas=1e-8, variance=1e-9)
        if row % 40 == 30:  # Removed, and another aircraft in its slot.
            joint.end(observation.aircraft)
            two_stage.end(observation.aircraft)
    assert outcomes == {Outcome.STARTED, Outcome.UPDATED}
    assert alone > 5


def simultaneous_plots(
    rng: np.random.Generator, scene: Scene, form: Form, time_s: float, state: np.ndarray
) -> list[Observation]:
    """Range and azimuth of one aircraft from three radars at one time."""
    model = measured(scene, "ellipsoid" if form == "ellipsoid" else "polar")
    plots = []
    for radar in range(3):
        nothing = Observation(time_s, 0, radar, np.zeros(2), 9e3)
        seen = model.linearise(nothing, state)
        value = seen.by_bias @ scene.biases_at(0.0) - seen.innovation
        value = value + np.sqrt(np.diagonal(seen.noise)) * rng.normal(size=2)
        plots.append(replace(nothing, value=value))
    return plots


@pytest.mark.parametrize("form", FORMS)
def test_the_macro_filter_eliminates_the_position_of_simultaneous_plots(form: Form) -> None:
    """Stacked as a whole, at one time: the Kalman update of ς by the remaining information."""
    scene = lively_scene(14)
    model = measured(scene, form)
    one = compiled(STACKS, scene, form=form)
    rng = np.random.default_rng(14)
    place, sigma = np.array([30e3, 60e3, 150.0, -90.0]), np.diag(START_SIGMA**2)
    one.start(0, 0.0, place + START_SIGMA * rng.normal(size=4), sigma)
    for time_s in np.arange(1.0, 30.0):
        place[:2] += place[2:]
        before = one.biases()
        plots = simultaneous_plots(rng, scene, form, time_s, place)
        for plot in plots:
            one.observe(plot)
        parts = [model.linearise(plot, one.aircraft(0)[0]) for plot in plots]
        one.publish()
        units = [np.linalg.inv(np.linalg.cholesky(part.noise)) for part in parts]
        shared = np.vstack([u @ part.by_state[:, :2] for u, part in zip(units, parts, strict=True)])
        matrix = np.vstack([u @ part.by_bias for u, part in zip(units, parts, strict=True)])
        news = np.concatenate([u @ part.innovation for u, part in zip(units, parts, strict=True)])
        left = null_space(shared.T).T
        gain = before[1] @ (left @ matrix).T
        expected = left @ matrix @ gain + np.eye(len(left))
        gain = np.linalg.solve(expected, gain.T).T
        mean = before[0] + gain @ left @ (news - matrix @ before[0])
        covariance = before[1] - gain @ expected @ gain.T
        assert_equal_estimates(one.biases(), (mean, covariance), sigmas=1e-8, variance=1e-9)
    assert one.biases()[1][0, 0] < 0.5 * scene.sensors.prior_sigma[0] ** 2


@pytest.mark.slow
def test_two_stage_equals_the_joint_filter_after_thousands_of_plots() -> None:
    """Without process noise P decreases forever: an update that loses symmetry diverges here."""
    rng = np.random.default_rng(12)
    radars = [replace(one, rotation_s=1.0, range_sigma_m=15.0) for one in three_radars()]
    scene = make_scene(rng, radars, random_flights(rng, 1, 700.0))
    two_stage = CompiledFilter(scene, plain_settings("two-stage", 0.0))
    joint = JointKalman(EllipsoidPolar(scene.plane, scene.sensors), bias_prior(scene), 0.0)
    for row, observation in played(scene, [joint, two_stage], 12):
        last, aircraft = row, observation.aircraft
    assert last > 2_000
    found, expected = two_stage.aircraft(aircraft), joint.aircraft(aircraft)
    np.testing.assert_allclose(found[0], expected[0], rtol=0, atol=1e-6)
    assert_equal_estimates(found, expected, sigmas=1e-7, variance=1e-9)
    assert_equal_estimates(two_stage.biases(), joint.biases(), sigmas=1e-7, variance=1e-9)


def test_two_stage_by_epochs_and_with_drift_equals_its_plain_form() -> None:
    scene = lively_scene(4, drift=2.0)
    model = EllipsoidPolar(scene.plane, scene.sensors)
    epochs: list[ReferenceFilter] = [
        compiled("two-stage", scene, by_epochs=True),
        TwoStage(model, bias_prior(scene), ACCELERATION, by_epochs=True),
    ]
    for _, observation in played(scene, epochs, 4, walk_s=4.0):
        found, expected = (one.aircraft(observation.aircraft) for one in epochs)
        assert_equal_estimates(found, expected, sigmas=1e-8, variance=1e-9)
        found, expected = (one.biases() for one in epochs)
        assert_equal_estimates(found, expected, sigmas=1e-8, variance=1e-9)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("drift", [0.0, 5.0])
def test_covariances_stay_symmetric_and_positive_definite(
    name: str, form: Form, drift: float
) -> None:
    scene = in_form(lively_scene(5, drift), form, 5)
    one = compiled(name, scene, by_epochs=True, form=form)
    for _, observation in played(scene, [one], 5, walk_s=4.0):
        require_covariance(one.aircraft(observation.aircraft)[1], f"{name}, aircraft")
        require_covariance(one.biases()[1], f"{name}, biases")
        assert np.isfinite(np.delete(one.readout, READOUT_RATE)).all()


@pytest.mark.parametrize("name", NAMES)
def test_readout_includes_the_biases(name: str) -> None:
    scene = lively_scene(6)
    one = compiled(name, scene, by_epochs=True)
    for row, observation in played(scene, [one], 6):
        mean, covariance = one.aircraft(observation.aircraft)
        np.testing.assert_allclose(one.readout[:4], mean, rtol=1e-12)
        upper = covariance[[0, 0, 1], [0, 1, 1]]
        np.testing.assert_allclose(one.readout[4:7], upper, rtol=1e-9)
        np.testing.assert_allclose(one.readout[7], np.trace(covariance[2:, 2:]), rtol=1e-9)
        assert one.readout[8] == scene.batch.height_m[row]
        if row % 20 == 0:
            one.publish()


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_reported_positions_need_no_biases(name: str) -> None:
    """ADS-B and radar, as in the plain form. Only the exact filters estimate biases with it."""
    scene = lively_scene(7)
    assert scene.sensors.ids[3] == "adsb"
    rng = np.random.default_rng(7)
    filters = [compiled(name, scene), plain(name, scene)]
    sigmas, variance = (0.0025, 0.001) if name == "ci" else (1e-8, 1e-9)
    for row, observation in played(scene, [*filters], 7):
        place = scene.truth[row, :2] + 30.0 * rng.normal(size=2)
        report = replace(observation, radar=3, value=place, is_position=True)
        before = filters[0].biases()[0].copy()
        for one in filters:
            one.observe(report)
        found, expected = (one.aircraft(observation.aircraft) for one in filters)
        assert_equal_estimates(found, expected, sigmas=sigmas, variance=variance)
        if name not in ("two-stage", "joint", "imm"):
            np.testing.assert_array_equal(filters[0].biases()[0], before)


@cache
def short_scene(seed: int) -> Scene:
    """A minute of four aircraft; the biases are drawn from their priors."""
    rng = np.random.default_rng(2000 + seed)
    flights = random_flights(rng, 4, 60.0, acceleration_density=ACCELERATION)
    drawn = rng.normal(size=(3, 2)) * [500.0, np.radians(0.5)]
    radars = [
        replace(one, biases=dict(enumerate(biases_of_one.tolist())))
        for one, biases_of_one in zip(three_radars(), drawn, strict=True)
    ]
    return make_scene(rng, radars, flights)


def normalised_errors(name: str, runs: int) -> tuple[list[float], list[float]]:
    """NEES of one aircraft and of the biases at the end of each of many short runs."""
    aircraft, biases = [], []
    for seed in range(runs):
        scene = short_scene(seed)
        one = compiled(name, scene)
        guesses = start_guesses(np.random.default_rng(3000 + seed), scene)
        for row, observation in play(scene, [one], guesses):
            last, chosen = row, observation.aircraft
        mean, covariance = one.aircraft(chosen)
        aircraft.append(float(normalised_squared(mean - scene.truth[last], covariance)))
        mean, covariance = one.biases()
        biases.append(float(normalised_squared(mean - scene.biases_at(0.0), covariance)))
    return aircraft, biases


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two-stage", "joint"])
def test_the_exact_filters_are_consistent(name: str) -> None:
    """NEES over 30 seeded runs within its band of 99.9 % in all, for aircraft and biases."""
    for values, size in zip(normalised_errors(name, 30), (4, 6), strict=True):
        low, high = chi2.ppf(tails(2), size * len(values)) / len(values)
        assert low < np.mean(values) < high


@pytest.mark.slow
def test_covariance_intersection_is_conservative() -> None:
    """Its bounds are conservative: the NEES is below that of a consistent filter."""
    for values, size in zip(normalised_errors("ci", 12), (4, 6), strict=True):
        assert np.mean(values) < chi2.ppf(tails(2)[1], size * len(values)) / len(values)


def gated(name: str, scene: Scene) -> CompiledFilter:
    settings = replace(
        plain_settings(name, ACCELERATION), downweight_nis=9.0, refuse_nis=50.0, cone_ratio=1.0
    )
    return CompiledFilter(scene, settings)


def settled(name: str, seed: int) -> tuple[CompiledFilter, Scene, int, Observation]:
    """A filter after a whole scenario, with its last row and observation."""
    rng = np.random.default_rng(seed)
    scene = make_scene(rng, three_radars(), random_flights(rng, 3, 60.0, acceleration_density=0.1))
    one = gated(name, scene)
    guesses = start_guesses(rng, scene)
    for aircraft, (time_s, guess) in guesses.items():
        one.start(aircraft, time_s, guess, np.diag(START_SIGMA**2))
    for row, observation in play(scene, [], guesses):
        one.process(observation)
        last = row, observation
    return one, scene, *last


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("bad", "outcome"),
    [
        (np.array([20_000.0, 0.0]), Outcome.REFUSED),
        (np.array([0.0, 0.4]), Outcome.REFUSED),
        (np.array([np.nan, 0.0]), Outcome.SINGULAR),
        (np.array([np.inf, 0.0]), Outcome.SINGULAR),
    ],
)
def test_an_absurd_plot_changes_only_the_time(name: str, bad: np.ndarray, outcome: Outcome) -> None:
    """It is rejected, and everything after is unchanged."""
    one, _, _, observation = settled(name, 8)
    aircraft = observation.aircraft
    before, biases = one.aircraft(aircraft), one.biases()
    wrong = replace(observation, value=observation.value + bad)
    with np.errstate(invalid="ignore"):  # inf − inf in the plain form.
        assert one.process(wrong) == outcome
    after = one.aircraft(aircraft)
    np.testing.assert_array_equal(after[0], before[0])
    np.testing.assert_array_equal(after[1], before[1])
    np.testing.assert_array_equal(one.biases()[0], biases[0])
    np.testing.assert_array_equal(one.biases()[1], biases[1])
    assert one.process(observation) == Outcome.UPDATED


@pytest.mark.parametrize("name", NAMES)
def test_a_plot_in_the_cone_of_silence_is_rejected(name: str) -> None:
    one, _, _, observation = settled(name, 9)
    # Twice as high as it is far away: 63 degrees of elevation and more.
    high = replace(observation, height_m=float(observation.value[0]) * 2.0)
    biases = one.biases()[0].copy()
    assert one.process(high) == Outcome.CONE_OF_SILENCE
    np.testing.assert_array_equal(one.biases()[0], biases)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("ground_m", "outcome"), [(3900.0, Outcome.CONE_OF_SILENCE), (4100.0, Outcome.UPDATED)]
)
def test_the_cone_of_silence_has_its_apex_at_the_site(
    name: str, ground_m: float, outcome: Outcome
) -> None:
    """Of 45 degrees, 4 km above the radar."""
    radars = [replace(one, height_m=1000.0) for one in three_radars()]
    rng = np.random.default_rng(15)
    scene = make_scene(rng, radars, random_flights(rng, 1, 10.0))
    one = gated(name, scene)
    place = np.array([*flat_sites(scene.plane, scene.sensors)[0], 0.0, 0.0])
    place[0] += ground_m
    one.start(0, 0.0, place, np.diag(START_SIGMA**2))
    plot = Observation(1.0, 0, 0, np.zeros(2), height_m=5000.0)
    expected = -measured(scene, "ellipsoid").linearise(plot, place).innovation
    assert one.process(replace(plot, value=expected)) == outcome


@pytest.mark.parametrize("name", NAMES)
def test_a_track_restarts_at_the_plots_after_rejections(name: str) -> None:
    one, scene, _, observation = settled(name, 10)
    away = replace(observation, value=observation.value + np.array([30_000.0, 0.0]))
    outcomes = [one.process(away) for _ in range(5)]
    assert outcomes[:4] == [Outcome.REFUSED] * 3 + [Outcome.RESTARTED]
    model = EllipsoidPolar(scene.plane, scene.sensors)
    seen = model.linearise(away, one.aircraft(observation.aircraft)[0])
    left = seen.innovation - seen.by_bias @ one.biases()[0]
    assert abs(left[0]) < 200.0
    assert abs(left[1]) * away.value[0] < 500.0


@pytest.mark.parametrize("name", NAMES)
def test_initiation_equals_an_uninformative_prior(name: str) -> None:
    """A first plot, then a few: as with a prior of 1 000 km around its position."""
    scene = lively_scene(11)
    one = compiled(name, scene)
    first = next(iter(played(scene, [], 11)))[1]
    assert one.process(first) == Outcome.STARTED
    mean, covariance = one.aircraft(first.aircraft)
    require_covariance(covariance, "start")
    other = plain(name, scene)
    vague = np.diag([1e12, 1e12, 300.0**2, 300.0**2])
    other.start(first.aircraft, first.time_s, mean, vague)
    other.observe(first)
    expected = other.aircraft(first.aircraft)
    sigmas = np.sqrt(np.diagonal(covariance))
    np.testing.assert_allclose(mean / sigmas, expected[0] / sigmas, rtol=0, atol=1e-3)
    if name != "ci":  # CI treats bias and noise as independent, which holds at initiation.
        outer = np.outer(sigmas, sigmas)
        np.testing.assert_allclose(covariance / outer, expected[1] / outer, rtol=0, atol=1e-3)
    # One plot does not inform about the biases.
    np.testing.assert_allclose(one.biases()[1], np.diag(scene.sensors.prior_sigma**2), rtol=1e-9)
