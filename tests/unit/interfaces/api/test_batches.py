"""The places of streams, and the batches that they share."""

import asyncio
import contextlib
import threading
from dataclasses import dataclass, field

import pytest

from multiradar.access.shares import CLIENT
from multiradar.access.workers import Workers
from multiradar.api.batches import Encoder, StreamHub
from multiradar.errors import RequestError
from multiradar.runtime.ports import StreamEvents
from multiradar.settings.limits import HttpLimits
from support.fakes.fake_service import FakeView
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until


def test_a_stream_beyond_the_maximum_is_rejected_until_a_slot_is_free() -> None:
    limits = HttpLimits(streams_max=2)
    hub = StreamHub(FakeView(), Workers(1), limits)
    with hub.slot("websocket"):
        with hub.slot("sse"):
            with pytest.raises(RequestError) as rejected, hub.slot("sse"):
                pass
            assert (rejected.value.status, rejected.value.code) == (503, "TOO_MANY_STREAMS")
        with contextlib.ExitStack() as held:
            held.enter_context(hub.slot("sse"))
            with pytest.raises(RequestError), hub.slot("websocket"):
                pass


def test_one_client_leaves_streams_to_others() -> None:
    hub = StreamHub(FakeView(), Workers(1), HttpLimits(streams_max=3, client_streams_max=2))

    def rejected() -> tuple[int, str]:
        with pytest.raises(RequestError) as error, hub.slot("sse"):
            pass
        assert error.value.headers == {"retry-after": "5"}
        return error.value.status, error.value.code

    with contextlib.ExitStack() as held:
        held.callback(CLIENT.reset, CLIENT.set("one"))
        held.enter_context(hub.slot("sse"))
        held.enter_context(hub.slot("websocket"))
        assert rejected() == (429, "TOO_MANY_STREAMS")
        CLIENT.set("other")
        held.enter_context(hub.slot("sse"))
        assert rejected() == (503, "TOO_MANY_STREAMS")


@dataclass(eq=False)
class _Encoding:
    """An encoder that notes what it encoded, and waits until it may end."""

    may_end: threading.Event = field(default_factory=threading.Event)
    done: list[list[int]] = field(default_factory=list)

    def __call__(self, events: StreamEvents) -> bytes:
        self.done.append(list(events.numbers))
        assert self.may_end.wait(WAIT_TIMEOUT_S)
        return b"%d" % len(events.kinds)


def _hub(view: FakeView, events_max: int = 500) -> StreamHub:
    return StreamHub(view, Workers(2), HttpLimits(stream_batch_events_max=events_max))


async def _batches(
    hub: StreamHub, encode: Encoder, count: int, after: int = 0
) -> list[tuple[int, int, bytes]]:
    batches = hub.batches("websocket", after, frozenset({"track"}), encode)
    async with contextlib.aclosing(batches):
        found = [await anext(batches) for _ in range(count)]
    return [(batch.last, batch.count, batch.text) for batch in found]


async def test_clients_of_the_same_tick_share_one_encoding() -> None:
    view, encoding = FakeView(), _Encoding()
    hub = _hub(view, events_max=2)
    view.add_events(3)
    clients = [asyncio.create_task(_batches(hub, encoding, 2)) for _ in range(3)]
    await asyncio.to_thread(wait_until, lambda: encoding.done, "the first client")
    encoding.may_end.set()
    assert await asyncio.gather(*clients) == [[(2, 2, b"2"), (3, 1, b"1")]] * 3
    # One that comes later gets the same.
    assert await _batches(hub, encoding, 2) == [(2, 2, b"2"), (3, 1, b"1")]
    assert await _batches(hub, encoding, 1, after=1) == [(3, 2, b"2")]
    assert encoding.done == [[1, 2], [3], [2, 3]]


async def test_a_batch_survives_the_client_that_asked_for_it_first() -> None:
    view, encoding = FakeView(), _Encoding()
    hub = _hub(view)
    view.add_events(3)
    first, other = (asyncio.create_task(_batches(hub, encoding, 1)) for _ in range(2))
    await asyncio.to_thread(wait_until, lambda: encoding.done, "the first client")
    first.cancel()
    encoding.may_end.set()
    assert await other == [(3, 3, b"3")]
    assert encoding.done == [[1, 2, 3]]
    with pytest.raises(asyncio.CancelledError):
        await first


async def test_a_failed_encoding_is_not_shared_with_those_who_come_later() -> None:
    view, encoding = FakeView(), _Encoding()
    hub = _hub(view)
    view.add_events(1)

    def failing(events: StreamEvents) -> bytes:
        if not encoding.done:
            encoding.done.append(list(events.numbers))
            raise ValueError("first")
        return b"second"

    with pytest.raises(ValueError, match="first"):
        await _batches(hub, failing, 1)
    assert await _batches(hub, failing, 1) == [(1, 1, b"second")]


async def test_a_notice_of_lost_events_is_for_its_client_alone() -> None:
    view, encoding = FakeView(), _Encoding()
    encoding.may_end.set()
    hub = _hub(view)
    view.add_events(2)
    # Its number is from another journal: all events of this one are lost to it.
    astray = hub.batches("websocket", 1000, frozenset({"track"}), encoding)
    view.add_events(3)
    assert await _batches(hub, encoding, 1, after=5 - 3) == [(5, 3, b"3")]
    async with contextlib.aclosing(astray):
        batch = await anext(astray)
    assert (batch.last, batch.count, batch.gaps) == (5, 1, 1)
    assert await _batches(hub, encoding, 1, after=2) == [(5, 3, b"3")]
    assert encoding.done == [[3, 4, 5], [5]]


async def test_after_a_replay_a_number_has_another_batch() -> None:
    view, encoding = FakeView(), _Encoding()
    encoding.may_end.set()
    hub = _hub(view)
    view.add_events(2)
    assert await _batches(hub, encoding, 1) == [(2, 2, b"2")]
    view.ring.clear()
    view.add_events(3)
    assert await _batches(hub, encoding, 1) == [(3, 3, b"3")]


async def test_events_after_a_pause_are_sent_at_once_and_further_ones_collected() -> None:
    """All waited for the next tick, half of the interval in the mean."""
    view, encoding = FakeView(), _Encoding()
    encoding.may_end.set()
    hub = StreamHub(view, Workers(2), HttpLimits(stream_batch_interval_s=86_400.0))
    kinds = frozenset({"track"})
    first = hub.batches("websocket", 0, kinds, encoding)
    asked = asyncio.ensure_future(anext(first))
    await asyncio.sleep(0)
    view.add_events(2)
    assert (await asked).last == 2
    asked = asyncio.ensure_future(anext(first))
    view.add_events(1)
    # One that is new at the same time has not had its first batch.
    other = hub.batches("websocket", 2, kinds, encoding)
    assert (await anext(other)).last == 3
    assert not asked.done()
    asked.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await asked
    for one in (first, other):
        await one.aclose()
