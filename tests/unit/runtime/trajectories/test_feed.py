"""Bundles in a service: in a separate thread, which the engine waits for only in a replay."""

import math
import threading
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import pytest

from multiradar.errors import TrajectoryError
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.publication import Publication
from multiradar.runtime.queries.registry import TRAJECTORIES
from multiradar.runtime.trajectories.feed import ROUND_PLOTS, TrajectoryFeed
from multiradar.runtime.trajectories.options import TrajectoryOptions
from multiradar.runtime.trajectories.waiting import NextPlots
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch
from support.fakes.engine_outputs import End, Update, output_of
from support.processes.waiting import WAIT_TIMEOUT_S, join, wait_until
from support.scenarios import live_scene
from support.scenarios.trajectory_scene import (
    JAMMED,
    PLANE,
    REPORTING,
    TABLE,
    TURN_MPS2,
    TURNING,
    flown,
    recording,
)

TRACKING = TrackingSettings(reorder_horizon_s=0.0)


@pytest.fixture(scope="module")
def outputs() -> list[EngineOutput]:
    """The output of the engine for the scenario, including its end."""
    engine = Engine(TABLE, TRACKING)
    parts = [engine.push(measurement_batch(part, TABLE)[0]) for part in recording().iter_slices(20)]
    return [*parts, engine.flush()]


class Feeds:
    """Feeds that are stopped at the end."""

    def __init__(self) -> None:
        self.open: list[TrajectoryFeed] = []

    def make(
        self, aircraft_max: int = 10, plots_waiting_max: int = 1000, lag_max_s: float = math.inf,
        workers: int = 1,
    ) -> TrajectoryFeed:  # fmt: skip
        options = TrajectoryOptions(
            aircraft_max, plots_waiting_max, lag_max_s=lag_max_s, workers=workers
        )
        feed = TrajectoryFeed(options, TABLE, TRACKING)
        self.open.append(feed)
        return feed


@pytest.fixture
def feeds() -> Iterator[Feeds]:
    found = Feeds()
    yield found
    for feed in found.open:
        feed.stop()


def followed(feed: TrajectoryFeed, outputs: Sequence[EngineOutput]) -> TrajectoryFeed:
    feed.start()
    feed.go_live()
    for output in outputs:
        feed.put(output)
    assert feed.settle(WAIT_TIMEOUT_S)
    return feed


def playing(feed: TrajectoryFeed, outputs: Iterable[EngineOutput]) -> threading.Thread:
    def play() -> None:
        for output in outputs:
            feed.put(output)

    player = threading.Thread(target=play, daemon=True)
    player.start()
    return player


def code_of(feed: TrajectoryFeed, track_id: int) -> str:
    with pytest.raises(TrajectoryError) as error:
        feed.read(track_id)
    return error.value.code


def test_bundles_follow_their_aircraft(feeds: Feeds, outputs: list[EngineOutput]) -> None:
    feed = followed(feeds.make(), outputs)
    for track in (TURNING, REPORTING):
        now = feed.read(track).bundle.estimate()
        since = np.array([now.time_s - live_scene.START_S])
        east, north = flown(track, since)
        true = feed.plane.to_plane(*PLANE.to_geodetic(east, north))
        assert np.hypot(now.state[0] - true[0][0], now.state[1] - true[1][0]) < 100.0
    best = feed.read(TURNING).bundle.trajectories()[0]
    assert best.kinds[-1] == "right"
    # Of a turn of 40 s, with plots that are off by 110 m.
    assert best.controls.lateral_mps2[-1] == pytest.approx(TURN_MPS2, abs=0.8)
    counts = feed.counts()
    assert counts["aircraft"] == 4
    assert counts["plots_refused"] == {"BEARING": 20}
    plots = sum(len(output.plots) for output in outputs)
    # Each track had a tentative plot or two before it was confirmed.
    assert 0 <= plots - counts["plots_taken"] - 20 <= 8
    assert (counts["plots_waiting"], counts["plots_lost"], counts["failure"]) == (0, 0, None)


