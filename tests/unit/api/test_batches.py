"""The places of streams."""

import contextlib

import pytest

from multiradar.api.batches import StreamHub
from multiradar.api.limits import HttpLimits
from multiradar.api.workers import Workers
from multiradar.errors import RequestError
from support.fakes.fake_service import FakeView


def test_a_place_is_refused_when_all_are_taken_and_given_when_one_is_free() -> None:
    limits = HttpLimits(streams_max=2)
    hub = StreamHub(FakeView(), Workers(1), limits)
    with hub.place("websocket"):
        with hub.place("sse"):
            with pytest.raises(RequestError) as refused, hub.place("sse"):
                pass
            assert (refused.value.status, refused.value.code) == (503, "TOO_MANY_STREAMS")
        with contextlib.ExitStack() as held:
            held.enter_context(hub.place("sse"))
            with pytest.raises(RequestError), hub.place("websocket"):
                pass
