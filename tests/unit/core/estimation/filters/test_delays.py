"""Delays of transponders: equal to the joint Kalman filter of all delays, states and biases."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from multiradar.errors import ConfigurationError, PriorError
from multiradar.estimation.bias.store import widened
from multiradar.estimation.filters._kernels import INTERVAL_MAX_S
from multiradar.estimation.filters.arrays import (
    DELAY_BIASES,
    DELAY_MEAN,
    DELAY_SIGMA,
    Aircraft,
    aircraft_arrays,
)
from multiradar.estimation.filters.bank import FILTERS, Outcome, find_filter_for
from multiradar.estimation.filters.two_stage._two_stage_kernels import apply_bias_drift
from multiradar.estimation.measurement.sensors import (
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
)
from multiradar.tracking.association.shared_plots import shared_plots
from multiradar.tracking.modes import mode_table
from multiradar.tracking.settings import BY_PROBABILITY
from support.references.compiled_filters import CompiledFilter, plain_settings
from support.references.measurement_models import EllipsoidPolar
from support.references.reference_delays import (
    DelayedImm,
    DelayedModel,
    DelayedTwoStage,
    with_delays,
)
from support.references.reference_filters import JointKalman, Observation, ReferenceFilter
from support.references.reference_runs import bias_prior, observations, play, start_guesses
from support.references.reference_time_offsets import TimedTwoStage
from support.scenarios.scenes import Scene, make_scene, random_flights, three_radars

ACCELERATION = 0.3
AIRCRAFT = 4
SIGMA_M = 60.0
DELAYS_M = np.array([75.0, -40.0, 10.0, -95.0])
# The third radar is a primary one.
DELAYED = np.array([True, True, False])


def delayed_scene(
    seed: int, *, length_s: float = 80.0, drift: float = 0.0, late_s: float = 0.0
) -> Scene:
    """Ranges of two radars with the delays of the aircraft, a third radar without."""
    rng = np.random.default_rng(seed)
    radars = [replace(one, detection=0.8) for one in three_radars()]
    if drift:
        radars[1] = replace(radars[1], drifts={PARAMETER_RANGE_OFFSET: drift})
    if late_s:
        radars[0] = replace(radars[0], biases={**radars[0].biases, PARAMETER_TIME_OFFSET: late_s})
    flights = random_flights(rng, AIRCRAFT, length_s, acceleration_density=ACCELERATION)
    scene = make_scene(rng, radars, flights)
    sensors = replace(scene.sensors, transponder_delay_sigma_m=np.where(DELAYED, SIGMA_M, np.nan))
    batch = scene.batch
    ranges = batch.range_m + DELAYS_M[scene.aircraft] * DELAYED[batch.sensor]
    return replace(scene, sensors=sensors, batch=replace(batch, range_m=ranges))


def compiled(name: str, scene: Scene) -> CompiledFilter:
    return CompiledFilter(scene, plain_settings(name, ACCELERATION))


def played(
    scene: Scene, filters: list[ReferenceFilter], seed: int, walk_s: float | None = None
) -> Iterator[tuple[int, Observation]]:
    guesses = start_guesses(np.random.default_rng(seed), scene)
    return play(scene, filters, guesses, walk_s=walk_s)


def assert_equal(
    found: tuple[np.ndarray, np.ndarray],
    expected: tuple[np.ndarray, np.ndarray],
    *,
    sigmas: float = 1e-8,
    variance: float = 1e-8,
) -> None:
    """Means in units of their sigmas; variances relative."""
    scale = np.sqrt(np.diagonal(expected[1]))
    np.testing.assert_allclose(found[0] / scale, expected[0] / scale, rtol=0, atol=sigmas)
    outer = np.outer(scale, scale)
    np.testing.assert_allclose(found[1] / outer, expected[1] / outer, rtol=0, atol=variance)


@pytest.mark.parametrize("name", ["two-stage", "imm"])
def test_delays_equal_those_of_the_filter_over_all(name: str) -> None:
    """States, biases and delays after each plot: by the joint filter, by modes for all."""
    scene = delayed_scene(5, length_s=30.0 if name == "imm" else 80.0)
    sensors = scene.sensors
    model = DelayedModel(EllipsoidPolar(scene.plane, sensors), sensors, AIRCRAFT)
    prior = with_delays(bias_prior(scene), SIGMA_M, AIRCRAFT)
    table = mode_table(plain_settings("imm", ACCELERATION))
    over_all: JointKalman | DelayedImm = JointKalman(model, prior, ACCELERATION)
    if name == "imm":
        over_all = DelayedImm(model, prior, table, sensors)
    one, columns = compiled(name, scene), len(sensors.parameter_kind)
    for _, observation in played(scene, [one, over_all], 5):
        aircraft = observation.aircraft
        assert_equal(one.aircraft(aircraft), over_all.aircraft(aircraft))
        mean, covariance = over_all.biases()
        assert_equal(one.biases(), (mean[:columns], covariance[:columns, :columns]))
        for other in range(AIRCRAFT):
            place = columns + other
            expected = mean[[place]], covariance[[place], place][None]
            assert_equal(as_arrays(one.delay(other)), expected)
    # The delays are observed: else equality would be that of two priors.
    found = np.array([one.delay(other) for other in range(AIRCRAFT)])
    assert (np.abs(found[:, 0] - DELAYS_M) < 4.0 * np.sqrt(found[:, 1])).all()
    assert np.sqrt(found[:, 1]).max() < 0.9 * SIGMA_M


def test_delays_with_drifting_biases_equal_a_fifth_component_of_the_state() -> None:
    scene = delayed_scene(6, drift=2.0)
    model = EllipsoidPolar(scene.plane, scene.sensors)
    plain = DelayedTwoStage(model, bias_prior(scene), ACCELERATION, scene.sensors)
    one = compiled("two-stage", scene)
    for _, observation in played(scene, [one, plain], 6, 4.0):
        aircraft = observation.aircraft
        assert_equal(one.aircraft(aircraft), plain.aircraft(aircraft))
        assert_equal(one.biases(), plain.biases())
        assert_equal(as_arrays(one.delay(aircraft)), as_arrays(plain.delay(aircraft)))


def test_delays_with_time_offsets_equal_further_biases() -> None:
    scene = delayed_scene(8, late_s=0.4)
    sensors = scene.sensors
    model = DelayedModel(EllipsoidPolar(scene.plane, sensors), sensors, AIRCRAFT)
    prior = with_delays(bias_prior(scene), SIGMA_M, AIRCRAFT)
    plain = TimedTwoStage(model, sensors, prior, ACCELERATION)
    one, columns = compiled("two-stage", scene), len(sensors.parameter_kind)
    for _, observation in played(scene, [one, plain], 8):
        aircraft = observation.aircraft
        mean, covariance = plain.biases()
        place = columns + aircraft
        # There, offsets are relinearised given the delay, at a velocity of before it is updated.
        for found, expected in (
            (one.aircraft(aircraft), plain.aircraft(aircraft)),
            (one.biases(), (mean[:columns], covariance[:columns, :columns])),
            (as_arrays(one.delay(aircraft)), (mean[[place]], covariance[[place], place][None])),
        ):
            assert_equal(found, expected, sigmas=0.1, variance=0.05)
    assert np.isfinite(one.arrays.velocity[:AIRCRAFT]).all()


def as_arrays(moments: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    return np.array(moments[:1]), np.array([moments[1:]])


def test_a_drift_changes_each_mode_with_its_delay() -> None:
    """The covariance of state and delay grows by that of the drift that it has not seen."""
    rng = np.random.default_rng(3)
    modes, columns = 3, 4
    made = aircraft_arrays(2, columns, modes=modes, delays=True)
    root = rng.normal(size=(4, 4))
    made.mode_covariance[:] = (root @ root.T)[np.triu_indices(4)]
    made.mode_sensitivity[:] = rng.normal(size=made.mode_sensitivity.shape)
    made.mode_mean[:] = rng.normal(size=made.mode_mean.shape)
    made.delay[:] = rng.normal(size=made.delay.shape)
    made.delay[:, DELAY_SIGMA], made.delay[:, -1] = 1.7, 0.0
    half = rng.normal(size=(3, 3))
    covariance, drift = half @ half.T + np.eye(3), np.diag([0.3, 0.0, 2.0])
    kept = covariance @ np.linalg.inv(covariance + drift)
    estimate = rng.normal(size=3)
    before = [joint_of(made, row) for row in range(modes)]
    wide = widened(kept, columns, 1.0), widened(kept @ drift, columns, 0.0)
    apply_bias_drift(np.array([0]), made, np.append(estimate - kept @ estimate, 0.0), *wide)
    for row in range(modes):
        mean, whole, slope = before[row]
        found = joint_of(made, row)
        np.testing.assert_allclose(found[0], mean + slope @ (estimate - kept @ estimate))
        np.testing.assert_allclose(found[1], whole + slope @ kept @ drift @ slope.T)
        np.testing.assert_allclose(found[2], slope @ kept)


def joint_of(made: Aircraft, row: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean, covariance and sensitivity to the biases of a mode of aircraft 0 and its delay."""
    upper = np.zeros((4, 4))
    upper[np.triu_indices(4)] = made.mode_covariance[row]
    slope, delay = made.mode_sensitivity[row], made.delay[0]
    side = np.append(slope[:, -1], delay[DELAY_SIGMA])
    covariance = np.zeros((5, 5))
    covariance[:4, :4] = upper + np.triu(upper, 1).T
    mean = np.append(made.mode_mean[row], delay[DELAY_MEAN])
    return (
        mean, covariance + np.outer(side, side),
        np.vstack([slope[:, :-1], delay[DELAY_BIASES:-1]]),
    )  # fmt: skip