def test_a_track_without_bundle_has_a_reason(feeds: Feeds, outputs: list[EngineOutput]) -> None:
    feed = followed(feeds.make(aircraft_max=1), outputs)
    assert len(feed.read(TURNING).bundle) > 0
    assert code_of(feed, JAMMED) == "NO_ROOM"
    assert code_of(feed, 99) == "NOT_CONFIRMED"
    assert feed.counts()["aircraft_waiting"] == 3
    idle = feeds.make()
    idle.put(output_of([Update(1, 1.0, 1)]))
    assert code_of(idle, 1) == "TOO_FEW_PLOTS"


def test_a_track_that_ends_lets_go_and_another_has_its_room(
    feeds: Feeds, outputs: list[EngineOutput]
) -> None:
    last = int(outputs[-2].updates.sequence[-1])
    end_s = float(outputs[-2].updates.time_s[-1]) + 1.0
    ended = output_of([End(end_s, TURNING), Update(last + 1, end_s + 1.0, JAMMED)])
    feed = followed(feeds.make(aircraft_max=1), [*outputs, ended])
    assert code_of(feed, TURNING) == "NOT_CONFIRMED"
    # The queued track of the lowest number gets the bundle; the others stay queued.
    assert feed.counts()["aircraft"] == 1
    assert code_of(feed, JAMMED) == "NO_ROOM"


@pytest.mark.slow
def test_repeated_output_after_a_failure_of_the_engine_changes_nothing(
    feeds: Feeds, outputs: list[EngineOutput]
) -> None:
    once = followed(feeds.make(), outputs)
    again = followed(feeds.make(), outputs[:4])
    again.restart()
    for output in outputs:
        again.put(output)
    assert again.settle(WAIT_TIMEOUT_S)
    assert again.counts() == once.counts()
    for track in (TURNING, REPORTING):
        states = [feed.read(track).bundle.estimate().state.tolist() for feed in (once, again)]
        assert states[0] == states[1]


def test_a_running_service_never_waits_for_bundles(
    feeds: Feeds, outputs: list[EngineOutput]
) -> None:
    """Without the thread, and with a queue of ten plots, all output is queued at once."""
    feed = feeds.make(plots_waiting_max=10)
    feed.go_live()
    for output in outputs:
        feed.put(output)
    counts = feed.counts()
    assert counts["plots_waiting"] <= 10
    assert counts["plots_lost"] > 100


def test_live_bundles_lag_behind_the_tracks_by_a_bounded_time(
    feeds: Feeds, outputs: list[EngineOutput]
) -> None:
    """Without the thread, plots are never processed: those beyond the bound are skipped."""
    feed = feeds.make(lag_max_s=10.0)
    feed.go_live()
    for output in outputs:
        feed.put(output)
        assert feed.counts()["lag_s"] <= 10.0
    counts = feed.counts()
    assert counts["plots_late"] > 100
    assert (counts["plots_lost"], counts["late_share"]) == (0, 1.0)
    feed.start()
    assert feed.settle(WAIT_TIMEOUT_S)
    counts = feed.counts()
    late, taken = (
        counts["plots_late"],
        counts["plots_taken"] + sum(counts["plots_refused"].values()),
    )
    assert counts["late_share"] == late / (late + taken)
    assert counts["lag_s"] == 0.0


def test_processed_plots_leave_the_queue(
    feeds: Feeds, outputs: list[EngineOutput], monkeypatch: pytest.MonkeyPatch
) -> None:
    feed = feeds.make(workers=2)
    push, rounds = feed._pool.push_all, []

    def watched(batches: Sequence[NextPlots]) -> None:
        # Popped plots are still counted while they are processed.
        rounds.append((feed._in_hand, sum(len(one.plots) for one in batches)))
        push(batches)

    monkeypatch.setattr(feed._pool, "push_all", watched)
    feed.go_live()
    for output in outputs:
        feed.put(output)
    waited = feed.counts()["plots_waiting"]
    feed.start()
    assert feed.settle(WAIT_TIMEOUT_S)
    assert sum(plots for _, plots in rounds) == waited
    assert all(in_hand == plots <= 2 * ROUND_PLOTS for in_hand, plots in rounds)
    assert feed.counts()["plots_waiting"] == 0


