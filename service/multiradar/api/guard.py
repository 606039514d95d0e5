"""The limit layer: plain ASGI around the application, so that no request takes more than its share.

It counts bodies while they stream, keeps deadlines, bounds the number of requests, names every
request, adds the security headers and turns whatever still escapes into a problem document.
"""

import asyncio
import re
import secrets
from collections.abc import Iterable, Sequence
from urllib.parse import urlsplit

import structlog
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from multiradar.api.limits import HttpLimits
from multiradar.api.problems import MEDIA_TYPE, REQUEST_ID_KEY, problem_bytes
from multiradar.errors import RequestError
from multiradar.observability.metrics import HTTP_REFUSALS, HTTP_REQUEST_SECONDS, HTTP_REQUESTS

_log = structlog.get_logger("multiradar.api")

_REQUEST_ID = re.compile(rb"[A-Za-z0-9._-]{1,64}", re.ASCII)
_DIGITS = re.compile(rb"[0-9]{1,18}", re.ASCII)

# Answered however busy the service is: an operator must be able to see why.
_ALWAYS_SERVED = frozenset({"/healthz", "/readyz", "/metrics"})
# Open for as long as the client likes; bounded on its own by `streams_max`.
_STREAMS = frozenset({"/v1/events", "/v1/stream"})

_SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})

_SECURITY_HEADERS: tuple[tuple[bytes, bytes], ...] = (
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cache-control", b"no-store"),
    (b"content-security-policy", b"default-src 'none'; frame-ancestors 'none'"),
)

# What is read and thrown away after an early refusal, so that the client sees the answer
# and not a reset.
_DRAIN_BYTES_MAX = 1024 * 1024
_DRAIN_DEADLINE_S = 1.0


