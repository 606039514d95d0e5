"""Time offsets: their derivative depends on the estimated velocity."""

from functools import lru_cache

import numpy as np
import pytest
from scipy.stats import chi2

from multiradar.errors import ConfigurationError
from multiradar.estimation.bias.store import BiasState
from multiradar.estimation.filters.arrays import Aircraft, aircraft_arrays
from multiradar.estimation.filters.bank import FILTERS
from multiradar.estimation.filters.two_stage._time_offset_kernels import (
    SPEED_MIN,
    initialise_with_velocity,
    relinearise_aircraft,
    relinearise_time_offsets,
)
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
)
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.settings import TrackingSettings
from support.references.compiled_filters import CompiledFilter, plain_settings
from support.references.measurement_models import EllipsoidPolar
from support.references.reference_runs import bias_prior, play, start_guesses
from support.references.reference_time_offsets import TimedTwoStage
from support.scenarios.scenes import Radar, Scene, make_scene, random_flights

SCENES = 6
PRIOR_SIGMA_S = 0.5
TIMED = ("two-stage", "imm")
PARAMETERS = np.array([0, 1, 3, 0, 1, 3])


# Each filter sees the same scenes, one after the other.
@lru_cache(maxsize=SCENES)
def scene(seed: int, *, density: float, anchored: bool) -> Scene:
    """Three radars with biases drawn from nearly their priors; B has an exact clock if anchored."""
    rng = np.random.default_rng(seed)
    radars = []
    for name, latitude, longitude, period in (
        ("A", 55.9, 60.2, 4.9),
        ("B", 57.4, 61.9, 4.0),
        ("C", 55.6, 63.3, 6.0),
    ):
        biases = {
            PARAMETER_RANGE_OFFSET: 300.0 * rng.normal(),
            PARAMETER_AZIMUTH_OFFSET: float(np.radians(0.3 * rng.normal())),
        }
        if not (anchored and name == "B"):
            biases[PARAMETER_TIME_OFFSET] = PRIOR_SIGMA_S * rng.normal()
        radars.append(Radar(name, latitude, longitude, rotation_s=period, biases=biases))
    flights = random_flights(rng, 20, 600.0, acceleration_density=density, lives_differ=True)
    return make_scene(rng, radars, flights)


def estimated(made: Scene, density: float, name: str = "two-stage") -> BiasState:
    settings = TrackingSettings(filter_name=name, acceleration_density=density)
    engine = Engine(made.sensors, settings)
    engine.push(made.batch)
    engine.flush()
    return engine.biases


def squared_errors(name: str, density: float, *, anchored: bool) -> tuple[float, int]:
    """NEES of all biases, summed over scenarios, and the number of biases."""
    total, count = 0.0, 0
    for seed in range(SCENES):
        made = scene(seed, density=density, anchored=anchored)
        state = estimated(made, density, name)
        error = state.estimate - made.bias_values[-1]
        total += float(error @ np.linalg.solve(state.covariance, error))
        count += len(error)
    return total, count


@pytest.mark.slow
@pytest.mark.parametrize("name", TIMED)
@pytest.mark.parametrize("density", [0.1, 4.0])
def test_a_common_delay_remains_unobservable(name: str, density: float) -> None:
    """A filter that linearises at its latest velocity is overconfident by a factor of ten."""
    for seed in range(2):
        made = scene(seed, density=density, anchored=False)
        state = estimated(made, density, name)
        late = np.flatnonzero(made.sensors.parameter_kind == PARAMETER_TIME_OFFSET)
        common = np.full(3, 1.0 / 3.0)
        block = state.covariance[np.ix_(late, late)]
        # Sigma of the mean of three independent priors, and 1 % for the relinearisation.
        assert np.sqrt(common @ block @ common) == pytest.approx(
            PRIOR_SIGMA_S / np.sqrt(3.0), rel=0.01
        )
        difference = np.array([1.0, -1.0, 0.0])
        assert np.sqrt(difference @ block @ difference) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("name", TIMED)
@pytest.mark.parametrize("density", [0.1, 4.0])
@pytest.mark.parametrize("anchored", [False, True])
def test_bias_estimates_are_consistent(name: str, density: float, anchored: bool) -> None:
    total, count = squared_errors(name, density, anchored=anchored)
    low, high = chi2.ppf([0.005, 0.995], count)
    assert low < total < high, total / count


@pytest.mark.parametrize("name", TIMED)
def test_one_exact_clock_makes_the_other_delays_observable(name: str) -> None:
    made = scene(1, density=0.1, anchored=True)
    state = estimated(made, 0.1, name)
    own = made.sensors.parameter_kind == PARAMETER_TIME_OFFSET
    assert state.sigma[own].max() < 0.03
    error = state.estimate - made.bias_values[-1]
    assert np.abs(error[own] / state.sigma[own]).max() < 4.0
    assert np.abs(made.bias_values[-1][own]).max() > 10.0 * state.sigma[own].max()


@pytest.mark.parametrize("name", [name for name in FILTERS if name not in TIMED])
def test_other_filters_reject_a_time_offset(name: str) -> None:
    made = scene(0, density=0.1, anchored=True)
    with pytest.raises(ConfigurationError, match=f"filter: expected two-stage, imm .* was {name}"):
        Engine(made.sensors, TrackingSettings(filter_name=name))


