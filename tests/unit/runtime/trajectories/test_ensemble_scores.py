"""Regions of bundles' forecasts become as large as past errors ask."""

import numpy as np
import pytest

from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.forecast.bundle_forecast import forecast
from multiradar.runtime.trajectories import ensemble_scores
from multiradar.runtime.trajectories.ensemble_scores import (
    ASKED_AFTER_S,
    EAGER_SAMPLES,
    EAGER_TRACKS,
    PLOTS_EACH,
    EnsembleScores,
)
from multiradar.tracking.forecast.region_sizes import CALIBRATED, HORIZONS_S
from multiradar.tracking.forecast.regions import gaussian_factor
from multiradar.tracking.forecast.state_samples import SAMPLE_TRACKS_MAX

pytestmark = pytest.mark.slow

SPEED_MPS, NOISE_M, PLOT_EVERY_S = 200.0, 40.0, 4.0
AIRCRAFT, SECONDS = 6, 400.0
NOISE = NOISE_M**2 * np.eye(2)


def plot(bundle: Bundle, number: int, time_s: float, random: np.random.Generator) -> None:
    there = np.array([SPEED_MPS * time_s, 1e4 * number])
    bundle.push(time_s, there + random.normal(0.0, NOISE_M, 2), NOISE)


def flown(seconds: float, number: int = 0) -> Bundle:
    """The bundle of an aircraft in straight flight."""
    bundle, random = Bundle(BundleSettings()), np.random.default_rng(number)
    for time_s in np.arange(0.0, seconds, PLOT_EVERY_S).tolist():
        plot(bundle, number, time_s, random)
    return bundle


@pytest.fixture(scope="module")
def taught() -> EnsembleScores:
    """What aircraft teach that never manoeuvre."""
    scores, random = EnsembleScores(), np.random.default_rng(9)
    bundles = {number: Bundle(BundleSettings()) for number in range(AIRCRAFT)}
    for time_s in np.arange(0.0, SECONDS, PLOT_EVERY_S).tolist():
        for number, bundle in bundles.items():
            plot(bundle, number, time_s, random)
        if time_s > 60.0 and time_s % 8.0 == 0.0:
            for number, bundle in bundles.items():
                scores.evaluate(number, bundle, time_s)
            scores.settle()
            for number, bundle in bundles.items():
                scores.make(number, bundle)
    return scores


def test_regions_shrink_without_manoeuvres(taught: EnsembleScores) -> None:
    plan = taught.sizes.plan(HORIZONS_S, 0.95)
    assert plan.calibrated.tolist() == [True, True, True, True, False]
    assert (plan.factor[1:3] < 0.2 * gaussian_factor(0.95)).all()
    assert taught.heard[0] > CALIBRATED
    assert taught.heard[-1] == 0.0


def test_calibrated_regions_have_their_nominal_containment(taught: EnsembleScores) -> None:
    """The truth is known here; what teaches is the bundle's own word."""
    inside = []
    plan = taught.sizes.plan(HORIZONS_S, 0.95)
    for number in range(100, 140):
        bundle = flown(100.0 + number % 7, number)
        ensemble = forecast(
            bundle.final_states(), HORIZONS_S, ensemble_scores.SETTINGS, bundle.manoeuvre_history
        )
        at_s = ensemble.time_s + HORIZONS_S
        truth = np.stack([SPEED_MPS * at_s, np.full(len(at_s), 1e4 * number)], axis=1)
        off = truth - ensemble.mean()[:, :2]
        spread = ensemble.spread()[:, :2, :2]
        square = np.einsum("ki,ki->k", off, np.linalg.solve(spread, off[..., None])[..., 0])
        inside.append(square <= plan.factor)
    # Of forty, and learnt from six aircraft: 95 % to 9 %.
    assert (np.mean(inside, axis=0)[:3] > 0.86).all()


