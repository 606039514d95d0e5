"""Numbered events: encoded once, resumed by number, lost only with a notice."""

import json
import threading
from collections.abc import Sequence

import pytest

from multiradar.runtime.stream.events import (
    BIAS,
    GAP,
    TRACK,
    Encode,
    Event,
    EventRing,
    EventTable,
    Subscription,
)
from support.processes.waiting import WAIT_TIMEOUT_S, join


def _events(first: int) -> Encode:
    return lambda begin, end: [
        Event(n, TRACK, str(n), b"{}") for n in range(first + begin, first + end)
    ]


def _fill(ring: EventRing, *counts: int) -> None:
    for count in counts:
        ring.append(count, _events(ring.head + 1))


def _numbers(events: Sequence[Event]) -> list[int]:
    return [event.sequence for event in events]


def _drain(subscription: Subscription, at_once: int = 3) -> list[Event]:
    found: list[Event] = []
    while part := subscription.poll(at_once):
        assert len(part) <= at_once
        found += part
    return found


def test_a_reader_gets_every_event_in_order_with_any_batch_size() -> None:
    for at_once in (1, 2, 3, 100):
        ring = EventRing(100)
        subscription = ring.subscribe(None, 100)
        _fill(ring, 1, 5, 3)
        assert _numbers(_drain(subscription, at_once)) == list(range(1, 10))
        _fill(ring, 2)
        assert _numbers(_drain(subscription, at_once)) == [10, 11]


def test_events_of_before_are_those_at_the_first_lead() -> None:
    ring = EventRing(100)
    _fill(ring, 4)
    assert ring.sent_before == 0
    ring.lead()
    _fill(ring, 2)
    # The engine is rebuilt.
    ring.lead()
    assert ring.sent_before == 4


def test_a_reader_without_a_number_starts_with_new_events() -> None:
    ring = EventRing(100)
    _fill(ring, 4)
    subscription = ring.subscribe(None, 100)
    assert subscription.poll(10) == []
    _fill(ring, 1)
    assert _numbers(subscription.poll(10)) == [5]


def test_a_reader_resumes_after_its_number() -> None:
    ring = EventRing(100)
    _fill(ring, 4, 4)
    assert _numbers(_drain(ring.subscribe(0, 100))) == list(range(1, 9))
    assert _numbers(_drain(ring.subscribe(6, 100))) == [7, 8]
    assert _drain(ring.subscribe(8, 100)) == []


def test_a_reader_gets_a_notice_of_events_lost_from_the_ring() -> None:
    ring = EventRing(10)
    _fill(ring, 4, 4, 4, 4)
    found = _drain(ring.subscribe(2, 100))
    assert found[0].kind == GAP
    assert json.loads(found[0].payload) == {"gap": {"from": 3, "to": 4}}
    assert found[0].sequence == 4
    assert _numbers(found[1:]) == list(range(5, 17))


def test_the_ring_keeps_its_bound_of_events_and_less_than_a_chunk_more() -> None:
    ring = EventRing(10)
    for _ in range(50):
        _fill(ring, 4)
        assert len(_drain(ring.subscribe(0, 1000))) <= 10 + 4
    assert sum(chunk.count for chunk in ring.after(0, 1000, 1000)[1]) == 12


@pytest.mark.fault(33)
def test_a_reader_behind_its_depth_gets_a_gap_not_a_backlog() -> None:
    ring = EventRing(100)
    subscription = ring.subscribe(0, 5)
    _fill(ring, 20)
    found = _drain(subscription)
    assert json.loads(found[0].payload) == {"gap": {"from": 1, "to": 15}}
    assert _numbers(found[1:]) == [16, 17, 18, 19, 20]
    assert subscription.lost == 15


def test_a_number_of_another_journal_is_answered_with_a_gap() -> None:
    ring = EventRing(100)
    _fill(ring, 3)
    subscription = ring.subscribe(1000, 100)
    assert [json.loads(event.payload) for event in _drain(subscription)] == [
        {"gap": {"from": 1, "to": 3}}
    ]
    _fill(ring, 1)
    assert _numbers(_drain(subscription)) == [4]


def test_events_are_encoded_once_and_only_when_read() -> None:
    ring, encoded = EventRing(100), []

    def encode(_begin: int, _end: int) -> list[Event]:
        encoded.append(ring.head)
        return [Event(1, TRACK, "1", b"{}")]

    ring.append(1, encode)
    assert encoded == []
    first, second = ring.subscribe(0, 10), ring.subscribe(0, 10)
    assert first.poll(1)[0].payload is second.poll_table(1).payloads[0]
    assert encoded == [1]


def test_columns_are_those_of_the_events() -> None:
    ring = EventRing(3)
    _fill(ring, 3)
    ring.append(
        3,
        lambda _begin, _end: [
            Event(one, BIAS if one == 5 else TRACK, "9", b"{}") for one in (4, 5, 6)
        ],
    )
    events, table = ring.subscribe(1, 9).poll(9), ring.subscribe(1, 9).poll_table(9)
    # Two of the first chunk are lost with it.
    assert [one.kind for one in events] == [GAP, TRACK, BIAS, TRACK]
    assert list(table) == events == list(EventTable.of(events))
    assert (table[1], table[1:]) == (events[1], events[1:])
    assert list(table.of_kinds({BIAS, GAP})) == [events[0], events[2]]
    assert table.of_kinds({BIAS, TRACK, GAP}) is table
    assert list(ring.subscribe(3, 9).poll_table(2)) == events[1:3]


