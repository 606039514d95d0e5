"""Plots that wait for their bundles: each track in its turn, and never more than may wait."""

import numpy as np

from multiradar.runtime.trajectories.plots import PLOT_DTYPE, Published
from multiradar.runtime.trajectories.roster import Take
from multiradar.runtime.trajectories.waiting import WaitingPlots

NOTHING = Published(np.zeros((1, 4)), np.zeros((1, 4)))


def take(track_id: int, first_s: float, count: int) -> Take:
    plots = np.zeros(count, PLOT_DTYPE)
    plots["time_s"] = first_s + np.arange(count)
    return Take(track_id, plots, NOTHING)


def drained(waiting: WaitingPlots) -> list[tuple[int, bool, list[float]]]:
    found = []
    while (following := waiting.take()) is not None:
        times = following.plots["time_s"].tolist()
        found.append((following.track_id, following.anew, times))
    return found


def test_tracks_are_served_in_turn_and_each_in_order() -> None:
    waiting = WaitingPlots(100)
    for one in (take(1, 0.0, 2), take(1, 2.0, 1), take(2, 5.0, 1), take(1, 3.0, 1)):
        waiting.put(one)
    assert waiting.count == 5
    assert drained(waiting) == [
        (1, False, [0.0, 1.0]), (2, False, [5.0]), (1, False, [2.0]), (1, False, [3.0]),
    ]  # fmt: skip
    assert waiting.count == 0


def test_a_track_that_has_ended_is_forgotten() -> None:
    waiting = WaitingPlots(100)
    waiting.put(take(1, 0.0, 3))
    waiting.put(take(2, 0.0, 1))
    waiting.drop(1)
    waiting.drop(7)
    assert waiting.count == 1
    assert drained(waiting) == [(2, False, [0.0])]


def test_without_room_the_longest_queue_is_lost_and_begins_anew() -> None:
    waiting = WaitingPlots(5)
    waiting.put(take(1, 0.0, 3))
    waiting.put(take(2, 0.0, 2))
    assert not waiting.fits(take(2, 2.0, 1))
    waiting.put(take(2, 2.0, 1))
    assert (waiting.count, waiting.lost) == (3, 3)
    waiting.put(take(1, 9.0, 1))
    # The plots of track 1 are not those that follow the ones it had.
    assert drained(waiting) == [(2, False, [0.0, 1.0]), (1, True, [9.0]), (2, False, [2.0])]
    waiting.put(take(1, 10.0, 1))
    assert drained(waiting) == [(1, False, [10.0])]


def test_what_was_served_or_forgotten_makes_no_queue_longer() -> None:
    waiting = WaitingPlots(6)
    for one in (take(1, 0.0, 3), take(1, 3.0, 1), take(2, 0.0, 2)):
        waiting.put(one)
    assert waiting.take() is not None
    # One plot of track 1 is left, two of track 2.
    waiting.put(take(3, 0.0, 4))
    assert (waiting.count, waiting.lost) == (3, 4)
    waiting.drop(2)
    waiting.put(take(2, 5.0, 2))
    waiting.put(take(4, 0.0, 3))
    waiting.put(take(1, 4.0, 1))
    assert (waiting.count, waiting.lost) == (4, 7)
    assert [track_id for track_id, _, _ in drained(waiting)] == [1, 2, 1]


def test_more_than_may_wait_at_all_is_lost() -> None:
    waiting = WaitingPlots(5)
    assert waiting.fits(take(1, 0.0, 6))
    waiting.put(take(1, 0.0, 6))
    assert (waiting.count, waiting.lost) == (0, 6)
