"""Bodies that are too long, lie or never end; clients that are too slow, too many or silent."""

import contextlib
import json
import socket
from collections.abc import Iterator
from dataclasses import replace

import pytest

from multiradar.api.factory import create_api
from multiradar.ingest.http import measurement_routes
from multiradar.settings.limits import HttpLimits
from support.fakes.fake_service import FakeService, live_tracks
from support.processes import clients
from support.processes.live_server import RawClient, dropped_connections, serving
from support.processes.waiting import WAIT_TIMEOUT_S, pause, wait_until

LIMITS = HttpLimits(
    body_bytes_max=100_000,
    header_deadline_s=WAIT_TIMEOUT_S,
    body_deadline_s=WAIT_TIMEOUT_S,
    send_deadline_s=WAIT_TIMEOUT_S,
    connections_max=20,
)
#: For clients that are disconnected: others may be too slow for it on a busy machine.
HASTY = replace(LIMITS, header_deadline_s=1.0)
HASTY_WITH_BODIES = replace(LIMITS, body_deadline_s=0.2)


@pytest.fixture(scope="module")
def service() -> FakeService:
    return FakeService()


@pytest.fixture(scope="module")
def port(service: FakeService) -> Iterator[int]:
    application = create_api(service, LIMITS, routers=[measurement_routes(service)])
    with serving(application, LIMITS) as port:
        yield port


@pytest.fixture
def hasty(service: FakeService) -> Iterator[RawClient]:
    """A client of a service with a short deadline for headers."""
    with serving(create_api(service, HASTY), HASTY) as port:
        client = RawClient(port)
        yield client
        client.close()


@pytest.fixture
def raw(port: int) -> Iterator[RawClient]:
    client = RawClient(port)
    yield client
    client.close()


def _alive(port: int) -> bool:
    return clients.get(f"http://127.0.0.1:{port}/healthz").status_code == 200


def _post(headers: bytes) -> bytes:
    return (
        b"POST /v1/measurements HTTP/1.1\r\nHost: 127.0.0.1\r\n"
        b"Content-Type: application/x-ndjson\r\n" + headers + b"\r\n"
    )


def _code(answer: bytes) -> tuple[bytes, str]:
    head, _, body = answer.partition(b"\r\n\r\n")
    return head.split()[1], json.loads(body)["code"]


@pytest.mark.fault(35)
def test_a_long_body_is_rejected_by_its_length_before_it_is_sent(raw: RawClient) -> None:
    raw.send(_post(b"Content-Length: 100001\r\nExpect: 100-continue\r\n"))
    answer = raw.answer()
    assert _code(answer) == (b"413", "BODY_TOO_LARGE")
    assert b"connection: close" in answer.lower()
    assert b"100 Continue" not in answer


@pytest.mark.fault(35)
def test_an_endless_chunked_body_is_rejected_at_the_limit(raw: RawClient, port: int) -> None:
    raw.send(_post(b"Transfer-Encoding: chunked\r\n"))
    chunk = b"2000\r\n" + b"\n" * 0x2000 + b"\r\n"
    sent = 0
    with contextlib.suppress(ConnectionError, TimeoutError):
        # Far more than the limit, what the server drains and what the sockets hold.
        while sent < 64 * len(chunk) * 32:
            raw.send(chunk)
            sent += len(chunk)
    assert sent < 64 * len(chunk) * 32
    assert _alive(port)


def test_a_client_that_writes_before_it_reads_finds_the_413(raw: RawClient) -> None:
    raw.send(_post(b"Transfer-Encoding: chunked\r\n"))
    for _ in range(30):
        # The limit is passed in the middle; were the connection closed at once, sending would fail.
        raw.send(b"2000\r\n" + b"\n" * 0x2000 + b"\r\n")
        pause(0.01)
    raw.send(b"0\r\n\r\n")
    assert _code(raw.until(b"}")) == (b"413", "BODY_TOO_LARGE")


def test_a_body_of_exactly_the_limit_is_accepted(raw: RawClient) -> None:
    raw.send(_post(b"Content-Length: 100000\r\nConnection: close\r\n") + b"\n" * 100_000)
    assert raw.answer().split()[1] == b"200"


@pytest.mark.parametrize(
    "headers",
    [
        b"Content-Length: 5\r\nContent-Length: 6\r\n",
        b"Content-Length: -1\r\n",
        b"Content-Length: 1_0\r\n",
        b"Content-Length: 0x10\r\n",
        b"Content-Length: 99999999999999999999999\r\n",
        b"Transfer-Encoding: gzip\r\n",
        b"Transfer-Encoding: chunked, identity\r\n",
        b"Bad Header: 1\r\n",
        b"X: a\x00b\r\n",
        b"X: a\r\n folded: b\r\n\x01: c\r\n",
    ],
)
def test_ambiguous_headers_are_rejected(raw: RawClient, port: int, headers: bytes) -> None:
    raw.send(_post(headers))
    assert raw.answer().split()[1] in {b"400", b"413", b"501"}
    assert _alive(port)


@pytest.mark.fault(36)
def test_a_request_hidden_in_a_body_is_not_answered(raw: RawClient, service: FakeService) -> None:
    hidden = b"0\r\n\r\nPOST /v1/flush HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 0\r\n\r\n"
    length = b"Content-Length: %d\r\nTransfer-Encoding: chunked\r\n" % len(hidden)
    raw.send(_post(length) + hidden)
    answer = raw.answer()
    assert _code(answer) == (b"400", "CONTENT_LENGTH_INVALID")
    assert service.flushes == []