def test_each_sleep_has_one_wake_up() -> None:
    ring, woken = EventRing(100), []
    subscription = ring.subscribe(None, 100)
    subscription.set_wakeup(lambda: woken.append(ring.head))
    _fill(ring, 1, 1, 1)
    assert woken == [1]
    assert _numbers(_drain(subscription)) == [1, 2, 3]
    _fill(ring, 1)
    assert woken == [1, 4]


def test_a_reader_with_pending_events_is_woken_at_once() -> None:
    ring, woken = EventRing(100), []
    _fill(ring, 2)
    subscription = ring.subscribe(0, 100)
    subscription.set_wakeup(lambda: woken.append(1))
    assert woken == [1]


def test_a_reader_whose_wake_up_fails_is_closed_and_the_others_are_woken() -> None:
    ring, woken = EventRing(100), []
    bad, good = ring.subscribe(None, 100), ring.subscribe(None, 100)

    def fail() -> None:
        raise RuntimeError("Event loop is closed")

    bad.set_wakeup(fail)
    good.set_wakeup(lambda: woken.append(1))
    _fill(ring, 1)
    assert bad.closed
    assert bad.poll(10) == []
    assert woken == [1]
    assert ring.subscriber_count == 1


def test_a_closed_reader_costs_nothing() -> None:
    ring, woken = EventRing(100), []
    subscription = ring.subscribe(None, 100)
    subscription.set_wakeup(lambda: woken.append(1))
    subscription.close()
    subscription.close()
    _fill(ring, 1)
    assert woken == []
    assert subscription.poll(10) == []
    assert ring.subscriber_count == 0


def test_readers_wait_for_their_numbers_while_the_journal_is_played_again() -> None:
    ring = EventRing(100)
    subscription = ring.subscribe(None, 100)
    _fill(ring, 5)
    assert _numbers(_drain(subscription)) == [1, 2, 3, 4, 5]
    ring.clear()
    _fill(ring, 3)
    assert _drain(subscription) == []
    _fill(ring, 4)
    assert _numbers(_drain(subscription)) == [6, 7]


def test_a_reader_skips_what_it_has_and_nothing_else() -> None:
    ring = EventRing(100)
    _fill(ring, 3)
    subscription, astray = ring.subscribe(0, 100), ring.subscribe(1000, 100)
    assert subscription.skip(1, 2)
    assert not subscription.skip(1, 2)
    assert not subscription.skip(4, 4)
    assert _numbers(_drain(subscription)) == [3]
    # It must have its notice first.
    assert not astray.skip(4, 4)
    assert [one.kind for one in _drain(astray)] == [GAP]
    subscription.close()
    assert not subscription.skip(4, 4)


@pytest.mark.parametrize("is_standby", [False, True])
def test_readers_wait_for_the_end_of_a_replay(is_standby: bool) -> None:
    """Clients reconnect at once after a restart, before the journal is replayed."""
    ring = EventRing(100)
    ring.follow()
    known, ahead, new = (ring.subscribe(after, 100) for after in (4, 9, None))
    woken: list[int] = []
    new.set_wakeup(lambda: woken.append(1))
    assert (known.waiting, new.waiting) == (False, True)
    assert [_drain(one) for one in (known, ahead, new)] == [[], [], []]
    _fill(ring, 3, 3)
    assert (_numbers(_drain(known)), _drain(ahead), _drain(new)) == ([5, 6], [], [])
    assert new.is_idle()
    woken.clear()
    ring.settle() if is_standby else ring.lead()
    assert (woken, new.waiting, new.after) == ([1], False, 6)
    late = ring.subscribe(None, 100)
    assert (_drain(new), _drain(late)) == ([], [])
    _fill(ring, 1)
    assert [_numbers(_drain(one)) for one in (known, new, late)] == [[7], [7], [7]]
    # Only a number that the journal does not reach is from another one.
    assert [one.kind for one in _drain(ahead)] == ([] if is_standby else [GAP, TRACK])


def test_an_idle_reader_is_woken() -> None:
    ring, woken = EventRing(100), []
    subscription, astray = ring.subscribe(None, 100), ring.subscribe(1000, 100)
    subscription.set_wakeup(lambda: woken.append(1))
    assert subscription.is_idle()
    assert not astray.is_idle()
    _fill(ring, 1)
    assert woken == [1]
    assert not subscription.is_idle()
    _drain(subscription)
    assert subscription.is_idle()
    subscription.close()
    assert subscription.is_idle()


@pytest.mark.parametrize(("after", "depth"), [(-1, 10), (0, 0)])
def test_an_invalid_position_is_rejected(after: int, depth: int) -> None:
    with pytest.raises(ValueError, match="expected after >= 0 and depth >= 1"):
        EventRing(10).subscribe(after, depth)


def test_no_wake_up_is_missed_while_two_threads_hurry() -> None:
    ring = EventRing(1_000_000)
    subscription, awake = ring.subscribe(0, 1_000_000), threading.Event()
    subscription.set_wakeup(awake.set)
    found: list[int] = []

    def read() -> None:
        while len(found) < 5_000:
            part = subscription.poll(7)
            found.extend(_numbers(part))
            if not part:
                assert awake.wait(WAIT_TIMEOUT_S)
                awake.clear()

    reader = threading.Thread(target=read)
    reader.start()
    for _ in range(5_000):
        _fill(ring, 1)
    join(reader)
    assert found == list(range(1, 5_001))


def test_a_single_event_that_is_lost_is_a_gap_too() -> None:
    ring = EventRing(100)
    _fill(ring, 1, 1, 1, 1)
    found = _drain(ring.subscribe(0, 3))
    assert json.loads(found[0].payload) == {"gap": {"from": 1, "to": 1}}
    assert _numbers(found[1:]) == [2, 3, 4]
