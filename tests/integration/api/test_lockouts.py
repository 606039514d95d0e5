"""What a host without credentials sends does not keep out those that have them."""

import contextlib
import ssl
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from multiradar.api.connections.server import TlsFiles
from multiradar.api.factory import create_api
from multiradar.ingest.http_sensors import sensor_change_routes
from multiradar.observability.metrics import HTTP_CONNECTIONS
from multiradar.settings.limits import HttpLimits
from support.access import KEYS, authentication, bearer, guarded_api
from support.fakes.fake_service import FakeService, live_tracks
from support.processes import clients
from support.processes.certificates import Authority
from support.processes.live_server import RawClient, serving
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until

_UPGRADE = (
    b"GET /v1/stream HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
)
_KEY = b"Authorization: Bearer " + KEYS["display"].encode() + b"\r\n"


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        (b"Content-Length: 5\r\n", b"400"),
        (b"Transfer-Encoding: chunked\r\n", b"400"),
        (b"".join(b"X-%d: 1\r\n" % number for number in range(200)), b"431"),
        (b"X: " + b"a" * 9_000 + b"\r\n", b"431"),
    ],
)
def test_an_upgrade_that_is_no_websocket_is_answered_and_closed(
    headers: bytes, status: bytes
) -> None:
    """Each such connection held its place until the service was started again."""
    limits = HttpLimits(client_connections_max=1)
    with serving(guarded_api(FakeService()), limits) as port:
        for _ in range(2):
            with contextlib.closing(RawClient(port)) as client:
                client.send(_UPGRADE + headers + b"\r\n")
                assert client.answer().split()[1] == status
        with contextlib.closing(RawClient(port)) as client:
            client.send(_UPGRADE + _KEY + b"\r\n")
            assert b"101 Switching Protocols" in client.until(b"\r\n\r\n")


def test_a_rejected_upgrade_is_no_error_of_the_service(caplog: pytest.LogCaptureFixture) -> None:
    with (
        serving(guarded_api(FakeService()), HttpLimits()) as port,
        contextlib.closing(RawClient(port)) as client,
    ):
        client.send(_UPGRADE + b"\r\n")
        assert client.answer().split()[1] == b"401"
    assert [one.getMessage() for one in caplog.records if one.name == "uvicorn.error"] == []


@pytest.mark.parametrize("asked", [b"GET /v1/tracks", b"PUT /v1/sensors/41-10"])
def test_rejected_requests_whose_bodies_do_not_arrive_take_no_places(asked: bytes) -> None:
    limits = HttpLimits(requests_max=4, client_requests_max=2)
    service = FakeService()
    application = create_api(
        service, limits, routers=[sensor_change_routes(service)], authentication=authentication()
    )
    request = asked + b" HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1\r\n\r\n"
    with serving(application, limits) as port, contextlib.ExitStack() as crowd:
        for address in ("127.0.0.2", "127.0.0.3"):
            for _ in range(10):
                client = RawClient(port, address=address)
                crowd.callback(client.close)
                client.send(request)
                # The server still waits for the rest of the body.
                assert b"401 Unauthorized" in client.until(b"\r\n\r\n")
        answer = clients.get(
            f"http://127.0.0.1:{port}/v1/tracks",
            bearer(KEYS["display"]),
        )
        assert answer.status_code == 200


def test_tls_clients_that_do_not_say_goodbye_give_their_places_to_others(tmp_path: Path) -> None:
    limits = HttpLimits(client_connections_max=3, send_deadline_s=WAIT_TIMEOUT_S)
    with _rejected_with_tls(tmp_path, limits) as (port, context):
        answer = httpx.get(
            f"https://127.0.0.1:{port}/healthz", verify=context, timeout=WAIT_TIMEOUT_S,
            trust_env=False,
        )  # fmt: skip
        assert answer.status_code == 200


def test_tls_clients_that_do_not_say_goodbye_are_soon_disconnected(tmp_path: Path) -> None:
    """The search for clients that do not read ended with an error, for ever."""
    limits = HttpLimits(client_connections_max=3, send_deadline_s=0.5)
    before = _open_connections()
    start_s = time.monotonic()
    with _rejected_with_tls(tmp_path, limits):
        wait_until(lambda: _open_connections() == before, "the connections to be lost")
        # asyncio waits for 30 s.
        assert time.monotonic() - start_s < 25.0


@pytest.mark.parametrize("with_tls", [False, True])
def test_a_stop_ends_the_connections_of_clients_that_do_not_read(
    tmp_path: Path, with_tls: bool
) -> None:
    """They stayed open without a server."""
    authority = Authority(tmp_path)
    tls = TlsFiles(*authority.issue("multiradar")) if with_tls else None
    service = FakeService()
    service.view.live = live_tracks(10_000)
    before = _open_connections()
    with contextlib.ExitStack() as crowd:
        with serving(create_api(service, HttpLimits()), HttpLimits(), tls) as port:
            client = RawClient(port, receive_buffer_bytes=4096).socket
            if with_tls:
                context = ssl.create_default_context(cafile=authority.certificate)
                client = context.wrap_socket(client, server_hostname="127.0.0.1")
            crowd.callback(client.close)
            client.sendall(b"GET /v1/tracks?limit=10000 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            assert client.recv(12) == b"HTTP/1.1 200"
        assert _open_connections() == before


# Three clients whose upgrades have been rejected, and which remain silent then.
@contextlib.contextmanager
def _rejected_with_tls(folder: Path, limits: HttpLimits) -> Iterator[tuple[int, ssl.SSLContext]]:
    authority = Authority(folder)
    context = ssl.create_default_context(cafile=authority.certificate)
    with (
        serving(
            guarded_api(FakeService()), limits, TlsFiles(*authority.issue("multiradar"))
        ) as port,
        contextlib.ExitStack() as crowd,
    ):
        for _ in range(3):
            client = context.wrap_socket(RawClient(port).socket, server_hostname="127.0.0.1")
            crowd.callback(client.close)
            client.sendall(_UPGRADE + b"\r\n")
            assert client.recv(12) == b"HTTP/1.1 401"
        yield port, context


def _open_connections() -> float:
    (family,) = HTTP_CONNECTIONS.collect()
    return family.samples[0].value
