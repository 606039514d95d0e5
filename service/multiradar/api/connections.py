"""Connections: deadlines and limits that uvicorn lacks, and its configuration.

A connection without a request is dropped after the header deadline, with TLS also one without a
complete handshake. At the maximum number of connections, of all or of one address, a new one
replaces the one that has been idle, or sending its request, longest; if all are busy, the new one
is closed. A connection whose client does not read is aborted after a timeout.
"""

import asyncio
import contextlib
import socket
import ssl
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from http import HTTPStatus
from pathlib import Path
from typing import Any

import h11
import uvicorn
from starlette.types import ASGIApp
from uvicorn.config import Config
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.utils import ClientDisconnected
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from uvicorn.server import ServerState
from websockets.exceptions import InvalidState
from websockets.http11 import Request
from websockets.protocol import State

from multiradar.access.authentication import CERTIFICATE, ClientCertificate
from multiradar.access.shares import client_at
from multiradar.errors import ConfigurationError
from multiradar.observability.metrics import HTTP_CONNECTIONS, HTTP_CONNECTIONS_DROPPED
from multiradar.settings.limits import HttpLimits

#: Member of an ASGI message `websocket.send`: a whole frame, which is sent as it is. A server that
#: reads it has the key in the `extensions` of the scope.
FRAME = "multiradar.frame"

# Clients of the event stream send nothing; larger messages are not read.
_WEBSOCKET_MESSAGE_BYTES_MAX = 4096
# First octet of a frame that is a whole text, and lengths that stand for longer ones after them.
_FINAL_TEXT = b"\x81"
_LENGTH_16, _LENGTH_64 = 126, 127


@dataclass(frozen=True, slots=True)
class TlsFiles:
    """Files of TLS (PEM).

    Attributes
    ----------
    certificate, private_key : Path
        Certificate of the service with its chain, and its key.
    client_authority : Path or None
        Authority of certificates of clients, which clients may then present.
    """

    certificate: Path
    private_key: Path
    client_authority: Path | None = None

    def context(self) -> ssl.SSLContext:
        """Return the context of a server: TLS 1.2 or later.

        Raises
        ------
        ConfigurationError
            If a file cannot be used.
        """
        context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
        try:
            context.load_cert_chain(self.certificate, self.private_key, password="")
            if self.client_authority is not None:
                context.load_verify_locations(self.client_authority)
                context.verify_mode = ssl.CERT_OPTIONAL
        except (OSError, ssl.SSLError) as error:
            named = f"{self.certificate}, {self.private_key}, {self.client_authority}"
            msg = f"TLS: cannot use {named.removesuffix(', None')}: {error}"
            raise ConfigurationError(msg) from error
        return context


def server_config(
    application: ASGIApp,
    host: str,
    port: int,
    limits: HttpLimits | None = None,
    tls: TlsFiles | None = None,
) -> Config:
    """Return the uvicorn configuration that enforces the limits.

    Parameters
    ----------
    application : ASGIApp
        Result of `create_api`.
    host, port
        Address to listen on; port 0 picks a free port.
    limits : HttpLimits, optional
        The limits of the application.
    tls : TlsFiles, optional
        Files of TLS; without them HTTP is not encrypted.

    Raises
    ------
    ConfigurationError
        If a file of TLS cannot be used.
    """
    limits = limits or HttpLimits()
    registry = _Registry(limits)
    http = _bound(_Http, registry)
    return Config(
        application,
        host=host,
        port=port,
        http=http if tls is None else _bound(_Handshake, registry, http=http, tls=tls.context()),
        ws=_bound(_WebSocket, registry),
        loop="asyncio",
        lifespan="on",
        backlog=min(limits.connections_max, socket.SOMAXCONN),
        h11_max_incomplete_event_size=limits.header_bytes_max,
        timeout_keep_alive=15,
        timeout_graceful_shutdown=3,
        ws_max_size=_WEBSOCKET_MESSAGE_BYTES_MAX,
        ws_ping_interval=20.0,
        ws_ping_timeout=20.0,
        ws_per_message_deflate=False,
        proxy_headers=False,
        server_header=False,
        access_log=False,
        log_config=None,
    )


def server(
    application: ASGIApp,
    host: str,
    port: int,
    limits: HttpLimits | None = None,
    tls: TlsFiles | None = None,
) -> uvicorn.Server:
    """Return a server that enforces the limits; see `server_config`."""
    return uvicorn.Server(server_config(application, host, port, limits, tls))


