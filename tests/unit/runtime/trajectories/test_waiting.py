"""Plots that wait for their bundles: in the order of the engine, and no more than may wait."""

import numpy as np

from multiradar.runtime.trajectories.plots import PLOT_DTYPE, Published
from multiradar.runtime.trajectories.roster import DropBundle, PushPlots, Sampled
from multiradar.runtime.trajectories.waiting import SLICE_PLOTS, WaitingPlots

NOTHING = Published(np.zeros((1, 4)), np.zeros((1, 4)))


def plots_of(track_id: int, first_s: float, count: int) -> PushPlots:
    plots = np.zeros(count, PLOT_DTYPE)
    plots["time_s"] = first_s + np.arange(count)
    return PushPlots(track_id, plots, NOTHING)


def drained(
    waiting: WaitingPlots,
) -> list[tuple[int, bool, list[float]] | DropBundle | Sampled]:
    """Return all operations, one at a time."""
    found: list[tuple[int, bool, list[float]] | DropBundle | Sampled] = []
    while (following := waiting.pop(SLICE_PLOTS)) is not None:
        found += read(following) if isinstance(following, list) else [following]
    assert len(waiting) == waiting.count == 0
    return found


def read(plots: object) -> list[tuple[int, bool, list[float]]]:
    assert isinstance(plots, list)
    return [(one.track_id, one.restart, one.plots["time_s"].tolist()) for one in plots]


def test_operations_are_popped_in_order() -> None:
    """Or what is learnt at a sample would depend on how far other tracks are."""
    waiting = WaitingPlots(100)
    for one in (
        plots_of(1, 0.0, 2), plots_of(2, 5.0, 1), Sampled(3, 8.0), plots_of(1, 3.0, 1),
        DropBundle(1), Sampled(4, 16.0),
    ):  # fmt: skip
        waiting.put(one)
    assert (waiting.count, len(waiting)) == (4, 6)
    assert drained(waiting) == [
        (1, False, [0.0, 1.0]), (2, False, [5.0]), Sampled(3, 8.0), (1, False, [3.0]),
        DropBundle(1),
        Sampled(4, 16.0),
    ]  # fmt: skip


def test_a_round_has_each_track_once_and_ends_before_other_operations() -> None:
    waiting = WaitingPlots(100)
    for one in (
        plots_of(1, 0.0, 5), plots_of(2, 5.0, 1), plots_of(3, 5.0, 1), plots_of(1, 9.0, 1),
        plots_of(4, 9.0, 1), Sampled(3, 9.5), plots_of(5, 10.0, 1),
    ):  # fmt: skip
        waiting.put(one)
    # At most two plots of a track, so that the others need not wait for it.
    first = read(waiting.pop(100))
    assert first == [(1, False, [0.0, 1.0]), (2, False, [5.0]), (3, False, [5.0])]
    assert (waiting.count, waiting.oldest_s) == (6, 2.0)
    assert read(waiting.pop(1)) == [(1, False, [2.0])]
    assert read(waiting.pop(100)) == [(1, False, [3.0, 4.0])]
    assert read(waiting.pop(100)) == [(1, False, [9.0]), (4, False, [9.0])]
    assert waiting.pop(100) == Sampled(3, 9.5)
    assert read(waiting.pop(100)) == [(5, False, [10.0])]
    assert waiting.pop(100) is None


def test_plots_lost_after_a_part_of_their_operation_restart_the_bundle() -> None:
    waiting = WaitingPlots(6)
    waiting.put(plots_of(1, 0.0, 5))
    assert read(waiting.pop(2)) == [(1, False, [0.0, 1.0])]
    waiting.put(plots_of(2, 0.0, 2))
    waiting.put(plots_of(3, 0.0, 2))
    assert (waiting.count, waiting.lost) == (4, 3)
    waiting.put(plots_of(1, 5.0, 1))
    assert drained(waiting)[-1] == (1, True, [5.0])


def test_a_track_ends_although_its_plots_were_lost() -> None:
    """Its bundle would stay for ever."""
    waiting = WaitingPlots(3)
    for one in (plots_of(1, 0.0, 3), DropBundle(1), plots_of(2, 0.0, 2)):
        waiting.put(one)
    assert waiting.lost == 3
    assert drained(waiting) == [DropBundle(1), (2, False, [0.0, 1.0])]


def test_samples_without_plots_are_bounded_too() -> None:
    waiting = WaitingPlots(3)
    samples = [Sampled(epoch, 4.0 * epoch) for epoch in range(5)]
    for number, sample in enumerate(samples):
        assert waiting.fits(sample) == (number < 3)
        waiting.put(sample)
    assert waiting.lost == 0
    assert drained(waiting) == samples[2:]


def test_a_full_queue_loses_the_most_queued_track_which_restarts() -> None:
    waiting = WaitingPlots(5)
    waiting.put(plots_of(1, 0.0, 3))
    waiting.put(plots_of(2, 0.0, 2))
    assert not waiting.fits(plots_of(2, 2.0, 1))
    waiting.put(plots_of(2, 2.0, 1))
    assert (waiting.count, waiting.lost) == (3, 3)
    waiting.put(plots_of(1, 9.0, 1))
    # The plots of track 1 are not those that follow the ones it had.
    assert drained(waiting) == [(2, False, [0.0, 1.0]), (2, False, [2.0]), (1, True, [9.0])]
    waiting.put(plots_of(1, 10.0, 1))
    assert drained(waiting) == [(1, False, [10.0])]


def test_popped_or_discarded_plots_do_not_count() -> None:
    waiting = WaitingPlots(6)
    for one in (plots_of(1, 0.0, 3), plots_of(1, 3.0, 1), plots_of(2, 0.0, 2)):
        waiting.put(one)
    assert waiting.pop(2) is not None
    assert waiting.pop(1) is not None
    # One plot of track 1 is left, two of track 2.
    waiting.put(plots_of(3, 0.0, 4))
    assert (waiting.count, waiting.lost) == (3, 4)
    assert read(waiting.pop(1)) == [(1, False, [3.0])]
    waiting.put(plots_of(4, 0.0, 3))
    waiting.put(plots_of(1, 4.0, 3))
    # Two of track 2 are left, three of 4 and of 1: of equals the lower number is lost.
    assert (waiting.count, waiting.lost) == (5, 7)
    assert drained(waiting) == [(2, False, [0.0, 1.0]), (4, False, [0.0, 1.0]), (4, False, [2.0])]


def test_plots_beyond_the_maximum_are_lost() -> None:
    waiting = WaitingPlots(5)
    assert waiting.fits(plots_of(1, 0.0, 6))
    waiting.put(plots_of(1, 0.0, 6))
    assert (waiting.count, waiting.lost) == (0, 6)


def test_plots_that_have_waited_too_long_are_skipped_and_nothing_else() -> None:
    waiting = WaitingPlots(100)
    for one in (
        plots_of(1, 0.0, 2), Sampled(3, 8.0), plots_of(2, 5.0, 3), DropBundle(2),
        plots_of(1, 9.0, 2), plots_of(3, 4.0, 1),
    ):  # fmt: skip
        waiting.put(one)
    waiting.skip_before(8.0)
    assert (waiting.late, waiting.lost, waiting.count) == (5, 0, 3)
    assert waiting.oldest_s == 9.0
    # The bundle of the first track continues, with fewer plots.
    assert drained(waiting) == [
        Sampled(3, 8.0), DropBundle(2), (1, False, [9.0, 10.0]), (3, False, [4.0]),
    ]  # fmt: skip
    assert waiting.oldest_s == np.inf