def test_after_a_loss_a_bundle_is_reinitialised(feeds: Feeds, outputs: list[EngineOutput]) -> None:
    feed = feeds.make(plots_waiting_max=30)
    feed.go_live()
    for output in outputs[:4]:
        feed.put(output)
    assert feed.counts()["plots_lost"] > 0
    feed.start()
    for output in outputs[4:]:
        feed.put(output)
        assert feed.settle(WAIT_TIMEOUT_S)
    # The reporting aircraft has plots enough since.
    assert feed.read(REPORTING).bundle.window_s[0] > live_scene.START_S + 20.0


def test_during_the_replay_the_engine_waits_for_the_queue(
    feeds: Feeds, outputs: list[EngineOutput]
) -> None:
    feed = feeds.make(plots_waiting_max=25)
    waiting: list[int] = []

    def watched() -> Iterator[EngineOutput]:
        for output in outputs:
            waiting.append(feed.counts()["plots_waiting"])
            yield output

    player = playing(feed, watched())
    wait_until(lambda: feed.counts()["plots_waiting"] > 5, "plots that wait")
    before = list(waiting)
    feed.start()
    join(player)
    assert feed.settle(WAIT_TIMEOUT_S)
    assert max(before) <= 25
    assert len(before) < len(outputs)
    assert feed.counts()["plots_lost"] == 0
    assert len(feed.read(TURNING).bundle) > 0


def test_a_service_that_stops_while_the_journal_is_played_lets_the_engine_go(
    feeds: Feeds, outputs: list[EngineOutput]
) -> None:
    feed = feeds.make(plots_waiting_max=25)
    player = playing(feed, outputs)
    feed.stop()
    join(player)


def test_waiting_for_bundles_fails_when_the_service_has_stopped(
    feeds: Feeds, outputs: list[EngineOutput]
) -> None:
    """Once it waited for ever for plots that were no longer processed."""
    feed = feeds.make()
    feed.go_live()
    for output in outputs:
        feed.put(output)
    errors: list[BaseException] = []

    def wait() -> None:
        try:
            feed.settle()
        except TrajectoryError as error:
            errors.append(error)

    waiter = threading.Thread(target=wait, daemon=True)
    waiter.start()
    feed.stop()
    join(waiter)
    with pytest.raises(TrajectoryError, match="the trajectory service has stopped"):
        feed.settle(WAIT_TIMEOUT_S)
    assert [str(error) for error in errors] == ["the trajectory service has stopped; see the log"]
    idle = feeds.make()
    idle.stop()
    assert idle.settle(WAIT_TIMEOUT_S)


def test_a_bug_stops_the_bundles_and_not_the_engine(
    feeds: Feeds, outputs: list[EngineOutput], caplog: pytest.LogCaptureFixture
) -> None:
    feed = followed(feeds.make(), outputs[:3])
    broken = output_of([Update(10**6, 1e12, 1)])
    object.__setattr__(broken.updates, "state", np.zeros(7, np.int8))
    feed.put(broken)
    feed.put(outputs[4])
    assert "trajectory service stopped" in caplog.text
    assert code_of(feed, TURNING) == "FAILED"
    assert feed.counts()["failure"] is not None


def test_a_service_without_bundles_says_so(outputs: list[EngineOutput]) -> None:
    publication = Publication(TABLE, TRACKING, RuntimeLimits())
    view = publication.view
    for output in outputs:
        publication.publish(output, None)
    with pytest.raises(TrajectoryError) as error:
        view.ask(TRAJECTORIES, TURNING, points=10, step_s=1)
    assert error.value.code == "TRAJECTORIES_OFF"
    assert view.ask(TRAJECTORIES, 99, points=10, step_s=1) is None


def test_a_coasting_track_is_marked(feeds: Feeds, outputs: list[EngineOutput]) -> None:
    publication, feed = Publication(TABLE, TRACKING, RuntimeLimits()), feeds.make()
    view = publication.view
    publication.keep(feed)
    feed.start()
    for output in outputs:
        publication.publish(output, live_scene.START_S + 100.0 + TRACKING.coast_after_s + 5.0)
    assert feed.settle(WAIT_TIMEOUT_S)
    answer = view.ask(TRAJECTORIES, TURNING, points=0, step_s=1)
    assert answer is not None
    assert answer["state"] == "coasting"
    assert answer["age_s"] > TRACKING.coast_after_s
    assert answer["time_s"] + answer["age_s"] == live_scene.START_S + 105.0 + TRACKING.coast_after_s
    assert view.status()["trajectories"]["aircraft"] == 4