class LimitLayer:
    """Keep each request within its bounds.

    Parameters
    ----------
    application : ASGIApp
        What answers the requests.
    limits : HttpLimits
        The bounds.
    allowed_hosts : sequence of str
        Names accepted in the Host header, without port; empty accepts any.
    """

    def __init__(
        self, application: ASGIApp, limits: HttpLimits, allowed_hosts: Sequence[str] = ()
    ) -> None:
        self._application = application
        self._limits = limits
        self._allowed_hosts = frozenset(host.lower() for host in allowed_hosts)
        self._requests = 0
        self._bodies_bytes = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection scope."""
        if scope["type"] == "lifespan":
            await self._application(scope, receive, send)
        elif scope["type"] == "websocket":
            await self._websocket(scope, receive, send)
        else:
            await self._http(scope, receive, send)

    async def _websocket(self, scope: Scope, receive: Receive, send: Send) -> None:
        _name_request(scope)
        try:
            self._check_origin(scope)
        except RequestError as error:
            HTTP_REFUSALS.labels(code=error.code).inc()
            await receive()
            await send({"type": "websocket.close", "code": 1008, "reason": error.code})
            return
        await self._application(scope, receive, send)

    async def _http(self, scope: Scope, receive: Receive, send: Send) -> None:
        _name_request(scope)
        exchange = _Exchange(scope, receive, send, self._limits, self)
        started_s = asyncio.get_running_loop().time()
        try:
            await self._serve(scope, exchange)
        except RequestError as error:
            await exchange.refuse(error)
        except Exception as error:
            await exchange.fail(error)
        finally:
            self._bodies_bytes -= exchange.body_bytes
            _count(scope, exchange.status, asyncio.get_running_loop().time() - started_s)

    async def _serve(self, scope: Scope, exchange: "_Exchange") -> None:
        self._check_origin(scope)
        exchange.check_headers()
        if scope["path"] in _ALWAYS_SERVED | _STREAMS:
            await self._application(scope, exchange.receive, exchange.send)
            return
        self._enter()
        try:
            await self._application(scope, exchange.receive, exchange.send)
        finally:
            self._requests -= 1

    def _enter(self) -> None:
        if self._requests >= self._limits.requests_max:
            raise RequestError(
                503,
                "TOO_MANY_REQUESTS",
                f"{self._limits.requests_max} requests are being worked on, no more are taken",
                {"retry-after": "1"},
            )
        self._requests += 1

    def hold_body(self, count: int) -> None:
        """Account for bytes of a body that is read; refuse when all bodies are too much."""
        self._bodies_bytes += count
        if self._bodies_bytes > self._limits.bodies_bytes_max:
            raise RequestError(
                503,
                "TOO_MANY_BODIES",
                f"request bodies hold {self._limits.bodies_bytes_max} bytes, no more are taken",
                {"retry-after": "1"},
            )

    def _check_origin(self, scope: Scope) -> None:
        # A page from elsewhere must not reach a service that listens on loopback, neither by
        # a name that was rebound to it nor by a form or socket opened from that page.
        host = _header(scope, b"host").decode("latin-1").lower()
        name = urlsplit(f"//{host}").hostname if _plain_host(host) else None
        if self._allowed_hosts and name not in self._allowed_hosts:
            raise RequestError(421, "HOST_NOT_ALLOWED", "the Host header names another service")
        origin = _header(scope, b"origin").decode("latin-1").lower()
        changes = scope["type"] == "websocket" or scope["method"] not in _SAFE_METHODS
        if changes and origin and origin.partition("://")[2] != host:
            raise RequestError(
                403, "ORIGIN_NOT_ALLOWED", "the request comes from a page of another origin"
            )


class _Exchange:
    # One request and its answer, counted.

    def __init__(
        self, scope: Scope, receive: Receive, send: Send, limits: HttpLimits, layer: LimitLayer
    ) -> None:
        self._scope = scope
        self._receive = receive
        self._send = send
        self._limits = limits
        self._layer = layer
        self._deadline_s = asyncio.get_running_loop().time() + limits.body_deadline_s
        self._body_complete = not _announces_body(scope)
        self.body_bytes = 0
        self.status = 0
        self._finished = False
        self._stalled = False

    def check_headers(self) -> None:
        """Refuse what the headers alone give away."""
        if _header_bytes(self._scope) > self._limits.header_bytes_max:
            raise RequestError(
                431,
                "HEADERS_TOO_LARGE",
                f"expected at most {self._limits.header_bytes_max} bytes of path and headers",
            )
        lengths = _headers(self._scope, b"content-length")
        both = bool(lengths) and bool(_header(self._scope, b"transfer-encoding"))
        if both or len(lengths) > 1 or any(_DIGITS.fullmatch(length) is None for length in lengths):
            # A body whose end can be seen in two places may hide a request from a proxy.
            raise RequestError(
                400,
                "CONTENT_LENGTH_INVALID",
                "expected one decimal Content-Length, or Transfer-Encoding without it",
            )
        if lengths and int(lengths[0]) > self._limits.body_bytes_max:
            raise self._too_large()

    def _too_large(self) -> RequestError:
        return RequestError(
            413,
            "BODY_TOO_LARGE",
            f"expected a body of at most {self._limits.body_bytes_max} bytes",
        )

    async def receive(self) -> Message:
        """Return the next piece of the body, counted, within the deadline."""
        if self._body_complete:
            return await self._receive()
        try:
            async with asyncio.timeout_at(self._deadline_s):
                message = await self._receive()
        except TimeoutError as error:
            raise RequestError(
                408,
                "BODY_TIMEOUT",
                f"expected the whole body within {self._limits.body_deadline_s} s",
            ) from error
        count = len(message.get("body", b""))
        self._body_complete = not message.get("more_body", False)
        self.body_bytes += count
        self._layer.hold_body(count)
        if self.body_bytes > self._limits.body_bytes_max:
            raise self._too_large()
        return message

    async def send(self, message: Message) -> None:
        """Pass a piece of the answer on; a client that does not read is let go after a while."""
        if message["type"] == "http.response.start":
            message = self._start(message)
        elif not message.get("more_body", False):
            if not self._body_complete:
                await self._send_within({**message, "more_body": True})
                await self._drain()
                message = {"type": "http.response.body", "body": b"", "more_body": False}
            self._finished = True
        await self._send_within(message)

    def _start(self, message: Message) -> Message:
        self.status = message["status"]
        headers = list(message.get("headers", []))
        present = {name.lower() for name, _ in headers}
        headers.extend(header for header in _SECURITY_HEADERS if header[0] not in present)
        headers.append((b"x-request-id", self._scope[REQUEST_ID_KEY].encode()))
        if not self._body_complete:
            headers.append((b"connection", b"close"))
        return {**message, "headers": headers}

    async def _send_within(self, message: Message) -> None:
        try:
            async with asyncio.timeout(self._limits.send_deadline_s):
                await self._send(message)
        except TimeoutError:
            self._stalled = True
            raise

    async def _drain(self) -> None:
        # The unread rest of a refused body: a little of it is read, so that a client which
        # writes before it reads finds the answer; then the connection closes.
        drained = 0
        try:
            async with asyncio.timeout(_DRAIN_DEADLINE_S):
                while drained < _DRAIN_BYTES_MAX:
                    message = await self._receive()
                    drained += len(message.get("body", b""))
                    if not message.get("more_body", False):
                        return
        except TimeoutError:
            return

    async def refuse(self, error: RequestError) -> None:
        """Answer with a problem document, unless the client does not read even that."""
        body = problem_bytes(error, self._scope[REQUEST_ID_KEY])
        headers = [(name.encode(), value.encode()) for name, value in error.headers.items()]
        headers += [
            (b"content-type", MEDIA_TYPE.encode()),
            (b"content-length", str(len(body)).encode()),
        ]
        start = {"type": "http.response.start", "status": error.status, "headers": headers}
        try:
            await self.send(start)
            await self.send({"type": "http.response.body", "body": body})
        except TimeoutError:
            self._log_stall()

    async def fail(self, error: Exception) -> None:
        """Answer for an error nobody expected: an identifier, and nothing of the inside."""
        if self._stalled:
            # The connection ends with half an answer; its client hears nothing anyway.
            self._log_stall()
            return
        _log.error(
            "request failed",
            request=self._scope[REQUEST_ID_KEY],
            method=self._scope["method"],
            path=self._scope["path"],
            exc_info=error,
        )
        if self._finished:
            return
        if self.status:
            # Half an answer is out; raising makes the server close the connection on it.
            raise error
        await self.refuse(
            RequestError(
                500, "INTERNAL_ERROR", "the service failed; its log has the request's identifier"
            )
        )

    def _log_stall(self) -> None:
        _log.info("client does not read its answer", request=self._scope[REQUEST_ID_KEY])


def _name_request(scope: Scope) -> None:
    given = _header(scope, b"x-request-id")
    scope[REQUEST_ID_KEY] = given.decode() if _REQUEST_ID.fullmatch(given) else secrets.token_hex(8)


def _headers(scope: Scope, name: bytes) -> list[bytes]:
    pairs: Iterable[tuple[bytes, bytes]] = scope["headers"]
    return [value for key, value in pairs if key == name]


def _header(scope: Scope, name: bytes) -> bytes:
    values = _headers(scope, name)
    return values[0] if values else b""


def _header_bytes(scope: Scope) -> int:
    path_bytes = len(scope["raw_path"] or b"") + len(scope["query_string"])
    return path_bytes + sum(len(name) + len(value) for name, value in scope["headers"])


def _announces_body(scope: Scope) -> bool:
    length = _header(scope, b"content-length")
    return bool(_header(scope, b"transfer-encoding")) or length not in {b"", b"0"}


def _plain_host(host: str) -> bool:
    return bool(host) and not any(character in host for character in "/?#@\\ ")


def _count(scope: Scope, status: int, duration_s: float) -> None:
    # The template of the route, never the path itself: the number of series stays bounded.
    route = getattr(scope.get("route"), "path", "none")
    HTTP_REQUESTS.labels(method=_known_method(scope), route=route, status=str(status)).inc()
    HTTP_REQUEST_SECONDS.labels(route=route).observe(duration_s)


def _known_method(scope: Scope) -> str:
    method: str = scope["method"]
    return method if method in {"GET", "POST", "HEAD", "OPTIONS"} else "other"
