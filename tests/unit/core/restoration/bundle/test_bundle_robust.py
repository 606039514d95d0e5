"""A bundle does not lose aircraft: slow ones, steep turns, gaps, wrong, biased and dense plots."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import ConfigurationError
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks._layout import INITIAL_PLOTS_MAX
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.control_tracks.tracks import (
    ControlTrack,
    MeasurementTrack,
    measurement_track,
)
from support.scenarios.flown import S_SHAPE, flight, plots_of

Floats = NDArray[np.float64]
NOISE = 2500.0 * np.eye(2)
#: Banks of 35 degrees, 6.9 m/s²: a quarter of a circle each way.
STEEP = ((0.0, 0.0), (90.0, 6.9), (131.0, 0.0), (200.0, -6.9), (241.0, 0.0))


def errors_of(
    bundle: Bundle, plots: MeasurementTrack, flown: ControlTrack, *, every: int = 1
) -> Floats:
    """Position errors at the plots, NaN without tracks; all estimates are finite."""
    true = flown.geometric(plots.time_s).position_m
    off = np.full(len(plots), np.nan)
    for row in range(len(plots)):
        bundle.push(float(plots.time_s[row]), plots.position_m[row], plots.covariance_m2[row])
        if len(bundle) and row % every == 0:
            now = bundle.estimate()
            assert np.linalg.eigvalsh(now.covariance)[0] > 0.0
            assert bundle.weights().sum() == pytest.approx(1.0)
            off[row] = np.hypot(*(now.state[:2] - true[row]))
    return off


def without(plots: MeasurementTrack, from_s: float, to_s: float) -> MeasurementTrack:
    """The plots before and after a gap."""
    kept = (plots.time_s < from_s) | (plots.time_s > to_s)
    return measurement_track(
        plots.time_s[kept], plots.position_m[kept], plots.covariance_m2[kept], plots.radar[kept]
    )


def test_slow_aircraft_are_followed() -> None:
    # 800 m take 27 s: three plots this far apart are not within the initial window of 30 s.
    flown = flight(((0.0, 0.0), (120.0, 1.5), (151.0, 0.0)), speed_mps=30.0)
    plots = plots_of(flown, 220.0, np.random.default_rng(21))
    off = errors_of(Bundle(BundleSettings()), plots, flown)
    assert np.isfinite(off[plots.time_s > 75.0]).all()
    assert np.sqrt(np.nanmean(off**2)) < 50.0


def test_a_slow_radar_with_a_missed_plot_initiates_tracks() -> None:
    flown = flight(((0.0, 0.0),))
    plots = plots_of(flown, 100.0, np.random.default_rng(22), interval_s=20.0)
    off = errors_of(Bundle(BundleSettings()), plots, flown)
    assert np.isfinite(off[2:]).all()
    assert np.nanmax(off) < 200.0


def longest_run(large: NDArray[np.bool_]) -> int:
    """Longest run of true values."""
    runs = np.split(large, np.flatnonzero(np.diff(large.astype(int))) + 1)
    return max((len(run) for run in runs if run[0]), default=0)


@pytest.mark.parametrize(("interval_s", "seed"), [(30.0, 0), (30.0, 1), (20.0, 2)])
def test_a_turn_between_plots_of_a_slow_radar_is_not_lost_for_long(
    interval_s: float, seed: int
) -> None:
    # Turns of 1.2 and 1.8 °/s: 40 s of them are a plot or two, after which the aircraft is 2 to
    # 6 km from straight flight.
    flown = flight(((0.0, 0.0), (215.0, 3.8), (255.0, 0.0), (430.0, -5.6), (475.0, 0.0)))
    rng = np.random.default_rng([31, seed])
    plots = plots_of(flown, 800.0, rng, interval_s=interval_s, sigma_m=100.0)
    off = errors_of(Bundle(BundleSettings(initial_s=60.0, lateral_max_mps2=14.0)), plots, flown)
    assert np.isfinite(off[3:]).all()
    # Three outliers are enough to reject the track; two may be wrong plots.
    assert longest_run(off > 1000.0) <= 2
    assert np.median(off[3:]) < 200.0


@pytest.mark.parametrize(("interval_s", "seed"), [(30.0, 0), (12.0, 1), (4.0, 2), (1.5, 3)])
def test_wrong_plots_do_not_reinitialise_it(interval_s: float, seed: int) -> None:
    flown = flight(((0.0, 0.0),))
    rng = np.random.default_rng([32, seed])
    plots = plots_of(flown, 200.0 * interval_s, rng, interval_s=interval_s, wrong=0.05)
    # Except at initiation.
    good = np.hypot(*(plots.position_m - flown.geometric(plots.time_s).position_m).T) < 250.0
    first = int(np.argmax(np.convolve(good, np.ones(5), mode="valid") == 5.0))
    heard = without(plots, -1.0, float(plots.time_s[first]) - 0.1)
    bundle = Bundle(BundleSettings())
    errors_of(bundle, heard, flown, every=9)
    assert bundle.restarts == 0


def test_an_aircraft_accelerating_at_initiation_is_followed() -> None:
    # From 50 to 170 m/s in 30 s, detected from the start; noise as at 200 km.
    times = np.arange(0.0, 120.0, 2.0)
    speeding = np.minimum(times, 30.0)
    flown_m = 50.0 * times + 4.0 * speeding * (times - 0.5 * speeding)
    true = np.stack([flown_m, np.zeros_like(times)], axis=-1)
    noise = 22500.0 * np.eye(2)
    settings = BundleSettings(longitudinal_max_mps2=4.0)
    for seed in range(4):
        rng = np.random.default_rng([33, seed])
        places = true + 150.0 * rng.normal(size=true.shape)
        bundle, off = Bundle(settings), []
        for time_s, place, at in zip(times, places, true, strict=True):
            bundle.push(float(time_s), place, noise)
            if len(bundle):
                off.append(float(np.hypot(*(bundle.estimate().state[:2] - at))))
        assert bundle.restarts == 0
        # Three sigmas of one plot along one axis.
        assert max(off) < 450.0


def test_a_turn_beyond_the_limits_is_not_lost() -> None:
    flown = flight(STEEP)
    plots = plots_of(flown, 300.0, np.random.default_rng(23))
    bundle = Bundle(BundleSettings())
    off = errors_of(bundle, plots, flown)
    # A turn of 6.9 m/s² leaves one of 4 m/s² by 500 m in 19 s.
    assert np.nanmax(off) < 500.0
    assert bundle.restarts == 0


def test_the_limits_hold_if_enforced() -> None:
    # With a factor of one always; else while tracks within the limits follow the plots.
    for segments, factor in ((STEEP, 1.0), (S_SHAPE, 2.0)):
        plots = plots_of(flight(segments), 250.0, np.random.default_rng(24))
        bundle = Bundle(BundleSettings(beyond_factor=factor))
        for row in range(len(plots)):
            bundle.push(float(plots.time_s[row]), plots.position_m[row], NOISE)
            for one in bundle.trajectories() if len(bundle) else ():
                assert np.abs(one.controls.lateral_mps2).max() <= 4.0
                assert np.abs(one.controls.longitudinal_mps2).max() <= 2.0
    with pytest.raises(ConfigurationError, match=r"beyond_factor: .* was 0\.5"):
        BundleSettings(beyond_factor=0.5)


def test_it_is_reinitialised_after_a_long_gap() -> None:
    flown = flight(((0.0, 0.0), (110.0, 2.0)))
    plots = plots_of(flown, 400.0, np.random.default_rng(25))
    heard = without(plots, 120.0, 300.0)
    bundle = Bundle(BundleSettings())
    off = errors_of(bundle, heard, flown)
    after = heard.time_s > 300.0
    # Estimates of 180 s ago are not extrapolated.
    assert np.isnan(off[after][0])
    assert np.isfinite(off[heard.time_s > 325.0]).all()
    assert np.nanmax(off[after]) < 200.0
    assert bundle.restarts == 1
    assert bundle.window_s[0] > 300.0


def test_a_gap_within_the_window_is_bridged() -> None:
    flown = flight(((0.0, 0.0), (110.0, 2.0), (170.0, 0.0)))
    plots = plots_of(flown, 300.0, np.random.default_rng(26))
    heard = without(plots, 105.0, 165.0)
    bundle = Bundle(BundleSettings())
    off = errors_of(bundle, heard, flown)
    assert np.isfinite(off[heard.time_s > 165.0]).all()
    # Ten plots later it has reconstructed the gap.
    assert np.nanmax(off[heard.time_s > 180.0]) < 250.0


@pytest.mark.parametrize("seed", range(4))
def test_wrong_plots_at_initiation_do_not_mislead(seed: int) -> None:
    flown = flight(((0.0, 0.0),))
    plots = plots_of(flown, 120.0, np.random.default_rng([27, seed]), interval_s=4.0, wrong=0.2)
    off = errors_of(Bundle(BundleSettings()), plots, flown)
    assert np.sqrt(np.mean(off[plots.time_s > 60.0] ** 2)) < 120.0


def test_plots_accurate_in_one_direction_initiate_tracks() -> None:
    # Two sources, each accurate to 1 m along one axis and to 5 km along the other.
    flown = flight(((0.0, 0.0), (90.0, 2.0)))
    times = np.arange(0.0, 150.0, 2.0)
    rng = np.random.default_rng(28)
    sigma = np.where(np.arange(len(times))[:, None] % 2, [1.0, 5e3], [5e3, 1.0])
    places = flown.geometric(times).position_m + sigma * rng.normal(size=sigma.shape)
    noise = np.einsum("ki,ij->kij", sigma**2, np.eye(2))
    plots = measurement_track(times, places, noise, np.zeros(len(times)))
    bundle = Bundle(BundleSettings())
    off = errors_of(bundle, plots, flown)
    # Metres along the line; an undetected turn of 2 m/s² deviates by 400 m after 20 s.
    assert np.nanmax(off[times < 90.0]) < 10.0
    assert np.nanmax(off) < 400.0
    assert bundle.restarts == 0


@pytest.mark.slow
def test_inconsistent_radars_do_not_break_it() -> None:
    flown = flight(((0.0, 0.0), (90.0, 2.0)))
    plots = plots_of(flown, 200.0, np.random.default_rng(29))
    bias = np.array([[1000.0, 0.0], [-700.0, 700.0], [0.0, -1000.0]])
    moved = plots.position_m + bias[np.arange(len(plots)) % 3]
    inconsistent = measurement_track(plots.time_s, moved, plots.covariance_m2, plots.radar)
    bundle = Bundle(BundleSettings())
    off = errors_of(bundle, inconsistent, flown)
    assert np.nanmax(off) < 1500.0
    assert bundle.restarts <= 2


@pytest.mark.slow
def test_crowded_plots_do_no_harm() -> None:
    # Duplicates, and more plots than the capacity, before and after tracks exist.
    flown = flight(((0.0, 0.0),))
    rng = np.random.default_rng(30)
    burst = np.arange(3 * INITIAL_PLOTS_MAX) * 1e-3
    times = np.sort(np.concatenate([burst, np.repeat(np.arange(2.0, 60.0, 2.0), 2), 40.0 + burst]))
    places = flown.geometric(times).position_m + 50.0 * rng.normal(size=(len(times), 2))
    noise = np.broadcast_to(NOISE, (len(times), 2, 2))
    plots = measurement_track(times, places, noise, np.zeros(len(times)))
    bundle = Bundle(BundleSettings())
    off = errors_of(bundle, plots, flown, every=97)
    assert np.nanmax(off[times > 30.0]) < 60.0
    assert bundle.restarts == 0
