"""HTTP with TLS, and certificates of clients in place of keys."""

import contextlib
import ssl
import time
from collections import deque
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import ConnectionClosed

from multiradar.api.connections.server import TlsFiles
from multiradar.api.http_server import HttpServer
from multiradar.clock import FixedClock, SystemClock
from multiradar.errors import ConfigurationError
from multiradar.observability.metrics import HTTP_CONNECTIONS
from multiradar.settings.limits import HttpLimits
from support.access import KEYS, authentication, bearer, guarded_api
from support.fakes.fake_service import FakeService
from support.processes import clients
from support.processes.certificates import Authority
from support.processes.live_server import RawClient, serving
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until


class Secured:
    """A service with TLS whose clients may present certificates."""

    def __init__(self, folder: Path) -> None:
        self.authority = Authority(folder)
        certificate, key = self.authority.issue("multiradar")
        self.files = TlsFiles(certificate, key, self.authority.certificate)
        self.port = 0

    def context(self, name: str | None, authority: Authority | None = None) -> ssl.SSLContext:
        """Trusts the service; with a name presents a certificate."""
        context = ssl.create_default_context(cafile=self.authority.certificate)
        if name is not None:
            context.load_cert_chain(*(authority or self.authority).issue(name))
        return context

    def get(self, path: str, context: ssl.SSLContext, key: str | None = None) -> httpx.Response:
        headers = {} if key is None else bearer(key)
        url = f"https://127.0.0.1:{self.port}{path}"
        return httpx.get(
            url, headers=headers, verify=context, timeout=WAIT_TIMEOUT_S, trust_env=False
        )


@pytest.fixture(scope="module")
def secured(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Secured]:
    scene = Secured(tmp_path_factory.mktemp("tls"))
    with serving(guarded_api(FakeService()), HttpLimits(), scene.files) as port:
        scene.port = port
        yield scene


def test_a_certificate_proves_the_name_of_a_client(secured: Secured) -> None:
    display = secured.context("display")
    assert secured.get("/v1/tracks", display).status_code == 200
    assert secured.get("/v1/tracks", secured.context("feed")).status_code == 403
    assert secured.get("/v1/tracks", secured.context("stranger")).status_code == 401
    assert secured.get("/v1/tracks", secured.context(None)).status_code == 401
    # The key counts before the certificate.
    assert secured.get("/v1/tracks", display, KEYS["feed"]).status_code == 403


def test_a_key_is_enough_without_a_certificate(secured: Secured) -> None:
    assert secured.get("/v1/tracks", secured.context(None), KEYS["display"]).status_code == 200


def test_a_certificate_counts_for_streams(secured: Secured) -> None:
    url = f"wss://127.0.0.1:{secured.port}/v1/stream"
    with clients.event_socket(url, ssl=secured.context("display")) as socket:
        socket.send("ends it")


@pytest.mark.fault(42)
def test_a_stream_ends_with_its_certificate(secured: Secured) -> None:
    clock = FixedClock(SystemClock().now_s())
    application = guarded_api(FakeService(), authentication(clock=clock))
    limits = HttpLimits(stream_heartbeat_s=0.1)
    with serving(application, limits, secured.files) as port:
        url = f"wss://127.0.0.1:{port}/v1/stream"
        with clients.event_socket(url, ssl=secured.context("display")) as socket:
            socket.recv(WAIT_TIMEOUT_S)
            # It is valid for one day.
            clock.advance(2.0 * 86_400.0)
            with pytest.raises(ConnectionClosed) as closed:
                deque(iter(partial(socket.recv, WAIT_TIMEOUT_S), None))
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.reason == "the credentials have expired or were revoked"


def test_closed_connections_do_not_count(secured: Secured) -> None:
    """After that many a client was locked out until the service was started again."""
    limits = HttpLimits(client_connections_max=2)
    context = secured.context("display")
    with serving(guarded_api(FakeService()), limits, secured.files) as port:
        for _ in range(6):
            answer = httpx.get(
                f"https://127.0.0.1:{port}/v1/tracks", verify=context, timeout=WAIT_TIMEOUT_S,
                trust_env=False,
            )  # fmt: skip
            assert answer.status_code == 200


