"""Bodies of tiny chunks and tiny WebSocket frames: handled in small parts, and ended if too many.

The work is counted, not timed: 43 000 chunks or frames fit into one read.
"""

import asyncio
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from itertools import pairwise
from typing import Any

import pytest
from starlette.types import Receive, Scope, Send
from uvicorn.server import ServerState

from multiradar.api.connections.pace import (
    CHUNKS_FREE,
    EVENTS_OF_A_PASS,
    FRAMES_FREE,
    FRAMES_PER_S,
    WEBSOCKET_OCTETS_OF_A_PASS,
    FrameAllowance,
)
from multiradar.api.connections.server import server_config
from multiradar.observability.metrics import HTTP_CONNECTIONS_DROPPED

_POST = b"POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n"
_CHUNK = b"1\r\nx\r\n"
_END = b"0\r\n\r\n"
_UPGRADE = (
    b"GET / HTTP/1.1\r\nHost: a\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)
_PING, _PONG = b"\x89\x80\0\0\0\0", b"\x8a\x00"
_TEXT, _FRAGMENT, _MORE = b"\x81\x80\0\0\0\0", b"\x01\x80\0\0\0\0", b"\x00\x80\0\0\0\0"


class _Application:
    """Answers with the length of the body, which it reads when it may; accepts WebSockets."""

    def __init__(self) -> None:
        self.may_read = asyncio.Event()
        self.ended: list[str] = []

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.accept"})
            while (await receive())["type"] != "websocket.disconnect":
                pass
            self.ended.append("websocket.disconnect")
            return
        await self.may_read.wait()
        length, more = 0, scope["method"] != "GET"
        while more:
            message = await receive()
            if message["type"] == "http.disconnect":
                self.ended.append("http.disconnect")
                return
            length, more = length + len(message["body"]), message["more_body"]
        text = b"%d." % length
        headers = [(b"content-length", b"%d" % len(text))]
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        await send({"type": "http.response.body", "body": text})


@asynccontextmanager
async def _connected(application: _Application) -> AsyncIterator[tuple[Any, socket.socket]]:
    """Yield a connection of the server, and the socket of its client."""
    config = server_config(application, "127.0.0.1", 0)
    config.load()
    protocol: Any = config.http_protocol_class
    http: Any = protocol(config, ServerState(), {})
    ours, theirs = socket.socketpair()
    with theirs:
        theirs.setblocking(False)
        await asyncio.get_running_loop().create_connection(lambda: http, sock=ours)
        yield http, theirs
        http.transport.abort()
        await asyncio.sleep(0.0)


async def _until(condition: Callable[[], object]) -> None:
    while not condition():  # noqa: ASYNC110 - what it waits for sets no event
        await asyncio.sleep(0.0)


async def _answer(theirs: socket.socket, mark: bytes | None = None) -> bytes:
    """Return what the client gets up to a mark, or to the end of the connection."""
    loop, received = asyncio.get_running_loop(), b""
    while mark is None or mark not in received:
        try:
            piece = await loop.sock_recv(theirs, 65_536)
        except ConnectionResetError:
            break
        if not piece:
            break
        received += piece
    return received


def _sending(
    theirs: socket.socket, octets: bytes, *, goodbye: bool = False
) -> "asyncio.Task[None]":
    async def send() -> None:
        try:
            await asyncio.get_running_loop().sock_sendall(theirs, octets)
            if goodbye:
                theirs.shutdown(socket.SHUT_WR)
        except OSError:
            return

    return asyncio.create_task(send())


def _dropped(cause: str) -> float:
    return float(HTTP_CONNECTIONS_DROPPED.labels(cause=cause)._value.get())


async def test_a_pass_of_the_event_loop_handles_few_chunks() -> None:
    application = _Application()
    async with _connected(application) as (http, theirs):
        theirs.send(_POST + _CHUNK * 1000 + _END)
        handled = [0]
        while handled[-1] < 1000:
            await asyncio.sleep(0.0)
            handled.append(len(http.cycle.body) if http.cycle else 0)
        assert max(b - a for a, b in pairwise(handled)) <= EVENTS_OF_A_PASS
        application.may_read.set()
        assert (await _answer(theirs, b"1000.")).startswith(b"HTTP/1.1 200")


async def test_nothing_is_read_while_chunks_wait() -> None:
    application = _Application()
    async with _connected(application) as (http, theirs):
        theirs.send(_POST + _CHUNK * 1000)
        await _until(lambda: http.cycle)
        assert not http.transport.is_reading()
        http.flow.pause_reading()
        http.flow.resume_reading()
        assert not http.transport.is_reading()
        await _until(lambda: len(http.cycle.body) == 1000)
        await _until(http.transport.is_reading)


@pytest.mark.parametrize("answered", [False, True])
async def test_a_body_of_tiny_chunks_ends_the_connection(answered: bool) -> None:
    """They delayed all others by seconds, without a key and for as long as they were sent."""
    application, before = _Application(), _dropped("too_many_chunks")
    errors: list[Any] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, error: errors.append(error))
    async with _connected(application) as (http, theirs):
        application.may_read.set()
        head = _POST.replace(b"POST", b"GET") if answered else _POST
        if answered:
            theirs.send(head)
            await _answer(theirs, b"0.")
        handled: list[int] = []
        parse = http.conn.next_event

        def counted() -> Any:
            handled.append(1)
            return parse()

        http.conn.next_event = counted
        sending = _sending(theirs, (b"" if answered else head) + _CHUNK * 50_000, goodbye=True)
        answer = await _answer(theirs)
        await sending
        if not answered:
            assert answer.startswith(b"HTTP/1.1 400")
            assert b"too many chunks" in answer
            await _until(lambda: application.ended)
    # Of 50 000, those that any body may have; and one call at the end of each pass.
    assert len(handled) <= 1.1 * (CHUNKS_FREE + EVENTS_OF_A_PASS)
    assert _dropped("too_many_chunks") == before + 1
    assert errors == []


