"""A request and its answer in the limit layer."""

import asyncio
import re
from collections.abc import Callable, Iterable

import structlog
from starlette.types import Message, Receive, Scope, Send

from multiradar.api.bodies import Body
from multiradar.api.problems import MEDIA_TYPE, REQUEST_ID_KEY, problem_bytes
from multiradar.errors import RequestError
from multiradar.settings.limits import HttpLimits

_log = structlog.get_logger("multiradar.api")

_DIGITS = re.compile(rb"[0-9]{1,18}", re.ASCII)

_SECURITY_HEADERS: tuple[tuple[bytes, bytes], ...] = (
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cache-control", b"no-store"),
    (b"content-security-policy", b"default-src 'none'; frame-ancestors 'none'"),
)

# After an early rejection, so much of the body is read and discarded, so that the client gets the
# answer and not a reset.
_DRAIN_BYTES_MAX = 1024 * 1024
_DRAIN_DEADLINE_S = 1.0


class Exchange:
    """A request and its answer, within their limits and deadlines.

    Parameters
    ----------
    scope, receive, send
        The ASGI request.
    limits : HttpLimits
        The limits.
    body : Body
        Its body.
    """

    def __init__(
        self,
        scope: Scope,
        receive: Receive,
        send: Send,
        limits: HttpLimits,
        body: Body,
    ) -> None:
        self._scope = scope
        self._receive = receive
        self._send = send
        self._limits = limits
        self._body = body
        #: Called when the whole body has arrived; may raise.
        self.on_body: Callable[[], None] = lambda: None
        #: Called when the answer has been sent, and a part of the body has not arrived.
        self.on_answer: Callable[[], None] = lambda: None
        self._body_complete = not _announces_body(scope)
        self._bodiless = scope["method"] == "HEAD"
        self._body_bytes = 0
        self.status = 0
        self._finished = False
        self._stalled = False

    @property
    def awaits_body(self) -> bool:
        """Whether a part of the body has not arrived."""
        return not self._body_complete

    def check_headers(self) -> None:
        """Reject a request with invalid or oversized headers."""
        if _header_bytes(self._scope) > self._limits.header_bytes_max:
            raise RequestError(
                431,
                "HEADERS_TOO_LARGE",
                f"expected at most {self._limits.header_bytes_max} bytes in path and headers",
            )
        lengths = _headers(self._scope, b"content-length")
        both = bool(lengths) and bool(header(self._scope, b"transfer-encoding"))
        if both or len(lengths) > 1 or any(_DIGITS.fullmatch(length) is None for length in lengths):
            # A body with an ambiguous end may smuggle a request past a proxy.
            raise RequestError(
                400,
                "CONTENT_LENGTH_INVALID",
                "expected either one decimal Content-Length or Transfer-Encoding",
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
        """Return the next piece of the body within the deadline."""
        if self._body_complete:
            return await self._receive()
        try:
            message = await self._next_piece()
        except BaseException:
            # It is not read any more: what it holds is given back with the end of the request.
            self._body.arrived()
            raise
        if not message.get("more_body", False):
            self._body.arrived()
            self.on_body()
        return message

    async def _next_piece(self) -> Message:
        try:
            async with self._body.deadline():
                message = await self._receive()
        except TimeoutError as error:
            raise self._body.error() from error
        count = len(message.get("body", b""))
        self._body_complete = not message.get("more_body", False)
        self._body_bytes += count
        self._body.hold(count)
        if self._body_bytes > self._limits.body_bytes_max:
            raise self._too_large()
        return message

    async def send(self, message: Message) -> None:
        """Send a piece of the answer; a client that does not read is dropped after a timeout."""
        if self._bodiless and message["type"] == "http.response.body":
            # An endless answer, such as a stream, ends here as well.
            if self._finished:
                return
            message = {**message, "body": b"", "more_body": False}
        if message["type"] == "http.response.start":
            message = self._start(message)
        elif not message.get("more_body", False):
            if not self._body_complete:
                await self._send_within({**message, "more_body": True})
                self.on_answer()
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
        # Part of the rest of a rejected body is read, so that a client that writes before it reads
        # gets the answer; then the connection is closed.
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

    async def reject(self, error: RequestError) -> None:
        """Answer with a problem document, unless the client does not read it."""
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
        """Answer an unexpected error with its identifier and no internals."""
        if self._stalled:
            # The connection ends with a partial answer; its client does not read anyway.
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
            # A partial answer was sent; raising makes the server close the connection.
            raise error
        await self.reject(
            RequestError(
                500,
                "INTERNAL_ERROR",
                "internal error; search the log for the request identifier",
            )
        )

    def _log_stall(self) -> None:
        _log.info("client stopped reading the response", request=self._scope[REQUEST_ID_KEY])


def _headers(scope: Scope, name: bytes) -> list[bytes]:
    pairs: Iterable[tuple[bytes, bytes]] = scope["headers"]
    return [value for key, value in pairs if key == name]


def header(scope: Scope, name: bytes) -> bytes:
    """Return the first value of a header; empty when absent."""
    values = _headers(scope, name)
    return values[0] if values else b""


def _header_bytes(scope: Scope) -> int:
    path_bytes = len(scope["raw_path"] or b"") + len(scope["query_string"])
    return path_bytes + sum(len(name) + len(value) for name, value in scope["headers"])


def _announces_body(scope: Scope) -> bool:
    length = header(scope, b"content-length")
    return bool(header(scope, b"transfer-encoding")) or length not in {b"", b"0"}
