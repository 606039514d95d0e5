"""Assignment of bundles, plots and biases to tracks, independent of the batches."""

from collections.abc import Sequence

import numpy as np
import pytest

from multiradar.runtime.trajectories.roster import DropBundle, Order, PushPlots, Roster, Sampled
from support.fakes.engine_outputs import Bias, End, Event, Sample, Update, output_of
from support.scenarios import live_scene

TABLE = live_scene.sensors()


def followed(
    outputs: Sequence[Sequence[Event]], room: int = 10
) -> dict[int, list[tuple[float, float] | str]]:
    """Time and bias of each plot of each bundle, in order, and `gone` where it is let go."""
    roster = Roster(room, TABLE)
    found: dict[int, list[tuple[float, float] | str]] = {}
    for events in outputs:
        for order in roster.push(output_of(events)):
            assert not isinstance(order, Sampled)
            own = found.setdefault(order.track_id, [])
            if isinstance(order, PushPlots):
                bias = float(order.published.estimate[0, 0])
                own += [(time_s, bias) for time_s in order.plots["time_s"].tolist()]
            else:
                assert isinstance(order, DropBundle)
                own.append("gone")
    return found


def times(found: list[tuple[float, float] | str]) -> list[float | str]:
    return [one if isinstance(one, str) else one[0] for one in found]


def test_a_bundle_starts_with_the_plot_that_confirms_its_track() -> None:
    events = [
        Update(1, 1.0, 7, False), Update(2, 2.0, 7, False), Update(3, 3.0, 7), Update(4, 4.0, 7),
        Update(5, 5.0, 8, False),
    ]  # fmt: skip
    assert times(followed([events])[7]) == [3.0, 4.0]
    assert 8 not in followed([events])
    # A track may be doubted again later; its plots are its plots.
    later = [Update(6, 6.0, 7, False)]
    assert times(followed([events, later])[7]) == [3.0, 4.0, 6.0]


def test_without_room_tracks_wait_and_the_lowest_number_is_next() -> None:
    events: list[Event] = [
        Update(1, 1.0, 4), Update(2, 2.0, 9), Update(3, 3.0, 6), Update(4, 4.0, 5),
        Update(5, 5.0, 9), End(6.0, 5), End(6.0, 4), Update(6, 6.0, 9), Update(7, 7.0, 6),
        End(8.0, 6), Update(8, 9.0, 9),
    ]  # fmt: skip
    found = followed([events], room=1)
    # 5 had ended while it waited; 6 is before 9, although 9 was confirmed first.
    assert found == {
        4: [(1.0, 0.0), "gone"], 6: [(7.0, 0.0), "gone"], 9: [(9.0, 0.0)],
    }  # fmt: skip


def test_the_queued_track_of_the_lowest_number_gets_the_free_bundle() -> None:
    tracks = (1, 7, 6, 8, 5)
    events: list[Event] = [Update(n, float(n), track) for n, track in enumerate(tracks, 1)]
    events += [End(9.0, 1), *(Update(n + 10, 10.0 + n, track) for n, track in enumerate(tracks))]
    assert set(followed([events[:-5], events[-4:]], room=1)) == {1, 5}


def test_biases_are_those_of_the_time_of_the_plot() -> None:
    events: list[Event] = [
        Update(1, 1.0, 1), Update(2, 3.5, 1), Bias(4.0, 10.0), Update(3, 4.0, 1),
        Update(4, 7.9, 1), Bias(8.0, 20.0), Bias(12.0, 30.0), Update(5, 8.5, 1),
        Update(6, 12.0, 1),
    ]  # fmt: skip
    expected = [(1.0, 0.0), (3.5, 0.0), (4.0, 10.0), (7.9, 10.0), (8.5, 20.0), (12.0, 30.0)]
    assert followed([events])[1] == expected
    assert followed([[event] for event in events])[1] == expected


def test_an_epoch_reopened_after_a_flush_uses_its_last_biases() -> None:
    # The stream was flushed at 2 s: the epoch's biases are published at its end, then once more.
    outputs: list[list[Event]] = [
        [Update(1, 1.0, 1), Bias(4.0, 10.0)], [Update(2, 2.5, 1)],
        [Bias(4.0, 12.0), Update(3, 4.5, 1)],
    ]  # fmt: skip
    assert followed(outputs)[1] == [(1.0, 0.0), (2.5, 0.0), (4.5, 12.0)]


