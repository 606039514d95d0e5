"""Every subscriber in another process gets every track update, in order, once."""

import os
import signal
import threading

import pytest

from multiradar.ingest.zenoh import joining
from support.processes.waiting import WAIT_TIMEOUT_S, join, pause, wait_until
from support.processes.zenoh_subscriber import SubscriberProcess
from support.scenarios.zenoh_scene import StreamingView, connections, gateway

# Longer gaps than these never come: a subscriber whose first query is held open queries again about
# once a second, until its own limit of 10 s ends that query.
_PATIENT = {
    "QUERY_GAP_S": 0.3, "QUERY_GAP_MAX_S": 0.6, "WAIT_MAX_S": WAIT_TIMEOUT_S,
    "ALLOWANCE_MAX_S": WAIT_TIMEOUT_S,
}  # fmt: skip


def complete(result: dict[str, int], expect: int) -> bool:
    wanted = {"distinct": expect, "greatest": expect, "twice": 0, "out_of_order": 0}
    return result == {**result, **wanted, "mismatched": 0}


def test_a_subscriber_that_was_there_gets_every_update_in_order() -> None:
    view = StreamingView()
    with gateway(view) as running, SubscriberProcess(running.endpoints[0], 5000) as subscriber:
        view.stream(5000, tracks=40, per_s=50_000)
        result = subscriber.result()
    assert complete(result, 5000), result
    assert result["keys"] == 40


def test_a_subscriber_that_joins_when_all_is_over_gets_every_update() -> None:
    view = StreamingView()
    with gateway(view) as running:
        view.stream(5000, tracks=40, per_s=50_000)
        with SubscriberProcess(running.endpoints[0], 5000) as subscriber:
            result = subscriber.result()
    assert complete(result, 5000), result


@pytest.mark.parametrize("detect", [True, False])
def test_a_subscriber_that_joins_while_updates_flow_gets_every_update(
    monkeypatch: pytest.MonkeyPatch, detect: bool
) -> None:
    # The service waits for a time, not for a subscriber; beside other work these take long.
    for name, limit_s in _PATIENT.items():
        monkeypatch.setattr(joining, name, limit_s)
    view = StreamingView()
    before, count = 15_000, 35_000
    with gateway(view) as running:
        # Sending the history takes longer than the interval of track updates.
        view.stream(before, tracks=150, per_s=100_000)
        joined = threading.Event()
        flow = threading.Thread(target=view.stream, args=(count - before, 150, 12_000.0, joined))
        flow.start()
        with (
            SubscriberProcess(running.endpoints[0], count, detect=detect) as first,
            SubscriberProcess(running.endpoints[0], count, detect=detect) as second,
        ):
            assert flow.is_alive()
            joined.set()
            results = [first.result(), second.result()]
        join(flow)
    assert all(complete(result, count) for result in results), results


@pytest.mark.slow
def test_a_subscriber_that_sleeps_gets_every_update_also_of_tracks_that_began_meanwhile() -> None:
    view = StreamingView()
    rounds, tracks_a_round, repeats = 60, 10, 30
    count = rounds * tracks_a_round * repeats
    with (
        gateway(view) as running,
        SubscriberProcess(running.endpoints[0], count, sleep_at=100) as asleep,
        SubscriberProcess(running.endpoints[0], count) as awake,
    ):
        for number in range(rounds):
            # Enough to fill the network buffers of the sleeping subscriber.
            tracks = range(1 + number * tracks_a_round, 1 + (number + 1) * tracks_a_round)
            view.publish_updates(list(tracks) * repeats, padding=900)
            pause(0.03)
        asleep.wake()
        of_awake, of_asleep = awake.result(), asleep.result()
    assert complete(of_awake, count), of_awake
    assert complete(of_asleep, count), of_asleep


@pytest.mark.slow
def test_a_stopped_subscriber_delays_no_other_and_catches_up() -> None:
    view = StreamingView()
    count = 30_000
    with (
        gateway(view) as running,
        SubscriberProcess(running.endpoints[0], count) as stopped,
        SubscriberProcess(running.endpoints[0], count) as other,
    ):
        os.kill(stopped.process.pid, signal.SIGSTOP)
        view.stream(count, tracks=100, per_s=15_000)
        # The other has everything although the first does not read.
        of_other = other.result()
        os.kill(stopped.process.pid, signal.SIGCONT)
        of_stopped = stopped.result()
    assert complete(of_other, count), of_other
    assert complete(of_stopped, count), of_stopped


def test_a_reconnected_subscriber_also_gets_the_tracks_initiated_meanwhile() -> None:
    view = StreamingView()
    # A track more in each round, all of them updated again and again.
    rounds, repeats = 30, 10
    count = repeats * rounds * (rounds + 1) // 2
    with (
        gateway(view) as running,
        # The service receives nothing from it for this time, and closes the connection.
        SubscriberProcess(running.endpoints[0], count, lease_ms=1000) as stopped,
        SubscriberProcess(running.endpoints[0], count) as other,
    ):
        for number in range(1, rounds + 1):
            if number == 6:
                os.kill(stopped.process.pid, signal.SIGSTOP)
                wait_until(lambda: connections(running) == 1, "the connection to be closed")
            if number == 21:
                os.kill(stopped.process.pid, signal.SIGCONT)
            for _ in range(repeats):
                view.publish_updates(list(range(1, number + 1)))
                pause(0.001)
        of_other, of_stopped = other.result(), stopped.result()
    assert complete(of_other, count), of_other
    assert complete(of_stopped, count), of_stopped
