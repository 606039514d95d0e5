"""HTTP with TLS, and certificates of clients in place of keys."""

import ssl
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from multiradar.api.connections import TlsFiles
from multiradar.api.http_server import HttpServer
from multiradar.errors import ConfigurationError
from multiradar.settings.limits import HttpLimits
from support.access import KEYS, bearer, guarded_api
from support.fakes.fake_service import FakeService
from support.processes import clients
from support.processes.certificates import Authority
from support.processes.live_server import serving
from support.processes.waiting import WAIT_TIMEOUT_S


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


def test_files_that_cannot_be_used_are_named(tmp_path: Path) -> None:
    (tmp_path / "service.pem").write_text("no certificate")
    files = TlsFiles(tmp_path / "service.pem", tmp_path / "service.key")
    with pytest.raises(ConfigurationError, match=r"TLS: cannot use .*service\.pem"):
        HttpServer(
            lambda _: guarded_api(FakeService()), "127.0.0.1", 0, HttpLimits(), lambda: None,
            tls=files,
        )  # fmt: skip
