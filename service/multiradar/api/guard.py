"""The limit layer: ASGI middleware that bounds the resources of each request.

It counts bodies while they stream, enforces deadlines, limits the number of requests, assigns
request identifiers, adds security headers and answers unhandled errors with a problem document.
"""

import asyncio
import re
import secrets
from collections.abc import Sequence
from urllib.parse import urlsplit

import structlog
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Receive, Scope, Send

from multiradar.access.authentication import Authentication
from multiradar.access.shares import CLIENT, Shares
from multiradar.api.bodies import Bodies, Body
from multiradar.api.exchange import Exchange, header
from multiradar.api.problems import REQUEST_ID_KEY
from multiradar.errors import RequestError
from multiradar.observability.metrics import HTTP_REJECTIONS, HTTP_REQUEST_SECONDS, HTTP_REQUESTS
from multiradar.settings.limits import HttpLimits

_log = structlog.get_logger("multiradar.api")

_REQUEST_ID = re.compile(rb"[A-Za-z0-9._-]{1,64}", re.ASCII)

# Always answered, so that an operator can diagnose an overload.
_ALWAYS_SERVED = frozenset({"/healthz", "/readyz", "/metrics"})
# Open as long as the client wants; limited by `streams_max`.
_STREAMS = frozenset({"/v1/events", "/v1/stream"})

# Those of which a route reads the body.
_METHODS_WITH_BODY = frozenset({"POST", "PUT"})
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
    authentication : Authentication, optional
        Names the clients; without it they are addresses.
    """

    def __init__(
        self,
        application: ASGIApp,
        limits: HttpLimits,
        allowed_hosts: Sequence[str] = (),
        authentication: Authentication | None = None,
    ) -> None:
        self._application = application
        self._limits = limits
        self._allowed_hosts = frozenset(host.lower() for host in allowed_hosts)
        self._authentication = authentication or Authentication()
        self._requests = Shares(
            "requests in progress", "TOO_MANY_REQUESTS", limits.requests_max,
            limits.client_requests_max,
        )  # fmt: skip
        self._bodies = Bodies(limits)

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
        CLIENT.set(self._authentication.client(scope))
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
        client = self._authentication.client(scope)
        CLIENT.set(client)
        body = Body(self._bodies, client, self._limits.body_deadline_s)
        exchange = Exchange(scope, receive, send, self._limits, body)
        # The answer to HEAD is that to GET without the body, which the exchange omits.
        asked = {**scope, "method": "GET"} if scope["method"] == "HEAD" else scope
        started_s = asyncio.get_running_loop().time()
        try:
            await self._serve(asked, exchange)
        except RequestError as error:
            await exchange.reject(error)
        except ClientDisconnect:
            _log.debug("client disconnected while sending the body", request=scope[REQUEST_ID_KEY])
        except Exception as error:
            await exchange.fail(error)
        finally:
            body.release()
            asked["method"] = scope["method"]
            _count(asked, exchange.status, asyncio.get_running_loop().time() - started_s)

    async def _serve(self, scope: Scope, exchange: Exchange) -> None:
        self._check_origin(scope)
        exchange.check_headers()
        if scope["path"] in _ALWAYS_SERVED | _STREAMS:
            await self._application(scope, exchange.receive, exchange.send)
            return
        client, entered = CLIENT.get(), False

        def enter() -> None:
            nonlocal entered
            self._requests.add(client)
            entered = True

        def leave() -> None:
            nonlocal entered
            if entered:
                self._requests.remove(client)
            entered = False

        # A body that has not arrived costs no work: its request does not count yet, or not any more
        # while the rest of a body is discarded after the answer.
        exchange.on_answer = leave
        if scope["method"] in _METHODS_WITH_BODY and exchange.awaits_body:
            exchange.on_body = enter
        else:
            enter()
        try:
            await self._application(scope, exchange.receive, exchange.send)
        finally:
            leave()

    def _check_origin(self, scope: Scope) -> None:
        # A foreign web page must not reach a service on loopback, neither by DNS rebinding nor by a
        # form or socket opened from that page.
        host = header(scope, b"host").decode("latin-1").lower()
        name = _host_name(host)
        if host and name is None:
            raise RequestError(421, "HOST_NOT_ALLOWED", "the Host header is not the name of a host")
        if self._allowed_hosts and name not in self._allowed_hosts:
            raise RequestError(
                421, "HOST_NOT_ALLOWED", "the Host header is not one of the allowed hosts"
            )
        origin = header(scope, b"origin").decode("latin-1").lower()
        changes = scope["type"] == "websocket" or scope["method"] not in _SAFE_METHODS
        if changes and origin and origin.partition("://")[2] != host:
            raise RequestError(
                403, "ORIGIN_NOT_ALLOWED", "the request comes from a page of a different origin"
            )


def _name_request(scope: Scope) -> None:
    given = header(scope, b"x-request-id")
    scope[REQUEST_ID_KEY] = given.decode() if _REQUEST_ID.fullmatch(given) else secrets.token_hex(8)


# Without the port; None of what is no host.
def _host_name(host: str) -> str | None:
    if any(character in host for character in "/?#@\\ "):
        return None
    try:
        return urlsplit(f"//{host}").hostname
    except ValueError:
        return None


def _count(scope: Scope, status: int, duration_s: float) -> None:
    # The template of the route, not the path, which keeps the number of series bounded.
    route = getattr(scope.get("route"), "path", "none")
    HTTP_REQUESTS.labels(method=_known_method(scope), route=route, status=str(status)).inc()
    HTTP_REQUEST_SECONDS.labels(route=route).observe(duration_s)


def _known_method(scope: Scope) -> str:
    method: str = scope["method"]
    return method if method in _SAFE_METHODS | _METHODS_WITH_BODY else "other"