def test_priors_are_known_before_anything_is_published() -> None:
    order = next(iter(Roster(1, TABLE).push(output_of([Update(1, 1.0, 1)]))))
    assert isinstance(order, PushPlots)
    sigma = order.published.sigma
    prior = sigma[TABLE.parameter_sensor, TABLE.parameter_kind]
    assert prior.tolist() == TABLE.prior_sigma.tolist()
    assert np.count_nonzero(sigma) == np.count_nonzero(TABLE.prior_sigma)


def test_repeated_output_is_skipped() -> None:
    """After a failure of the engine all output is repeated from the start."""
    first: list[Event] = [
        Update(1, 1.0, 1), Update(2, 2.0, 2), Bias(4.0, 10.0), End(4.0, 2), Update(3, 5.0, 1),
    ]  # fmt: skip
    again: list[list[Event]] = [first[:2], first[2:], [Update(4, 6.0, 1), Update(5, 6.5, 3)]]
    assert followed([first, *again]) == followed(again)


@pytest.mark.parametrize("room", [1, 2, 10])
def test_a_track_terminated_in_the_output_of_its_last_plot_is_dropped_after_it(room: int) -> None:
    events: list[Event] = [Update(1, 1.0, 1), Update(2, 2.0, 1), End(3.0, 1)]
    assert followed([events], room)[1] == [(1.0, 0.0), (2.0, 0.0), "gone"]


def served(outputs: Sequence[Sequence[Event]]) -> list[float | str]:
    """Times of plots, ends and samples in their order, those of plots of one order sorted."""
    roster, orders = Roster(10, TABLE), list[Order]()
    for events in outputs:
        orders += roster.push(output_of(events))
    found: list[float | str] = []
    for order in orders:
        if isinstance(order, PushPlots):
            found += order.plots["time_s"].tolist()
        else:
            found.append(f"epoch {order.epoch}" if isinstance(order, Sampled) else "gone")
    return found


def test_a_sample_is_between_the_plots_before_and_after_it_for_any_batches() -> None:
    events: list[Event] = [
        Update(1, 1.0, 1), Update(2, 7.5, 2), Sample(8.0, 1), Update(3, 8.0, 1), End(9.0, 2),
        Update(4, 15.0, 1), Sample(16.0, 3), Update(5, 17.0, 1),
    ]  # fmt: skip
    expected = [1.0, 7.5, "epoch 1", 8.0, "gone", 15.0, "epoch 3", 17.0]
    assert served([events]) == expected
    assert served([[event] for event in events]) == expected
    # All of it is repeated after a failure of the engine.
    assert served([events[:4], events]) == expected


def test_after_a_step_back_bundles_have_new_biases_and_samples() -> None:
    roster = Roster(10, TABLE)
    before: list[Event] = [
        Update(1, 100.0, 1), Bias(104.0, 10.0), Sample(104.0, 26), Bias(112.0, 20.0),
        Update(2, 105.0, 1), End(106.0, 1),
    ]  # fmt: skip
    after: list[Event] = [
        Update(3, 50.0, 2), Bias(52.0, 30.0), Sample(52.0, 13), Update(4, 53.0, 2),
    ]  # fmt: skip
    later: list[Event] = [Update(5, 113.0, 2), Bias(116.0, 40.0), Update(6, 117.0, 2)]

    def pushed(events: Sequence[Event]) -> list[tuple[float, float] | str]:
        found: list[tuple[float, float] | str] = []
        for order in roster.push(output_of(events)):
            if isinstance(order, PushPlots):
                bias = float(order.published.estimate[0, 0])
                found += [(time_s, bias) for time_s in order.plots["time_s"].tolist()]
            else:
                found.append(f"epoch {order.epoch}" if isinstance(order, Sampled) else "gone")
        return found

    assert pushed(before) == [(100.0, 0.0), "epoch 26", (105.0, 10.0), "gone"]
    roster.set_back()
    # A bias that was published for a later time is kept.
    expected: list[tuple[float, float] | str] = [(50.0, 20.0), "epoch 13", (53.0, 30.0)]
    assert pushed(after) == expected
    # After a failure of the engine all output is repeated, with the step.
    roster.restart()
    assert pushed(before) == []
    roster.set_back()
    assert pushed(after) == []
    # The bias of before the step is not published once its time is reached.
    assert pushed(later) == [(113.0, 30.0), (117.0, 40.0)]