@pytest.mark.parametrize(
    "chunks",
    [
        # A row and its line feed; rows; a body written in very small pieces; large ones.
        [b"12c\r\n" + b"x" * 300 + b"\r\n", _CHUNK] * 5000,
        [b"64\r\n" + b"x" * 100 + b"\r\n"] * 10_000,
        [_CHUNK] * (CHUNKS_FREE - 1),
        [b"40000\r\n" + b"x" * 0x40000 + b"\r\n"] * 8,
    ],
    ids=["rows and line feeds", "rows", "small body", "large chunks"],
)
async def test_a_body_of_usual_chunks_is_received(chunks: list[bytes]) -> None:
    application = _Application()
    application.may_read.set()
    content = sum(chunk.count(b"x") for chunk in chunks)
    async with _connected(application) as (_, theirs):
        for _ in range(2):
            sending = _sending(theirs, _POST + b"".join(chunks) + _END)
            answer = await _answer(theirs, b"%d." % content)
            assert answer.startswith(b"HTTP/1.1 200")
            await sending


async def test_requests_that_arrive_together_are_answered_in_order() -> None:
    application = _Application()
    application.may_read.set()
    async with _connected(application) as (_, theirs):
        theirs.send(b"".join(_POST + _CHUNK * count + _END for count in (100, 31, 30, 0, 999)))
        answer = await _answer(theirs, b"999.")
        bodies = [part.rpartition(b"\r\n")[2] for part in answer.split(b"HTTP/1.1 200")[1:]]
        assert bodies == [b"100.", b"31.", b"30.", b"0.", b"999."]


async def test_an_invalid_chunk_after_the_answer_ends_the_connection() -> None:
    """It raised an error in the event loop."""
    application = _Application()
    application.may_read.set()
    errors: list[Any] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, error: errors.append(error))
    async with _connected(application) as (_, theirs):
        theirs.send(_POST.replace(b"POST", b"GET"))
        await _answer(theirs, b"0.")
        theirs.send(b"no chunk\r\n")
        assert await _answer(theirs) == b""
    assert errors == []


@asynccontextmanager
async def _websocket() -> AsyncIterator[tuple[Any, socket.socket, _Application]]:
    application = _Application()
    async with _connected(application) as (http, theirs):
        theirs.send(_UPGRADE)
        assert (await _answer(theirs, b"\r\n\r\n")).startswith(b"HTTP/1.1 101")
        yield http.transport.get_protocol(), theirs, application


async def test_a_pass_of_the_event_loop_handles_few_frames() -> None:
    async with _websocket() as (protocol, theirs, _):
        passes: list[int] = []
        handle: Callable[[], None] = protocol.handle_events

        def counted() -> None:
            passes.append(len(protocol.conn.events))
            handle()

        protocol.handle_events = counted
        theirs.send(_PING * FRAMES_FREE)
        assert await _answer(theirs, _PONG * FRAMES_FREE) == _PONG * FRAMES_FREE
        assert sum(passes) == FRAMES_FREE
        assert max(passes) <= WEBSOCKET_OCTETS_OF_A_PASS // len(_PING) + 1
        await _until(protocol.transport.is_reading)


@pytest.mark.parametrize(
    "frames",
    [_PING * 40_000, _TEXT * 40_000, _FRAGMENT + _MORE * 40_000],
    ids=["pings", "texts", "fragments"],
)
async def test_a_flood_of_tiny_frames_ends_the_websocket(frames: bytes) -> None:
    before = _dropped("too_many_frames")
    async with _websocket() as (_, theirs, application):
        sending = _sending(theirs, frames, goodbye=True)
        answer = await _answer(theirs)
        await sending
        await _until(lambda: application.ended)
        assert answer.count(_PONG) <= FRAMES_FREE * 2
        # 1008, policy violation.
        assert b"\x03\xf0too many frames" in answer
    assert _dropped("too_many_frames") == before + 1


def test_frames_each_second_are_allowed_and_a_flood_is_not() -> None:
    allowance = FrameAllowance()
    assert all(allowance.spend(2, float(second)) for second in range(10_000))
    assert allowance.spend(FRAMES_FREE, 20_000.0)
    assert not allowance.spend(1, 20_000.0)
    assert allowance.spend(1, 20_000.0 + 3.0 / FRAMES_PER_S)
