"""The server: deadlines and limits that uvicorn lacks, and its configuration.

A connection without a request is dropped after the header deadline, with TLS also one without a
complete handshake. At the maximum number of connections, of all or of one address, a new one
replaces the one that has been idle, or sending its request, longest; if all are busy, the new one
is closed. A connection whose client does not read is aborted after a timeout, and one with too many
chunks or frames at once.
"""

import asyncio
import contextlib
import socket
import ssl
from collections.abc import Callable
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
from websockets.frames import CloseCode
from websockets.http11 import Request
from websockets.protocol import State

from multiradar.access.authentication import CERTIFICATE, ClientCertificate
from multiradar.api.connections.frames import FRAME
from multiradar.api.connections.pace import (
    EVENTS_OF_A_PASS,
    OCTETS_PER_CHUNK,
    WEBSOCKET_OCTETS_OF_A_PASS,
    FrameAllowance,
    PacedConnection,
    PacedFlow,
)
from multiradar.api.connections.registry import Registry
from multiradar.errors import ConfigurationError
from multiradar.settings.limits import HttpLimits

# Clients of the event stream send nothing; larger messages are not read.
_WEBSOCKET_MESSAGE_BYTES_MAX = 4096
# Answer to an upgrade with a body, or one that is malformed.
_NOT_A_WEBSOCKET = (
    b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\nContent-Type: text/plain\r\n"
    b"Content-Length: 29\r\n\r\nInvalid WebSocket handshake.\n"
)


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
    return _config(application, host, port, Registry(limits or HttpLimits()), tls)


def _config(
    application: ASGIApp, host: str, port: int, registry: Registry, tls: TlsFiles | None
) -> Config:
    limits = registry.limits
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
    registry = Registry(limits or HttpLimits())
    return _Server(_config(application, host, port, registry, tls), registry)


# uvicorn waits 3 s for its connections, and leaves open those that remain.
class _Server(uvicorn.Server):
    def __init__(self, config: Config, registry: Registry) -> None:
        super().__init__(config)
        self._registry = registry

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        await super().shutdown(sockets)
        await self._registry.end_all()


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
    protocol: Callable[..., asyncio.Protocol], registry: Registry, **further: object
) -> type[asyncio.Protocol]:
    # uvicorn creates protocols with its own arguments, so the registry is a class attribute.
    assert isinstance(protocol, type)
    return type(protocol.__name__, (protocol,), {"registry": registry, **further})


# TLS by the listening socket would report a connection only after its handshake: until then no
# limit would apply, and asyncio allocates a buffer of 256 KiB for each.
class _Handshake(asyncio.Protocol):
    registry: Registry
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
    registry: Registry
    conn: PacedConnection
    flow: PacedFlow

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        self.conn = PacedConnection(self.registry.limits.header_bytes_max)
        self._header_timer: asyncio.TimerHandle | None = None

    def connection_made(  # type: ignore[override]  # the transport is narrower, as in uvicorn
        self, transport: asyncio.Transport
    ) -> None:
        super().connection_made(transport)
        self.flow = PacedFlow(transport)
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

    # One pass: of what has been received, others come in the next ones.
    def handle_events(self) -> None:
        if self.flow.held:
            self.transport.pause_reading()
            return
        self.conn.left = EVENTS_OF_A_PASS
        super().handle_events()
        if not self._waits_for_request():
            self._headers_received()
            if self.conn.their_state is not h11.SEND_BODY:
                self.registry.busy(self.transport)
        if self.conn.too_many_chunks:
            self._end_body()
        elif self.conn.left == 0 and self.transport.get_protocol() is self:
            self.flow.hold()
            self.loop.call_soon(self._next_pass)

    def _next_pass(self) -> None:
        self.flow.release()
        if not self.transport.is_closing():
            self.handle_events()

    def _end_body(self) -> None:
        self.cycle.disconnected = True
        self.send_400_response(
            f"The body has too many chunks of less than {OCTETS_PER_CHUNK} octets."
        )
        self.registry.drop(self.transport, "too_many_chunks")

    def send_400_response(self, msg: str) -> None:
        # After the beginning of an answer, h11 accepts no other.
        if self.conn.our_state in {h11.IDLE, h11.SEND_RESPONSE}:
            super().send_400_response(msg)
        else:
            self.transport.close()

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
        self.registry.drop(self.transport, "headers_late")


class _WebSocket(WebSocketsSansIOProtocol):
    registry: Registry

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        # Received, but left to the next passes.
        self._rest = bytearray()
        self._frames = FrameAllowance()

    def connection_lost(self, exc: Exception | None) -> None:
        self.registry.lost(self.transport)
        super().connection_lost(exc)

    def shutdown(self) -> None:
        # To a client that has said goodbye uvicorn cannot do so, and would not stop.
        try:
            super().shutdown()
        except InvalidState:
            self.transport.close()

    def data_received(self, data: bytes) -> None:
        if self.handshake_initiated:
            waiting = bool(self._rest)
            self._rest += data
            if waiting:
                self.transport.pause_reading()
            else:
                self._pass()
            return
        super().data_received(data)
        # What h11 takes for an upgrade may be none for this library, which uvicorn does not notice:
        # no task has been started, and nothing else would end the connection.
        if not self.handshake_initiated and not self.transport.is_closing():
            self.transport.write(b"".join(self.conn.data_to_send()) or _NOT_A_WEBSOCKET)
            self.transport.close()

    def _pass(self) -> None:
        if self.transport.is_closing():
            self._rest.clear()
            return
        piece = bytes(self._rest[:WEBSOCKET_OCTETS_OF_A_PASS])
        del self._rest[: len(piece)]
        super().data_received(piece)
        if self._rest:
            self.transport.pause_reading()
            self.loop.call_soon(self._pass)
        elif not self.read_paused:
            self.transport.resume_reading()

    def handle_events(self) -> None:
        # Before the frames comes the request.
        frames = len(self.conn.events) if self.handshake_initiated else 0
        if self._frames.spend(frames, self.loop.time()):
            super().handle_events()
            return
        with contextlib.suppress(InvalidState):
            self.conn.send_close(CloseCode.POLICY_VIOLATION, "too many frames")
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.close_sent = True
        self.registry.drop(self.transport, "too_many_frames")

    async def receive(self) -> Any:
        message = await super().receive()
        if self._rest:
            # uvicorn reads again.
            self.transport.pause_reading()
        return message

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
        if self.close_sent and self.initial_response is not None:
            # A rejection is complete; for uvicorn it would be an error of the application.
            self.handshake_complete = True

    # A frame that many clients get is not copied for each, as `send` does several times.
    async def _send_frame(self, frame: bytes) -> None:
        await self.writable.wait()
        if self.disconnected or self.close_sent or self.conn.state is not State.OPEN:
            raise ClientDisconnected
        self.transport.write(frame)