def test_a_body_shorter_than_announced_runs_into_the_deadline(service: FakeService) -> None:
    limits = HASTY_WITH_BODIES
    application = create_api(service, limits, routers=[measurement_routes(service)])
    with serving(application, limits) as port, contextlib.closing(RawClient(port)) as raw:
        raw.send(_post(b"Content-Length: 1000\r\n") + b"\n" * 10)
        assert _code(raw.answer()) == (b"408", "BODY_TIMEOUT")


def test_a_stream_waits_for_the_body_that_its_request_announces(service: FakeService) -> None:
    """It began, and ended with an error of the service at the deadline of the body."""
    request = b"GET /v1/events HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1\r\n\r\n"
    limits = HASTY_WITH_BODIES
    with serving(create_api(service, limits), limits) as port:
        with contextlib.closing(RawClient(port)) as raw:
            raw.send(request)
            assert _code(raw.answer()) == (b"408", "BODY_TIMEOUT")
        with contextlib.closing(RawClient(port)) as raw:
            raw.send(request + b"x")
            assert b"200 OK" in raw.until(b"retry")


def test_headers_longer_than_allowed_are_rejected(raw: RawClient) -> None:
    raw.send(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + b"a" * 20_000 + b"\r\n\r\n")
    assert _code(raw.until(b"}")) == (b"431", "HEADERS_TOO_LARGE")


def test_endless_headers_are_rejected(raw: RawClient) -> None:
    raw.send(b"GET /healthz HTTP/1.1\r\n")
    with contextlib.suppress(ConnectionError):
        for _ in range(1000):
            raw.send(b"X: " + b"a" * 20_000 + b"\r\n")
    assert raw.answer()[:12] in {b"HTTP/1.1 400", b""}


def test_a_silent_connection_is_dropped(hasty: RawClient) -> None:
    assert hasty.answer() == b""


@pytest.mark.fault(36)
def test_headers_that_trickle_are_dropped(hasty: RawClient) -> None:
    hasty.send(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n")
    hasty.socket.setblocking(False)

    def dropped() -> bool:
        try:
            hasty.send(b"X: 1\r\n")
            return hasty.socket.recv(1) == b""
        except BlockingIOError:
            return False
        except ConnectionError:
            return True

    wait_until(dropped, "the connection to be dropped")


def test_the_second_request_of_a_connection_has_a_deadline_too(hasty: RawClient) -> None:
    hasty.send(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
    hasty.until(b"alive")
    hasty.send(b"GET /healthz HTTP/1.1\r\n")
    assert hasty.answer() == b""


def test_many_silent_connections_do_not_block_others() -> None:
    # Their deadline is far away: a new connection has to replace one of them.
    limits = HttpLimits(connections_max=10, header_deadline_s=WAIT_TIMEOUT_S)
    with (
        serving(create_api(FakeService(), limits), limits) as port,
        contextlib.ExitStack() as crowd,
    ):
        for _ in range(25):
            silent = socket.create_connection(("127.0.0.1", port))
            crowd.callback(silent.close)
        assert _alive(port)


@pytest.mark.fault(36)
def test_slow_bodies_do_not_hold_the_connections_of_others() -> None:
    limits = replace(LIMITS, connections_max=10)
    service = FakeService()
    application = create_api(service, limits, routers=[measurement_routes(service)])
    with serving(application, limits) as port, contextlib.ExitStack() as crowd:
        for _ in range(25):
            slow = RawClient(port)
            crowd.callback(slow.close)
            slow.send(_post(b"Content-Length: 1000\r\n") + b"\n")
        assert _alive(port)


def test_an_address_has_a_share_of_the_connections() -> None:
    limits = replace(LIMITS, connections_max=6, client_connections_max=3)
    with (
        serving(create_api(FakeService(), limits), limits) as port,
        contextlib.ExitStack() as crowd,
    ):
        stream = b"GET /v1/events HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
        for _ in range(3):
            client = RawClient(port)
            crowd.callback(client.close)
            client.send(stream)
            client.until(b"retry")
        # All of its connections are busy, so that none is replaced.
        fourth = RawClient(port)
        crowd.callback(fourth.close)
        assert fourth.answer() == b""
        other = RawClient(port, address="127.0.0.2")
        crowd.callback(other.close)
        other.send(stream)
        assert b"200 OK" in other.until(b"retry")


def test_pipelined_requests_are_answered_in_order(raw: RawClient) -> None:
    one = b"GET %s HTTP/1.1\r\nHost: 127.0.0.1\r\n%s\r\n"
    raw.send(one % (b"/v1/tracks/1", b"") + one % (b"/healthz", b"Connection: close\r\n"))
    answer = raw.answer()
    assert answer.index(b'"track_id": 1') < answer.index(b"alive")


def test_a_stopped_reader_is_disconnected_and_others_are_served(service: FakeService) -> None:
    before, service.view.live = service.view.live, live_tracks(10_000)
    limits = replace(LIMITS, send_deadline_s=0.5)
    try:
        with serving(create_api(service, limits), limits) as port:
            stopped = RawClient(port, receive_buffer_bytes=4096)
            dropped = dropped_connections(port)
            # Ten answers of some MB each, none of them read.
            request = b"GET /v1/tracks?limit=10000 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
            stopped.send(request * 10)
            wait_until(lambda: dropped_connections(port) > dropped, "the reader to be let go")
            stopped.close()
            assert _alive(port)
    finally:
        service.view.live = before
