"""A bundle follows an aircraft through turns and wrong plots, and reconstructs its path."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import (
    ConfigurationError,
    CovarianceError,
    RestorationError,
    ShapeError,
    TimeOrderError,
)
from multiradar.restoration.bundle import trajectory_bundle
from multiradar.restoration.bundle.estimate import BEST, WEIGHTED
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks.settings import KIND_NAMES, BundleSettings
from multiradar.restoration.control_tracks.tracks import MeasurementTrack, whole_seconds
from support.scenarios.flown import S_SHAPE, flight, plots_of

NOISE = 2500.0 * np.eye(2)


def followed(plots: MeasurementTrack, settings: BundleSettings | None = None) -> Bundle:
    bundle = Bundle(settings or BundleSettings())
    bundle.push_all(plots)
    return bundle


@pytest.mark.parametrize("by", [BEST, WEIGHTED])
def test_it_reconstructs_an_s_shaped_flight(by: str) -> None:
    flown = flight(S_SHAPE)
    bundle = followed(plots_of(flown, 200.0, np.random.default_rng(5)))
    first, last = bundle.window_s
    grid = whole_seconds(first, last)
    off = bundle.restored(grid, by).position_m - flown.geometric(grid).position_m
    # Plots have errors of 71 m; some sixty of them determine three turns.
    assert last - first == pytest.approx(90.0, abs=1.5)
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 25.0
    best = bundle.trajectories()[0]
    assert best.kinds[-1] == "straight"
    assert bundle.restarts == 0


def test_accelerations_are_estimated_in_a_turn() -> None:
    flown = flight(((0.0, 0.0), (60.0, 2.5)))
    now = followed(plots_of(flown, 100.0, np.random.default_rng(6))).estimate(BEST)
    truth = flown.geometric([now.time_s])
    assert now.lateral_mps2 == pytest.approx(2.5, abs=0.3)
    assert abs(now.longitudinal_mps2) < 0.1
    assert now.kind_probability.tolist() == [0.0, 1.0, 0.0, 0.0, 0.0]
    assert now.speed_mps == pytest.approx(truth.speed_mps[0], abs=5.0)
    assert now.heading_rad == pytest.approx(truth.heading_rad[0] % (2 * np.pi), abs=0.05)


@pytest.mark.slow
def test_bundle_estimates_are_consistent() -> None:
    squares = []
    for seed in range(12):
        flown = flight(S_SHAPE if seed % 2 else ((0.0, 0.0),))
        now = followed(plots_of(flown, 126.0, np.random.default_rng([7, seed]))).estimate()
        off = now.state[:2] - flown.geometric([now.time_s]).position_m[0]
        squares.append(off @ np.linalg.solve(now.covariance[:2, :2], off))
    # Mean of twelve χ² with two degrees of freedom: 99.9 % band.
    assert 0.7 < np.mean(squares) < 4.3


def test_wrong_plots_do_not_move_it() -> None:
    flown = flight(S_SHAPE)
    rng = np.random.default_rng(8)
    bundle = followed(plots_of(flown, 200.0, rng, wrong=0.1))
    grid = whole_seconds(*bundle.window_s)
    off = bundle.restored(grid).position_m - flown.geometric(grid).position_m
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 30.0
    assert bundle.restarts == 0


def test_a_lost_aircraft_is_reacquired() -> None:
    there = plots_of(flight(((0.0, 0.0),)), 100.0, np.random.default_rng(9))
    bundle = followed(there)
    later = plots_of(flight(((0.0, 0.0),)), 60.0, np.random.default_rng(10))
    for time, place in zip(later.time_s, later.position_m, strict=True):
        bundle.push(100.0 + float(time), place + np.array([0.0, 3e4]), NOISE)
    now = bundle.estimate()
    assert bundle.restarts == 1
    assert np.hypot(now.state[0] - 180.0 * (now.time_s - 100.0), now.state[1] - 3e4) < 100.0
    # It has no estimate of the time before.
    assert bundle.window_s[0] >= 98.0


def test_a_failed_reinitialisation_is_repeated_after_eight_seconds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bundle = followed(plots_of(flight(((0.0, 0.0),)), 60.0, np.random.default_rng(12)))
    tried: list[float] = []
    found = bundle._tracks[:1].copy()
    now_s = 0.0

    def attempt(*_: object) -> NDArray[np.float64]:
        tried.append(now_s)
        return found

    # The last plots always seem to be of another aircraft, and the new track is never likelier.
    monkeypatch.setattr(trajectory_bundle, "lost_since", lambda _: bundle._last - 5)
    monkeypatch.setattr(trajectory_bundle, "fits_none", lambda _: False)
    monkeypatch.setattr(trajectory_bundle, "is_likelier", lambda *_, refuted: refuted)
    monkeypatch.setattr(trajectory_bundle, "first_tracks", attempt)
    for now_s in np.arange(62.0, 92.0, 2.0):
        # A copy knows the last attempt.
        bundle = bundle.copy()
        bundle.push(now_s, np.array([180.0 * now_s, 0.0]), NOISE)
    assert tried == [62.0, 70.0, 78.0, 86.0]
    assert bundle.restarts == 0


def test_dissimilar_tracks_are_kept() -> None:
    # Eight seconds after the start of a turn, straight flight and the turn are both present.
    flown = flight(((0.0, 0.0), (90.0, 2.0)))
    bundle = followed(plots_of(flown, 96.0, np.random.default_rng(11)))
    last = {one.kinds[-1] for one in bundle.trajectories()}
    assert {"straight", "right", "left"} <= last
    assert len(bundle) <= BundleSettings().tracks_max


@pytest.mark.parametrize("seed", [18, 19])
def test_similar_tracks_do_not_displace_others(seed: int) -> None:
    # One radar alone, with errors of 200 m: hypotheses about the past minute differ more than those
    # about the present. Every kind of motion is still present.
    flown = flight(((0.0, 0.0),), along_mps2=0.4)
    rng = np.random.default_rng(seed)
    bundle = followed(plots_of(flown, 150.0, rng, interval_s=6.0, sigma_m=200.0))
    assert {one.kinds[-1] for one in bundle.trajectories()} == set(KIND_NAMES)


def test_a_reversal_may_continue_or_end() -> None:
    # Half a circle later, with a scan period of 6 s: continued, straight, or reversed.
    flown = flight(((0.0, 0.0), (80.0, 3.0)))
    rng = np.random.default_rng(16)
    bundle = followed(plots_of(flown, 142.0, rng, interval_s=6.0, sigma_m=100.0))
    ahead_s = bundle.window_s[1] + 30.0
    headings: dict[str, float] = {}
    for one in bundle.trajectories():
        heading = one.controls.geometric([ahead_s]).heading_rad[0]
        headings.setdefault(one.kinds[-1], float(heading))
    assert {"straight", "right", "left"} <= set(headings)
    # 30 s of 3 m/s² at 180 m/s are a turn of 29 degrees.
    assert headings["right"] - headings["straight"] > np.radians(15.0)
    assert headings["straight"] - headings["left"] > np.radians(15.0)


def test_weights_are_probabilities_the_best_first() -> None:
    bundle = followed(plots_of(flight(S_SHAPE), 130.0, np.random.default_rng(12)))
    weights = bundle.weights()
    assert weights.sum() == pytest.approx(1.0)
    assert np.all(np.diff(weights) <= 0.0)
    assert [one.weight for one in bundle.trajectories()] == weights.tolist()


def test_best_and_mean_are_close_where_one_kind_of_motion_prevails() -> None:
    """Section 2.2.5: within the sigma of the mean; half a minute after the last switch."""
    for seed in range(4):
        plots = plots_of(flight(S_SHAPE), 175.0, np.random.default_rng([15, seed]))
        bundle = followed(plots)
        best, mean = bundle.estimate(BEST), bundle.estimate(WEIGHTED)
        sigma = np.sqrt(np.trace(mean.covariance[:2, :2]))
        assert np.hypot(*(best.state - mean.state)[:2]) < sigma
        assert best.speed_mps == pytest.approx(mean.speed_mps, abs=3.0)


@pytest.mark.slow
def test_cost_and_estimate_do_not_depend_on_the_past() -> None:
    # Sliding the window is not evidence: after an hour of straight flight the estimate for the last
    # plots equals that of a bundle of three minutes, except for the information of 3600 s of the
    # same heading.
    flown = flight(((0.0, 0.0),))
    long = plots_of(flown, 1800.0, np.random.default_rng(13), interval_s=3.0)
    old = followed(long)
    new = Bundle(BundleSettings())
    for row in range(len(long) - 60, len(long)):
        new.push(float(long.time_s[row]), long.position_m[row], long.covariance_m2[row])
    off = old.estimate().state[:2] - new.estimate().state[:2]
    assert np.hypot(*off) < 15.0
    assert old.window_s[1] - old.window_s[0] <= 90.0
    assert old.weights()[0] == pytest.approx(new.weights()[0], abs=0.25)


def test_the_same_plots_give_the_same_bytes() -> None:
    plots = plots_of(flight(S_SHAPE), 150.0, np.random.default_rng(14), wrong=0.05)
    one, other = followed(plots), followed(plots)
    grid = whole_seconds(*one.window_s)
    assert one.restored(grid).position_m.tobytes() == other.restored(grid).position_m.tobytes()


def test_without_a_wide_triple_there_is_no_trajectory() -> None:
    bundle = Bundle(BundleSettings())
    for time in range(10):
        bundle.push(float(time), [0.0, 150.0 * time], NOISE)
    assert len(bundle) == 0
    with pytest.raises(RestorationError, match="expected three plots 8 s and 800 m apart"):
        bundle.estimate()
    with pytest.raises(RestorationError, match="no such triple among 10 plots"):
        bundle.trajectories()
    with pytest.raises(RestorationError, match="triple among 0 plots"):
        Bundle(BundleSettings()).weights()


def test_invalid_plots_are_rejected() -> None:
    bundle = Bundle(BundleSettings())
    bundle.push(5.0, [0.0, 0.0], NOISE)
    with pytest.raises(TimeOrderError, match=r"expected a time of 5.0 s or later, was 4.0 s"):
        bundle.push(4.0, [0.0, 0.0], NOISE)
    with pytest.raises(ShapeError, match="plot positions: expected finite numbers"):
        bundle.push(6.0, [np.nan, 0.0], NOISE)
    with pytest.raises(CovarianceError, match="plot covariances"):
        bundle.push(6.0, [0.0, 0.0], np.array([[1.0, 2.0], [2.0, 1.0]]))
    assert len(bundle) == 0
    followed_so = followed(plots_of(flight(S_SHAPE), 60.0, np.random.default_rng(1)))
    with pytest.raises(ShapeError, match="estimation time: expected finite numbers"):
        followed_so.estimate(time_s=np.nan)
    with pytest.raises(ValueError, match="expected 'best' or 'weighted', was 'worst'"):
        followed_so.estimate("worst")


@pytest.mark.parametrize(
    ("name", "value"), [("tracks_max", 0), ("window_s", 1e4), ("outlier_probability", 0.9)]
)
def test_bundle_settings_out_of_range_are_rejected(name: str, value: float) -> None:
    with pytest.raises(ConfigurationError, match=f"{name}: expected"):
        BundleSettings(**{name: value})  # type: ignore[arg-type]
