"""The places of streams, and the batches that they share."""

import asyncio
import contextlib
from unittest import mock

import pytest

from multiradar.access.shares import CLIENT
from multiradar.api.batches import StreamHub
from multiradar.api.workers import Workers
from multiradar.errors import RequestError
from multiradar.runtime.ports import StreamEvents
from multiradar.runtime.stream.events import EventTable, Subscription
from multiradar.settings.limits import HttpLimits
from support.fakes.fake_service import FakeView
from support.processes.waiting import wait_until


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


def test_clients_of_the_same_tick_share_one_encoding() -> None:
    view = FakeView()
    hub = StreamHub(view, Workers(2), HttpLimits())
    polled: list[int] = []
    encoded: list[int] = []
    poll = Subscription.poll_table

    def counted(subscription: Subscription, max_events: int) -> EventTable:
        events = poll(subscription, max_events)
        polled.append(len(events))
        return events

    def encode(events: StreamEvents) -> bytes:
        encoded.append(len(events.kinds))
        # The other client asks for the same batch meanwhile.
        wait_until(lambda: len(polled) == 2, "the other client")
        return b"%d" % len(events.kinds)

    async def first() -> tuple[int, bytes]:
        batches = hub.batches("websocket", 0, frozenset({"track"}), encode)
        async with contextlib.aclosing(batches):
            batch = await anext(batches)
            return batch.count, batch.text

    async def of_both() -> list[tuple[int, bytes]]:
        return list(await asyncio.gather(first(), first()))

    view.add_events(3)
    with mock.patch.object(Subscription, "poll_table", counted):
        assert asyncio.run(of_both()) == [(3, b"3")] * 2
    assert encoded == [3]
