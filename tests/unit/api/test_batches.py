"""The places of streams."""

import contextlib

import pytest

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
