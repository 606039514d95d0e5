"""A fan goes on as its tracks do, with chances that sum to one and errors of the right size."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.errors import ConfigurationError, RestorationError, ShapeError, TimeOrderError
from multiradar.restoration.bundle.bundle import Bundle
from multiradar.restoration.bundle.estimate import BEST
from multiradar.restoration.bundle.final_states import FinalStates
from multiradar.restoration.bundle.manoeuvre_history import ManoeuvreHistory
from multiradar.restoration.control_tracks.motion import advance
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.control_tracks.tracks import ControlTrack, MeasurementTrack
from multiradar.restoration.forecast.ensemble import LATER_NAMES, ForecastEnsemble
from multiradar.restoration.forecast.forecast import forecast, remaining_durations
from multiradar.restoration.forecast.settings import AHEAD_MAX_S, ForecastSettings
from support.scenarios.flown import flight, plots_of

#: Horizons of the tables.
AHEAD_S = np.array([0.0, 10.0, 30.0, 60.0, 120.0, 300.0])
#: An aircraft that was never seen to manoeuvre for so long hardly will.
CRUISE = ManoeuvreHistory(straight_s=1e5, manoeuvring_s=0.0)
#: The rates of the bundle itself: then its chances stay as they are.
LIKE_THE_BUNDLE = ForecastSettings(
    straight_s=BundleSettings().straight_s,
    turn_s=BundleSettings().manoeuvre_s,
    speeding_s=BundleSettings().manoeuvre_s,
    weight_min=1e-300,
)


def followed(plots: MeasurementTrack) -> Bundle:
    bundle = Bundle(BundleSettings())
    bundle.push_all(plots)
    return bundle


def ends_of(controls: ControlTrack, kinds: tuple[int, ...], now_s: float) -> FinalStates:
    """One track whose motion is known but for 20 m and 1 m/s."""
    begins = controls.begin_s
    known = controls.geometric([now_s])
    place = len(begins) - 1
    motion = np.array(
        [
            *known.position_m[0], known.speed_mps[0], known.heading_rad[0],
            controls.lateral_mps2[place], controls.longitudinal_mps2[place],
        ]
    )  # fmt: skip
    rates = BundleSettings().kinds()[:, 4]
    covariance = np.diag([400.0, 400.0, 1.0, 3e-5, 0.01, 1e-4])
    return FinalStates(
        now_s, float(begins[0]), np.ones(1), motion[None], covariance[None],
        np.array([kinds]), begins[None], rates, np.zeros((2, 2)),
    )  # fmt: skip


def sigma_m(fan: ForecastEnsemble) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    spread = fan.spread()
    return np.sqrt(spread[:, 0, 0] + spread[:, 1, 1])


def test_straight_flight_goes_straight_on() -> None:
    controls = flight(((0.0, 0.0),))
    fan = forecast(ends_of(controls, (0,), 80.0), AHEAD_S, ForecastSettings(), CRUISE)
    on = fan.later == LATER_NAMES.index("straight")
    truth = controls.geometric(80.0 + AHEAD_S).position_m
    assert on.sum() == 1
    np.testing.assert_allclose(fan.state[:, on, :2][:, 0], truth, atol=1e-6)
    assert np.all(fan.weight[:, on] > 0.98)
    # Both sides are equally likely: the mean keeps to the line.
    assert np.abs(fan.mean()[:, 1] - truth[:, 1]).max() < 1e-6
    assert np.all(np.diff(sigma_m(fan)) > 0.0)


def test_a_turn_goes_on_and_ends() -> None:
    controls = flight(((0.0, 0.0), (60.0, 3.0)))
    fan = forecast(ends_of(controls, (0, 1), 75.0), AHEAD_S, ForecastSettings(), CRUISE)
    on = np.flatnonzero(fan.later == LATER_NAMES.index("straight"))
    assert len(on) == ForecastSettings().durations
    begun = np.array([*controls.geometric([75.0]).position_m[0], 180.0,
                      controls.geometric([75.0]).heading_rad[0]])  # fmt: skip
    for member in on:
        lasts_s = fan.lasts_s[member]
        turned = advance(begun, 3.0, 0.0, np.minimum(AHEAD_S, lasts_s))
        truth = advance(turned, 0.0, 0.0, np.maximum(AHEAD_S - lasts_s, 0.0))
        np.testing.assert_allclose(fan.state[:, member, :2], truth[:, :2], rtol=1e-9)
    # They last for a minute on average, some much less, some much more.
    assert np.mean(fan.lasts_s[on]) == pytest.approx(ForecastSettings().turn_s)
    assert fan.lasts_s[on].min() < 10.0
    assert fan.lasts_s[on].max() > 120.0


def test_what_a_bundle_sees_is_where_the_aircraft_will_be() -> None:
    inside, count = 0, 0
    for seed in range(6):
        # A turn that began 20 s ago goes on for 30 s more.
        controls = flight(((0.0, 0.0), (100.0, 2.5), (150.0, 0.0)))
        bundle = followed(plots_of(controls, 120.0, np.random.default_rng([31, seed])))
        fan = forecast(
            bundle.final_states(), AHEAD_S[:4], ForecastSettings(), bundle.manoeuvre_history
        )
        off = fan.mean()[:, :2] - controls.geometric(fan.time_s + AHEAD_S[:4]).position_m
        spread = fan.spread()[:, :2, :2]
        squares = np.einsum("ki,kij,kj->k", off, np.linalg.inv(spread), off)
        inside, count = inside + int(np.sum(squares < 6.0)), count + len(squares)
        assert np.hypot(*off[1]) < 400.0
    assert inside >= count - 3


def test_chances_sum_to_one_at_each_time() -> None:
    bundle = followed(plots_of(flight(((0.0, 0.0), (80.0, 2.0))), 100.0, np.random.default_rng(2)))
    fan = forecast(bundle.final_states(), AHEAD_S, ForecastSettings(), bundle.manoeuvre_history)
    np.testing.assert_allclose(fan.weight.sum(axis=1), 1.0, rtol=1e-12)
    assert fan.weight.min() >= 0.0
    new = fan.later != LATER_NAMES.index("straight")
    assert np.all(fan.weight[0, new] == 0.0)
    assert np.all(np.diff(fan.weight[:, new].sum(axis=1)) > 0.0)
    assert np.linalg.eigvalsh(fan.covariance).min() > 0.0


def test_time_zero_is_the_estimate() -> None:
    bundle = followed(plots_of(flight(((0.0, 0.0), (80.0, 2.0))), 95.0, np.random.default_rng(3)))
    now = bundle.estimate()
    fan = forecast(bundle.final_states(), [0.0], LIKE_THE_BUNDLE, ManoeuvreHistory())
    # A table's step of durations, not the duration itself: a part of 7 % of a rate.
    np.testing.assert_allclose(fan.mean()[0], now.state, atol=0.5)
    np.testing.assert_allclose(fan.spread()[0], now.covariance, rtol=0.02, atol=0.5)
    # With rates of its own it says what the bundle says to a part of a sigma.
    other = forecast(bundle.final_states(), [0.0], ForecastSettings(), bundle.manoeuvre_history)
    off = other.mean()[0, :2] - now.state[:2]
    assert off @ np.linalg.solve(now.covariance[:2, :2], off) < 0.5


def test_a_time_is_told_the_same_whatever_others_are_asked_for() -> None:
    bundle = followed(plots_of(flight(((0.0, 0.0), (80.0, 2.0))), 95.0, np.random.default_rng(4)))
    ends, settings = bundle.final_states(), ForecastSettings()
    many = forecast(ends, np.arange(0.0, 600.5, 2.5), settings, bundle.manoeuvre_history)
    for ahead_s in (0.0, 12.5, 57.5, 300.0, 600.0):
        alone = forecast(ends, [ahead_s], settings, bundle.manoeuvre_history)
        row = int(ahead_s / 2.5)
        np.testing.assert_array_equal(alone.state[0], many.state[row])
        np.testing.assert_array_equal(alone.covariance[0], many.covariance[row])
        np.testing.assert_array_equal(alone.weight[0], many.weight[row])
    # Nothing jumps from one time to the next: none flies 2.5 s in more than 2.5 s.
    steps = np.hypot(*np.diff(many.mean()[:, :2], axis=0).T)
    assert steps.max() < 2.5 * 185.0


def test_who_never_manoeuvred_is_expected_to_fly_on_straight() -> None:
    controls = flight(((0.0, 0.0),))
    ends = ends_of(controls, (0,), 80.0)
    new, old = (
        forecast(ends, AHEAD_S, ForecastSettings(), habits)
        for habits in (ManoeuvreHistory(), CRUISE)
    )
    assert sigma_m(old)[-1] < 0.3 * sigma_m(new)[-1]


def test_habits_are_those_of_the_flight() -> None:
    straight = followed(plots_of(flight(((0.0, 0.0),)), 240.0, np.random.default_rng(5)))
    turning = followed(
        plots_of(flight(((0.0, 0.0), (80.0, 2.0), (140.0, 0.0))), 240.0, np.random.default_rng(5))
    )
    # What was told 40 s after it, from some seconds after the first plot on.
    assert straight.manoeuvre_history.straight_s == pytest.approx(200.0, abs=8.0)
    # Doubt of the plots, 3 % of the time at most.
    assert straight.manoeuvre_history.manoeuvring_s < 6.0
    assert turning.manoeuvre_history.manoeuvring_s == pytest.approx(60.0, abs=10.0)
    settings = ForecastSettings()
    durations = [
        one.mean_straight_s(settings.straight_s, settings.turn_s, settings.habit_s)
        for one in (ManoeuvreHistory(), straight.manoeuvre_history, turning.manoeuvre_history)
    ]
    assert durations[0] == pytest.approx(settings.straight_s)
    assert durations[1] > durations[0]
    assert durations[1] > durations[2]


def test_habits_are_noted_every_5_s_and_40_s_after_it() -> None:
    flown = flight(((0.0, 0.0),))
    for until_s, noted_s in ((60.0, 20.0), (62.5, 20.0), (65.0, 25.0)):
        plots = plots_of(flown, until_s + 0.1, np.random.default_rng(5), interval_s=2.5)
        assert followed(plots).manoeuvre_history.until_s == noted_s


def test_a_copy_of_a_bundle_forecasts_the_same() -> None:
    bundle = followed(plots_of(flight(((0.0, 0.0), (80.0, 2.0))), 200.0, np.random.default_rng(6)))
    other = bundle.copy()
    one, two = (
        forecast(each.final_states(), AHEAD_S, ForecastSettings(), each.manoeuvre_history)
        for each in (bundle, other)
    )
    np.testing.assert_array_equal(one.weight, two.weight)
    np.testing.assert_array_equal(one.covariance, two.covariance)


def test_a_segment_that_begins_after_the_last_plot_is_left_out() -> None:
    bundle = followed(plots_of(flight(((0.0, 0.0),)), 94.0, np.random.default_rng(7)))
    ends = bundle.final_states()
    told = [len(one.kinds) for one in bundle.trajectories()]
    assert np.all((ends.segment_kind >= 0).sum(axis=1) <= told)
    begun = ends.segment_begin_s[ends.segment_kind >= 0]
    assert begun.max() <= ends.time_s
    assert max(one.controls.begin_s[-1] for one in bundle.trajectories()) > ends.time_s


def test_the_best_track_is_the_first_end() -> None:
    bundle = followed(plots_of(flight(((0.0, 0.0), (60.0, 2.5))), 100.0, np.random.default_rng(8)))
    now, ends = bundle.estimate(BEST), bundle.final_states()
    np.testing.assert_allclose(ends.motion[0, :2], now.state[:2])
    assert ends.motion[0, 2] == pytest.approx(now.speed_mps)
    assert ends.motion[0, 4] == pytest.approx(now.lateral_mps2)
    np.testing.assert_allclose(ends.covariance[0, :2, :2], now.covariance[:2, :2], rtol=1e-4)


@pytest.mark.parametrize("count", [1, 2, 6, 32])
def test_remaining_durations_have_the_moments_of_the_whole(count: int) -> None:
    durations, variances = remaining_durations(40.0, count)
    assert np.mean(durations) == pytest.approx(40.0, rel=1e-12)
    second = np.mean(variances + durations**2)
    assert second == pytest.approx(2.0 * 40.0**2, rel=1e-12)
    assert np.all(variances > 0.0)


def test_times_out_of_bounds_are_refused() -> None:
    ends = ends_of(flight(((0.0, 0.0),)), (0,), 80.0)
    for ahead in ([-1.0], [AHEAD_MAX_S + 1.0]):
        with pytest.raises(ConfigurationError, match="time ahead: expected 0 to 720 s"):
            forecast(ends, ahead, ForecastSettings(), ManoeuvreHistory())
    with pytest.raises(TimeOrderError):
        forecast(ends, [10.0, 5.0], ForecastSettings(), ManoeuvreHistory())
    with pytest.raises(ShapeError):
        forecast(ends, [np.nan], ForecastSettings(), ManoeuvreHistory())
    with pytest.raises(RestorationError, match="expected three plots"):
        Bundle(BundleSettings()).final_states()


@pytest.mark.parametrize(
    ("name", "value"),
    [("straight_s", 0.0), ("turn_s", np.nan), ("later_turns", 1.5), ("durations", 33),
     ("turn_rates_rad_per_s", ()), ("turn_rates_rad_per_s", (0.01, -0.01))],
)  # fmt: skip
def test_settings_out_of_range_are_refused(name: str, value: object) -> None:
    with pytest.raises(ConfigurationError, match=name):
        replace(ForecastSettings(), **{name: value})  # type: ignore[arg-type] # Wrong on purpose.