class _Registry:
    # The open connections of a server. Used on the thread of the event loop only.

    def __init__(self, limits: HttpLimits) -> None:
        self.limits = limits
        self._open: dict[asyncio.Transport, _Progress] = {}
        # In order of insertion: the first has been idle longest.
        self._idle: dict[asyncio.Transport, None] = {}
        # The client of each, which a closed connection with TLS does not know, and their numbers.
        self._client_of: dict[asyncio.Transport, str] = {}
        self._clients: Counter[str] = Counter()
        self._sweeping = False

    def admit(self, transport: asyncio.Transport) -> bool:
        if transport in self._open:  # Since before its handshake.
            return True
        client = _client_of(transport)
        of_client = self._clients[client] >= self.limits.client_connections_max
        full = of_client or len(self._open) >= self.limits.connections_max
        if full and not self._evict(client if of_client else None):
            _drop(transport, "too_many_of_client" if of_client else "too_many")
            return False
        self._client_of[transport] = client
        self._clients[client] += 1
        loop = asyncio.get_running_loop()
        self._open[transport] = _Progress(0, loop.time())
        self._idle[transport] = None
        HTTP_CONNECTIONS.inc()
        if not self._sweeping:
            self._sweeping = True
            loop.call_later(self._sweep_interval_s(), self._sweep)
        return True

    def secured(self, transport: asyncio.Transport, over: asyncio.Transport) -> bool:
        # TLS takes the place of the connection that it goes over, unless that one has been dropped.
        if over not in self._open:
            return False
        del self._open[over], self._idle[over]
        self._client_of[transport] = self._client_of.pop(over)
        self._open[transport] = _Progress(0, asyncio.get_running_loop().time())
        self._idle[transport] = None
        return True

    def busy(self, transport: asyncio.Transport) -> None:
        self._idle.pop(transport, None)

    def idle(self, transport: asyncio.Transport) -> None:
        if transport in self._open:
            self._idle[transport] = None

    def lost(self, transport: asyncio.Transport) -> None:
        self._idle.pop(transport, None)
        if self._open.pop(transport, None) is not None:
            HTTP_CONNECTIONS.dec()
            client = self._client_of.pop(transport)
            self._clients[client] -= 1
            if not self._clients[client]:
                del self._clients[client]

    def _evict(self, client: str | None) -> bool:
        # Of a client, or of all.
        candidates = (one for one in self._idle if client in (None, self._client_of[one]))
        oldest = next(candidates, None)
        if oldest is None:
            return False
        self.lost(oldest)
        _drop(oldest, "idle_longest")
        return True

    def _sweep(self) -> None:
        # A buffer that does not shrink means that the client does not read. Twice the deadline of a
        # piece leaves time for a close code behind it.
        loop = asyncio.get_running_loop()
        stalled_since_s = loop.time() - 2.0 * self.limits.send_deadline_s
        for transport, progress in list(self._open.items()):
            size = transport.get_write_buffer_size()
            if size == 0 or size < progress.size:
                self._open[transport] = _Progress(size, loop.time())
            elif progress.since_s < stalled_since_s:
                _drop(transport, "does_not_read")
            else:
                self._open[transport] = _Progress(size, progress.since_s)
        self._sweeping = bool(self._open)
        if self._sweeping:
            loop.call_later(self._sweep_interval_s(), self._sweep)

    def _sweep_interval_s(self) -> float:
        return self.limits.send_deadline_s / 10.0


@dataclass(frozen=True, slots=True)
class _Progress:
    # Bytes that a connection still has to deliver, and since when they have not decreased.
    size: int
    since_s: float


def _drop(transport: asyncio.Transport, cause: str) -> None:
    HTTP_CONNECTIONS_DROPPED.labels(cause=cause).inc()
    transport.abort()


def _client_of(transport: asyncio.Transport) -> str:
    return client_at((transport.get_extra_info("peername") or ("unknown",))[0])


# The client's certificate, which the handshake has verified.
def _certificate(transport: asyncio.Transport) -> ClientCertificate | None:
    certificate = transport.get_extra_info("peercert") or {}
    subject = dict(pair for part in certificate.get("subject", ()) for pair in part)
    name = subject.get("commonName")
    if name is None:
        return None
    return ClientCertificate(name, float(ssl.cert_time_to_seconds(certificate["notAfter"])))


def _send_at_once(transport: asyncio.Transport) -> None:
    # asyncio sets this only if the listening socket names its protocol; without it an answer in two
    # pieces waits 40 ms for the acknowledgement of the first.
    connection = transport.get_extra_info("socket")
    if connection is not None and connection.family in {socket.AF_INET, socket.AF_INET6}:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


def _bound(
    protocol: Callable[..., asyncio.Protocol], registry: _Registry, **further: object
) -> type[asyncio.Protocol]:
    # uvicorn creates protocols with its own arguments, so the registry is a class attribute.
    assert isinstance(protocol, type)
    return type(protocol.__name__, (protocol,), {"registry": registry, **further})


