"""HEAD over a real connection: no body is sent, and the next request is answered."""

import json

from multiradar.api.factory import create_api
from multiradar.settings.limits import HttpLimits
from support.fakes.fake_service import FakeService
from support.processes.clients import client, get
from support.processes.live_server import RawClient, serving

_LIMITS = HttpLimits()


def test_a_connection_goes_on_after_head() -> None:
    with serving(create_api(FakeService(), _LIMITS), _LIMITS) as port:
        raw = RawClient(port)
        raw.send(b"HEAD /v1/tracks HTTP/1.1\r\nHost: x\r\n\r\n")
        raw.send(b"GET /healthz HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
        head, alive, body = raw.answer().split(b"\r\n\r\n")
        raw.close()
        length = get(f"http://127.0.0.1:{port}/v1/tracks").content
    assert head.startswith(b"HTTP/1.1 200")
    assert b"content-length: %d" % len(length) in head.lower()
    assert alive.startswith(b"HTTP/1.1 200")
    assert json.loads(body) == {"status": "alive"}


def test_head_of_the_events_ends_and_frees_its_slot() -> None:
    limits = HttpLimits(streams_max=1)
    application = create_api(FakeService(), limits)
    with (
        serving(application, limits) as port,
        client(f"http://127.0.0.1:{port}") as http,
    ):
        for _ in range(5):
            # The slot may become free shortly after the answer.
            assert any(http.head("/v1/events").status_code == 200 for _ in range(1000))