@pytest.mark.parametrize("name", ["two-stage", "imm"])
def test_a_reinitialised_aircraft_keeps_its_delay(name: str) -> None:
    """A state from one plot depends on the delay as the plot does; another aircraft has its own."""
    scene = delayed_scene(7, length_s=60.0)
    one = compiled(name, scene)
    for _, observation in played(scene, [one], 7):
        aircraft = observation.aircraft
    kept, sensors = one.delay(aircraft), scene.sensors
    radar = next(
        plot for plot in observations(scene) if plot.aircraft == aircraft and not plot.radar
    )
    late = replace(radar, time_s=observation.time_s + 2.0 * INTERVAL_MAX_S)
    assert one.process(late) == Outcome.RESTARTED
    assert one.delay(aircraft) == kept
    mean, covariance = one.aircraft(aircraft)
    seen = EllipsoidPolar(scene.plane, sensors).linearise(late, mean)
    offset = seen.innovation - seen.by_bias @ one.biases()[0]
    assert offset[0] == pytest.approx(kept[0], abs=1e-6)
    spread = (seen.by_state @ covariance @ seen.by_state.T)[0, 0]
    others = seen.by_bias[0] @ one.biases()[1] @ seen.by_bias[0] + seen.noise[0, 0]
    shared = one.arrays.delay[aircraft, DELAY_BIASES:-1] @ one.biases()[1] @ seen.by_bias[0]
    assert spread == pytest.approx(others + kept[1] + 2.0 * shared, rel=1e-9)
    one.end(aircraft)
    assert one.process(replace(late, time_s=late.time_s + 1.0)) == Outcome.STARTED
    np.testing.assert_allclose(one.delay(aircraft), (0.0, SIGMA_M**2))


@pytest.mark.parametrize("name", sorted(FILTERS))
def test_filters_without_delays_say_which_have_them(name: str) -> None:
    none = np.empty(0, np.int64)
    if FILTERS[name].estimates_delays:
        assert find_filter_for(name, none, delays=True).name == name
        return
    with pytest.raises(ConfigurationError, match="expected two-stage or imm if transponder"):
        find_filter_for(name, none, delays=True)


def test_hypotheses_and_delays_exclude_each_other() -> None:
    settings = replace(plain_settings("imm", 1.0), association=BY_PROBABILITY)
    with pytest.raises(ConfigurationError, match="choose nearest or identity"):
        shared_plots(settings, FILTERS["imm"], (3, 1, 8), delays=True)


def test_all_radars_have_one_sigma_of_the_delays() -> None:
    sensors = delayed_scene(1, length_s=10.0).sensors
    with pytest.raises(PriorError, match="expected 60, as for the other radars"):
        replace(sensors, transponder_delay_sigma_m=np.array([60.0, 30.0, np.nan]))