# TLS by the listening socket would report a connection only after its handshake: until then no
# limit would apply, and asyncio allocates a buffer of 256 KiB for each.
class _Handshake(asyncio.Protocol):
    registry: _Registry
    http: type["_Http"]
    tls: ssl.SSLContext

    def __init__(self, **of_uvicorn: Any) -> None:
        self._of_uvicorn = of_uvicorn
        self._early = bytearray()
        self._task: asyncio.Task[None] | None = None

    def connection_made(  # type: ignore[override]  # the transport is narrower, as in uvicorn
        self, transport: asyncio.Transport
    ) -> None:
        # Nothing is read before TLS.
        transport.pause_reading()
        if self.registry.admit(transport):
            self._task = asyncio.get_running_loop().create_task(self._secure(transport))

    def data_received(self, data: bytes) -> None:
        # With the end of the handshake, before the task continues.
        self._early += data

    async def _secure(self, over: asyncio.Transport) -> None:
        transport: asyncio.Transport | None = None
        try:
            # Of one that has been dropped meanwhile, the handshake would never end.
            if not over.is_closing():
                # An error: it failed, took too long, or the client has gone.
                with contextlib.suppress(OSError):
                    transport = await asyncio.get_running_loop().start_tls(
                        over, self, self.tls, server_side=True,
                        ssl_handshake_timeout=self.registry.limits.header_deadline_s,
                    )  # fmt: skip
        finally:
            if transport is None:
                self.registry.lost(over)
                over.abort()
        if transport is None or not self.registry.secured(transport, over):
            return
        protocol = self.http(**self._of_uvicorn)
        transport.set_protocol(protocol)
        protocol.connection_made(transport)
        if self._early:
            protocol.data_received(bytes(self._early))


class _Http(H11Protocol):
    registry: _Registry

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        self._header_timer: asyncio.TimerHandle | None = None

    def connection_made(  # type: ignore[override]  # the transport is narrower, as in uvicorn
        self, transport: asyncio.Transport
    ) -> None:
        super().connection_made(transport)
        _send_at_once(transport)
        certificate = _certificate(transport)
        if certificate is not None:
            # The state of each request on this connection, WebSockets included.
            self.app_state = {**self.app_state, CERTIFICATE: certificate}
        if self.registry.admit(transport):
            self._expect_headers()

    def connection_lost(self, exc: Exception | None) -> None:
        self._headers_received()
        self.registry.lost(self.transport)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        # The first byte of a further request starts the deadline of its headers.
        if self._waits_for_request() and self._header_timer is None:
            self._expect_headers()
        super().data_received(data)
        if not self._waits_for_request():
            self._headers_received()
            if self.conn.their_state is not h11.SEND_BODY:
                self.registry.busy(self.transport)

    def handle_websocket_upgrade(self, event: Any) -> None:
        self._headers_received()
        self.registry.busy(self.transport)
        super().handle_websocket_upgrade(event)

    def on_response_complete(self) -> None:
        super().on_response_complete()
        if self._waits_for_request():
            self.registry.idle(self.transport)

    def _waits_for_request(self) -> bool:
        return self.cycle is None or self.cycle.response_complete

    def _expect_headers(self) -> None:
        self._header_timer = self.loop.call_later(
            self.registry.limits.header_deadline_s, self._headers_late
        )

    def _headers_received(self) -> None:
        if self._header_timer is not None:
            self._header_timer.cancel()
            self._header_timer = None

    def _headers_late(self) -> None:
        self._header_timer = None
        _drop(self.transport, "headers_late")


class _WebSocket(WebSocketsSansIOProtocol):
    registry: _Registry

    def connection_lost(self, exc: Exception | None) -> None:
        self.registry.lost(self.transport)
        super().connection_lost(exc)

    def shutdown(self) -> None:
        # To a client that has said goodbye uvicorn cannot do so, and would not stop.
        try:
            super().shutdown()
        except InvalidState:
            self.transport.close()

    def handle_connect(self, event: Request) -> None:
        super().handle_connect(event)
        if self.response.status_code == HTTPStatus.SWITCHING_PROTOCOLS:
            self.scope["extensions"][FRAME] = {}

    async def send(self, message: Any) -> None:
        if FRAME in message:
            await self._send_frame(message[FRAME])
            return
        if message["type"] == "websocket.close":
            # A close code is queued behind unread data of a stalled client without waiting.
            self.writable.set()
        await super().send(message)

    # A frame that many clients get is not copied for each, as `send` does several times.
    async def _send_frame(self, frame: bytes) -> None:
        await self.writable.wait()
        if self.disconnected or self.close_sent or self.conn.state is not State.OPEN:
            raise ClientDisconnected
        self.transport.write(frame)


def text_frame(parts: Sequence[bytes]) -> bytes:
    """Return a text as one WebSocket frame of a server, without mask (RFC 6455, section 5.2).

    Parameters
    ----------
    parts : sequence of bytes
        The text, UTF-8.
    """
    length = sum(map(len, parts))
    if length < _LENGTH_16:
        size = length.to_bytes(1, "big")
    elif length < 1 << 16:
        size = bytes([_LENGTH_16]) + length.to_bytes(2, "big")
    else:
        size = bytes([_LENGTH_64]) + length.to_bytes(8, "big")
    return b"".join([_FINAL_TEXT, size, *parts])