def test_the_cost_of_samples_is_proportional_to_the_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    tracks = list(range(1, 30))
    first = EnsembleScores()
    assert [len(first.chosen(tracks, epoch, 1)) for epoch in range(EAGER_SAMPLES)] == (
        [EAGER_TRACKS] * EAGER_SAMPLES
    )
    assert len(first.chosen(tracks, 99, 1)) == 1
    monkeypatch.setattr(ensemble_scores, "EAGER_SAMPLES", 0)
    scores = EnsembleScores()
    assert len(scores.chosen(tracks, 1, 1)) == 1
    assert len(scores.chosen(tracks, 2, int(3 * PLOTS_EACH))) == 3
    assert len(scores.chosen(tracks, 3, int(100 * PLOTS_EACH))) == SAMPLE_TRACKS_MAX
    assert scores.chosen([], 4, 1000) == []
    assert scores.chosen([7], 5, 1000) == [7]
    counts = [
        len(EnsembleScores().chosen(tracks, epoch, int(2 * PLOTS_EACH))) for epoch in range(9)
    ]
    assert counts == [2] * 9
    drawn = {one for epoch in range(60) for one in EnsembleScores().chosen(tracks, epoch, 1)}
    assert len(drawn) > 15


def test_a_time_without_plots_around_it_is_not_evaluated() -> None:
    scores, random = EnsembleScores(), np.random.default_rng(3)
    bundle = flown(100.0)
    scores.make(0, bundle)
    last_s = bundle.window_s[1]
    # Silence from 5 to 35 s after the forecast: 10 and 30 s lie in it.
    for time_s in (last_s + 5.0, *(last_s + np.arange(35.0, 120.0, PLOT_EVERY_S)).tolist()):
        plot(bundle, 0, time_s, random)
    scores.evaluate(0, bundle, last_s + 120.0)
    scores.settle()
    assert scores.heard.tolist() == [0.0, 0.0, 1.0, 0.0, 0.0]
    assert scores.waiting == 2


def test_forecasts_of_a_track_without_updates_are_discarded() -> None:
    scores, bundle = EnsembleScores(), flown(100.0)
    scores.make(0, bundle)
    last_s = bundle.window_s[1]
    scores.evaluate(0, bundle, last_s + 80.0)
    # Those of 120 and 300 s may still come.
    assert scores.waiting == 2
    scores.discard(0)
    assert scores.waiting == 0


def test_a_terminated_track_evaluates_its_due_forecasts() -> None:
    scores, random = EnsembleScores(), np.random.default_rng(3)
    bundle = flown(100.0)
    scores.make(0, bundle)
    last_s = bundle.window_s[1]
    for time_s in (last_s + np.arange(PLOT_EVERY_S, 33.0, PLOT_EVERY_S)).tolist():
        plot(bundle, 0, time_s, random)
    assert last_s + 33.0 < last_s + HORIZONS_S[0] + ASKED_AFTER_S
    scores.evaluate(0, bundle, last_s + 33.0)
    scores.settle()
    assert scores.heard.tolist() == [0.0] * 5
    scores.evaluate(0, bundle, None)
    scores.settle()
    assert scores.heard.tolist() == [1.0, 1.0, 0.0, 0.0, 0.0]


def test_no_more_forecasts_wait_than_may(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ensemble_scores, "WAITING_MAX", 12)
    scores, bundle = EnsembleScores(), flown(100.0)
    for track_id in range(4):
        scores.make(track_id, bundle)
    assert scores.waiting == 2 * len(HORIZONS_S)


def test_the_order_of_the_tracks_leaves_no_trace() -> None:
    learnt = []
    for order in ((1, 2, 3), (3, 1, 2)):
        scores = EnsembleScores()
        bundles = {number: flown(100.0, number) for number in order}
        random = {number: np.random.default_rng(number + 50) for number in order}
        for number, bundle in bundles.items():
            scores.make(number, bundle)
        for number, bundle in bundles.items():
            for time_s in np.arange(100.0, 180.0, PLOT_EVERY_S).tolist():
                plot(bundle, number, time_s, random[number])
            scores.evaluate(number, bundle, 180.0)
        scores.settle()
        learnt.append(scores.sizes.shares)
    np.testing.assert_array_equal(learnt[0], learnt[1])
