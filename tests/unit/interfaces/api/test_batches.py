"""The places of streams."""

import contextlib

import pytest

from multiradar.access.shares import CLIENT
from multiradar.api.batches import StreamHub
from multiradar.api.workers import Workers
from multiradar.errors import RequestError
from multiradar.settings.limits import HttpLimits
from support.fakes.fake_service import FakeView


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