@pytest.mark.slow
def test_compiled_time_offsets_equal_their_plain_form() -> None:
    made = scene(3, density=0.5, anchored=False)
    found = CompiledFilter(made, plain_settings("two-stage", 0.5), slots=20)
    model = EllipsoidPolar(made.plane, made.sensors)
    expected = TimedTwoStage(model, made.sensors, bias_prior(made), 0.5)
    guesses = start_guesses(np.random.default_rng(3), made)
    for row, observation in play(made, [found, expected], guesses):
        if row % 50:
            continue
        for one, other in (
            (found.aircraft(observation.aircraft), expected.aircraft(observation.aircraft)),
            (found.biases(), expected.biases()),
        ):
            sigma = np.sqrt(np.diagonal(other[1]))
            np.testing.assert_allclose(one[0] / sigma, other[0] / sigma, rtol=0, atol=1e-4)
            outer = np.outer(sigma, sigma)
            np.testing.assert_allclose(one[1] / outer, other[1] / outer, rtol=0, atol=1e-5)
        if row > 1500:
            break
    assert np.sqrt(np.diagonal(found.biases()[1])[2]) < PRIOR_SIGMA_S


def test_relinearisation_preserves_states_and_the_sum_of_offsets() -> None:
    rng = np.random.default_rng(4)
    old, new, bias = np.array([150.0, -80.0]), np.array([160.0, -20.0]), rng.normal(size=6)
    means = rng.normal(size=(1, 4)) * 1e4
    sensitivity = rng.normal(size=(1, 4, 6))
    sensitivity[0, :2, 5] = old - sensitivity[0, :2, 2]
    before = means[0] + sensitivity[0] @ bias
    relinearise_time_offsets(means, sensitivity, 0, old, False, PARAMETERS, bias, *new)
    np.testing.assert_allclose(sensitivity[0, :2, 2] + sensitivity[0, :2, 5], new, rtol=1e-12)
    np.testing.assert_allclose(means[0] + sensitivity[0] @ bias, before, rtol=1e-12)


def aircraft_at(velocity: tuple[float, float]) -> Aircraft:
    """One aircraft of two modes whose time offsets are linearised at a velocity."""
    rng = np.random.default_rng(8)
    made = aircraft_arrays(1, 6, modes=2)
    made.velocity[0] = velocity
    for states in (made.mean, made.mode_mean, made.sensitivity, made.mode_sensitivity):
        states[...] = rng.normal(size=states.shape)
    return made


def test_modes_are_relinearised_with_their_aircraft() -> None:
    made, bias = aircraft_at((150.0, -80.0)), np.arange(6.0)
    made.mode_sensitivity[:, :2, 5] = made.velocity[0] - made.mode_sensitivity[:, :2, 2]
    before = made.mode_mean + made.mode_sensitivity @ bias
    relinearise_aircraft(0, made, PARAMETERS, bias, 160.0, -20.0)
    offsets = made.mode_sensitivity[:, :2, 2] + made.mode_sensitivity[:, :2, 5]
    np.testing.assert_allclose(offsets, [[160.0, -20.0]] * 2, rtol=1e-12)
    np.testing.assert_allclose(made.mode_mean + made.mode_sensitivity @ bias, before, rtol=1e-12)
    assert made.velocity[0].tolist() == [160.0, -20.0]


def test_weights_of_a_slow_aircraft_are_limited() -> None:
    """Errors of sensitivities of a taxiing aircraft must not grow with its speed at take-off."""
    made, bias = aircraft_at((2.0, 0.0)), np.ones(6)
    made.sensitivity[0, :2, 2] = 5.0, 1.0
    made.sensitivity[0, :2, 5] = -3.0, -1.0
    before = made.mean[0] + made.sensitivity[0] @ bias
    relinearise_aircraft(0, made, PARAMETERS, bias, 30.0, 40.0)
    assert made.velocity[0].tolist() == [30.0, 40.0]
    np.testing.assert_allclose(made.sensitivity[0, :2, [2, 5]], [[30.0, 40.0], [0.0, 0.0]])
    np.testing.assert_allclose(made.mean[0] + made.sensitivity[0] @ bias, before, rtol=1e-12)


def test_a_standing_aircraft_keeps_its_linearisation_velocity() -> None:
    made, expected = aircraft_at((0.5 * SPEED_MIN, 0.0)), aircraft_at((0.5 * SPEED_MIN, 0.0))
    relinearise_aircraft(0, made, PARAMETERS, np.ones(6), 0.01, -0.02)
    np.testing.assert_array_equal(made.velocity, expected.velocity)
    np.testing.assert_array_equal(made.sensitivity, expected.sensitivity)


def test_a_plot_that_is_late_lies_behind_the_aircraft() -> None:
    """∂χ/∂τ = v: the later the stamp, the farther ahead the aircraft is."""
    sensitivity, velocities = np.zeros((1, 4, 6)), np.full((1, 2), np.nan)
    means, covariances = np.zeros((1, 4)), np.zeros((1, 10))
    initialise_with_velocity(
        means, covariances, sensitivity, velocities, 0, 3, 6, PARAMETERS, 120.0, 50.0, 25.0
    )
    assert sensitivity[0, :2, 5].tolist() == [120.0, 50.0]
    assert not sensitivity[0, :, :5].any()
    assert means[0].tolist() == [0.0, 0.0, 120.0, 50.0]
    assert covariances[0, [7, 9]].tolist() == [25.0, 25.0]
