"""Interacting modes: each part, and the accuracy for manoeuvring aircraft."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from multiradar.errors import ConfigurationError
from multiradar.estimation.filters._kernels import ALL_BLOCKS
from multiradar.estimation.filters.imm._mode_column_kernels import move_columns
from multiradar.estimation.filters.imm._mode_scratch_kernels import (
    SCRATCH_ROWS,
    SHARES,
    prepare_scratch,
)
from multiradar.estimation.gaussian import normalised_squared, require_covariance
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking import model as model_module
from multiradar.tracking.modes import GRAVITY_MPS2, mode_table
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from multiradar_compiled.lane_kernels import LANES
from support.kernels import plain
from support.references import reference_runs
from support.references._mode_kernels import join, move_alone, pass_and_mix
from support.references.compiled_filters import UPPER, CompiledFilter, plain_settings
from support.references.measurement_models import EllipsoidPolar
from support.references.reference_filters import Observation, TwoStage
from support.references.reference_modes import Imm, Mode, mixture, motion, switching
from support.references.reference_runs import START_SIGMA, bias_prior, play, start_guesses
from support.scenarios.scenes import Scene, make_scene, random_flights, three_radars
from validation.motion import check_manoeuvres

Floats = NDArray[np.float64]
Kernel = Callable[..., None]
FORMS = ["compiled", "plain"]
COLUMNS = 6


def of_form(kernel: Kernel, form: str) -> Kernel:
    return kernel if form == "compiled" else plain(kernel)


def busy_scene(seed: int, drift: float = 0.0, detection: float = 0.7) -> Scene:
    rng = np.random.default_rng(seed)
    radars = [replace(one, detection=detection) for one in three_radars()]
    if drift:
        radars[1] = replace(radars[1], drifts={0: drift})
    return make_scene(
        rng, radars, random_flights(rng, 4, 90.0, acceleration_density=2.0, lives_differ=True)
    )


@pytest.fixture
def close_guesses(monkeypatch: pytest.MonkeyPatch) -> None:
    """Start so close that no plot is linearised again, which the plain forms do not do."""
    monkeypatch.setattr(reference_runs, "START_SIGMA", START_SIGMA / 5.0)


def packed(covariance: np.ndarray) -> np.ndarray:
    return np.asarray(covariance[UPPER])


def unpacked(upper: np.ndarray) -> np.ndarray:
    matrix = np.zeros((4, 4))
    matrix[UPPER] = upper
    return matrix + np.triu(matrix, 1).T


def random_modes(rng: np.random.Generator, count: int) -> list[Mode]:
    roots = rng.normal(size=(count, 4, 4)) * np.array([60.0, 60.0, 5.0, 5.0])[:, None]
    return [
        Mode(
            np.array([4e4, -2e4, 150.0, 90.0])
            + rng.normal(size=4) * np.array([200.0, 200.0, 20.0, 20.0]),
            root @ root.T,
            0.1 * rng.normal(size=(4, COLUMNS)),
        )
        for root in roots
    ]


class Room:
    """The arrays of the kernels of modes, for one aircraft."""

    def __init__(self, modes: list[Mode], table: np.ndarray) -> None:
        self.means = np.array([one.mean for one in modes])
        self.covariances = np.array([packed(one.covariance) for one in modes])
        self.sensitivities = np.array([one.sensitivity for one in modes])
        self.rows = np.zeros((SCRATCH_ROWS, LANES))
        self.table = table
        prepare_scratch(table, self.rows)

    def pass_and_mix(
        self, form: str, interval: float, chances: np.ndarray, bias: np.ndarray
    ) -> np.ndarray:
        passed = np.empty((1, len(chances)))
        of_form(pass_and_mix, form)(
            interval, self.table, bias[None], chances[None].copy(), self.means, self.covariances,
            self.sensitivities, self.rows, passed,
        )  # fmt: skip
        after: np.ndarray = passed[0]
        return after

    def move(self, form: str, interval: float, bias: np.ndarray, more: float = 0.0) -> np.ndarray:
        expected = np.empty((4, len(self.means)))
        of_form(move_alone, form)(
            interval, more, self.means, self.covariances, self.sensitivities, bias[None],
            self.rows, len(self.means), expected,
        )  # fmt: skip
        return expected.T

    def modes(self) -> list[Mode]:
        states = zip(self.means, self.covariances, self.sensitivities, strict=True)
        return [Mode(mean, unpacked(upper), V) for mean, upper, V in states]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("count", [3, 6, 8])
@pytest.mark.parametrize("interval", [1e-9, 0.01, 4.0, 300.0, 86_400.0])
def test_mixing_is_that_of_the_exponential_of_the_rates(
    form: str, count: int, interval: float
) -> None:
    rng = np.random.default_rng(count)
    table = mode_table(TrackingSettings(imm_modes=count))
    modes, chances = random_modes(rng, count), rng.dirichlet(np.ones(count))
    bias = rng.normal(size=COLUMNS)
    room = Room(modes, table)
    passed = room.pass_and_mix(form, interval, chances, bias)
    joint = chances[:, None] * switching(table, interval)
    np.testing.assert_allclose(passed, joint.sum(axis=0), rtol=1e-9, atol=1e-15)
    for j, found in enumerate(room.modes()):
        expected = mixture(modes, joint[:, j] / joint[:, j].sum(), bias)
        np.testing.assert_allclose(found.mean, expected.mean, rtol=1e-9)
        np.testing.assert_allclose(found.covariance, expected.covariance, rtol=1e-8, atol=1e-6)
        np.testing.assert_allclose(found.sensitivity, expected.sensitivity, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_mixing_keeps_the_mean_at_any_bias_and_the_covariance_at_the_published(form: str) -> None:
    rng = np.random.default_rng(3)
    table = mode_table(TrackingSettings())
    modes, chances = random_modes(rng, len(table)), rng.dirichlet(np.ones(len(table)))
    bias = rng.normal(size=COLUMNS)
    room = Room(modes, table)
    passed = room.pass_and_mix(form, 4.0, chances, bias)
    before, after = mixture(modes, chances, bias), mixture(room.modes(), passed, bias)
    for other in (bias, np.zeros(COLUMNS), 100.0 * rng.normal(size=COLUMNS)):
        np.testing.assert_allclose(after.at(other), before.at(other), rtol=1e-12)
    np.testing.assert_allclose(after.covariance, before.covariance, rtol=1e-9, atol=1e-6)
    require_covariance(after.covariance, "after mixing")


@pytest.mark.parametrize("form", FORMS)
def test_combination_has_the_moments_of_the_modes(form: str) -> None:
    rng = np.random.default_rng(4)
    modes, chances = random_modes(rng, 6), rng.dirichlet(np.ones(6))
    bias = rng.normal(size=COLUMNS)
    room = Room(modes, mode_table(TrackingSettings(imm_modes=6)))
    mean, covariance, sensitivity = np.empty((1, 4)), np.empty((1, 10)), np.empty((1, 4, COLUMNS))
    of_form(join, form)(
        bias[None], chances[None], room.means, room.covariances, room.sensitivities, room.rows,
        mean, covariance, sensitivity,
    )  # fmt: skip
    expected = mixture(modes, chances, bias)
    np.testing.assert_allclose(mean[0], expected.mean, rtol=1e-12)
    np.testing.assert_allclose(unpacked(covariance[0]), expected.covariance, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(sensitivity[0], expected.sensitivity, rtol=1e-12)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("bank_deg", [-25.0, 12.0, 25.0])
@pytest.mark.parametrize("interval", [1e-7, 3.0, 60.0])
def test_a_coordinated_turn_is_an_exact_circle(form: str, bank_deg: float, interval: float) -> None:
    """To a millimetre: position and velocity on the circle, right turns clockwise."""
    speed, course = 180.0, 0.7
    lateral = GRAVITY_MPS2 * np.tan(np.radians(bank_deg))
    start = np.array([1e4, 2e4, speed * np.sin(course), speed * np.cos(course)])
    table = np.array([[lateral, 0.0, 0.0, 1.0, 1.0, 0.0]])
    room = Room([Mode(start, 1e-12 * np.eye(4), np.zeros((4, COLUMNS)))], table)
    room.move(form, interval, np.zeros(COLUMNS))
    radius, later = speed**2 / lateral, course + lateral / speed * interval
    centre = start[:2] + radius * np.array([np.cos(course), -np.sin(course)])
    place = centre - radius * np.array([np.cos(later), -np.sin(later)])
    velocity = speed * np.array([np.sin(later), np.cos(later)])
    np.testing.assert_allclose(room.means[0], [*place, *velocity], rtol=0, atol=1e-3)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("number", [0, 1, 2])
@pytest.mark.parametrize("state", ["under way", "at rest"])
def test_a_mode_predicts_moments_and_sensitivity(form: str, number: int, state: str) -> None:
    rng = np.random.default_rng(number)
    one, bias = random_modes(rng, 1)[0], rng.normal(size=COLUMNS)
    if state == "at rest":
        one.mean[2:], one.sensitivity[2:] = 0.0, 0.0
    table = mode_table(TrackingSettings(imm_modes=3))[number : number + 1]
    room = Room([one], table)
    expected = room.move(form, 3.7, bias)
    step, noise = motion(table[0], one, bias, 3.7)
    np.testing.assert_allclose(room.means[0], step @ one.mean, rtol=1e-10)
    np.testing.assert_allclose(
        unpacked(room.covariances[0]), step @ one.covariance @ step.T + noise, rtol=1e-9, atol=1e-6
    )
    np.testing.assert_allclose(expected[0], step @ one.at(bias), rtol=1e-10)
    # All probability remains in the only mode.
    room.rows[SHARES : SHARES + 3] = [[1.0], [0.0], [0.0]]
    of_form(move_columns, form)(0, 1, np.ones((1, 1)), room.rows, room.sensitivities, ALL_BLOCKS)
    np.testing.assert_allclose(room.sensitivities[0], step @ one.sensitivity, atol=1e-9)


def test_transitions_over_a_gap_equal_those_over_its_parts() -> None:
    """Transitions over two intervals equal the transition over both."""
    table = mode_table(TrackingSettings())
    parts = switching(table, 2.0) @ switching(table, 3.5)
    np.testing.assert_allclose(parts, switching(table, 5.5), atol=1e-12)
    turns = table[1:7, 0]
    np.testing.assert_allclose(turns[::2], -turns[1::2])
    assert np.degrees(np.arctan(turns.max() / GRAVITY_MPS2)) == pytest.approx(25.0)
    assert (np.diff(turns[::2]) > 0.0).all()


@pytest.mark.parametrize(("count", "turns"), [(3, 2), (5, 4), (6, 4), (8, 6)])
def test_changes_of_speed_are_their_share_of_the_manoeuvres(count: int, turns: int) -> None:
    settings = TrackingSettings(imm_modes=count, imm_straight_s=50.0, imm_speeding_share=0.3)
    entered = switching(mode_table(settings), 1e-6)[0, 1:] / 1e-6
    speeding = 0.3 if count % 2 == 0 else 0.0
    np.testing.assert_allclose(entered[:turns], (1.0 - speeding) / turns / 50.0, rtol=1e-4)
    np.testing.assert_allclose(entered[turns:], speeding / 50.0, rtol=1e-4)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("count", [3, 5, 6, 8])
def test_unmodelled_noise_is_added_to_changes_of_speed_or_to_all_modes(
    form: str, count: int
) -> None:
    rng = np.random.default_rng(count)
    modes, table = random_modes(rng, count), mode_table(TrackingSettings(imm_modes=count))
    widened = []
    for more in (0.0, 50.0):
        room = Room(modes, table)
        room.move(form, 2.0, np.zeros(COLUMNS), more)
        widened.append(room.covariances)
    expected = np.zeros((count, 10))
    for row in range(count) if count % 2 else [count - 1]:
        expected[row, [0, 4]], expected[row, [2, 6]] = 50.0 * 8.0 / 3.0, 50.0 * 2.0
        expected[row, [7, 9]] = 50.0 * 2.0
    np.testing.assert_allclose(widened[1] - widened[0], expected, rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize("count", [2, 9, -1])
def test_a_number_of_modes_out_of_range_is_rejected(count: int) -> None:
    with pytest.raises(ConfigurationError, match=f"imm_modes: expected 3 to 8, was {count}"):
        mode_table(TrackingSettings(imm_modes=count))


@pytest.mark.slow
# With few detections intervals are divided.
@pytest.mark.usefixtures("close_guesses")
@pytest.mark.parametrize(("count", "detection"), [(3, 0.7), (5, 0.7), (8, 0.7), (8, 0.1)])
def test_probabilities_equal_the_plain_form_with_drifting_biases(
    count: int, detection: float
) -> None:
    scene = busy_scene(5, drift=2.0, detection=detection)
    settings = replace(plain_settings("imm", 1.0), imm_modes=count)
    one = CompiledFilter(scene, settings)
    other = Imm(EllipsoidPolar(scene.plane, scene.sensors), bias_prior(scene), mode_table(settings))
    guesses = start_guesses(np.random.default_rng(5), scene)
    for _, observation in play(scene, [one, other], guesses, walk_s=4.0):
        chances = one.arrays.mode_probability[observation.aircraft]
        np.testing.assert_allclose(chances, other.probabilities(observation.aircraft), atol=1e-8)
        assert chances.sum() == pytest.approx(1.0, abs=1e-12)
        for found, expected in zip(
            (one.aircraft(observation.aircraft), one.biases()),
            (other.aircraft(observation.aircraft), other.biases()),
            strict=True,
        ):
            sigma = np.sqrt(np.diagonal(expected[1]))
            np.testing.assert_allclose(found[0] / sigma, expected[0] / sigma, rtol=0, atol=1e-7)
            outer = np.outer(sigma, sigma)
            np.testing.assert_allclose(found[1] / outer, expected[1] / outer, rtol=0, atol=1e-8)


@pytest.mark.usefixtures("close_guesses")
@pytest.mark.parametrize("by_epochs", [False, True])
def test_identical_modes_equal_the_two_stage_filter(
    monkeypatch: pytest.MonkeyPatch, by_epochs: bool
) -> None:
    density = 0.7
    alike = np.tile([0.0, density, density, 0.01, 1.0, 0.25], (5, 1))
    alike[0, 5] = 0.0
    monkeypatch.setattr(model_module, "mode_table", lambda _settings: alike)
    scene = busy_scene(6, drift=1.0)
    one = CompiledFilter(scene, plain_settings("imm", density), by_epochs=by_epochs)
    other = TwoStage(
        EllipsoidPolar(scene.plane, scene.sensors), bias_prior(scene), density, by_epochs=by_epochs
    )
    guesses = start_guesses(np.random.default_rng(6), scene)
    for _, observation in play(scene, [one, other], guesses, walk_s=4.0):
        for found, expected in zip(
            (one.aircraft(observation.aircraft), one.biases()),
            (other.aircraft(observation.aircraft), other.biases()),
            strict=True,
        ):
            sigma = np.sqrt(np.diagonal(expected[1]))
            np.testing.assert_allclose(found[0] / sigma, expected[0] / sigma, rtol=0, atol=1e-8)
            outer = np.outer(sigma, sigma)
            np.testing.assert_allclose(found[1] / outer, expected[1] / outer, rtol=0, atol=1e-9)


def flown_by_the_modes(seed: int, table: np.ndarray, runs_s: float) -> tuple[float, float, float]:
    """NEES of an aircraft and of the biases, and the probability of the true mode."""
    rng = np.random.default_rng([7, seed])
    scene = make_scene(rng, three_radars(), random_flights(rng, 1, 10.0))
    model = EllipsoidPolar(scene.plane, scene.sensors)
    one = CompiledFilter(scene, plain_settings("imm", 1.0))
    biases = rng.normal(size=COLUMNS) * scene.sensors.prior_sigma
    state, mode = np.array([3e4, 4e4, 120.0, -150.0]), 0
    one.start(0, 0.0, state + START_SIGMA * rng.normal(size=4), np.diag(START_SIGMA**2))
    nothing, known = np.zeros((4, COLUMNS)), np.zeros((4, 4))
    intervals = rng.uniform(0.5, 2.5, int(runs_s / 1.5))
    for interval, time in zip(intervals, np.cumsum(intervals), strict=True):
        mode = rng.choice(len(table), p=switching(table, interval)[mode])
        step, noise = motion(table[mode], Mode(state, known, nothing), np.zeros(COLUMNS), interval)
        state = step @ state + rng.multivariate_normal(np.zeros(4), noise, method="svd")
        blank = Observation(time, 0, int(rng.integers(3)), np.zeros(2), 9e3)
        seen = model.linearise(blank, state)
        value = seen.by_bias @ biases - seen.innovation
        value = value + np.sqrt(np.diagonal(seen.noise)) * rng.normal(size=2)
        one.observe(replace(blank, value=value))
    mean, covariance = one.aircraft(0)
    estimate, spread = one.biases()
    scale = scene.sensors.prior_sigma
    return (
        float(normalised_squared(mean - state, covariance)),
        float(normalised_squared((estimate - biases) / scale, spread / np.outer(scale, scale))),
        float(one.arrays.mode_probability[0, mode]),
    )


@pytest.mark.slow
def test_it_is_consistent_for_motion_as_modelled() -> None:
    """NEES over 12 runs within its band; the true mode is the most likely one."""
    table = mode_table(plain_settings("imm", 1.0))
    found = np.array([flown_by_the_modes(seed, table, 120.0) for seed in range(12)])
    for values, size in ((found[:, 0], 4), (found[:, 1], COLUMNS)):
        low, high = chi2.ppf([0.005, 0.995], size * len(values)) / len(values)
        assert low < np.mean(values) < high
    assert np.mean(found[:, 2]) > 2.0 / len(table)


@pytest.mark.slow
@pytest.mark.parametrize("known", [True, False])
def test_turns_and_straights_gain_over_the_best_single_motion_model(known: bool) -> None:
    """With known and with estimated biases; the margins are those of one short scenario."""
    flown = check_manoeuvres.flights(1, aircraft=16, duration_s=700.0, known=known)
    best, modes = (
        check_manoeuvres.figures(settings, flown)
        for settings in (
            check_manoeuvres.best_constant(flown, densities=(3.0, 10.0, 30.0)),
            TrackingSettings(filter_name="imm"),
        )
    )
    assert modes["turns"].rms_m < 0.7 * best["turns"].rms_m
    assert modes["straights"].rms_m < 0.8 * best["straights"].rms_m
    assert 0.6 < modes["all"].nees < 1.3


@pytest.mark.parametrize("name", ["imm", "two-stage"])
def test_updates_report_the_direction_of_a_turn(name: str) -> None:
    """Half a minute into a turn its direction is known; without modes it is not reported."""
    (flown,) = check_manoeuvres.flights(1, aircraft=8, duration_s=500.0, known=True)
    engine = Engine(flown.sensors, TrackingSettings(filter_name=name))
    updates = TrackUpdates.concatenate([engine.push(flown.batch).updates, engine.flush().updates])
    right, left = updates.turn_right_probability, updates.turn_left_probability
    speeding = updates.speed_change_probability
    if name == "two-stage":
        assert np.isnan([right, left, speeding]).all()
        return
    first = np.unique(updates.track_id, return_index=True)[1]
    assert set(np.flatnonzero(np.isnan(right))) == set(first)
    assert np.nanmax(right + left + speeding) <= 1.0 + 1e-12
    turned = 0
    for track in np.unique(updates.track_number):
        own = np.flatnonzero(updates.track_number == track)
        truth = np.flatnonzero(flown.rows.aircraft == track - 1)
        rate = np.gradient(
            np.unwrap(flown.rows.true_heading_rad[truth]), flown.rows.time_s[truth] + 1e-6 * truth
        )
        rates = np.interp(updates.time_s[own], flown.rows.time_s[truth], rate)
        before = np.interp(updates.time_s[own] - 25.0, flown.rows.time_s[truth], rate)
        settled = (np.abs(rates) > 0.012) & (np.abs(before) > 0.012) & (rates * before > 0.0)
        turned += settled.sum()
        wrong = np.where(rates > 0.0, left[own], right[own])[settled]
        assert wrong.size == 0 or np.mean(wrong) < 0.1
    assert turned > 30
