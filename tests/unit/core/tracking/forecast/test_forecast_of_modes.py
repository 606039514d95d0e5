"""Forecasts by motion modes: motion, mixing as in the filter, and consistency."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.estimation.filters.imm._mode_scratch_kernels import LATERAL, LEAVING
from multiradar.estimation.gaussian import normalised_squared
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.paths import Path, fly
from multiradar.simulation.scenario.model import Leg
from multiradar.tracking.forecast.forecast_of_modes import (
    density_of,
    forecast_modes_of,
    forecast_of_modes,
)
from multiradar.tracking.mode_states import ModeStates
from multiradar.tracking.modes import mode_table
from multiradar.tracking.outputs import TrackStates
from multiradar.tracking.settings import TrackingSettings
from support.references.straight_forecast import forecast
from support.scenarios.scenes import Flight, flier, make_scene, three_radars

Floats = NDArray[np.float64]

SETTINGS = TrackingSettings(filter_name="imm")
TABLE = mode_table(SETTINGS)
COUNT = len(TABLE)
#: Modes with a negligible leaving rate.
HELD = TABLE.copy()
HELD[:, LEAVING] = 1e-9
MEAN = np.array([1000.0, -2000.0, 150.0, -80.0])
COVARIANCE = np.array([400.0, 50.0, 20.0, 4.0, 300.0, 5.0, 15.0, 4.0, 0.5, 3.0])
UPPER = np.triu_indices(4)


def _all_alike(probability: Floats) -> tuple[Floats, Floats, Floats]:
    return probability, np.tile(MEAN, (COUNT, 1)), np.tile(COVARIANCE, (COUNT, 1))


def _certain(mode: int) -> tuple[Floats, Floats, Floats]:
    # As in the filter no mode is impossible.
    return _all_alike((np.eye(COUNT)[mode] + 1e-9) / (1.0 + COUNT * 1e-9))


def _full(packed: Floats) -> Floats:
    full = np.zeros((4, 4))
    full[UPPER] = packed
    return full + np.triu(full, 1).T


def test_forecasts_leave_their_modes_once_in_their_usual_duration() -> None:
    modes = forecast_modes_of(SETTINGS)
    np.testing.assert_allclose(modes[:, LEAVING], [1.0 / 90.0, *[1.0 / 60.0] * (COUNT - 1)])


def test_straight_flight_is_a_constant_velocity_with_its_own_noise() -> None:
    ahead = np.array([7.0, 60.0])
    means, covariances = forecast_of_modes(*_certain(0), HELD, ahead)
    expected, spread = forecast(MEAN, _full(COVARIANCE), SETTINGS.imm_straight_density, ahead)
    np.testing.assert_allclose(means, expected, atol=1e-3)  # some 1e-8 of the others
    np.testing.assert_allclose(covariances, spread, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize("mode", [1, 2])
def test_a_turn_goes_round_its_circle(mode: int) -> None:
    """Right is clockwise: the velocity turns by ω t, on a circle of radius v/ω."""
    ahead = np.array([10.0, 40.0])
    certain = np.full((COUNT, 10), 1e-6)
    certain[:, [1, 2, 3, 5, 6, 8]] = 0.0
    probability, mean, _ = _certain(mode)
    means, _ = forecast_of_modes(probability, mean, certain, HELD, ahead)
    speed, course = np.hypot(*MEAN[2:]), np.arctan2(MEAN[2], MEAN[3])
    rate = HELD[mode, LATERAL] / speed
    later = course + rate * ahead
    radius = speed / rate
    east = MEAN[0] + radius * (np.cos(course) - np.cos(later))
    north = MEAN[1] + radius * (np.sin(later) - np.sin(course))
    # The effect of the noise on the speed slows the turn a little: 2 % of the path.
    off = np.hypot(*(means[:, :2] - np.column_stack([east, north])).T)
    assert np.all(off < 0.02 * speed * ahead)
    paths = np.unwrap([course, *np.arctan2(means[:, 2], means[:, 3])])
    assert np.all(np.sign(np.diff(paths)) == np.sign(rate))


def test_at_zero_the_forecast_is_the_mean_with_the_spread_of_the_modes() -> None:
    rng = np.random.default_rng(3)
    probability = rng.dirichlet(np.ones(COUNT))
    mean = MEAN + rng.normal(size=(COUNT, 4)) * [80.0, 90.0, 20.0, 15.0]
    covariance = np.tile(COVARIANCE, (COUNT, 1))
    means, covariances = forecast_of_modes(probability, mean, covariance, TABLE, np.zeros(1))
    middle = probability @ mean
    apart = mean - middle
    spread = _full(COVARIANCE) + (probability[:, None] * apart).T @ apart
    np.testing.assert_allclose(means[0], middle)
    np.testing.assert_allclose(covariances[0], spread, rtol=1e-9)


def test_a_forecast_is_independent_of_the_other_requested_times() -> None:
    states = _all_alike(np.full(COUNT, 1.0 / COUNT))
    alone = forecast_of_modes(*states, TABLE, np.array([31.3]))
    among = forecast_of_modes(*states, TABLE, np.array([0.0, 0.7, 2.0, 30.0, 31.3, 31.3, 90.0]))
    for one, many in zip(alone, among, strict=True):
        assert np.array_equal(one[0], many[4])
        assert np.array_equal(many[4], many[5])


def test_an_hour_ahead_the_covariance_is_still_valid() -> None:
    states = _all_alike(np.full(COUNT, 1.0 / COUNT))
    table = forecast_modes_of(SETTINGS)
    _, covariances = forecast_of_modes(*states, table, np.linspace(0.0, 3600.0, 30))
    assert np.all(covariances == covariances.transpose(0, 2, 1))
    assert np.all(np.linalg.eigvalsh(covariances) > 0.0)
    assert np.all(np.diff(covariances[:, 0, 0] + covariances[:, 1, 1]) > 0.0)


def test_forecasts_do_not_modify_the_states() -> None:
    states = _all_alike(np.full(COUNT, 1.0 / COUNT))
    before = [one.copy() for one in states]
    forecast_of_modes(*states, TABLE, np.array([20.0]))
    assert all(np.array_equal(*pair) for pair in zip(states, before, strict=True))


@pytest.mark.parametrize("ahead", [[-1.0], [np.nan], [5.0, 4.0]])
def test_descending_times_are_rejected(ahead: list[float]) -> None:
    with pytest.raises(ValueError, match="expected"):
        forecast_of_modes(*_certain(0), TABLE, np.array(ahead))


def test_the_velocity_frame_turns_with_the_velocity() -> None:
    settings = TrackingSettings(
        filter_name="two-stage", motion="velocity-frame", turn_rate_rad_per_s=0.05
    )
    north = density_of(settings, np.array([0.0, 200.0]))
    east = density_of(settings, np.array([200.0, 0.0]))
    np.testing.assert_allclose(north, np.diag([(0.05 * 200.0) ** 2, 1.0]))
    np.testing.assert_allclose(east, north[::-1, ::-1])
    still = TrackingSettings(filter_name="two-stage", acceleration_density=7.0)
    np.testing.assert_allclose(density_of(still, np.array([0.0, 200.0])), 7.0 * np.eye(2))


def test_an_isotropic_density_may_be_given_as_a_matrix() -> None:
    full, ahead = _full(COVARIANCE), np.array([3.0, 30.0])
    for one, same in zip(
        forecast(MEAN, full, 2.5, ahead), forecast(MEAN, full, 2.5 * np.eye(2), ahead), strict=True
    ):
        np.testing.assert_allclose(one, same)
    _, spread = forecast(MEAN, 0.0 * full, np.array([[4.0, 1.0], [1.0, 2.0]]), np.array([6.0]))
    np.testing.assert_allclose(spread[0, :2, 2:], 18.0 * np.array([[4.0, 1.0], [1.0, 2.0]]))
    np.testing.assert_allclose(spread[0, :2, :2], 72.0 * np.array([[4.0, 1.0], [1.0, 2.0]]))


AHEAD_S = np.array([10.0, 30.0, 60.0])


def _turning(rng: np.random.Generator) -> list[Flight]:
    # Straight, a turn of 20° of bank by 60° to 150°, straight again, and so on.
    flights = []
    for _ in range(24):
        course, speed = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(120.0, 240.0)
        legs: list[Leg] = []
        while sum(leg.duration_s for leg in legs) < 700.0:
            rate = 9.81 * np.tan(np.radians(20.0)) / speed
            angle = np.radians(rng.uniform(60.0, 150.0))
            legs += [Leg(rng.uniform(60.0, 180.0)), Leg(angle / rate, rate * rng.choice([-1, 1]))]
        velocity = speed * np.sin(course), speed * np.cos(course)
        place = rng.uniform(-100e3, 100e3, 2).tolist()
        flights.append(Flight(0.0, 500.0, (*place, *velocity), 8e3, legs=tuple(legs)))
    return flights


def _forecasts(settings: TrackingSettings) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    # Errors, m, error² / sigma² of an axis, and whether the aircraft turned at the time.
    rng = np.random.default_rng(11)
    flights = _turning(rng)
    scene = make_scene(rng, three_radars(), flights)
    paths = [fly(flier(1, one), 500.0, rng) for one in flights]
    engine = Engine(scene.sensors, settings)
    errors, squares, turning, before = [], [], [], 0
    number: dict[int, int] = {}
    for cut in np.searchsorted(scene.batch.time_s, np.arange(90.0, 440.0, 15.0)).tolist():
        updates = engine.push(scene.batch.select(slice(before, cut))).updates
        number |= dict(zip(updates.track_id.tolist(), updates.track_number.tolist(), strict=True))
        before = cut
        states = engine.tracks()
        for place, track in enumerate(states.track_id.tolist()):
            path, time_s = paths[number[track] - 1], float(states.time_s[place])
            means, covariances = _forecast(states, place, settings)
            error = means[:, :2] - path.position(time_s + AHEAD_S)
            errors.append(np.hypot(error[:, 0], error[:, 1]))
            squares.append(normalised_squared(error, covariances[:, :2, :2]) / 2.0)
            turning.append(_turns(path, time_s))
    return np.array(errors), np.array(squares), np.array(turning)


def _turns(path: Path, time_s: float) -> bool:
    velocity = path.states(np.array([time_s - 0.5, time_s + 0.5]))[:, 2:]
    (east, north), (later_east, later_north) = velocity
    turned = east * later_north - north * later_east
    return bool(abs(turned) > 1e-3 * (east**2 + north**2))


def _forecast(states: TrackStates, place: int, settings: TrackingSettings) -> tuple[Floats, Floats]:
    if states.modes is None:
        mean = states.mean[place]
        density = density_of(settings, mean[2:])
        return forecast(mean, states.covariance[place], density, AHEAD_S)
    known: ModeStates = states.modes
    return forecast_of_modes(
        known.probability[place], known.mean[place], known.covariance[place],
        forecast_modes_of(settings), AHEAD_S,
    )  # fmt: skip


@pytest.mark.slow
def test_in_turns_modes_are_more_accurate_than_white_noise_and_consistent() -> None:
    """Bands of the NEES: 400 forecasts, those of one turn being correlated."""
    errors, squares, turning = _forecasts(SETTINGS)
    white, claims, same = _forecasts(TrackingSettings(filter_name="two-stage"))
    assert 100 < turning.sum() < len(turning) - 100
    rms, of_white = (
        np.sqrt(np.mean(one[mask] ** 2, axis=0)) for one, mask in ((errors, turning), (white, same))
    )
    assert np.all(rms < 0.75 * of_white)
    assert np.all((squares.mean(axis=0) > 0.4) & (squares.mean(axis=0) < 1.4))
    assert np.all(squares[turning].mean(axis=0) < 2.0)
    assert np.all(claims[same].mean(axis=0) > 4.0)


def test_the_modes_of_a_new_aircraft_are_its_one_state() -> None:
    rng = np.random.default_rng(5)
    scene = make_scene(rng, three_radars(), _turning(rng)[:6])
    engine = Engine(scene.sensors, SETTINGS)
    engine.push(scene.batch)
    states = engine.tracks()
    first = Engine(scene.sensors, SETTINGS)
    first.push(scene.batch.select(slice(0, 1)))
    first.flush()
    initial = first.tracks()
    assert initial.modes is not None
    assert states.modes is not None
    np.testing.assert_allclose(initial.modes.probability.sum(axis=1), 1.0)
    np.testing.assert_allclose(initial.modes.mean, np.tile(initial.mean[:, None], (1, COUNT, 1)))
    now, spread = forecast_of_modes(
        initial.modes.probability[0], initial.modes.mean[0], initial.modes.covariance[0], TABLE,
        np.zeros(1),
    )  # fmt: skip
    np.testing.assert_allclose(now[0], initial.mean[0])
    np.testing.assert_allclose(spread[0], initial.covariance[0], rtol=1e-9)
    # Later the mean of the modes is the track, and their spread its covariance, up to different
    # sensitivities to the biases.
    for place in range(len(states)):
        now, spread = forecast_of_modes(
            states.modes.probability[place], states.modes.mean[place],
            states.modes.covariance[place], TABLE, np.zeros(1),
        )  # fmt: skip
        np.testing.assert_allclose(now[0], states.mean[place], rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(spread[0], states.covariance[place], rtol=0.02, atol=0.5)
