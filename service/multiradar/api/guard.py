"""The limit layer: ASGI middleware that bounds the resources of each request.

It counts bodies while they stream, enforces deadlines, limits the number of requests, assigns
request identifiers, adds security headers and answers unhandled errors with a problem document.
"""

import asyncio
import re
import secrets
from collections.abc import Sequence
from urllib.parse import urlsplit

from starlette.types import ASGIApp, Receive, Scope, Send

from multiradar.api.exchange import Exchange, header
from multiradar.api.problems import REQUEST_ID_KEY
from multiradar.errors import RequestError
from multiradar.observability.metrics import HTTP_REJECTIONS, HTTP_REQUEST_SECONDS, HTTP_REQUESTS
from multiradar.settings.limits import HttpLimits

_REQUEST_ID = re.compile(rb"[A-Za-z0-9._-]{1,64}", re.ASCII)

# Always answered, so that an operator can diagnose an overload.
_ALWAYS_SERVED = frozenset({"/healthz", "/readyz", "/metrics"})
# Open as long as the client wants; limited by `streams_max`.
_STREAMS = frozenset({"/v1/events", "/v1/stream"})

_SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})


class LimitLayer:
    """Enforces the limits of each request.

    Parameters
    ----------
    application : ASGIApp
        The application.
    limits : HttpLimits
        The limits.
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
            HTTP_REJECTIONS.labels(code=error.code).inc()
            await receive()
            await send({"type": "websocket.close", "code": 1008, "reason": error.code})
            return
        await self._application(scope, receive, send)

    async def _http(self, scope: Scope, receive: Receive, send: Send) -> None:
        _name_request(scope)
        exchange = Exchange(scope, receive, send, self._limits, self._hold_body)
        # The answer to HEAD is that to GET without the body, which the exchange omits.
        asked = {**scope, "method": "GET"} if scope["method"] == "HEAD" else scope
        started_s = asyncio.get_running_loop().time()
        try:
            await self._serve(asked, exchange)
        except RequestError as error:
            await exchange.reject(error)
        except Exception as error:
            await exchange.fail(error)
        finally:
            self._bodies_bytes -= exchange.body_bytes
            asked["method"] = scope["method"]
            _count(asked, exchange.status, asyncio.get_running_loop().time() - started_s)

    async def _serve(self, scope: Scope, exchange: Exchange) -> None:
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
                f"{self._limits.requests_max} requests are in progress, no more are accepted",
                {"retry-after": "1"},
            )
        self._requests += 1

    def _hold_body(self, count: int) -> None:
        self._bodies_bytes += count
        if self._bodies_bytes > self._limits.bodies_bytes_max:
            raise RequestError(
                503,
                "TOO_MANY_BODIES",
                f"request bodies hold {self._limits.bodies_bytes_max} bytes, no more are accepted",
                {"retry-after": "1"},
            )

    def _check_origin(self, scope: Scope) -> None:
        # A foreign web page must not reach a service on loopback, neither by DNS rebinding nor by a
        # form or socket opened from that page.
        host = header(scope, b"host").decode("latin-1").lower()
        name = urlsplit(f"//{host}").hostname if _plain_host(host) else None
        if self._allowed_hosts and name not in self._allowed_hosts:
            raise RequestError(421, "HOST_NOT_ALLOWED", "the Host header names another service")
        origin = header(scope, b"origin").decode("latin-1").lower()
        changes = scope["type"] == "websocket" or scope["method"] not in _SAFE_METHODS
        if changes and origin and origin.partition("://")[2] != host:
            raise RequestError(
                403, "ORIGIN_NOT_ALLOWED", "the request comes from a page of another origin"
            )


def _name_request(scope: Scope) -> None:
    given = header(scope, b"x-request-id")
    scope[REQUEST_ID_KEY] = given.decode() if _REQUEST_ID.fullmatch(given) else secrets.token_hex(8)


def _plain_host(host: str) -> bool:
    return bool(host) and not any(character in host for character in "/?#@\\ ")


def _count(scope: Scope, status: int, duration_s: float) -> None:
    # The template of the route, not the path, which keeps the number of series bounded.
    route = getattr(scope.get("route"), "path", "none")
    HTTP_REQUESTS.labels(method=_known_method(scope), route=route, status=str(status)).inc()
    HTTP_REQUEST_SECONDS.labels(route=route).observe(duration_s)


def _known_method(scope: Scope) -> str:
    method: str = scope["method"]
    return method if method in {"GET", "POST", "HEAD", "OPTIONS"} else "other"
