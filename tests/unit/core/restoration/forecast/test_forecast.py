"""Forecast ensembles continue their tracks, normalised and consistent."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.errors import ConfigurationError, RestorationError, ShapeError, TimeOrderError
from multiradar.restoration.bundle.estimate import BEST
from multiradar.restoration.bundle.final_states import FinalStates
from multiradar.restoration.bundle.manoeuvre_history import ManoeuvreHistory
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks.motion import advance
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.control_tracks.tracks import ControlTrack, MeasurementTrack
from multiradar.restoration.forecast.bundle_forecast import forecast, remaining_durations
from multiradar.restoration.forecast.ensemble import LATER_NAMES, ForecastEnsemble
from multiradar.restoration.forecast.settings import AHEAD_MAX_S, ForecastSettings
from support.scenarios.flown import flight, plots_of

#: Horizons of the tables.
AHEAD_S = np.array([0.0, 10.0, 30.0, 60.0, 120.0, 300.0])
#: An aircraft that has not manoeuvred for this time.
CRUISE = ManoeuvreHistory(straight_s=1e5, manoeuvring_s=0.0)
#: The rates of the bundle itself: its probabilities are then unchanged.
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
    """One track with a motion known to 20 m and 1 m/s."""
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


def sigma_m(ensemble: ForecastEnsemble) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    spread = ensemble.spread()
    return np.sqrt(spread[:, 0, 0] + spread[:, 1, 1])


def test_straight_flight_continues_straight() -> None:
    controls = flight(((0.0, 0.0),))
    ensemble = forecast(ends_of(controls, (0,), 80.0), AHEAD_S, ForecastSettings(), CRUISE)
    on = ensemble.later == LATER_NAMES.index("straight")
    truth = controls.geometric(80.0 + AHEAD_S).position_m
    assert on.sum() == 1
    np.testing.assert_allclose(ensemble.state[:, on, :2][:, 0], truth, atol=1e-6)
    assert np.all(ensemble.weight[:, on] > 0.98)
    # Both sides are equally likely: the mean remains on the line.
    assert np.abs(ensemble.mean()[:, 1] - truth[:, 1]).max() < 1e-6
    assert np.all(np.diff(sigma_m(ensemble)) > 0.0)


def test_a_segment_applies_from_its_start_time() -> None:
    ends = ends_of(flight(((0.0, 0.0), (60.0, 3.0))), (0, 1), 75.0)
    found = [ends.kind_at(time_s).tolist() for time_s in (-1.0, np.nextafter(60.0, 0.0), 60.0)]
    assert found == [[0], [0], [1]]


def test_a_turn_continues_and_ends() -> None:
    controls = flight(((0.0, 0.0), (60.0, 3.0)))
    ensemble = forecast(ends_of(controls, (0, 1), 75.0), AHEAD_S, ForecastSettings(), CRUISE)
    on = np.flatnonzero(ensemble.later == LATER_NAMES.index("straight"))
    assert len(on) == ForecastSettings().durations
    starts = np.array([*controls.geometric([75.0]).position_m[0], 180.0,
                      controls.geometric([75.0]).heading_rad[0]])  # fmt: skip
    for member in on:
        lasts_s = ensemble.lasts_s[member]
        turned = advance(starts, 3.0, 0.0, np.minimum(AHEAD_S, lasts_s))
        truth = advance(turned, 0.0, 0.0, np.maximum(AHEAD_S - lasts_s, 0.0))
        np.testing.assert_allclose(ensemble.state[:, member, :2], truth[:, :2], rtol=1e-9)
    # The mean duration is a minute; some are much shorter, some much longer.
    assert np.mean(ensemble.lasts_s[on]) == pytest.approx(ForecastSettings().turn_s)
    assert ensemble.lasts_s[on].min() < 10.0
    assert ensemble.lasts_s[on].max() > 120.0


def test_forecasts_of_bundles_are_consistent() -> None:
    inside, count = 0, 0
    for seed in range(6):
        # A turn that started 20 s ago continues for another 30 s.
        controls = flight(((0.0, 0.0), (100.0, 2.5), (150.0, 0.0)))
        bundle = followed(plots_of(controls, 120.0, np.random.default_rng([31, seed])))
        ensemble = forecast(
            bundle.final_states(), AHEAD_S[:4], ForecastSettings(), bundle.manoeuvre_history
        )
        off = ensemble.mean()[:, :2] - controls.geometric(ensemble.time_s + AHEAD_S[:4]).position_m
        spread = ensemble.spread()[:, :2, :2]
        squares = np.einsum("ki,kij,kj->k", off, np.linalg.inv(spread), off)
        inside, count = inside + int(np.sum(squares < 6.0)), count + len(squares)
        assert np.hypot(*off[1]) < 400.0
    assert inside >= count - 3


def test_probabilities_sum_to_one_at_each_time() -> None:
    bundle = followed(plots_of(flight(((0.0, 0.0), (80.0, 2.0))), 100.0, np.random.default_rng(2)))
    ensemble = forecast(
        bundle.final_states(), AHEAD_S, ForecastSettings(), bundle.manoeuvre_history
    )
    np.testing.assert_allclose(ensemble.weight.sum(axis=1), 1.0, rtol=1e-12)
    assert ensemble.weight.min() >= 0.0
    new = ensemble.later != LATER_NAMES.index("straight")
    assert np.all(ensemble.weight[0, new] == 0.0)
    assert np.all(np.diff(ensemble.weight[:, new].sum(axis=1)) > 0.0)
    assert np.linalg.eigvalsh(ensemble.covariance).min() > 0.0


def test_time_zero_is_the_estimate() -> None:
    bundle = followed(plots_of(flight(((0.0, 0.0), (80.0, 2.0))), 95.0, np.random.default_rng(3)))
    now = bundle.estimate()
    ensemble = forecast(bundle.final_states(), [0.0], LIKE_THE_BUNDLE, ManoeuvreHistory())
    # Durations are rounded to the step of the tables: a part of 7 % of a rate.
    np.testing.assert_allclose(ensemble.mean()[0], now.state, atol=0.5)
    np.testing.assert_allclose(ensemble.spread()[0], now.covariance, rtol=0.02, atol=0.5)
    # With rates of its own it equals the bundle to a fraction of a sigma.
    other = forecast(bundle.final_states(), [0.0], ForecastSettings(), bundle.manoeuvre_history)
    off = other.mean()[0, :2] - now.state[:2]
    assert off @ np.linalg.solve(now.covariance[:2, :2], off) < 0.5


def test_a_forecast_does_not_depend_on_the_other_times() -> None:
    bundle = followed(plots_of(flight(((0.0, 0.0), (80.0, 2.0))), 95.0, np.random.default_rng(4)))
    ends, settings = bundle.final_states(), ForecastSettings()
    many = forecast(ends, np.arange(0.0, 600.5, 2.5), settings, bundle.manoeuvre_history)
    for ahead_s in (0.0, 12.5, 57.5, 300.0, 600.0):
        alone = forecast(ends, [ahead_s], settings, bundle.manoeuvre_history)
        row = int(ahead_s / 2.5)
        np.testing.assert_array_equal(alone.state[0], many.state[row])
        np.testing.assert_array_equal(alone.covariance[0], many.covariance[row])
        np.testing.assert_array_equal(alone.weight[0], many.weight[row])
    # Continuous in time: the displacement over 2.5 s is that of 2.5 s of flight.
    steps = np.hypot(*np.diff(many.mean()[:, :2], axis=0).T)
    assert steps.max() < 2.5 * 185.0


def test_an_aircraft_that_never_manoeuvred_is_expected_to_fly_straight() -> None:
    controls = flight(((0.0, 0.0),))
    ends = ends_of(controls, (0,), 80.0)
    new, old = (
        forecast(ends, AHEAD_S, ForecastSettings(), history)
        for history in (ManoeuvreHistory(), CRUISE)
    )
    assert sigma_m(old)[-1] < 0.3 * sigma_m(new)[-1]


def test_manoeuvre_history_is_that_of_the_flight() -> None:
    straight = followed(plots_of(flight(((0.0, 0.0),)), 240.0, np.random.default_rng(5)))
    turning = followed(
        plots_of(flight(((0.0, 0.0), (80.0, 2.0), (140.0, 0.0))), 240.0, np.random.default_rng(5))
    )
    # Decided after 40 s, from some seconds after the first plot.
    assert straight.manoeuvre_history.straight_s == pytest.approx(200.0, abs=8.0)
    # Uncertainty of the plots, at most 3 % of the time.
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


def test_manoeuvre_history_is_sampled_every_5_s_after_40_s() -> None:
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


def test_a_segment_after_the_last_plot_is_omitted() -> None:
    bundle = followed(plots_of(flight(((0.0, 0.0),)), 94.0, np.random.default_rng(7)))
    ends = bundle.final_states()
    counts = [len(one.kinds) for one in bundle.trajectories()]
    assert np.all((ends.segment_kind >= 0).sum(axis=1) <= counts)
    starts = ends.segment_begin_s[ends.segment_kind >= 0]
    assert starts.max() <= ends.time_s
    assert max(one.controls.begin_s[-1] for one in bundle.trajectories()) > ends.time_s


def test_the_best_track_is_the_first_final_state() -> None:
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


def test_times_out_of_range_are_rejected() -> None:
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
def test_settings_out_of_range_are_rejected(name: str, value: object) -> None:
    with pytest.raises(ConfigurationError, match=name):
        replace(ForecastSettings(), **{name: value})  # type: ignore[arg-type] # Wrong on purpose.