def test_connections_without_a_handshake_count(secured: Secured) -> None:
    limits = HttpLimits(client_connections_max=3, header_deadline_s=WAIT_TIMEOUT_S)
    with (
        serving(guarded_api(FakeService()), limits, secured.files) as port,
        contextlib.ExitStack() as crowd,
    ):
        silent = [RawClient(port) for _ in range(10)]
        for one in silent:
            crowd.callback(one.close)
        # Those that have been idle longest are replaced, the last ones by this request.
        for one in silent[:7]:
            assert one.answer() == b""
        url, context = f"https://127.0.0.1:{port}/healthz", secured.context(None)
        for _ in range(4):
            answer = httpx.get(url, verify=context, timeout=WAIT_TIMEOUT_S, trust_env=False)
            assert answer.status_code == 200


def test_a_handshake_has_the_deadline_of_headers_and_is_counted_until_then(
    secured: Secured,
) -> None:
    limits = HttpLimits(header_deadline_s=0.5)
    hello = _Bio(secured.context(None)).hello()
    open_before = _open_connections()
    with serving(guarded_api(FakeService()), limits, secured.files) as port:
        for sent in (b"", hello, b"GET / HTTP/1.1\r\n\r\n"):
            start_s = time.monotonic()
            client = RawClient(port)
            client.send(sent)
            client.answer()
            client.close()
            # Without limits asyncio waits for 60 s.
            assert time.monotonic() - start_s < 50.0
            wait_until(lambda: _open_connections() == open_before, "the connection to be lost")


def test_a_request_may_come_with_the_end_of_the_handshake(secured: Secured) -> None:
    with serving(guarded_api(FakeService()), HttpLimits(), secured.files) as port:
        client, bio = RawClient(port), _Bio(secured.context(None))
        client.send(bio.hello())
        while not bio.is_complete():
            bio.received.write(client.socket.recv(65536))
        bio.tls.write(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n")
        # The last part of the handshake has not been sent before.
        client.send(bio.to_send.read())
        bio.received.write(client.answer())
        assert bio.tls.read(65536).startswith(b"HTTP/1.1 200 OK")
        client.close()


class _Bio:
    """The client's side of TLS without a socket."""

    def __init__(self, context: ssl.SSLContext) -> None:
        self.received, self.to_send = ssl.MemoryBIO(), ssl.MemoryBIO()
        self.tls = context.wrap_bio(self.received, self.to_send, server_hostname="127.0.0.1")

    def is_complete(self) -> bool:
        """Continue the handshake."""
        try:
            self.tls.do_handshake()
        except ssl.SSLWantReadError:
            return False
        return True

    def hello(self) -> bytes:
        """Return the first part of the handshake."""
        assert not self.is_complete()
        return self.to_send.read()


def _open_connections() -> float:
    (family,) = HTTP_CONNECTIONS.collect()
    return family.samples[0].value


@pytest.mark.fault(42)
def test_a_certificate_of_another_authority_is_rejected(secured: Secured, tmp_path: Path) -> None:
    stranger = Authority(tmp_path, "another-authority")
    with pytest.raises(httpx.TransportError):
        secured.get("/v1/tracks", secured.context("display", stranger))


@pytest.mark.parametrize("version", [ssl.TLSVersion.TLSv1_1])
def test_old_protocols_and_plain_http_get_no_answer(
    secured: Secured, version: ssl.TLSVersion
) -> None:
    old = secured.context(None)
    with pytest.warns(DeprecationWarning, match="TLSv1_1"):
        old.maximum_version = version
    old.set_ciphers("ALL:@SECLEVEL=0")
    with pytest.raises(httpx.TransportError):
        secured.get("/healthz", old)
    with pytest.raises(httpx.TransportError):
        clients.get(f"http://127.0.0.1:{secured.port}/healthz")


@pytest.mark.fault(42)
def test_files_that_cannot_be_used_are_named(tmp_path: Path) -> None:
    (tmp_path / "service.pem").write_text("no certificate")
    files = TlsFiles(tmp_path / "service.pem", tmp_path / "service.key")
    with pytest.raises(ConfigurationError, match=r"TLS: cannot use .*service\.pem"):
        HttpServer(
            lambda _: guarded_api(FakeService()), "127.0.0.1", 0, HttpLimits(), lambda: None,
            tls=files,
        )  # fmt: skip
